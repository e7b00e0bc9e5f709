"""What every target folder must be: found by itself, packaged, chosen, safe from users' names; its flash; a new one.

Oracle of the sectors: C2000Ware 26.01.00.00, device_support/f2833x/common/cmd/F28335.cmd and
device_support/f28004x/common/cmd/28004x_generic_flash_lnk.cmd; `make bench-c2000ware` reads a user's own copy of them.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from dataclasses import dataclass, replace
from pathlib import PurePosixPath

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dzdesign.codegen import project
from dzdesign.codegen.banner import LONGEST, printable_list, printable_name
from dzdesign.codegen.calibration.layout import LENGTH_WORDS
from dzdesign.codegen.calibration.packing import Place
from dzdesign.codegen.cortex_m4 import target as cortex_m4
from dzdesign.codegen.other_targets import ALL_TARGET_NAMES, OTHER_TARGETS
from dzdesign.codegen.project import TARGET_NAMES, generate, target_named, targets
from dzdesign.codegen.target import folder_of
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import DzdesignError, InputError
from dzdesign.verify.folder import USER_FOLDER
from dzdesign.verify.toolchain.host_compiler import STRICT, host_compiler
from tests.support.documented_commands import try_page
from tests.support.golden_firmware import GOLDENS, golden_compensator
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

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
        assert PurePosixPath(path).parts[0] in (target.folder, USER_FOLDER) and ".." not in path


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
    designed = tmp_path / "compensator.json"
    designed.write_bytes(to_json_bytes(golden_compensator()))
    command = [sys.executable, "-c", code, str(designed)]
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


@pytest.mark.parametrize("command", [["design", str(VALVE)], ["codegen", "compensator.json"]])
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
    target = target_named(name)
    compensator, one = tmp_path / "compensator.json", tmp_path / "one"
    assert main(["design", str(VALVE), "--target", name, "-o", str(compensator)]) == 0
    signals = json.loads(compensator.read_text())["signals"]
    assert signals["compare_max"] == target.compare_max
    assert signals["code_max"] == signals["command"]["full_code"] == target.converter.code_max
    assert main(["codegen", str(compensator), "--target", name, "-o", str(one)]) == 0
    assert len([path for path in one.rglob("*") if path.is_file()]) > 5
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


@dataclass(frozen=True, kw_only=True)
class Stated:
    """What TI's linker file says of the range, and the flash ranges that it places sections in."""

    file: str
    region: str
    page: int
    origin: int
    length: int
    used: frozenset[str]


STATED = {
    "f28335": Stated(
        file="F28335.cmd", region="FLASHB", page=1, origin=0x330000, length=0x8000,
        used=frozenset({"FLASHA", "FLASHC", "FLASHD", "BEGIN", "CSM_PWL", "CSM_RSVD"}),
    ),
    "f280049c": Stated(
        file="28004x_generic_flash_lnk.cmd", region="FLASH_BANK1_SEC8", page=0, origin=0x098000, length=0x1000,
        used=frozenset({"BEGIN", *(f"FLASH_BANK0_SEC{number}" for number in (1, 2, 3, 4, 5))}),
    ),
}  # fmt: skip


def test_every_sector_is_stated_and_no_other():
    assert {target.name for target in targets() if target.sector} == STATED.keys()
    assert target_named("host").block_place == Place()


@pytest.mark.parametrize("name", STATED)
def test_the_sector_is_that_of_the_linker_file(name):
    stated, target = STATED[name], target_named(name)
    sector = target.sector
    assert (sector.file, sector.region, sector.page) == (stated.file, stated.region, stated.page)
    assert (sector.address, sector.words) == (stated.origin, stated.length)
    assert target.block_place == Place(address=stated.origin, unit_octets=2)
    assert sector.words >= LENGTH_WORDS


@pytest.mark.parametrize("name", STATED)
def test_a_block_alone_is_linked_into_the_sector(name):
    stated = STATED[name]
    assert stated.region not in stated.used, "TI's file places nothing there"
    files = generate(golden_compensator(name), name, calibration="block").files
    fragment = re.sub(r"/\*.*?\*/", "", files[f"{name}/dz_calibration.cmd"], flags=re.DOTALL)
    placed = re.findall(r"(\S+)\s*:\s*>+\s*(\w+),\s*PAGE\s*=\s*(\d)", fragment)
    assert placed == [("dz_calibration", stated.region, str(stated.page))]
    sections = {path: re.findall(r'#pragma \w+_SECTION\((\w+), "(\S+)"\)', text) for path, text in files.items()}
    in_it = [(path, what) for path, found in sections.items() for what, section in found if section == "dz_calibration"]
    assert in_it == [(f"{name}/dz_block.c", "dz_block")]
    assert {section for found in sections.values() for _, section in found} <= {"dz_calibration", ".TI.ramfunc"}


@pytest.mark.parametrize("name", STATED)
def test_the_pages_state_the_same_address(name):
    page = (ROOT / "docs" / "reference" / "calibration.md").read_text(encoding="utf-8")
    (row,) = (line for line in page.splitlines() if line.startswith(f"| {name} |"))
    assert f"word `{STATED[name].origin:#x}`" in row
    assert f"`{STATED[name].region}` of TI's `{STATED[name].file}`" in row


PAGE = ROOT / "docs" / "howto" / "add-target.md"
FOLDER = "codegen/dzdesign/codegen/mychip/"
#: A paragraph that begins with a file's name, then the file.
FILE = re.compile(r"^`([^`\n]+)`[^`]*?\n\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """The room of a clone, with the files of the page, found before the installed one."""
    files = dict(FILE.findall(PAGE.read_text(encoding="utf-8")))
    assert len(files) == 5 and all(name.startswith(FOLDER) for name in files), "one folder, nothing else"
    shutil.copytree(ROOT / "codegen", tmp_path / "codegen", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path / 'codegen'}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    return tmp_path


@pytest.mark.slow
@needs_compiler
@pytest.mark.skipif(shutil.which("bash") is None, reason="the page's commands need bash")
def test_the_page_adds_a_target_that_goes_through_the_whole_chain(clone, request):
    assert try_page(PAGE, clone, request.config.getoption("--update-docs")) == []
    manifest = json.loads((clone / "firmware" / "manifest.json").read_text())
    assert manifest["target"] == "mychip" and manifest["board"] == ["mychip/pins.c"]
    evidence = json.loads((clone / "evidence" / "verification.json").read_text())
    assert evidence["target"] == "mychip" and evidence["holds"] is True
    assert "mychip" in (clone / "evidence" / "report.html").read_text(encoding="utf-8")
    firmware = clone / "firmware"
    sources = [*firmware.glob("core/*.c"), *firmware.glob("mychip/*.c")]
    command = [host_compiler(), *STRICT, "-I", str(firmware / "core"), *map(str, sources), "-o", str(clone / "mychip")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert len(sources) == 4 and done.returncode == 0, done.stderr
