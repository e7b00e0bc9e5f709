"""The files of FMUs: the same bytes twice, tokens, units, static symbols, refusals."""

import json
import subprocess
from dataclasses import asdict, fields, replace
from io import BytesIO
from zipfile import ZipFile

import pytest

from dzdesign.codegen.fmu import files
from dzdesign.codegen.fmu.description import UNITS
from dzdesign.codegen.fmu.files import archive
from dzdesign.codegen.fmu.models import PARAMETERS
from dzdesign.codegen.other_targets import generate_output
from dzdesign.core.errors import InputError
from dzdesign.stages.generate import GenerateArguments, generate
from dzdesign.verify.closed_loop.plant import Plant
from tests.support.golden_firmware import golden_compensator
from tests.support.host_fmus import PLANT, fmus_of, full_compensator, host_platforms, plant_setting


@pytest.fixture
def one_binary(monkeypatch):
    """Make FMUs with this machine's binary alone."""
    monkeypatch.setattr(files, "PLATFORMS", host_platforms())


@pytest.fixture
def no_binary(monkeypatch):
    """Make FMUs without binaries."""
    monkeypatch.setattr(files, "binaries_of", lambda *_: {})


def opened(content):
    with ZipFile(BytesIO(content)) as packed:
        return {name: packed.read(name) for name in packed.namelist()}


def test_the_same_input_gives_the_same_bytes(one_binary):
    first, again = (fmus_of(full_compensator(), None).files for _ in range(2))
    assert dict(first) == dict(again) and len(first) == 3


def test_a_zip_has_no_date_and_one_order():
    content = archive({"b": b"1", "binaries/x.so": b"2", "modelDescription.xml": b"3"})
    with ZipFile(BytesIO(content)) as packed:
        entries = packed.infolist()
    assert [entry.filename for entry in entries] == ["modelDescription.xml", "b", "binaries/x.so"]
    assert {entry.date_time for entry in entries} == {(1980, 1, 1, 0, 0, 0)}
    assert entries[2].external_attr >> 16 & 0o111 and not entries[1].external_attr >> 16 & 0o111


def test_every_fmu_has_a_token_of_its_own_and_of_its_compensator(no_binary):
    def tokens(compensator, plant=PLANT):
        made = fmus_of(compensator, plant).files
        return {
            name: json.loads(opened(content)["extra/dzdesign/manifest.json"])["token"]
            for name, content in made.items()
            if name.endswith(".fmu")
        }

    first = tokens(full_compensator())
    assert len(set(first.values())) == 2
    assert tokens(golden_compensator("host"))["dz_compensator.fmu"] != first["dz_compensator.fmu"]
    moved = tokens(full_compensator(), replace(PLANT, L_c_H=0.05))
    changed = {name for name in first if moved[name] != first[name]}
    assert changed == {"dz_plant.fmu"}


def test_the_core_in_an_fmu_is_that_of_the_firmware(no_binary):
    from dzdesign.codegen.project import generate as generate_project

    compensator = full_compensator()
    core = {path.removeprefix("core/"): text.encode() for path, text in
            generate_project(compensator, "host").files.items() if path.startswith("core/")}  # fmt: skip
    inside = opened(fmus_of(compensator, None).files["dz_compensator.fmu"])
    assert {name: inside[f"sources/{name}"] for name in core} == core


def test_nothing_but_the_functions_of_fmi_leaves_the_one_unit(no_binary, tmp_path):
    from dzdesign.verify.toolchain.host_compiler import host_compiler, words_of

    for name, content in fmus_of(full_compensator()).files.items():
        if not name.endswith(".fmu"):
            continue
        folder = tmp_path / name
        folder.mkdir()
        for path, text in opened(content).items():
            if path.startswith("sources/"):
                (folder / path.removeprefix("sources/")).write_bytes(text)
        strict = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror", "-O2", "-c", "dz_fmu.c")
        subprocess.run([*words_of(host_compiler()), *strict], cwd=folder, check=True)
        symbols = subprocess.run(["nm", "-g", "dz_fmu.o"], cwd=folder, check=True, capture_output=True, text=True)
        shown = [line.split()[-1] for line in symbols.stdout.splitlines() if " U " not in line]
        assert shown and all(symbol.startswith("fmi2") for symbol in shown)


def displayed(model, name):
    """Return unit and display unit of a variable, and factor and offset of that."""
    from xml.etree import ElementTree

    from dzdesign.codegen.fmu.description import model_description

    document = ElementTree.fromstring(model_description(model, "{token}"))
    (typed,) = next(each for each in document.find("ModelVariables") if each.get("name") == name)
    unit, shown = typed.get("unit"), typed.get("displayUnit")
    entries = document.iterfind(f"UnitDefinitions/Unit[@name='{unit}']/DisplayUnit")
    units = {each.get("name"): each for each in entries}
    scaled = (float(units[shown].get("factor")), float(units[shown].get("offset", "0"))) if shown else ()
    return (unit, shown, *scaled)


