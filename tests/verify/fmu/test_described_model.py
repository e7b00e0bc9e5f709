"""modelDescription.xml says what an FMU was made from; whatever is changed in it is found."""

from dataclasses import asdict, replace

import pytest

from dzdesign.codegen.fmu.archive import archive
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import CommandUnit, FlowUnit, PressureUnit, RecordedUnits
from dzdesign.verify.fmu.described_model import compensator_faults, plant_faults
from dzdesign.verify.fmu.fmu_file import read_fmu
from tests.support.host_fmus import PLANT, fmus_of

RECORDED = RecordedUnits(
    command=CommandUnit(unit="mA", at_zero=12.0, factor=0.8), pressure=PressureUnit(unit="bar", factor=10.0),
    flow=FlowUnit(unit="L/h", factor=60.0),
)  # fmt: skip


def changed(fmu, place, *pairs):
    """Return an FMU whose description has other texts, each of which must be there."""
    text = fmu.files["modelDescription.xml"].decode()
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = place / fmu.name
    path.write_bytes(archive({**fmu.files, "modelDescription.xml": text.encode()}))
    return read_fmu(path)


def test_the_description_says_what_it_was_made_from(fmu, plant_fmu, compensator):
    assert not list(compensator_faults(fmu, compensator))
    assert not list(plant_faults(plant_fmu, asdict(PLANT), compensator))


def test_units_of_recordings_are_display_units(monkeypatch, compensator, tmp_path):
    monkeypatch.setattr("dzdesign.codegen.fmu.files.binaries_of", lambda *_: {})
    made = replace(compensator, valve=replace(compensator.valve, recorded_units=RECORDED))
    files = fmus_of(made).files
    for name in ("dz_compensator", "dz_plant"):
        (tmp_path / f"{name}.fmu").write_bytes(files[f"{name}.fmu"])
    fmu, plant = (read_fmu(tmp_path / f"{name}.fmu") for name in ("dz_compensator", "dz_plant"))
    assert not list(compensator_faults(fmu, made)) and not list(plant_faults(plant, asdict(PLANT), made))
    assert list(compensator_faults(fmu, compensator)) and list(plant_faults(plant, asdict(PLANT), compensator))


@pytest.mark.parametrize(
    ("old", "new"),
    (
        ('name="p_A" valueReference="2"', 'name="p_A" valueReference="3"'),
        ('name="u_O"', 'name="u_0"'),
        ('unit="V"', 'unit="MPa"'),
        ('unit="V" start="0.0"', 'unit="V" start="1.0"'),
        ('factor="1000000.0"', 'factor="100000.0"'),
        ('factor="1000000.0"', 'factor="1000000.0" offset="1.0"'),
        ('kg="1" m="2" s="-3" A="-1"', 'kg="1" m="2" s="-2" A="-1"'),
        ('<BaseUnit kg="1" m="2" s="-3" A="-1"/>', '<BaseUnit kg="1" m="2" s="-3" A="-1"/><DisplayUnit name="mV"/>'),
        ('variability="continuous"', 'variability="discrete"'),
        ('max="65535"', 'max="4095"'),
        ('start="false"', 'start="true"'),
        ('stepSize="0.0004"', 'stepSize="0.004"'),
        ('startTime="0"', 'startTime="0" tolerance="1"'),
        ('canHandleVariableCommunicationStepSize="true"', 'canHandleVariableCommunicationStepSize="false"'),
        ("<LogCategories>", "<VendorAnnotations/><LogCategories>"),
        (' dependencies="1 2 3 4 5 6"', ' dependencies="1 2"'),
        (' dependencies="1 2 3 4 5 6"', ""),
        ('variableNamingConvention="structured"', 'variableNamingConvention="flat"'),
        ('modelIdentifier="dz_compensator"', 'modelIdentifier="dz_compensator2"'),
    ),
)  # fmt: skip
def test_a_wrong_description_is_found(fmu, compensator, tmp_path, old, new):
    assert list(compensator_faults(changed(fmu, tmp_path, (old, new)), compensator))


@pytest.mark.parametrize(
    ("old", "new"),
    (
        ('start="0.04"', 'start="0.05"'),
        ('name="supply"', 'name="back"'),
        ('nominal="0.001"', 'nominal="0.01"'),
        ('factor="3600000000000000.0"', 'factor="3600.0"'),
        ('initial="exact"', 'initial="approx"'),
        ('factor="1000.0"', 'factor="100.0"'),
        ('unit="V" start="10.0"', 'unit="V" displayUnit="mA" start="10.0"'),
    ),
)
def test_a_wrong_description_of_the_plant_is_found(plant_fmu, compensator, tmp_path, old, new):
    assert list(plant_faults(changed(plant_fmu, tmp_path, (old, new)), asdict(PLANT), compensator))


def test_swapped_states_and_fewer_indicators_are_found(plant_fmu, compensator, tmp_path):
    indicators = ('numberOfEventIndicators="3"', 'numberOfEventIndicators="2"')
    for pair in (('derivative="24"', 'derivative="25"'), indicators):
        assert list(plant_faults(changed(plant_fmu, tmp_path, pair), asdict(PLANT), compensator))


def test_two_variables_of_a_name_are_refused(fmu, tmp_path):
    with pytest.raises(InputError, match="two variables"):
        changed(fmu, tmp_path, ('name="p_B"', 'name="p_A"'))
