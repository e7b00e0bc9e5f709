"""`--units`: what a person asks for goes before the recordings' own units, and nothing that is no unit is taken."""

import pytest

from dzdesign.core.chosen_units import ChosenUnits, read_units
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import CommandUnit, FlowUnit, PressureUnit, RecordedUnits

PSI = RecordedUnits(pressure=PressureUnit(unit="psi", factor=145.03773773), flow=FlowUnit(unit="gpm", factor=0.264))
MILLIAMPS = RecordedUnits(command=CommandUnit(unit="mA", at_zero=12.0, factor=0.8))


@pytest.mark.parametrize("given", ["bar, %, mA", ["bar", "%", "mA"], ("%", "mA,bar")])
def test_units_are_a_text_or_a_list(given):
    assert read_units(given, "--units") == ChosenUnits(pressure="bar", command="%", current="mA")


def test_what_is_chosen_goes_before_what_was_recorded_and_the_rest_stays():
    units = read_units("bar, %, mA", "--units").over(PSI, 5.0)
    assert units.text(2.5, ".2f MPa") == "25.0 bar" and units.text(1.25, ".3f V") == "25.00 %"
    assert units.text(0.55, "g A") == "550 mA" and units.label("L/min") == "gpm"
    assert units.text(1.0, ".3f mV") == "0.02000 %"
    assert PSI.text(0.55, "g A") == "0.55 A"


def test_a_command_that_was_recorded_in_a_unit_keeps_its_zero_in_it():
    kept = read_units("mA", "--units").over(MILLIAMPS, 10.0)
    assert kept.command == MILLIAMPS.command
    amperes = read_units("A", "--units").over(MILLIAMPS, 10.0)
    assert amperes.text(5.0, ".3f V") == "0.016000 A" and amperes.command.at_zero == pytest.approx(0.012)
    percent = read_units("%, mA", "--units").over(MILLIAMPS, 10.0)
    assert percent.text(-5.0, ".1f V") == "-50 %"
    backwards = RecordedUnits(command=CommandUnit(unit="%", at_zero=100.0, factor=-10.0))
    assert read_units("%", "--units").over(backwards, 10.0).command == backwards.command


def test_a_choice_settles_what_the_recordings_differ_in():
    mixed = RecordedUnits(differ=("pressure", "flow"))
    settled = read_units("bar", "--units").over(mixed, 10.0)
    assert settled.differ == ("flow",) and settled.pressure.unit == "bar"


@pytest.mark.parametrize("given", ["bar, psi", "V, %", "bra", "", "aPa", "bar;%", "s", ["bar", 3], 7])
def test_what_is_no_unit_or_one_too_many_is_refused(given, wording):
    with pytest.raises(InputError) as refused:
        read_units(given, "--units")
    wording(f"units to show: {given}", str(refused.value))
