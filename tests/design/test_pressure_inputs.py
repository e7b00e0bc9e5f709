"""Signals as engineers write them and their codes; the pressure inputs, and a failure that no signal shows."""

import random
import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.codegen.project import targets
from dzdesign.core.errors import InputError
from dzdesign.design.pressure_inputs import hidden_failure, wiring_in_words
from dzdesign.design.signal_text import command_signal, live_zero_signal, parse_signal, pressure_signal
from dzdesign.design.signals import CommandSignal, PressureSignal, Signals
from dzdesign.design.target_inputs import Converter
from dzdesign.identify.valve.recorded_drop import DropColumns, RecordedDrop
from tests.support.designs import BOTH_SIGNS, designed, options
from tests.support.golden_firmware import FULL, golden_valve
from tests.support.repeatable_valves import identify
from tests.support.synthetic import Truth, synthetic_ramp

ADC = Converter()


def command(text: str, **options) -> CommandSignal:
    return command_signal(parse_signal(text, "--command-signal"), ADC, **options)


def sensor(text: str, span: int = 20) -> PressureSignal:
    return pressure_signal(parse_signal(text, "--pressure-a"), ADC, Fraction(span))


def test_the_defaults_are_a_whole_range_of_command_and_live_zero_sensors():
    assert command("0..10 V x 0.3") == CommandSignal()
    assert sensor(live_zero_signal(ADC)) == PressureSignal()


def test_a_command_of_both_signs_has_its_zero_between():
    both = command("-10..10 V x 0.15 + 1.5 V")
    assert (both.negative_full_code, both.zero_code, both.full_code) == (0, 2048, 4095)
    assert both.from_zero(2148, 1) == 100 and both.from_zero(2148, -1) == 0
    turned = command("-10..10 V x 0.15 + 1.5 V", inverted=True)
    assert (turned.negative_full_code, turned.full_code) == (4095, 0)
    assert turned.from_zero(2148, -1) == 100


def test_4_to_20_mA_on_a_shunt():
    # 4 mA * 150 ohm = 0.6 V = 819.2 codes; 3.6 mA is the end of a sound signal, 20 mA fills the converter.
    found = sensor("4..20 mA on 150 ohm = 25 MPa")
    assert (found.zero_code, found.full_code, found.span_MPa) == (819, 4095, 25)
    assert found.valid_codes == (737, 4095)
    # 21 mA shows where the shunt leaves room for it.
    assert sensor("4..20 mA on 140 ohm").valid_codes == (688, 4014)


@pytest.mark.parametrize(
    "text", ["0..3 V", "4..20 mA on 149 ohm = 25 MPa", "0.5..4.5 V x 0.6 = 160 bar", "0..10 V x 0.29"]
)
def test_a_code_stands_for_every_pressure_that_makes_it(text):
    """Random pressures through the signal and the converter: the code's pressure and its error bounds hold them."""
    signal = parse_signal(text, "--pressure-a")
    found = pressure_signal(signal, ADC, Fraction(20))
    draw = random.Random(4)
    for _ in range(2000):
        share = Fraction(draw.randrange(10**9), 10**9)
        code = ADC.code(signal.volts(signal.low + share * (signal.high - signal.low)))
        taken = (code - found.zero_code) * found.per_code_MPa
        assert found.error_MPa[0] <= share * found.span_MPa - taken <= found.error_MPa[1]


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_difference_of_unlike_sensors_stands_for_every_drop_that_makes_it(sign, swapped):
    texts = ("4..20 mA on 149 ohm = 25 MPa", "0.5..4.5 V x 0.6 = 160 bar")
    parsed = [parse_signal(text, "--pressure-a") for text in texts]
    a, b = (pressure_signal(one, ADC, Fraction(20)) for one in parsed)
    both = command("-10..10 V x 0.15 + 1.5 V")
    signals = Signals(command=both, pressure_a=a, pressure_b=b, swapped=swapped)
    low, high = signals.difference_error(sign)
    draw = random.Random(5)
    for _ in range(3000):
        shares = [Fraction(draw.randrange(10**9), 10**9) for _ in range(2)]
        codes = [ADC.code(one.volts(one.low + s * (one.high - one.low))) for one, s in zip(parsed, shares, strict=True)]
        drop = shares[0] * a.span_MPa - shares[1] * b.span_MPa
        if sign < 0 and swapped:
            drop = -drop
        counted = signals.difference(*codes, sign)
        assert low <= drop / a.per_code_MPa - counted <= high
        assert counted <= signals.largest_difference(sign)


@pytest.mark.parametrize(
    "text",
    ["10 V", "0..10 V", "10..0 V x 0.3", "-10..8 V x 0.15 + 1.5 V", "0..10 bar x 0.3", "4..20 mA x 0.3", "0..10 V x 0"],
)
def test_a_command_that_cannot_be(text, wording):
    with wording.refusal(InputError, f"a signal: {text}"):
        command(text)


@pytest.mark.parametrize("text", ["0..10 V", "-10..10V", "-7..7 V", "0..7 V", "-12..12 V"])
def test_the_attenuator_that_is_proposed_is_one_that_serves(text):
    with pytest.raises(InputError) as caught:
        command(text)
    proposed = re.search(r"such as '([^']+)'", str(caught.value))[1]
    assert proposed.startswith(text)
    found = command(proposed)
    assert abs(found.full_code - found.zero_code) > (0.98 if text.startswith("0") else 0.49) * ADC.code_max


def test_a_pressure_signal_may_not_start_below_zero(wording):
    with wording.refusal(InputError, "a signal: pressure below zero"):
        sensor("-1..1 V + 1 V")


def test_a_current_of_both_signs_has_its_zero_between():
    both = command("4..20 mA on 150 ohm = -10..10 V")
    # 12 mA on 150 ohm are 1.8 V of 3 V: 2457.6 codes.
    assert (both.negative_full_code, both.zero_code, both.full_code) == (819, 2457, 4095)
    assert both.valid_codes == (737, 4095)
    assert command("4..20 mA on 150 ohm = -100..100 %") == both
    assert command("4..20 mA on 150 ohm = 0..10 V") == command("4..20 mA on 150 ohm")
    turned = command("4..20 mA on 150 ohm = -10..10 V", inverted=True)
    assert (turned.negative_full_code, turned.full_code) == (4095, 819)


@pytest.mark.parametrize(
    "meaning", ["25 MPa", "-10..8 V", "10..-10 V", "2..10 V", "-10..-2 V", "-10..10 bar", "-10..10"]
)
def test_what_a_command_cannot_stand_for(meaning):
    with pytest.raises(InputError, match=r"4\.\.20 mA on 150 ohm"):
        command(f"4..20 mA on 150 ohm = {meaning}")


def test_noise_at_the_end_of_a_signal_is_no_failure():
    """A code below zero command let the valve go, and the spool would have hammered."""
    found = command("0..10 V x 0.25 + 0.2 V")
    low, high = found.valid_codes
    margin = (found.full_code - found.zero_code) / 20
    assert found.zero_code - low == pytest.approx(margin, abs=2) == high - found.full_code


def test_the_default_signals_take_neither_end_of_the_converter_for_a_pressure():
    for target in targets():
        made = options(target.name).signals
        for each in (made.pressure_a, made.pressure_b):
            assert 0 < each.valid_codes[0] < each.zero_code
            assert each.full_code < each.valid_codes[1] < made.code_max
        assert all(made.hidden_failures(1, reads_high=high) == () for high in (True, False))
    assert options().signals == Signals()


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
