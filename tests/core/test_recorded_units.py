"""`RecordedUnits`: a number in the unit of the recordings, with the digits that mean as much as those in V."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import (
    AS_COMPUTED,
    CommandUnit,
    FlowUnit,
    PressureUnit,
    RecordedUnits,
    common_units,
    shown_in,
    worded,
)
from dzdesign.core.units import si_factor

MA = RecordedUnits(command=CommandUnit(unit="mA", at_zero=4.0, factor=1.6))
BOTH = RecordedUnits(command=CommandUnit(unit="mA", at_zero=12.0, factor=0.8))
COUNTS = RecordedUnits(command=CommandUnit(unit="counts", factor=2764.8))
DUTY = RecordedUnits(command=CommandUnit(unit="duty", factor=0.09))
BACKWARDS = RecordedUnits(command=CommandUnit(unit="%", at_zero=100.0, factor=-10.0))
SHOP = RecordedUnits(
    pressure=PressureUnit(unit="psi", factor=145.03773773), flow=FlowUnit(unit="gpm", factor=1 / 3.785411784)
)
NUMBERS = st.floats(-100, 100, allow_subnormal=False)


def test_a_threshold_and_its_error_are_read_as_the_bench_reads_them():
    """12.32 mA ± 0.005 mA of 5.2 V ± 3 mV."""
    assert (MA.text(5.2, ".2f V"), MA.text(3.0, ".0f mV")) == ("12.32 mA", "0.005 mA")
    assert (COUNTS.text(4.66, ".3f V"), COUNTS.text(3.0, ".0f mV")) == ("12884 counts", "8 counts")
    assert (DUTY.text(4.66, ".3f V"), DUTY.text(3.0, ".0f mV")) == ("0.4194 duty", "0.0003 duty")
    assert (BACKWARDS.text(4.66, ".3f V"), BACKWARDS.text(3.0, "+.0f mV")) == ("53.40 %", "+0.03 %")
    assert (SHOP.text(1.0, ".3f MPa"), SHOP.text(15.1, ".2f L/min")) == ("145.0 psi", "3.989 gpm")
    assert (SHOP.text(3.5, ".3g L/min/V"), SHOP.label("L/min per MPa")) == ("0.925 gpm/V", "gpm per psi")
    assert MA.text(0.2, ".3g V/s") == "0.32 mA/s"


@given(NUMBERS, st.sampled_from([".3f", "+.1f", ".4f", ".3g", "g", ".0f"]))
def test_what_is_recorded_in_V_MPa_and_L_min_stays_to_the_last_sign(value, form):
    for unit, name in (("V", "V"), ("mV", "mV"), ("MPa", "MPa"), ("L/min", "L/min"), ("L/min/V", "L/min/V")):
        assert AS_COMPUTED.text(value, f"{form} {unit}") == f"{value:{form}} {name}"
    assert AS_COMPUTED.text(value, ".4f dV") == f"{value:.4f} V"


@given(st.floats(-10, 10), st.integers(0, 4), st.floats(1e-6, 1e6), st.floats(-100, 100), st.sampled_from([1.0, -1.0]))
def test_a_last_digit_means_as_much_in_any_unit(value, digits, size, at_zero, sign):
    """What is printed lies within half a digit, and that digit is worth a third to three times as much as in V."""
    units = RecordedUnits(command=CommandUnit(unit="x", at_zero=at_zero, factor=sign * size))
    shown = units.number(value, f".{digits}f V")
    last = 10.0 ** -len(shown.partition(".")[2])
    right = at_zero + sign * size * value
    assert abs(float(shown) - right) <= 0.5 * last + 1e-9 * abs(right)
    assert last == 1 or 0.31 <= last / size / 10.0**-digits <= 3.2
    step = units.number(value, f".{digits}f dV")
    assert math.copysign(1, float(step)) == math.copysign(1, value) or float(step) == 0


def test_a_difference_counts_from_zero_command_outwards_and_has_no_zero():
    for units in (MA, BOTH, BOTH.of_side("negative"), BACKWARDS):
        assert float(units.number(100.0, "+.1f mV")) == pytest.approx(0.1 * abs(units.command.factor), rel=0.01)
    assert BOTH.of_side("negative").text(3.26, ".3f V") == "9.392 mA"
    assert BOTH.of_side("positive") == BOTH and COUNTS.of_side("negative") == COUNTS
    np.testing.assert_allclose(BOTH.of_side("negative").convert(np.array([0.0, 10.0]), "V"), [12.0, 4.0])


def test_a_plot_and_a_table_agree():
    for units in (MA, BOTH, COUNTS, DUTY, BACKWARDS, SHOP):
        for unit in ("V", "dV", "MPa", "L/min", "L/min/V"):
            drawn = units.convert(3.3, unit)
            assert float(units.number(3.3, f".6f {unit}")) == pytest.approx(drawn, rel=1e-6)


def test_recordings_that_differ_are_shown_in_what_the_file_holds_whatever_their_order():
    bar, psi = PressureUnit(unit="bar", factor=10.0), PressureUnit(unit="psi", factor=145.0)
    gpm = FlowUnit(unit="gpm", factor=0.264)
    found = common_units({"pressure": (bar, psi, bar), "flow": (gpm, gpm)})
    assert found == common_units({"pressure": (psi, bar), "flow": (gpm,)})
    assert (found.pressure.unit, found.flow, found.differ) == ("MPa", gpm, ("pressure",))
    assert "pressure" in found.in_words() and "gpm" in found.in_words()
    assert common_units({}) == AS_COMPUTED and not AS_COMPUTED.in_words()


def test_texts_are_in_the_units_that_are_shown_and_what_stands_in_them_stays():
    def text():
        error = InputError(
            worded("opens at {u:.2f V}, between {low:.1f #MPa} and {high:.1f MPa}", u=5.2, low=1, high=2)
        )
        return worded("{name}: {error}", name="{u:.2f V}", error=error)

    assert text() == "{u:.2f V}: opens at 5.20 V, between 1.0 and 2.0 MPa"
    with shown_in(SHOP):
        with pytest.raises(ZeroDivisionError), shown_in(MA):
            assert text() == "{u:.2f V}: opens at 12.32 mA, between 1.0 and 2.0 MPa"
            raise ZeroDivisionError
        assert text() == "{u:.2f V}: opens at 5.20 V, between 145 and 290 psi"


def test_a_place_that_nobody_fills_or_that_is_no_format_is_an_error_at_once():
    with pytest.raises(KeyError):
        worded("opens at {u:.2f V}")
    with pytest.raises(KeyError):
        worded("opens at {u:.2f volts}", u=1.0)
    with pytest.raises(ValueError, match="no format"):
        MA.text(1.0, ".2e V")


@pytest.mark.parametrize(
    ("unit", "quantity", "plain"),
    [
        *((unit, "flow", "L/min") for unit in ("l/m", "Liter/min", "dm3/min", "dm³/min", "L·min⁻¹", "l/min.")),
        ("in3/s", "flow", "in**3/s"), ("usgpm", "flow", "gpm"), ("mLmin", "flow", "mL/min"),
        *((unit, "pressure", "MPa") for unit in ("Mpa", "MPA", "MPa(g)", "MPag", "MPa_a", "N/mm2", "N/mm²")),
        *((unit, "pressure", "kPa") for unit in ("kpa", "KPA", "Kpa", "kPa(a)")),
        *((unit, "pressure", "bar") for unit in ("bar_g", "bar g", "barg", "BAR", "bar(d)")),
        ("kg/cm2", "pressure", "kgf/cm**2"), ("psi_g", "pressure", "psi"),
        *((unit, "time", "s") for unit in ("Sec", "Sekunden", "sek.", "sec")),
    ],
)  # fmt: skip
def test_a_unit_as_loggers_spell_it(unit, quantity, plain):
    assert si_factor(unit, quantity) == si_factor(plain, quantity)


def test_the_case_of_a_unit_is_not_guessed(wording):
    """Seeded: of mpa both MPa and mPa would do, and of mPa a millipascal is what it says."""
    assert si_factor("mPa", "pressure") == 1e-3
    for unit in ("mpa", "Nl/min", "Nm3/h", "sccm"):
        with wording.refusal(InputError, f"recorded units: {unit}"):
            si_factor(unit, "pressure" if unit == "mpa" else "flow")
