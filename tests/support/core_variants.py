"""The core in every form that its options give it, from the goldens' valve: what a check of the C's text runs over."""

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from functools import cache

from dzdesign.codegen.project import Firmware, generate, target_named
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions
from dzdesign.design.signal_text import command_signal, parse_signal, pressure_signal
from dzdesign.design.signals import Signals
from dzdesign.design.target_inputs import Converter
from dzdesign.identify.valve.guard_curve import OpeningCurve
from dzdesign.identify.valve.side_model import SideModel
from tests.support.golden_firmware import golden_valve

TARGET = "f28335"
ADC = Converter()


def _command(text: str, **options):
    return command_signal(parse_signal(text, "--command-signal"), ADC, **options)


def _sensor(text: str):
    return pressure_signal(parse_signal(text, "--pressure-a"), ADC, Fraction(20))


BOTH = _command("-10..10 V x 0.15 + 1.5 V")
UNLIKE = {
    "pressure_a": _sensor("4..20 mA on 149 ohm = 25 MPa"),
    "pressure_b": _sensor("0.5..4.5 V x 0.6 = 160 bar"),
}
DRIVE_FUNCTIONS = {
    "ramp_up_s": (0.5, 0.8),
    "ramp_down_s": (0.3, 0.0),
    "dither_Hz": 150.0,
    "dither_peak": Fraction(1, 100),
    "output_max": Fraction(9, 10),
}
#: Name to the options of `design`; "signals" are those that differ from the target's own.
VARIANTS = {
    "default": {},
    "no transition": {"transition": Fraction(0)},
    "target law": {"law": "target"},
    "target law, no transition": {"law": "target", "transition": Fraction(0)},
    "live zero": {"signals": UNLIKE | {"command": _command("4..20 mA on 149 ohm")}},
    "live zero, no transition": {
        "signals": UNLIKE | {"command": _command("4..20 mA on 149 ohm")},
        "transition": Fraction(0),
    },
    "inverted": {"signals": {"command": _command("0..10 V x 0.3", inverted=True)}, **DRIVE_FUNCTIONS},
    "bipolar": {"signals": {"command": BOTH}},
    "play": {"play": True},
    "bipolar, play": {"signals": {"command": BOTH}, "play": True, "ramp_up_s": (0.5, 0.8)},
    "bipolar, no transition": {"signals": {"command": BOTH}, "transition": Fraction(0), **DRIVE_FUNCTIONS},
    "bipolar, all options": {
        "signals": UNLIKE | {"command": BOTH, "negative_pair": "BA"}, "transition": Fraction(1, 100)
    } | DRIVE_FUNCTIONS,
    "three pressures": {
        "signals": UNLIKE
        | {"command": BOTH, "negative_pair": "AC", "pressure_c": _sensor("4..20 mA on 140 ohm = 100 bar")},
        "play": True, "ramp_up_s": (0.5, 0.8), "fault_latch": True,
    },
    "three pressures, others ahead": {
        "signals": UNLIKE | {"command": BOTH, "negative_pair": "CB", "pressure_c": _sensor("0.5..2.5 V = 30 MPa")},
        **DRIVE_FUNCTIONS,
    },
}  # fmt: skip
NAMES = tuple(VARIANTS)


@cache
def variant(name: str) -> Compensator:
    """Design a variant."""
    target = target_named(TARGET)
    valve = golden_valve()
    options = dict(VARIANTS[name])
    given = options.pop("signals", {})
    signals = Signals(compare_max=target.compare_max, sample_Hz=target.sample_Hz, tick_Hz=target.tick_Hz, **given)
    sides = {side: _with_opening_curve(valve.sides["positive"]) for side in ("positive", "negative")}
    if len(signals.signs) == 1:
        del sides["negative"]
    valve = replace(valve, sides=sides)
    return design(valve, DesignOptions(signals=signals, **options))


def _with_opening_curve(side: SideModel) -> SideModel:
    """Add where the rising branch's knees are: the goldens' valve was identified before that curve was kept."""
    curve = OpeningCurve(
        dp_MPa=tuple(test.dp_MPa for test in side.tests),
        u_V=tuple(test.u_knee_rising_V for test in side.tests),
        u_se_V=tuple(0.001 for _ in side.tests),
    )
    return replace(side, opening_curve=curve)


def firmware(name: str) -> Firmware:
    """Generate a variant's firmware."""
    return generate(variant(name), TARGET)


def core_files(name: str) -> Iterator[tuple[str, str]]:
    """Give name and text of each file of a variant's core."""
    for path, text in firmware(name).files.items():
        if path.startswith("core/"):
            yield path.removeprefix("core/"), text
