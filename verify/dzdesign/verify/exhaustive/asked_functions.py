"""Whether the drive's numbers are those that were asked for: the options' texts are read once more, by own rules.

The drive's model takes the same numbers as the C, so it can't see that `design` made them wrong.
"""

import re
from fractions import Fraction
from math import ceil

from dzdesign.design.compensator import Compensator
from dzdesign.verify.requirements import ASKED_FOR, Check

NUMBER = r"(\d+(?:\.\d+)?)"
TIME = re.compile(rf"{NUMBER} ?(s|ms)", re.ASCII)
SAMPLES = re.compile(r"(\d+) ?samples?", re.ASCII)
SHARE = re.compile(rf"{NUMBER} ?%", re.ASCII)
WAVE = re.compile(rf"{NUMBER} ?Hz {NUMBER} ?%", re.ASCII)
#: Units of the ramped command in a code; a negative pressure drop beyond this share of the span is a failure.
UNITS, REVERSE = 65536, Fraction(1, 50)


def functions_asked_for(compensator: Compensator) -> Check:
    """Compare ramps, debounce, latch, interlock, dither, limit and the reverse drop with the options."""
    texts, faults = compensator.options or {}, list[str]()
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
    return ASKED_FOR.check(holds=not faults, text="; ".join(faults) or "ramps, faults, interlock, dither and limit")


def _seconds(text: str) -> Fraction | None:
    """Return a time, s; None of one in another unit, which is not compared."""
    found = TIME.fullmatch(text.strip())
    return None if found is None else Fraction(found[1]) / (1000 if found[2] == "ms" else 1)
