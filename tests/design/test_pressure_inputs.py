"""Signals as engineers write them and their codes; the pressure inputs, and a failure that no signal shows."""

import random
import re
from dataclasses import replace
from fractions import Fraction
from typing import get_args

import numpy as np
import pytest

from dzdesign.codegen.project import targets
from dzdesign.core.artefact_types import RuleError
from dzdesign.core.errors import InputError
from dzdesign.design.pressure_inputs import hidden_failure, input_columns, what_machine_switches, wiring_in_words
from dzdesign.design.signal_text import command_signal, live_zero_signal, parse_signal, pressure_signal
from dzdesign.design.signals import CommandSignal, InputPair, PressureSignal, Signals
from dzdesign.design.target_inputs import Converter
from dzdesign.identify.valve.recorded_drop import DropColumns, RecordedDrop
from tests.support.designs import BOTH_SIGNS, designed, options
from tests.support.golden_firmware import FULL, golden_valve
from tests.support.repeatable_valves import identify
from tests.support.synthetic import Truth, synthetic_ramp

ADC = Converter()
PAIRS = get_args(InputPair)


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


@pytest.mark.parametrize("pair", PAIRS)
def test_a_difference_of_unlike_sensors_stands_for_every_drop_that_makes_it(pair):
    texts = {"A": "4..20 mA on 149 ohm = 25 MPa", "B": "0.5..4.5 V x 0.6 = 160 bar", "C": "0.3..2.7 V = 10 MPa"}
    parsed = {name: parse_signal(text, "--pressure-a") for name, text in texts.items()}
    sensors = {name: pressure_signal(one, ADC, Fraction(20)) for name, one in parsed.items()}
    third = {"pressure_c": sensors["C"]} if "C" in pair else {}
    both = command("-10..10 V x 0.15 + 1.5 V")
    signals = Signals(command=both, pressure_a=sensors["A"], pressure_b=sensors["B"], negative_pair=pair, **third)
    assert signals.pair(1).names == "AB"
    found, draw = signals.pair(-1), random.Random(5)
    low, high = found.difference_error(signals.code_max)
    ahead, behind = (parsed[name] for name in pair)
    for _ in range(3000):
        shares = [Fraction(draw.randrange(10**9), 10**9) for _ in range(2)]
        values = zip((ahead, behind), shares, strict=True)
        codes = [ADC.code(one.volts(one.low + share * (one.high - one.low))) for one, share in values]
        drop = shares[0] * sensors[pair[0]].span_MPa - shares[1] * sensors[pair[1]].span_MPa
        counted = found.difference(*codes)
        assert low <= drop / sensors[pair[0]].per_code_MPa - counted <= high
        assert counted <= found.largest_difference


@pytest.mark.parametrize(("pair", "third"), [("AC", None), ("AB", PressureSignal()), ("BA", PressureSignal())])
def test_a_third_sensor_is_there_where_the_negative_side_reads_it_and_nowhere_else(pair, third):
    with pytest.raises(RuleError, match="expected a pressure_c where C is one of them"):
        Signals(command=command("-10..10 V x 0.15 + 1.5 V"), negative_pair=pair, pressure_c=third)


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
        assert all(made.pair(1).hidden_failures(made.code_max, reads_high=high) == () for high in (True, False))
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


#: Recorded drops of three ports: of each side's edge, and the inputs ahead and behind at negative commands.
THREE_PORTS = [
    (drop("pP", "pA"), drop("pP", "pB"), "AC"),
    (drop("pB", "pT"), drop("pA", "pT"), "CB"),
    (drop("pP", "pA"), drop("pA", "pT"), "BC"),
    (drop("pB", "pT"), drop("pP", "pB"), "CA"),
]


@pytest.mark.parametrize(
    ("positive", "negative", "choice", "pair"),
    [
        (drop(*AB), drop(*AB), "", "AB"),
        (drop(*AB), drop(*AB, sign=-1), "", "BA"),
        (drop(*AB), drop(*AB, sign=-1), "B-A", "BA"),
        (drop(*DP), drop(*DP, sign=-1), "", "BA"),
        # A dP above zero on both sides may be a magnitude, and a declared one has no sign at all.
        (drop(*DP), drop(*DP), "", "AB"),
        (drop(*DP), drop(*DP), "B-A", "BA"),
        (drop(*DP), drop(*DP), "A-C", "AC"),
        (None, None, "", "AB"),
        (None, None, "C-B", "CB"),
        (drop("pP", "pA"), drop("pP", "pB"), "wired", "AB"),
        (drop("pP", "pA"), drop("pP", "pB"), "A-C", "AC"),
        (drop(*AB), drop(*AB, sign=-1), "wired", "AB"),
        *((positive, negative, "", pair) for positive, negative, pair in THREE_PORTS),
    ],
)
def test_the_inputs_are_the_recorded_ones_unless_they_are_declared(two_sides, positive, negative, choice, pair):
    signals = designed_as(two_sides, positive, negative, choice).signals
    assert signals.negative_pair == pair and (signals.pressure_c is not None) == ("C" in pair)


@pytest.mark.parametrize(("positive", "negative", "pair"), THREE_PORTS)
def test_the_inputs_are_named_after_what_was_recorded(two_sides, positive, negative, pair):
    made = designed_as(two_sides, positive, negative)
    columns = input_columns(made)
    for each, names in ((positive, "AB"), (negative, pair)):
        assert [columns[name] for name in names] == [AHEAD_LABELS[port] for port in each.columns[0].quantities]
    assert not what_machine_switches(made)


