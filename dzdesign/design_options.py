"""The options of `design` on the command line, turned into `DesignOptions`."""

import argparse
import re
from fractions import Fraction

from dzdesign.core.errors import InputError, nearest
from dzdesign.core.units import parse_quantity

#: What stands where an option is not given. They have no argparse default, so that `codegen` can tell.
DEFAULTS = {
    "law": "paper",
    "pressure_span": "20 MPa",
    "guard": "closing",
    "below_dp0": "hold",
    "command_signal": "",  # 0..10 V and 0 to full pressure over the target's whole converter
    "pressure_a": "",
    "pressure_b": "",
    "negative_dp": "same",
    "polarity": "normal",
    "edge": "0 %",
    "zero_window": "1 %",
    "ramp_up": "0 s",
    "ramp_down": "0 s",
    "dither": "off",
    "output_max": "100 %",
    "accept": "",
}
CHOICES = {"negative_dp": ("same", "swapped"), "polarity": ("normal", "inverted")}


def given_design_options(args: argparse.Namespace) -> list[str]:
    """Return the design's options that were given, as they are written."""
    return [f"--{name.replace('_', '-')}" for name in DEFAULTS if getattr(args, name) is not None]


def design_options(args: argparse.Namespace, target: "TargetInputs") -> "DesignOptions":  # noqa: F821
    """Return the engineer's choices.

    Parameters
    ----------
    args : argparse.Namespace
        Of `design` or `codegen`.
    target : TargetInputs
        Converter and timer of the target that is designed for.

    Raises
    ------
    InputError
        If an option can't be read; it is named.
    """
    from dzdesign.design.options import DesignOptions
    from dzdesign.design.signal_text import command_signal, parse_signal, pressure_signal
    from dzdesign.design.signals import Signals

    text = {name: getattr(args, name) or default for name, default in DEFAULTS.items()}
    for name, known in CHOICES.items():
        if text[name] not in known:
            option = f"--{name.replace('_', '-')}"
            raise InputError(f"{option} is '{text[name]}'{nearest(text[name], known)}, expected {' or '.join(known)}")
    converter = target.converter
    full_V = float(converter.full_V)
    text["command_signal"] = text["command_signal"] or f"0..10 V x {full_V / 10:.12g}"
    for name in ("pressure_a", "pressure_b"):
        text[name] = text[name] or f"0..{full_V:.12g} V"
    span = Fraction(round(parse_quantity(text["pressure_span"], "pressure", "--pressure-span")), 10**6)
    if span <= 0:
        raise InputError(f"--pressure-span is '{text['pressure_span']}', expected more than zero")
    sensors = {
        name: pressure_signal(parse_signal(text[name], f"--{name.replace('_', '-')}"), converter, span)
        for name in ("pressure_a", "pressure_b")
    }
    command = command_signal(
        parse_signal(text["command_signal"], "--command-signal"), converter, inverted=text["polarity"] == "inverted"
    )
    if command.negative_full_code is None:
        _refuse_what_needs_both_signs(args, text)
    dither_Hz, dither_peak = _dither(text["dither"])
    return DesignOptions(
        law_name=text["law"],
        signals=Signals(
            code_max=converter.code_max,
            compare_max=target.compare_max,
            sample_Hz=target.sample_Hz,
            tick_Hz=target.tick_Hz,
            command=command,
            swapped=text["negative_dp"] == "swapped",
            **sensors,
        ),
        guard=text["guard"],
        below_reference=text["below_dp0"],
        edge=_share(text["edge"], "--edge"),
        window=_share(text["zero_window"], "--zero-window"),
        ramp_up_s=_seconds(text["ramp_up"], "--ramp-up"),
        ramp_down_s=_seconds(text["ramp_down"], "--ramp-down"),
        dither_Hz=dither_Hz,
        dither_peak=dither_peak,
        output_max=_share(text["output_max"], "--output-max"),
        accept=tuple(text["accept"].replace(",", " ").split()),
    )


def _refuse_what_needs_both_signs(args: argparse.Namespace, text: dict[str, str]) -> None:
    """Refuse options of negative commands where the command has none, and would leave them without effect."""
    given = [
        f"--{name.replace('_', '-')}" for name in ("negative_dp", "zero_window") if getattr(args, name) is not None
    ]
    given += [
        f"the second time of --{name.replace('_', '-')}" for name in ("ramp_up", "ramp_down") if "/" in text[name]
    ]
    if given:
        raise InputError(
            f"{given[0]} is for a command of both signs, but {text['command_signal']!r} has one; leave it out, or give "
            "a --command-signal such as '-10..10 V x 0.15 + 1.5 V'"
        )


def _share(text: str, option: str) -> Fraction:
    value = parse_quantity(text, "ratio", option)
    return Fraction(round(value * 10**9), 10**9)


def _seconds(text: str, option: str) -> tuple[float, float]:
    """Read one time, or two with a slash between: of positive and of negative commands."""
    parts = [parse_quantity(part.strip(), "time", option) for part in text.split("/")]
    if len(parts) > 2:
        raise InputError(f"{option} is '{text}', expected a time, or two such as '0.5 s / 0.8 s'")
    return parts[0], parts[-1]


def _dither(text: str) -> tuple[float, Fraction]:
    """Read ``off`` or a frequency and the peak of the wave."""
    if text == "off":
        return 0.0, Fraction(0)
    parts = re.fullmatch(r"(.+?hz)\b(.+)", text.strip(), re.IGNORECASE)
    if parts is None:
        raise InputError(
            f"--dither is '{text}', expected 'off', or a frequency in Hz and the wave's peak over full drive, such as "
            "'150 Hz 1 %'"
        )
    return parse_quantity(parts[1], "frequency", "--dither"), _share(parts[2], "--dither")
