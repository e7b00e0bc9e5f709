"""Pressures as they were recorded, wired to the firmware's two inputs: whether it reads the recorded pressure drop.

Neither the direction that `identify` stores nor the one that `design` chose counts here. Inputs A and B get the two
columns that make the drop of positive commands, and keep them at negative ones, as wires do.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import and_more, one_line
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.requirements import PRESSURE_INPUTS, Check

#: A command this far into a side, as a share of its largest, is where the pressure drop is read.
OPEN = 0.8
#: A recording shows a side if its command goes that far into it, as a share of full command.
SHOWS = 0.1
#: Sensors named A and B, or a column of their difference: what a fixed pair of inputs can be.
TWO_SENSORS = {("pA", "pB"), ("dP",)}
#: Status bits that a sound pressure does not set: sensor A, sensor B, a difference that can't be right.
PRESSURE_BITS = 2 | 4 | 8
MPA = 1e6
MOST_NAMED = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reading:
    """What one recording shows at commands of one sign: which columns, and A minus B there, MPa."""

    source: str
    sign: int
    columns: tuple[str, ...]
    words: str
    a_minus_b_MPa: float


def recorded_inputs_follow(compensator: Compensator, tests: Sequence[RampTest]) -> Check:
    """Tell whether a firmware of both signs, wired as recorded, reads the pressure drop of each recording.

    `tests` are the recordings as they were read. It is the exact law that answers: the firmware, or another output, was
    compared with it at every pair of pressures.
    """
    readings = list(_readings(tests, float(compensator.u_max_V)))
    declared = (compensator.options or {}).get("negative_dp")
    switched = _words(readings, -1)
    if declared == "wired":
        readings = [each for each in readings if each.sign > 0]
    if declared == "swapped":  # of a column above zero on both sides nobody knows which sensor is ahead
        readings = [each for each in readings if each.sign > 0 or each.columns != ("dP",) or each.a_minus_b_MPa < 0]
    if fault := next(_faults(compensator, readings), ""):
        return PRESSURE_INPUTS.check(holds=False, text=one_line(f"{fault}; design again from these recordings"))
    counts = {sign: sum(each.sign == sign for each in readings) for sign in (1, -1)}
    text = (
        f"A minus B is {_words(readings, 1)}. The firmware reads the recorded drop of {counts[1]} recordings at "
        f"positive commands, and of {counts[-1]} at negative ones"
        if readings
        else "no pressure drop was recorded, so nothing was tried"
    )
    if declared == "wired":
        text += f". There the machine must switch the inputs, so that A minus B is {switched} (--negative-dp wired)"
    elif readings and not counts[-1]:
        text += ". The recordings do not show which sensor is ahead there: taken as declared"
    return PRESSURE_INPUTS.check(holds=True, text=one_line(text))


def _readings(tests: Sequence[RampTest], u_max_V: float) -> Iterator[_Reading]:
    """Yield what each recording shows of each side; nothing where the pressure drop was not recorded."""
    for test in tests:
        for sign, columns in zip((1, -1), test.dp_from, strict=True):
            along = sign * test.u
            if test.dp is None or test.dp_is_declared or not columns or along.max() < SHOWS * u_max_V:
                continue
            drop = float(np.median(test.dp[along >= OPEN * along.max()])) / MPA
            yield _Reading(
                source=test.source,
                sign=sign,
                columns=columns[0].quantities,
                words=" - ".join(columns[0].labels),
                a_minus_b_MPa=drop,
            )


def _faults(compensator: Compensator, readings: Sequence[_Reading]) -> Iterator[str]:
    """Yield what the firmware reads wrong, and a drop that its inputs do not have."""
    units = compensator.valve.recorded_units
    ways = {each.columns for each in readings if each.sign > 0}
    for sign in (1, -1):
        mine = [each for each in readings if each.sign == sign]
        others = [each for each in mine if {each.columns} | ways != ways and not ({each.columns} | ways) <= TWO_SENSORS]
        if others:
            yield (
                f"'{others[0].source}': the pressure drop was recorded as {others[0].words}, which is no difference of "
                f"the inputs that read {_words(readings, 1)}"
            )
        yield from _misread(ExactLaw(compensator, sign), mine, units) if mine else ()


def _misread(exact: ExactLaw, readings: Sequence[_Reading], units: RecordedUnits) -> Iterator[str]:
    """Yield the recordings of one side whose pressure drop the law does not read, within a code."""
    for reading in readings:
        a, b = _codes(exact, reading)
        status = exact.answer(exact.zero, a, b).status & PRESSURE_BITS
        if not status and abs(int(exact.difference(np.array(a), np.array(b))) - _drop_code(exact, reading)) <= 1:
            continue
        drop_text = units.text(abs(reading.a_minus_b_MPa), ".3g MPa")
        below = "below" if reading.a_minus_b_MPa < 0 else "above"
        what = f"reports a failed sensor (status {status})" if status else "reads another pressure drop"
        yield (
            f"{exact.side} commands of '{reading.source}': input A is {drop_text} {below} input B as recorded "
            f"({reading.words}), and the firmware {what}"
        )


def _codes(exact: ExactLaw, reading: _Reading) -> tuple[int, int]:
    """Return the codes of both inputs: the lower pressure is none, as the firmware takes their difference alone."""
    sensors = {"A": exact.a, "B": exact.b}
    codes = {name: sensor.zero_code for name, sensor in sensors.items()}
    higher = "A" if reading.a_minus_b_MPa > 0 else "B"
    sensor = sensors[higher]
    away = round(abs(reading.a_minus_b_MPa) / float(sensor.per_code_MPa))
    codes[higher] = min(sensor.zero_code + away, sensor.valid_codes[1])
    return codes["A"], codes["B"]


def _drop_code(exact: ExactLaw, reading: _Reading) -> int:
    """Return the pressure drop that the firmware is to read, in codes of sensor A."""
    a, b = _codes(exact, reading)
    drop_MPa = (a - exact.a.zero_code) * exact.a.per_code_MPa + (b - exact.b.zero_code) * exact.b.per_code_MPa
    return round(drop_MPa / exact.a.per_code_MPa)


def _words(readings: Sequence[_Reading], sign: int) -> str:
    """Return the columns that make the drop of one sign, as differences of labels."""
    return and_more(list(dict.fromkeys(each.words for each in readings if each.sign == sign)), MOST_NAMED)