def test_the_display_unit_of_a_command_is_that_of_its_side_and_of_no_other_voltage():
    """A reading of 12 mA at zero command falls on the negative side, whose outputs count from zero outwards."""
    from dzdesign.codegen.fmu.models import compensator_model, plant_model
    from dzdesign.core.recorded_units import CommandUnit, PressureUnit, RecordedUnits

    def of(command):
        made = full_compensator()
        return replace(made, valve=replace(made.valve, recorded_units=RecordedUnits(command=command)))

    centred = of(CommandUnit(unit="mA", at_zero=12.0, factor=0.8))
    model = compensator_model(centred)
    assert displayed(model, "u_i") == displayed(model, "u_O") == ("V", "mA", 0.8, 12.0)
    assert displayed(model, "u_O_negative") == ("V", None)
    assert displayed(compensator_model(of(CommandUnit(unit="%", factor=10.0))), "u_O_negative") == ("V", "%", 10.0, 0.0)
    in_bar = replace(model, units=RecordedUnits(pressure=PressureUnit(unit="bar", factor=10.0)))
    assert displayed(in_bar, "p_A") == ("MPa", "bar", 10.0, 0.0)
    plant = plant_model(asdict(PLANT), centred)
    for name in ("voltage", "u_max_V", "hysteresis_V"):
        assert displayed(plant, name) == ("V", None)


def test_the_output_of_a_current_controller_is_a_current(no_binary):
    from dzdesign.codegen.fmu.models import compensator_model
    from dzdesign.codegen.project import target_named
    from tests.support.example_coil import SENSORS, with_current

    made = with_current(golden_compensator("f28335"), target_named("f28335"), SENSORS["supply unknown"])
    rated_A = made.current_drive.circuit.rated_A
    assert displayed(compensator_model(made), "u_O") == ("A", None)
    assert displayed(compensator_model(made), "u_i")[0] == "V"
    values = compensator_model(made).values
    assert values["full_output"] == repr(float(rated_A)) != values["u_max"]


def test_the_plants_parameters_are_those_of_its_file():
    assert list(PARAMETERS) == [field.name for field in fields(Plant)]


@pytest.mark.parametrize(
    "setting",
    ("no JSON", "[]", "{}", json.dumps({**asdict(PLANT), "K_b": 1}), json.dumps({**asdict(PLANT), "K_a": "x"})),
)
def test_what_is_no_plant_is_refused(setting, no_binary):
    with pytest.raises(InputError, match="plant"):
        generate_output(full_compensator(), "fmu", {"plant": setting})


def test_a_plant_behind_a_current_controller_is_refused(no_binary, monkeypatch):
    from dzdesign.codegen.fmu.models import plant_of

    class Current:
        current_drive = object()

    with pytest.raises(InputError, match="--plant"):
        plant_of(plant_setting(), Current())
    assert plant_of("", Current()) is None


@pytest.mark.parametrize(
    ("name", "instead", "named"),
    [
        ("find_spec", lambda name: None, "pip install"),
        ("version", lambda name: "0.13.0", r"0\.13\.0 .* expected 0\.17"),
    ],
    ids=["none", "too old"],
)
def test_without_a_ziglang_that_will_do_it_is_said_how_to_install_it(name, instead, named, monkeypatch):
    monkeypatch.setattr(files, name, instead)
    files.made_with.cache_clear()
    try:
        with pytest.raises(InputError, match=named):
            fmus_of(full_compensator(), None)
    finally:
        files.made_with.cache_clear()


@pytest.mark.parametrize(
    ("text", "named"),
    [("int x = ;", "can't compile"), ("double sin(double); double x(double y) { return sin(y); }", "sin")],
    ids=["no C", "a name that nothing defines"],
)
def test_c_that_is_none_or_needs_a_library_is_refused(text, named, monkeypatch):
    monkeypatch.setattr(files, "PLATFORMS", [each for each in files.PLATFORMS if each.folder in ("linux64", "win64")])
    with pytest.raises(InputError, match=named):
        files.binaries_of("dz_wrong", {"dz_fmu.c": text.encode()})


def test_a_plant_is_of_the_target_fmu_alone(example_compensator, example_folder, tmp_path):
    arguments = {"target": "host", "plant": example_folder / "plant.toml", "output": tmp_path / "made"}
    with pytest.raises(InputError, match="--plant is an option of target fmu"):
        generate(GenerateArguments(example_compensator, **arguments))
    with pytest.raises(InputError, match="missing"):
        generate(GenerateArguments(example_compensator, target="fmu", plant=tmp_path / "missing.toml"))
    assert not (tmp_path / "made").exists()


@pytest.mark.slow
def test_binaries_of_every_platform_are_valid_for_fmpy(tmp_path):
    from fmpy.validation import validate_fmu

    made = fmus_of(golden_compensator("host"))
    for name in ("dz_compensator.fmu", "dz_plant.fmu"):
        (tmp_path / name).write_bytes(made.files[name])
        assert validate_fmu(str(tmp_path / name)) == []
        binaries = {path.split("/")[1] for path in opened(made.files[name]) if path.startswith("binaries/")}
        assert binaries == {"linux64", "win64", "darwin64", "aarch64-linux", "aarch64-darwin"}


def test_units_are_those_of_pint():
    from pint import UnitRegistry

    base = {"kilogram": "kg", "meter": "m", "second": "s", "ampere": "A"}
    registry = UnitRegistry()
    for name, (factor, exponents) in UNITS.items():
        text = name.replace("m3", "m**3").replace("^", "**").replace(" ", "*")
        whole = registry(f"1.0 * {text}").to_base_units()
        assert whole.magnitude == pytest.approx(factor, rel=1e-12), name
        assert {base[unit]: power for unit, power in whole.unit_items()} == dict(exponents), name
