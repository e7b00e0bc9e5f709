"""Tests of which some have a branch that others lack, refused with the reason, such as a pressure on its way."""

from collections.abc import Sequence

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import worded
from dzdesign.identify.constants import MPA
from dzdesign.identify.knees.described_tests import DescribedTest
from dzdesign.identify.reading.ramp_test import RampTest, despiked

#: The pressure drop has settled where it lies within this share of its level, for this share of the recording.
SETTLED, LAST = 0.05, 0.05


def refuse_mixed_branches(described: Sequence[DescribedTest], recordings: Sequence[RampTest]) -> None:
    """Refuse tests of which some have a branch that others lack: they can't be compared.

    A test's branch may be a test of its own, at the pressure drop that the pump had come up to by then.
    """
    for column, name in ((0, "rising"), (1, "falling")):
        lacking = [item for item in described if item.shapes[column] is None]
        if not lacking or len(lacking) == len(described):
            continue
        item, remedy = lacking[0], "record every pressure drop up and down, or leave that file out"
        remedy = _pressure_on_its_way(item, column, described, recordings) or remedy
        raise InputError(
            worded(
                "'{source}' has no {name} branch while other ramp tests have one; {remedy}",
                source=item.test.source,
                name=name,
                remedy=remedy,
            )
        )


def _pressure_on_its_way(
    item: DescribedTest, column: int, described: Sequence[DescribedTest], recordings: Sequence[RampTest]
) -> str | None:
    """Return what to say where the branch that a test lacks was run at another pressure drop, in the same recording."""
    other = next(
        (
            each
            for each in described
            if each is not item
            and set(each.files) & set(item.files)
            and each.shapes[column] is not None
            and each.shapes[1 - column] is None
        ),
        None,
    )
    if other is None or other.dp is None or item.dp is None:
        return None
    source = next(file for file in item.files if file in other.files)[0]
    recording = next(test for test in recordings if test.source == source)
    settled = _settles_at(recording, item.dp)
    return worded(
        "in '{source}' the pressure drop was {dp:.3g #MPa} on that branch, and {level:.3g MPa} on the other one{when}, "
        "so it is another test. Start the ramp after the pressure has settled and record again, or leave "
        "that file out",
        source=source,
        dp=other.dp / MPA,
        level=item.dp / MPA,
        when="" if settled is None else f" (it settled at {settled:.1f} s only)",
    )


def _settles_at(recording: RampTest, level: float) -> float | None:
    """Return when the pressure drop of a recording first comes to a level and stays near it for a while, s."""
    if recording.dp is None:
        return None
    near = np.abs(despiked(recording.dp) - level) <= SETTLED * level
    count = max(int(LAST * near.size), 1)
    # The command rises meanwhile, and under flow the pressure drop may sink again.
    steady = np.convolve(near, np.ones(count), mode="valid") >= 0.9 * count
    first = np.flatnonzero(steady)
    return float(recording.time[first[0]]) if first.size else None
