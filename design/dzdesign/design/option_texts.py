"""The engineer's options as text, turned into `DesignOptions`."""

import re
from collections.abc import Mapping
from fractions import Fraction
from math import ceil
from typing import cast

from dzdesign.core.dither import parted
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import flag_of
from dzdesign.core.units import parse_quantity
from dzdesign.design.current.texts import current_request
from dzdesign.design.design_choices import (
    DEFAULTS,
    HYSTERESIS,
    NEGATIVE_DP,
    ON_OFF,
    POLARITIES,
    Above,
    BelowDp0,
    DesignRequest,
    NegativeDp,
)
from dzdesign.design.machine.texts import machine_of
from dzdesign.design.options import DesignOptions
from dzdesign.design.signal_text import (
    command_signal,
    full_command_V,
    live_zero_signal,
    parse_signal,
    pressure_signal,
)
from dzdesign.design.signals import Signals
from dzdesign.design.target_inputs import TargetInputs
from dzdesign.design.zero_band import command_error_of
from dzdesign.identify.constants import L_MIN
from dzdesign.identify.valve.guard_curve import Guard
from dzdesign.identify.valve.model import DECIMALS

#: Options that take one of a few words.
ONE_OF = (
    ("negative_dp", NEGATIVE_DP),
    ("polarity", POLARITIES),
    ("hysteresis", HYSTERESIS),
    ("fault_latch", ON_OFF),
    ("interlock", ON_OFF),
)


def options_of(texts: Mapping[str, str], target: TargetInputs) -> DesignOptions:
    """Return the engineer's choices, each from its text; the default stands for one that is missing or empty."""
    text = {name: texts.get(name) or default for name, default in DEFAULTS.items()}
    for name, known in ONE_OF:
        if text[name] not in known:
            raise InputError(
                f"{flag_of(name)} is '{text[name]}'{nearest(text[name], known)}, expected {' or '.join(known)}"
            )
    converter = target.converter
    full_V = float(converter.full_V)
    text["command_signal"] = text["command_signal"] or f"0..10 V x {full_V / 10:.12g}"
    for name in ("pressure_a", "pressure_b"):
        text[name] = text[name] or live_zero_signal(converter)
    span = Fraction(round(parse_quantity(text["pressure_span"], "pressure", "--pressure-span")), 10**6)
    if span <= 0:
        raise InputError(f"--pressure-span is '{text['pressure_span']}', expected more than zero")
    sensors = {
        name: pressure_signal(parse_signal(text[name], flag_of(name)), converter, span)
        for name in ("pressure_a", "pressure_b")
    }
    signal = parse_signal(text["command_signal"], "--command-signal")
    command = command_signal(signal, converter, inverted=text["polarity"] == "inverted")
    dither_Hz, dither_peak = _dither(text["dither"])
    signals = Signals(
        code_max=converter.code_max,
        compare_max=target.compare_max,
        sample_Hz=target.sample_Hz,
        tick_Hz=target.tick_Hz,
        command=command,
        pressure_a=sensors["pressure_a"],
        pressure_b=sensors["pressure_b"],
    )
    current = current_request(text, target)
    return DesignOptions(
        law=text["law"],
        signals=signals,
        negative_dp=cast(NegativeDp, text["negative_dp"]),
        guard=cast(Guard, text["guard"]),
        below_dp0=cast(BelowDp0, text["below_dp0"]),
        above=cast(Above, text["above"]),
        transition=_transition(text["transition"]),
        command_error=command_error_of(text["command_error"], converter, command),
        ramp_up_s=_seconds(text["ramp_up"], "--ramp-up"),
        ramp_down_s=_seconds(text["ramp_down"], "--ramp-down"),
        dither_Hz=dither_Hz,
        dither_peak=dither_peak,
        play=text["hysteresis"] == "play",
        output_max=_share(text["output_max"], "--output-max"),
        fault_samples=_samples(text["fault_debounce"], target.sample_Hz),
        fault_latch=text["fault_latch"] == "on",
        interlock=text["interlock"] == "on",
        reading_flow_L_min=_flow_L_min(text["reading_flow"], "--reading-flow") if text["reading_flow"] else None,
        full_command_V=full_command_V(signal),
        accept=tuple(text["accept"].replace(",", " ").split()),
        current=current,
        machine=machine_of(text, target, signals, current),
        request=DesignRequest(target=target, options=text),
    )


def _transition(text: str) -> Fraction | None:
    """Read ``auto`` (None), ``off`` (0) or a share."""
    if text == "auto":
        return None
    return Fraction(0) if text == "off" else _share(text, "--transition")


def _share(text: str, option: str) -> Fraction:
    value = parse_quantity(text, "ratio", option)
    return Fraction(round(value * 10**9), 10**9)


def _flow_L_min(text: str, option: str) -> float:
    return round(parse_quantity(text, "flow", option) / L_MIN, DECIMALS)


def _seconds(text: str, option: str) -> tuple[float, float]:
    """Read one time, or two with a slash between: of positive and of negative commands."""
    parts = [parse_quantity(part.strip(), "time", option) for part in text.split("/")]
    if len(parts) > 2:
        raise InputError(f"{option} is '{text}', expected a time, or two such as '0.5 s / 0.8 s'")
    return parts[0], parts[-1]


def _samples(text: str, sample_Hz: int) -> int:
    """Read a number of samples, or a time as the samples that it needs."""
    if match := re.fullmatch(r"(\d{1,9}) ?samples?", text.strip()):
        return int(match[1])
    try:
        seconds = parse_quantity(text, "time", "--fault-debounce")
    except InputError as error:
        raise InputError(f"--fault-debounce is '{text}', expected '5 samples' or a time such as '4 ms'") from error
    return ceil(Fraction(repr(seconds)) * sample_Hz)


def _dither(text: str) -> tuple[float, Fraction]:
    """Read ``off`` or a frequency and the peak of the wave."""
    if text == "off":
        return 0.0, Fraction(0)
    frequency_Hz, peak = parted(text, "--dither", "'off', or ")
    return frequency_Hz, _share(peak, "--dither")
