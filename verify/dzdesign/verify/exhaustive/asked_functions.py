"""Whether the numbers of drive and signals are those asked for: the options' texts are read once more, by own rules.

The models of drive and law take the same numbers as the C, so they can't see that `design` made them wrong.
"""

import re
from collections.abc import Iterator
from fractions import Fraction
from math import ceil

from dzdesign.design.compensator import Compensator
from dzdesign.verify.requirements import ASKED_FOR, Check

NUMBER = r"(\d+(?:\.\d+)?)"
TIME = re.compile(rf"{NUMBER} ?(s|ms)", re.ASCII)
SAMPLES = re.compile(r"(\d+) ?samples?", re.ASCII)
SHARE = re.compile(rf"{NUMBER} ?%", re.ASCII)
#: A signal's ends, what brings it to the converter's pin, and what its ends stand for.
SIGNAL = re.compile(
    rf"(?P<low>-?{NUMBER})\.\.(?P<high>{NUMBER}) (?P<unit>V|mA)(?: on (?P<ohm>{NUMBER}) ohm)?(?: x (?P<gain>{NUMBER}))?"
    rf"(?: \+ (?P<offset>{NUMBER}) V)?(?: = (?:(?P<bottom>-?{NUMBER})\.\.)?(?P<top>{NUMBER}) (?P<means>MPa|bar|V|%))?",
    re.ASCII,
)
SPAN = re.compile(rf"(?P<top>{NUMBER}) (?P<means>MPa|bar)", re.ASCII)
WAVE = re.compile(rf"{NUMBER} ?Hz {NUMBER} ?%", re.ASCII)
#: Units of the ramped command in a code; a negative pressure drop beyond this share of the span is a failure.
UNITS, REVERSE = 65536, Fraction(1, 50)


def functions_asked_for(compensator: Compensator) -> Check:
    """Compare signals, ramps, debounce, latch, interlock, dither, limit and the reverse drop with the options."""
    texts, faults = compensator.options or {}, list(_signals_not_asked_for(compensator))
    functions, signals = compensator.drive_functions, compensator.signals
    for name, found in (("ramp_up", functions.ramp_up), ("ramp_down", functions.ramp_down)):
        parts = [_seconds(part) for part in texts.get(name, "0 s").split("/")]
        for sign, step in zip((1, -1), found, strict=True):
            seconds = parts[0] if sign > 0 else parts[-1]
            if sign not in signals.signs or seconds is None:
                continue
            wanted = UNITS * signals.command.span(sign) / (seconds * signals.sample_Hz) if seconds else Fraction(0)
            if abs(step - max(wanted, Fraction(bool(seconds)))) > 1:
                faults.append(f"{name} has steps of {step}, {texts[name]!r} are {float(wanted):.0f}")
    debounce = texts.get("fault_debounce", "")
    samples, seconds = SAMPLES.fullmatch(debounce), _seconds(debounce)
    wanted_samples = int(samples[1]) if samples else ceil(seconds * signals.sample_Hz) if seconds else None
    if wanted_samples not in (None, functions.fault_samples):
        faults.append(f"a fault is over after {functions.fault_samples} samples, {debounce!r} are {wanted_samples}")
    for name, is_on in (
        ("fault_latch", functions.fault_latch), ("interlock", functions.interlock_codes is not None)
    ):  # fmt: skip
        if texts.get(name, "") in ("on", "off") and is_on != (texts[name] == "on"):
            faults.append(f"{name} is {'on' if is_on else 'off'}, {texts[name]!r} was asked for")
    if limit := SHARE.fullmatch(texts.get("output_max", "")):
        counts = int(Fraction(limit[1]) / 100 * signals.compare_max)
        if functions.compare_limit != counts:
            faults.append(f"the largest output is {functions.compare_limit} counts, {limit[0]!r} are {counts}")
    if wave := WAVE.fullmatch(texts.get("dither", "")):
        peak, ticks = Fraction(wave[2]) / 100 * signals.compare_max, signals.tick_Hz / (2 * Fraction(wave[1]))
        if abs(functions.dither_counts - peak) > 1 or abs(functions.dither_ticks - ticks) > 1:
            made = f"{functions.dither_counts} counts every {functions.dither_ticks} periods"
            faults.append(f"the dither is {made}, {wave[0]!r} is {float(peak):.0f} every {float(ticks):.1f}")
    elif texts.get("dither") == "off" and functions.dither_counts:
        faults.append(f"the dither has {functions.dither_counts} counts, none was asked for")
    ahead = (signals.pair(sign).ahead for sign in signals.signs)
    span = min(abs(sensor.full_code - sensor.zero_code) for sensor in ahead)
    if compensator.reverse_codes > REVERSE * span:
        most = int(REVERSE * span)
        faults.append(f"a drop of -{compensator.reverse_codes} codes is no failure, expected {most} at most")
    named = "signals, ramps, faults, interlock, dither and limit"
    return ASKED_FOR.check(holds=not faults, text="; ".join(faults) or named)


def _signals_not_asked_for(compensator: Compensator) -> Iterator[str]:
    """Say which signal has other codes than its text makes, or a sensor another span; other units are not compared."""
    texts, signals, target = compensator.options or {}, compensator.signals, compensator.target
    if target is None:
        return
    for name in ("command_signal", "pressure_a", "pressure_b"):
        text = texts.get(name, "")
        found = SIGNAL.fullmatch(text)
        if found is None or (found["unit"] == "mA") != bool(found["ohm"]):
            continue
        per_unit = Fraction(found["gain"] or 1) * Fraction(found["ohm"] or 1000) / 1000
        ends = [Fraction(found[end]) * per_unit + Fraction(found["offset"] or 0) for end in ("low", "high")]
        low, high = (target.converter.levels * volts / target.converter.full_V for volts in ends)
        wanted: tuple[Fraction | None, ...] = (low, high)
        if name == "command_signal":
            both = Fraction((found["bottom"] or 0) if found["top"] else found["low"]) < 0
            low, high = (high, low) if texts.get("polarity") == "inverted" else (low, high)
            wanted = ((low + high) / 2, high, low) if both else (low, high, None)
            command = signals.command
            made: tuple[int | None, ...] = (command.zero_code, command.full_code, command.negative_full_code)
        else:
            sensor = signals.pressure_a if name == "pressure_a" else signals.pressure_b
            made = (sensor.zero_code, sensor.full_code)
            span = found if found["top"] else SPAN.fullmatch(texts.get("pressure_span", ""))
            span_MPa = Fraction(span["top"]) / (10 if span["means"] == "bar" else 1) if span else sensor.span_MPa
            if abs(sensor.span_MPa - span_MPa) > Fraction(1, 10**6):
                yield f"{name} spans {float(sensor.span_MPa):g} MPa, asked for were {float(span_MPa):g} MPa"
        for code, exact in zip(made, wanted, strict=True):
            if (code is None) != (exact is None) or (code is not None and exact is not None and abs(code - exact) > 1):
                asked = "none" if exact is None else f"{float(exact):.1f}"
                yield f"{name} has a code of {code} at its zero or an end, {text!r} makes {asked}"


def _seconds(text: str) -> Fraction | None:
    """Return a time, s; None of one in another unit, which is not compared."""
    found = TIME.fullmatch(text.strip())
    return None if found is None else Fraction(found[1]) / (1000 if found[2] == "ms" else 1)
