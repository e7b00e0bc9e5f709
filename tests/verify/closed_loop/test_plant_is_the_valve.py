"""A plant of the user's own opens and closes where the valve does, or the closed loop says nothing of that valve."""

from dataclasses import replace

import pytest

from dzdesign.verify.closed_loop.loop_checks import plant_is_the_valve, stand_in_is_the_recording
from dzdesign.verify.loop_results import PressureResult
from tests.support.evidence import pressure_result


def at_the_thresholds(valve, **off_V: float) -> PressureResult:
    """What a ramp of a plant shows that opens and closes where the first test does, but for so many volts."""
    test = valve.positive.tests[0]
    shares = {"opening": test.u_knee_rising_V, "closing": test.u_knee_falling_V}
    found = {f"dead_zone_{name}": (at + off_V.get(name, 0.0)) / valve.u_max_V for name, at in shares.items()}
    return pressure_result(dp_MPa=test.dp_MPa, **found)


@pytest.mark.parametrize(
    ("off_V", "holds"),
    [
        ({}, True),
        ({"opening": 0.29, "closing": 0.29}, True),
        ({"opening": 0.31}, False),
        ({"opening": -0.31}, False),
        ({"closing": 0.31}, False),
        ({"closing": -0.9}, True),
    ],
    ids=str,
)
def test_where_it_opens_and_closes_is_compared(example_valve, off_V, holds):
    """One that closes at a larger command would show no flow where the valve still passes some; else it is no fault."""
    check = plant_is_the_valve([at_the_thresholds(example_valve, **off_V)], example_valve)
    assert check.holds is holds
    assert ("closes 0.31 V above" in check.text) == ("closing" in off_V and not holds)


def test_a_flow_that_departs_is_said_with_command_pressure_drop_and_recording(example_valve, wording):
    test = example_valve.positive.tests[2]
    ramps = [
        pressure_result(dp_MPa=each.dp_MPa, flow_miss=0.12 if each is test else 0.01, flow_miss_at=0.935)
        for each in example_valve.positive.tests
    ]
    check = stand_in_is_the_recording(ramps, example_valve)
    assert check.holds is False and f"'{test.source}'" in check.text
    wording("stand in: a dent in the recorded flow", check.text)
    both = replace(example_valve, sides={side: example_valve.positive for side in ("positive", "negative")})
    negative = [replace(ramp, side="negative") for ramp in ramps]
    assert "negative side" in stand_in_is_the_recording(negative, both).text
