"""What every target folder must be: found by itself, packaged, chosen on the command line, safe from users' names."""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import PurePosixPath

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dzdesign.codegen import project
from dzdesign.codegen.banner import LONGEST, printable_list, printable_name
from dzdesign.codegen.cortex_m4 import target as cortex_m4
from dzdesign.codegen.other_targets import ALL_TARGET_NAMES, OTHER_TARGETS
from dzdesign.codegen.project import TARGET_NAMES, generate, target_named
from dzdesign.codegen.target import folder_of
from dzdesign.command_line.cli import main
from dzdesign.core.errors import DzdesignError, InputError
from tests.support.golden_firmware import GOLDENS, golden_compensator
from tests.support.paths import ROOT

VALVE = GOLDENS / "valve.json"
CODEGEN = ROOT / "codegen" / "dzdesign" / "codegen"


# --- found and packaged -------------------------------------------------------------------------------------


def test_targets_are_the_folders_with_a_target_py(tmp_path, monkeypatch):
    folders = sorted(path.parent.name for path in CODEGEN.glob("*/target.py"))
    assert [folder_of(name) for name in TARGET_NAMES] == folders and {"cortex-m4", "host"} <= set(TARGET_NAMES)
    for name, has_target in (("zeta", True), ("new_one", True), ("templates", False)):
        (tmp_path / name).mkdir()
        if has_target:
            (tmp_path / name / "target.py").touch()
    monkeypatch.setattr(project, "files_of", lambda _: tmp_path)
    assert project._found_targets() == ("new-one", "zeta")


@pytest.mark.parametrize("name", TARGET_NAMES)
def test_a_target_says_its_own_name_and_uses_every_template(name):
    target = target_named(name)
    assert target.name == name and target.description and "\n" not in target.description
    folder = CODEGEN / target.folder / "templates"
    own = {path.name for path in folder.iterdir()}
    places = [CODEGEN / place for place in ("templates", "core/templates")]
    shared = {path.relative_to(place).as_posix() for place in places for path in place.rglob("*.jinja")}
    used = {**target.templates, **target.block_templates}
    assert own <= set(used.values()) <= own | shared
    for path in used:
        assert PurePosixPath(path).parts[0] == target.folder and ".." not in path


