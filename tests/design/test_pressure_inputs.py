"""The pressure inputs: which is ahead at negative commands, and a failure of one that its signal does not show."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.design.pressure_inputs import hidden_failure, wiring_in_words
from dzdesign.identify.valve.recorded_drop import DropColumns, RecordedDrop
from tests.support.designs import BOTH_SIGNS, designed
from tests.support.golden_firmware import FULL, golden_valve
from tests.support.repeatable_valves import identify
from tests.support.synthetic import Truth, synthetic_ramp

AHEAD_LABELS = {"dP": "dP (bar)", "pP": "Druck P", "pA": "Druck A | links", "pB": "Druck B", "pT": "Druck T"}


def drop(*quantities, sign=1):
    columns = DropColumns(quantities=quantities, labels=tuple(AHEAD_LABELS[each] for each in quantities))
    return RecordedDrop(columns=(columns,), sign=sign)


AB, DP = ("pA", "pB"), ("dP",)


@pytest.fixture(scope="module")
def two_sides():
    return golden_valve(FULL)


def designed_as(valve, positive, negative, choice="", **texts):
    drops = {"positive": positive, "negative": negative}
    sides = {name: replace(side, recorded_drop=drops[name]) for name, side in valve.sides.items()}
    given = {"command_signal": BOTH_SIGNS, "negative_dp": choice} | texts
    return designed(replace(valve, sides=sides), **given)


@pytest.mark.parametrize(
    ("positive", "negative", "choice", "swapped"),
    [
        (drop(*AB), drop(*AB), "", False),
        (drop(*AB), drop(*AB, sign=-1), "", True),
        (drop(*AB), drop(*AB, sign=-1), "swapped", True),
        (drop(*DP), drop(*DP, sign=-1), "", True),
        # A dP above zero on both sides may be a magnitude, and a declared one has no sign at all.
        (drop(*DP), drop(*DP), "", False),
        (drop(*DP), drop(*DP), "swapped", True),
        (None, None, "", False),
        (None, None, "swapped", True),
        (drop("pP", "pA"), drop("pP", "pB"), "wired", False),
        (drop(*AB), drop(*AB, sign=-1), "wired", False),
    ],
)
def test_the_direction_is_the_recorded_one_unless_it_is_declared(two_sides, positive, negative, choice, swapped):
    assert designed_as(two_sides, positive, negative, choice).signals.swapped is swapped


@pytest.mark.parametrize(
    ("negative", "choice"), [(drop(*AB, sign=-1), "same"), (drop(*AB), "swapped")], ids=["same", "swapped"]
)
def test_a_declared_direction_that_the_recordings_contradict_is_refused(two_sides, negative, choice, wording):
    kept = f"negative drop: a declared direction that the recordings contradict is refused [{choice}]"
    with wording.refusal(InputError, kept):
        designed_as(two_sides, drop(*AB), negative, choice)


@pytest.mark.parametrize("choice", ["", "same", "swapped"])
@pytest.mark.parametrize(
    ("positive", "negative"),
    [
        (drop("pP", "pA"), drop("pP", "pB")),
        (drop("pB", "pT"), drop("pA", "pT")),
        (drop("pP", "pA"), drop("pA", "pT")),
        (drop("pB", "pT"), drop("pP", "pB")),
    ],
)
def test_drops_that_no_two_inputs_give_are_refused(two_sides, positive, negative, choice, wording):
    with pytest.raises(InputError) as refused:
        designed_as(two_sides, positive, negative, choice)
    if positive.columns[0].quantities[0] == negative.columns[0].quantities[0] == "pP":
        wording("negative drop: three sensors", str(refused.value))
    assert "--negative-dp wired" in str(refused.value)


def test_one_side_alone_needs_no_direction(two_sides):
    made = designed_as(two_sides, drop("pP", "pA"), drop("pP", "pB"), command_signal="0..10 V x 0.3")
    (line,) = wiring_in_words(made)
    assert line == "pressure inputs: A = Druck P, B = Druck A | links, as recorded at positive commands"


@pytest.mark.parametrize(
    ("positive", "negative", "choice"),
    [
        (drop(*AB), drop(*AB, sign=-1), ""),
        (drop(*DP), drop(*DP), ""),
        (drop("pP", "pA"), drop("pP", "pB"), "wired"),
    ],
    ids=["recorded", "assumed", "wired"],
)
def test_what_the_direction_rests_on_is_said(two_sides, positive, negative, choice, wording, request):
    made = designed_as(two_sides, positive, negative, choice)
    wording(f"negative drop: {request.node.callspec.id}", "\n".join(wiring_in_words(made)))


# ---- a failed sensor: refused, or accepted with what it costs

WHOLE, NO_ROOM, BOTH = "0..3 V", "4..20 mA on 150 ohm", "4..20 mA on 140 ohm"
PRESSURES = (1.0, 3.0, 5.0)


@pytest.fixture(scope="module", params=["decreasing", "flat", "increasing"])
def valve(request):
    slope = {"decreasing": -0.1, "flat": 0.0, "increasing": 0.1}[request.param]
    found = identify([synthetic_ramp(dp, Truth(knee_rising=5.0 + slope * dp)) for dp in PRESSURES])
    assert found.positive.trend == request.param
    return found


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
    trend, given = valve.positive.trend, dict(zip(("pressure_a", "pressure_b"), texts, strict=True))
    expected = {"decreasing": falling, "increasing": rising, "flat": ()}[trend]
    if not expected:
        assert hidden_failure(designed(valve, **given), 1) is None
        return
    with pytest.raises(InputError, match="--accept broken-sensor") as caught:
        designed(valve, **given)
    assert all(failure in str(caught.value) for failure in expected)
    compensator = designed(valve, accept="broken-sensor", **given)
    hidden = hidden_failure(compensator, 1)
    assert hidden.failures == expected
    assert compensator.costs[-1] and any(line.startswith("accepted, broken-sensor: ") for line in compensator.costs)
    # The flow, from the recorded points alone: the largest offset of any code, over the closing branch of each test.
    codes = range(compensator.signals.largest_difference(1) + 1)
    largest_V = max(compensator.compare(0, code) for code in codes) / 6000
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
    compensator = designed(
        two, pressure_a=BOTH, pressure_b=WHOLE, command_signal=BOTH_SIGNS, accept="broken-sensor",
        negative_dp="swapped" if swapped else "same",
    )  # fmt: skip
    found = [hidden_failure(compensator, sign) for sign in (1, -1)]
    broken, above = "a broken wire of sensor B", "a reading of sensor B above its span"
    expected = {
        ("decreasing", False): [None, None], ("decreasing", True): [None, (broken,)],
        ("increasing", False): [(broken,), (broken,)], ("increasing", True): [(broken,), (above,)],
    }.get((valve.positive.trend, swapped), [None, None])  # fmt: skip
    assert [each and each.failures for each in found] == expected
