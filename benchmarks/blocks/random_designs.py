"""Designs with options drawn as texts, as the command line takes them, for known valves: refused ones are left out."""

import random
from collections.abc import Iterator, Mapping

from dzdesign.codegen.project import target_named
from dzdesign.core.errors import DzdesignError
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.identify.valve.model import ValveModel

TARGETS = ("f28335", "f280049c", "cortex-m4", "host")
SPANS_MPA = (5, 10, 16, 20, 25, 31.5, 40, 60, 100)
BOTH_SIGNS = ("-10..10 V x 0.15 + 1.5 V", "4..20 mA on 140 ohm = -10..10 V", "-10..10 V x 0.1 + 1.1 V")


def random_texts(draw: random.Random, *, two_sided: bool) -> dict[str, str]:
    """Return options of `dzdesign design`, each now and then; most of those that exclude each other are not drawn."""

    def seldom(share: float, text: object) -> str:
        return str(text) if draw.random() < share else ""

    span = draw.choice(SPANS_MPA)
    both = two_sided and draw.random() < 0.75
    one_sign = (f"0..10 V x {draw.choice((0.05, 0.1, 0.2, 0.25, 0.29, 0.3))}", "4..20 mA on 140 ohm",
                "0.5..4.5 V x 0.6 = 0..10 V")  # fmt: skip
    ohm_a, ohm_b = draw.choice((100, 120, 139, 140)), draw.choice((60, 100, 130, 140))
    hysteresis = draw.random()
    texts = {
        "law": draw.choice(("paper", "target")),
        "guard": draw.choice(("closing", "closing", "mean", "opening")),
        "transition": draw.choice(("auto", "1 %", f"{draw.uniform(0.1, 10):.2f} %")),
        "below_dp0": draw.choice(("hold", "extend")),
        "above": draw.choice(("hold", "lower", "release")),
        "output_max": seldom(0.4, f"{draw.choice((60, 75, 95, draw.uniform(10, 100))):.3g} %"),
        "accept": seldom(0.7, "branch-order, broken-sensor"),
        "command_error": seldom(0.5, f"{draw.randrange(40)} + {draw.randrange(1, 9)} codes"),
        "command_signal": draw.choice(BOTH_SIGNS) if both else seldom(0.6, draw.choice(one_sign)),
        "polarity": seldom(0.3, "inverted"),
        "pressure_span": f"{span} MPa",
        "pressure_a": seldom(0.5, f"4..20 mA on {ohm_a} ohm = {draw.choice(SPANS_MPA)} MPa"),
        "pressure_b": seldom(0.5, f"4..20 mA on {ohm_b} ohm = {draw.choice(SPANS_MPA)} MPa"),
        "negative_dp": (seldom(0.5, "B-A") or "wired") if both else "",
        "ramp_up": seldom(0.4, _ramps(draw)),
        "ramp_down": seldom(0.4, _ramps(draw)),
        "hysteresis": "play" if hysteresis < 0.3 else "",
        "dither": f"{draw.uniform(100, 300):.0f} Hz {draw.uniform(0.1, 9):.2g} %" if hysteresis > 0.6 else "",
        "fault_debounce": seldom(0.5, f"{draw.choice((1, 2, 3, 50, 1000, 10_000))} samples"),
        "fault_latch": seldom(0.4, "on"),
        "interlock": seldom(0.4, "off"),
    }
    if hysteresis >= 0.3 and draw.random() < 0.35:
        texts["transition"] = "off"
    if not both and draw.random() < 0.4:
        texts |= _current(draw)
    return {name: text for name, text in texts.items() if text}


def random_designs(
    valves: Mapping[str, ValveModel], seed: int, refused: list[str] | None = None
) -> Iterator[tuple[str, str, Compensator]]:
    """Yield a name, a target and a compensator without end; why others were refused is put to `refused`."""
    draw = random.Random(seed)
    while True:
        name, target = draw.choice(sorted(valves)), draw.choice(TARGETS)
        texts = random_texts(draw, two_sided="negative" in valves[name].sides)
        if "drive" in texts:
            target = draw.choice(("cortex-m4", "host", "f28335", "f280049c"))
        try:
            compensator = design(valves[name], options_of(texts, target_named(target).inputs()))
        except DzdesignError as error:
            if refused is not None:
                refused.append(str(error))
            continue
        yield f"{name} for {target}: {texts}", target, compensator


def _ramps(draw: random.Random) -> str:
    return " / ".join(f"{draw.choice((0, 0.001, 0.01, 0.5, 2, 600, draw.uniform(0.001, 5))):.4g} s" for _ in range(2))


def _current(draw: random.Random) -> dict[str, str]:
    rated = draw.choice((0.3, 0.8, 1, 1.6, 3))
    ohm, mH = draw.uniform(1, 25) / rated, draw.uniform(2, 200) / rated
    low = max(1.5 * rated * (ohm + 0.5), draw.uniform(8, 24))
    high = low * draw.uniform(1, 2)
    texts = {
        "drive": "current",
        "coil": f"{ohm:.3g} ohm {mH:.3g} mH",
        "rated_current": f"{rated} A",
        "supply": f"{low:.3g}..{high:.3g} V",
        "current_signal": f"0..{1.2 * rated:.3g} A on {draw.uniform(0.8, 2.3) / rated / 1.2:.3g} ohm + "
        f"{draw.uniform(0.07, 0.5):.2g} V",
    }
    if draw.random() < 0.6:
        top = 1.1 * high
        texts["supply_signal"] = f"0..{top:.3g} V x {draw.uniform(0.3, 0.99) * 3 / top:.4g}"
    return texts