@pytest.mark.slow
def test_the_wheel_generates_for_every_target(tmp_path):
    source = tmp_path / "source"
    left_out = shutil.ignore_patterns(".*", "*.egg-info", "build", "__pycache__", "tests", "benchmarks")
    shutil.copytree(ROOT, source, ignore=left_out)
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    command += ["--disable-pip-version-check", "-w", str(tmp_path / "wheel"), str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    with zipfile.ZipFile(next((tmp_path / "wheel").glob("*.whl"))) as wheel:
        wheel.extractall(tmp_path / "installed")
    code = (
        "import sys, json, dzdesign; from dzdesign.codegen.project import generate, targets;"
        "from dzdesign.core.artefact_reading import read_artefact;"
        "from dzdesign.design.compensator import Compensator;"
        "from dataclasses import replace;"
        "c = read_artefact(open(sys.argv[1], 'rb').read(), Compensator, 'c');"
        "fit = lambda m: replace(c, signals=replace(c.signals, compare_max=m),"
        " drive_functions=replace(c.drive_functions, compare_limit=m));"
        "print(json.dumps([dzdesign.__path__[0]] + [sorted(generate(fit(t.compare_max), t.name).files)"
        " for t in targets()]))"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "installed")}
    command = [sys.executable, "-c", code, str(GOLDENS / "compensator.json")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stderr
    where, *listings = json.loads(done.stdout)
    assert where.startswith(str(tmp_path / "installed"))
    expected = [sorted(generate(golden_compensator(name), name).files) for name in TARGET_NAMES]
    assert listings == expected


# --- on the command line ------------------------------------------------------------------------------------


def test_list_targets_is_a_line_each(capsys):
    assert main(["codegen", "--list-targets"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(ALL_TARGET_NAMES)
    assert all(target_named(name).description in line for name, line in zip(TARGET_NAMES, lines, strict=False))
    assert all(OTHER_TARGETS[line.split()[0]].description in line for line in lines[len(TARGET_NAMES) :])
    assert main(["codegen", "--list-targets", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["targets"]
    assert [entry["name"] for entry in listed] == list(ALL_TARGET_NAMES)


@pytest.mark.parametrize("command", [["design", str(VALVE)], ["codegen", str(VALVE)]])
def test_a_wrong_target_names_the_nearest_and_writes_nothing(command, tmp_path, capsys, wording):
    assert main([*command, "--target", "cortex-m3", "-o", str(tmp_path / "out")]) == 2
    wording.of_test(capsys.readouterr().err)
    assert list(tmp_path.iterdir()) == []


def test_codegen_without_a_source_says_so(capsys, wording):
    assert main(["codegen"]) == 2
    wording.of_test(capsys.readouterr().err)


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGET_NAMES)
def test_design_and_codegen_fit_the_target(name, tmp_path, capsys):
    """From a valve codegen designs by itself, and that is what design and codegen do one after the other."""
    target = target_named(name)
    compensator, one, two = (tmp_path / part for part in ("compensator.json", "one", "two"))
    assert main(["design", str(VALVE), "--target", name, "-o", str(compensator)]) == 0
    signals = json.loads(compensator.read_text())["signals"]
    assert signals["compare_max"] == target.compare_max
    assert signals["code_max"] == signals["command"]["full_code"] == target.converter.code_max
    assert main(["codegen", str(compensator), "--target", name, "-o", str(one)]) == 0
    assert main(["codegen", str(VALVE), "--target", name, "-o", str(two)]) == 0
    files = {path.relative_to(one): path.read_bytes() for path in one.rglob("*") if path.is_file()}
    assert len(files) > 5
    assert files == {path.relative_to(two): path.read_bytes() for path in two.rglob("*") if path.is_file()}
    assert json.loads((one / "manifest.json").read_text())["target"] == name


def test_a_compensator_of_another_target_is_refused_with_the_way_out(wording):
    with wording.refusal(InputError):
        generate(golden_compensator("f28335"), "f280049c")
    for name in ("host", "cortex-m4"):  # these have no converter and timer of their own
        assert "DZ_COMPARE_MAX 40000u" in generate(golden_compensator("f280049c"), name).files["core/dz_calibration.h"]


@pytest.mark.parametrize("name", ["cortex_m4", "Cortex-M4", "-m4"])
def test_a_target_with_a_wrong_name_is_refused(name):
    with pytest.raises(DzdesignError):
        replace(target_named("cortex-m4"), name=name)


@pytest.mark.parametrize(
    ("module", "name", "value", "derived"),
    [
        (cortex_m4, "CLOCK_HZ", 25_000_001, "systick_counts"),
        (cortex_m4, "CLOCK_HZ", 2_500 * (2**24 + 1), "systick_counts"),
    ],
)
def test_a_clock_that_does_not_divide_is_refused(monkeypatch, module, name, value, derived, wording):
    monkeypatch.setattr(module, name, value)
    with wording.refusal(DzdesignError):
        getattr(module, derived)()


@pytest.mark.parametrize("name", ["signals", "banner"])
def test_a_context_that_takes_a_name_of_the_renderer_is_refused(name, monkeypatch):
    target = replace(target_named("host"), context={name: "none"})
    monkeypatch.setattr(project, "target_named", lambda _: target)
    with pytest.raises(DzdesignError, match=rf"{name}.* belong to the renderer"):
        generate(golden_compensator("host"), "host")


# --- names from users ---------------------------------------------------------------------------------------


@given(st.text())
def test_a_printable_name_acts_nowhere(name):
    safe = printable_name(name)
    assert re.fullmatch(r"[A-Za-z0-9._-]*", safe) and "--" not in safe and ".." not in safe and len(safe) <= LONGEST
    assert printable_name(safe) == safe


def test_an_honest_name_stays_and_many_are_counted():
    assert printable_name("ramp_1.0-MPa.csv") == "ramp_1.0-MPa.csv"
    assert printable_list(["a", "b", "c", "d", "e", "f"]) == "a, b, c, d and 2 more"
