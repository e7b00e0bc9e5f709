"""Signals as engineers write them, and the codes they become."""

import random
import re
from fractions import Fraction

import pytest

from dzdesign.codegen.project import targets
from dzdesign.core.errors import InputError
from dzdesign.design.signal_text import command_signal, live_zero_signal, parse_signal, pressure_signal
from dzdesign.design.signals import CommandSignal, PressureSignal, Signals
from dzdesign.design.target_inputs import Converter
from tests.support.designs import options

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