@pytest.mark.parametrize(
    ("positive", "negative", "choice"),
    [
        (drop(*AB), drop(*AB, sign=-1), "A-B"),
        (drop(*AB), drop(*AB), "B-A"),
        (drop("pP", "pA"), drop("pP", "pB"), "A-B"),
        (drop("pP", "pA"), drop("pP", "pB"), "C-A"),
    ],
    ids=["B-A as A-B", "A-B as B-A", "A-C as A-B", "A-C as C-A"],
)
def test_declared_inputs_that_the_recordings_contradict_are_refused(
    two_sides, positive, negative, choice, wording, request
):
    with wording.refusal(InputError, f"negative drop: contradicted [{request.node.callspec.id}]"):
        designed_as(two_sides, positive, negative, choice)


def test_a_side_whose_recordings_hold_the_drop_of_several_edges_has_no_two_inputs(two_sides, wording):
    columns = (*drop("pP", "pB").columns, *drop("pA", "pT").columns)
    several = RecordedDrop(columns=columns, sign=1)
    with wording.refusal(InputError, "negative drop: several edges"):
        designed_as(two_sides, drop("pP", "pA"), several)
    assert designed_as(two_sides, drop("pP", "pA"), several, "wired").signals.negative_pair == "AB"


def test_a_third_sensor_has_a_signal_and_an_error_of_its_own(two_sides):
    machine = {"amplifier": "1 %", "pressure_error": "0.1 MPa / 0.2 MPa / 0.3 MPa"}
    own = {"pressure_c": "4..20 mA on 140 ohm = 10 MPa", **machine}
    made = designed_as(two_sides, drop("pP", "pA"), drop("pP", "pB"), **own)
    assert made.signals.pressure_c.span_MPa == 10 and made.signals.pressure_a.span_MPa == 20
    sensors = [{name for name in made.allowance(sign).pressures_MPa if "sensor" in name} for sign in (1, -1)]
    assert sensors == [{"pressure sensor A", "pressure sensor B"}, {"pressure sensor A", "pressure sensor C"}]
    assert made.allowance(-1).pressures_MPa["pressure sensor C"] == Fraction(3, 10)
    for signal in (BOTH_SIGNS, "0..10 V x 0.3"):
        two = designed_as(two_sides, drop(*AB), drop(*AB), amplifier="1 %", command_signal=signal)
        assert two.machine.pressure_error_c_MPa is None and not [name for name in two.machine.defaults if "_c_" in name]


@pytest.mark.parametrize("signal", [BOTH_SIGNS, "0..10 V x 0.3"])
@pytest.mark.parametrize(
    "given",
    [{"pressure_c": "4..20 mA on 140 ohm"}, {"amplifier": "1 %", "pressure_error": "0.1 % / 0.1 % / 0.2 %"}],
)
def test_what_is_said_of_a_third_sensor_that_nothing_reads_is_refused(two_sides, signal, given, wording):
    with wording.refusal(InputError, "negative drop: a third sensor that nothing reads"):
        designed_as(two_sides, drop(*AB), drop(*AB), command_signal=signal, **given)


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
        (drop("pP", "pA"), drop("pP", "pB"), ""),
    ],
    ids=["recorded", "assumed", "wired", "three"],
)
def test_what_the_direction_rests_on_is_said(two_sides, positive, negative, choice, wording, request):
    made = designed_as(two_sides, positive, negative, choice)
    said = [*wiring_in_words(made), *filter(None, [what_machine_switches(made)])]
    wording(f"negative drop: {request.node.callspec.id}", "\n".join(said))


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
    codes = range(compensator.signals.pair(1).largest_difference + 1)
    largest_V = max(compensator.compare(0, code) for code in codes) / 6000
    flows = {
        test.dp_MPa: float(np.interp(largest_V, test.recorded.falling.u_V, test.recorded.falling.q_L_min))
        for test in valve.positive.tests
    }
    assert hidden.dp_MPa == (5.0 if trend == "decreasing" else 1.0)
    assert hidden.flow_L_min == pytest.approx(max(flows.values()), rel=0.02)
    assert flows[hidden.dp_MPa] == max(flows.values()) > 0.5


@pytest.mark.parametrize("pair", ["AB", "BA", "AC"])
def test_what_is_hidden_at_negative_commands_is_of_the_inputs_of_that_side(valve, pair):
    two = replace(valve, sides={"positive": valve.positive, "negative": valve.positive})
    compensator = designed(
        two, pressure_a=BOTH, pressure_b=WHOLE, command_signal=BOTH_SIGNS, accept="broken-sensor",
        negative_dp="-".join(pair),
    )  # fmt: skip
    found = [hidden_failure(compensator, sign) for sign in (1, -1)]
    broken, above = "a broken wire of sensor B", "a reading of sensor B above its span"
    expected = {
        ("decreasing", "AB"): [None, None], ("decreasing", "BA"): [None, (broken,)],
        ("increasing", "AB"): [(broken,), (broken,)], ("increasing", "BA"): [(broken,), (above,)],
        ("increasing", "AC"): [(broken,), None],
    }.get((valve.positive.trend, pair), [None, None])  # fmt: skip
    assert [each and each.failures for each in found] == expected
