"""Pressures as they were recorded, wired to the firmware's inputs: whether it reads the recorded pressure drop.

Neither the direction that `identify` stores nor the one that `design` chose counts here. Inputs A and B get the two
columns that make the drop of positive commands, and keep them at negative ones, as wires do; input C gets the column
that only the drop of negative commands has.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import and_more, one_line
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.verify.exhaustive.exact_law import DIFFERENCE, PRESSURES, ExactLaw
from dzdesign.verify.requirements import PRESSURE_INPUTS, Check

#: A command this far into a side, as a share of its largest, is where the pressure drop is read.
OPEN = 0.8
#: A recording shows a side if its command goes that far into it, as a share of full command.
SHOWS = 0.1
#: Status bits that sound pressures do not set: of each input, and of a difference that can't be right.
PRESSURE_BITS = sum(PRESSURES.values()) | DIFFERENCE
MPA = 1e6
MOST_NAMED = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reading:
    """What one recording shows at commands of one sign: which columns, and their difference there, MPa."""

    source: str
    sign: int
    columns: tuple[str, ...]
    words: str
    drop_MPa: float


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
    if declared not in (None, "recorded", "A-B"):  # of a column above zero on both sides nobody knows which is ahead
        readings = [each for each in readings if each.sign > 0 or each.columns != ("dP",) or each.drop_MPa < 0]
    if fault := next(_faults(compensator, readings), ""):
        return PRESSURE_INPUTS.check(holds=False, text=one_line(f"{fault}; design again from these recordings"))
    counts = {sign: sum(each.sign == sign for each in readings) for sign in (1, -1)}
    text = (
        f"A minus B is {_words(readings, 1)}{_third(compensator, readings)}. The firmware reads the recorded drop of "
        f"{counts[1]} recordings at positive commands, and of {counts[-1]} at negative ones"
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
                drop_MPa=drop,
            )


def _faults(compensator: Compensator, readings: Sequence[_Reading]) -> Iterator[str]:
    """Yield what the firmware reads wrong, and a drop that its inputs do not have."""
    inputs, units = _wired(compensator, readings), compensator.valve.recorded_units
    for sign in (1, -1):
        exact = ExactLaw(compensator, sign) if any(each.sign == sign for each in readings) else None
        for reading in readings if exact else ():
            if reading.sign != sign or exact is None:
                continue
            if not all(port in inputs for port in _ports(reading)):
                yield (
                    f"'{reading.source}': the pressure drop was recorded as {reading.words}, which is no difference of "
                    f"the inputs that read {_words(readings, 1)}"
                )
            elif fault := _misread(exact, reading, [inputs[port] for port in _ports(reading)], units):
                yield fault


def _ports(reading: _Reading) -> tuple[str, ...]:
    """Return the ports whose difference a recording holds; a column of the difference is of those named A and B."""
    return ("pA", "pB") if reading.columns == ("dP",) else reading.columns


def _wired(compensator: Compensator, readings: Sequence[_Reading]) -> dict[str, str]:
    """Return which input each recorded port is wired to; a port that there is no input for has none."""
    first = sorted(readings, key=lambda each: -each.sign)[:1]
    inputs = {port: name for each in first for port, name in zip(_ports(each), "AB", strict=True)}
    others = [port for each in readings if each.sign < 0 for port in _ports(each) if port not in inputs]
    if others and compensator.signals.pressure_c is not None:
        inputs[others[0]] = "C"
    return inputs


def _misread(exact: ExactLaw, reading: _Reading, names: Sequence[str], units: RecordedUnits) -> str:
    """Say that the law does not read the recorded pressure drop, within a code; nothing where it does.

    The lower pressure is none, as the firmware takes their difference alone; what another input reads is half its span.
    """
    sensors = exact.compensator.signals.pressures
    higher, lower = names if reading.drop_MPa > 0 else names[::-1]
    away = round(abs(reading.drop_MPa) / float(sensors[higher].per_code_MPa))
    codes = {name: (sensor.zero_code + sensor.full_code) // 2 for name, sensor in sensors.items()}
    codes[lower] = sensors[lower].zero_code
    codes[higher] = min(sensors[higher].zero_code + away, sensors[higher].valid_codes[1])
    drop_MPa = (codes[higher] - sensors[higher].zero_code) * sensors[higher].per_code_MPa
    ahead, behind = (codes[name] for name in exact.pair)
    status = exact.answer(exact.zero, ahead, behind).status & PRESSURE_BITS
    drop = int(exact.difference(np.array(ahead), np.array(behind)))
    if not status and abs(drop - round(drop_MPa / exact.ahead.per_code_MPa)) <= 1:
        return ""
    drop_text = units.text(abs(reading.drop_MPa), ".3g MPa")
    below = "below" if reading.drop_MPa < 0 else "above"
    what = f"reports a failed sensor (status {status})" if status else "reads another pressure drop"
    return (
        f"{exact.side} commands of '{reading.source}': input {names[0]} is {drop_text} {below} input {names[1]} as "
        f"recorded ({reading.words}), and the firmware {what}"
    )


def _third(compensator: Compensator, readings: Sequence[_Reading]) -> str:
    """Say which difference is read at negative commands, where that takes a third input."""
    if compensator.signals.pressure_c is None:
        return ""
    ahead, behind = compensator.signals.negative_pair
    return f", and {ahead} minus {behind} {_words(readings, -1) or 'as declared'}"


def _words(readings: Sequence[_Reading], sign: int) -> str:
    """Return the columns that make the drop of one sign, as differences of labels."""
    return and_more(list(dict.fromkeys(each.words for each in readings if each.sign == sign)), MOST_NAMED)
