"""A failed pressure sensor that its signal does not show: refused, or accepted with what it costs."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.codegen.project import target_named, targets
from dzdesign.core.errors import InputError
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions, options_of
from dzdesign.design.pressure_inputs import hidden_failure
from dzdesign.design.signal_text import command_signal, parse_signal, pressure_signal
from dzdesign.design.signals import Signals
from dzdesign.design.target_inputs import Converter
from tests.support.repeatable_valves import identify
from tests.support.synthetic import Truth, synthetic_ramp

WHOLE, NO_ROOM, BOTH = "0..3 V", "4..20 mA on 150 ohm", "4..20 mA on 140 ohm"
PRESSURES = (1.0, 3.0, 5.0)


@pytest.fixture(scope="module", params=["decreasing", "flat", "increasing"])
def valve(request):
    slope = {"decreasing": -0.1, "flat": 0.0, "increasing": 0.1}[request.param]
    found = identify([synthetic_ramp(dp, Truth(knee_rising=5.0 + slope * dp)) for dp in PRESSURES])
    assert found.positive.trend == request.param
    return found


def signals(a: str, b: str, **options) -> Signals:
    made = {
        f"pressure_{name}": pressure_signal(parse_signal(text, "--pressure-a"), Converter(), Fraction(20))
        for name, text in (("a", a), ("b", b))
    }
    return Signals(**made, **options)


#: Signals of sensors A and B, and the failures that each trend can't tell, of a falling and of a rising threshold.
HIDDEN = [
    ((BOTH, BOTH), (), ()),
    ((WHOLE, BOTH), ("a broken wire of sensor A",), ("a reading of sensor A above its span",)),
    ((BOTH, WHOLE), (), ("a broken wire of sensor B",)),
    # A live zero of 12 codes: the converter's offset of 15 makes as much of a broken wire.
    (("0.01..2.8 V", "0.01..2.8 V"), ("a broken wire of sensor A",), ("a broken wire of sensor B",)),
    ((NO_ROOM, NO_ROOM), (), ("a reading of sensor A above its span",)),
    ((BOTH, f"{NO_ROOM} = 10 MPa"), ("a reading of sensor B above its span",), ()),
    (("0..3 V = 10 MPa", WHOLE), ("a broken wire of sensor A",),
     ("a broken wire of sensor B", "a reading of sensor A above its span")),
]  # fmt: skip


@pytest.mark.parametrize(("texts", "falling", "rising"), HIDDEN)
def test_a_signal_that_hides_what_raises_the_offset_is_refused(valve, texts, falling, rising):
    trend, made = valve.positive.trend, signals(*texts)
    expected = {"decreasing": falling, "increasing": rising, "flat": ()}[trend]
    if not expected:
        assert hidden_failure(design(valve, DesignOptions(signals=made)), 1) is None
        return
    with pytest.raises(InputError, match="--accept broken-sensor") as caught:
        design(valve, DesignOptions(signals=made))
    assert all(failure in str(caught.value) for failure in expected)
    compensator = design(valve, DesignOptions(signals=made, accept=("broken-sensor",)))
    hidden = hidden_failure(compensator, 1)
    assert hidden.failures == expected
    assert compensator.costs[-1] and any(line.startswith("accepted, broken-sensor: ") for line in compensator.costs)
    # The flow, from the recorded points alone: the largest offset of any code, over the closing branch of each test.
    largest_V = max(compensator.compare(0, code) for code in range(made.largest_difference(1) + 1)) / 6000
    flows = {
        test.dp_MPa: float(np.interp(largest_V, test.recorded.falling.u_V, test.recorded.falling.q_L_min))
        for test in valve.positive.tests
    }
    assert hidden.dp_MPa == (5.0 if trend == "decreasing" else 1.0)
    assert hidden.flow_L_min == pytest.approx(max(flows.values()), rel=0.02)
    assert flows[hidden.dp_MPa] == max(flows.values()) > 0.5


@pytest.mark.parametrize("swapped", [False, True])
def test_the_negative_sides_sensor_ahead_is_the_other_one_where_the_pressures_are_swapped(valve, swapped):
    two = replace(valve, sides={"positive": valve.positive, "negative": valve.positive})
    command = command_signal(parse_signal("-10..10 V x 0.15 + 1.5 V", "--command-signal"), Converter())
    made = signals(BOTH, WHOLE, command=command, swapped=swapped)
    compensator = design(two, DesignOptions(signals=made, accept=("broken-sensor",)))
    found = [hidden_failure(compensator, sign) for sign in (1, -1)]
    broken, above = "a broken wire of sensor B", "a reading of sensor B above its span"
    expected = {
        ("decreasing", False): [None, None], ("decreasing", True): [None, (broken,)],
        ("increasing", False): [(broken,), (broken,)], ("increasing", True): [(broken,), (above,)],
    }.get((valve.positive.trend, swapped), [None, None])  # fmt: skip
    assert [each and each.failures for each in found] == expected


def test_the_default_signals_take_neither_end_of_the_converter_for_a_pressure():
    for target in targets():
        made = options_of({}, target.inputs()).signals
        for sensor in (made.pressure_a, made.pressure_b):
            assert 0 < sensor.valid_codes[0] < sensor.zero_code
            assert sensor.full_code < sensor.valid_codes[1] < made.code_max
        assert all(made.hidden_failures(1, reads_high=high) == () for high in (True, False))
    assert options_of({}, target_named("f28335").inputs()).signals == Signals()
