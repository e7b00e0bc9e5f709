"""Names from users act nowhere: not in the C, the plots, the pages, the terminal, or the file system."""

import difflib
import json
import os
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from dzdesign.codegen import banner
from dzdesign.codegen.project import generate
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import MANIFEST_NAME, check_inside, write_files, write_folder
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile
from dzdesign.core.documents import sha256_of, to_json
from dzdesign.core.errors import InputError, one_line
from dzdesign.design.firmware_manifest import FirmwareManifest, FirmwareOrigin
from dzdesign.identify.valve.model import Warning_
from dzdesign.verify.folder import read_firmware_manifest
from tests.support.golden_firmware import FULL, golden_compensator

NAMES = [
    "*/ int evil; /*",
    "/* // */ #error x",
    "a // b \\",
    "??/\nint evil;",
    "x\\\nint evil;",
    "a\nint evil;\r\n#include </etc/passwd>",
    "\x1b[2J\x1b]0;title\x07\x9b31m",
    "../../../../etc/passwd",
    "/etc/passwd",
    "C:\\Windows\\system32",
    "CON",
    "a:b",
    "x" * 5000,
    "\u202ecod.exe\u2066",
    "<script>alert(1)</script>",
    "--><script>alert(1)</script><!--",
    "]]>&xxe;<!ENTITY",
    "{{ 7 * 7 }}{% raw %}{# x #}",
    "%s%n{0.__class__}",
    "$(rm -rf x)`id`${HOME}",
    "$x_{\\frac",
    "[/bold][link=file:///etc/passwd]x[/] :bomb:",
    "\ud800",
    "",
    " ",
]
HARMLESS = "harmless"
COMPILER = next((path for name in ("gcc", "clang", "cc") if (path := shutil.which(name))), None)


def with_names(names: list[str]):
    """Return the compensator with everything switched on, of a valve from recordings of these names."""
    names = [name for name in names if "\ud800" not in name]  # no JSON brings half a character
    compensator = golden_compensator("f28335", FULL)
    sides = {
        name: replace(side, tests=tuple(replace(test, source=names[0]) for test in side.tests))
        for name, side in compensator.valve.sides.items()
    }
    warnings = tuple(Warning_(code=name, text=name, source=name) for name in names)
    valve = replace(compensator.valve, made_from=recordings(names), sides=sides, warnings=warnings)
    return replace(compensator, valve=valve, costs=tuple(names))


def recordings(names: list[str]) -> tuple[SourceFile, ...]:
    """Return recordings of these names, as valve.json lists them."""
    return tuple(SourceFile(source=name, sha256="0" * 64) for name in names)


# C, and what builds it


def code_of(text: str) -> str:
    """Return C without its comments, as a compiler with trigraphs sees it."""
    for third, sign in zip("=/'()!<>-", "#\\^[]|{}~", strict=True):
        text = text.replace("??" + third, sign)
    text = re.sub(r"\\[ \t]*\n", "", text)
    return re.sub(r'/\*.*?\*/|//[^\n]*|("(?:\\.|[^"\\\n])*")', lambda match: match[1] or " ", text, flags=re.DOTALL)


def test_the_code_without_comments_shows_what_left_one():
    """The checker itself."""
    assert code_of("/* a */ int b; // c\n") != code_of("/* a */ int b; /* */ int evil; // c\n")
    assert "evil" in code_of("/* a *??/\n/ int evil;") and "evil" in code_of("// a\nint evil;")
    assert "evil" not in code_of("// a ??/\nint evil;")


@pytest.fixture(scope="module", params=["f28335", "host"])
def both(request):
    """The files of a target, of harmless names and of hostile ones; a banner shows four, one target gets them all."""
    harmless = generate(with_names([HARMLESS]), request.param).files
    groups = [NAMES[start : start + 4] for start in range(0, len(NAMES) if request.param == "f28335" else 4, 4)]
    return harmless, [generate(with_names(group), request.param).files for group in groups]


def test_hostile_names_leave_no_comment(both):
    harmless, hostile = both
    for files in hostile:
        assert files.keys() == harmless.keys()
        for name, text in files.items():
            if name == "compensator.json":
                continue
            changed = [
                line[2:] for line in difflib.ndiff(harmless[name].splitlines(), text.splitlines()) if line[0] == "+"
            ]
            for line in changed:  # hashes, and the names in a banner
                assert re.fullmatch(r"[-\w#*/;<>!=.,:|` ()\"']*", line, re.ASCII), (name, line)
                assert re.search(r"[0-9a-f]{64}|Valve identified from|0x[0-9A-F]{4}|hash|SHA", line), (name, line)
            if name.endswith(".projectspec"):
                ElementTree.fromstring(text)
            if name.endswith((".c", ".h")):
                origin = re.compile(r"0x[0-9A-F]{4}u?")
                assert origin.sub("", code_of(text)) == origin.sub("", code_of(harmless[name])), name


def test_a_name_that_gets_through_is_seen(both, monkeypatch):
    monkeypatch.setattr(banner, "printable_list", ", ".join)
    for name in NAMES[4:6]:
        changed = generate(with_names([name]), "host").files
        with pytest.raises(AssertionError):
            test_hostile_names_leave_no_comment((both[0], [changed]))


@pytest.mark.skipif(COMPILER is None, reason="no C compiler (cc, gcc, clang) on the path")
def test_hostile_names_compile_without_a_warning(both, tmp_path):
    _, hostile = both
    for number, files in enumerate(hostile):
        core = {name: text for name, text in files.items() if name.startswith("core/")}
        for name, text in core.items():
            place = tmp_path / str(number) / name
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(text)
        sources = [str(tmp_path / str(number) / name) for name in core if name.endswith(".c")]
        strict = ["-std=c99", "-Wall", "-Wextra", "-Wcomment", "-Wtrigraphs", "-trigraphs", "-Werror", "-fsyntax-only"]
        done = subprocess.run([COMPILER, *strict, *sources], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


# plots and pages


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES, ids=range(len(NAMES)))
def test_a_name_in_a_plot(name):
    from dzdesign.identify.plots.style import finish, new_figure, plot_style, saved

    with plot_style():
        figure = new_figure(2.0, f"1 MPa: {one_line(name)}", name)
        figure.subplots().plot([0, 1], label="line")
        picture = saved(finish(figure, 1), "svg")
    root = ElementTree.fromstring(picture)  # it is XML, whatever the name
    tags = {element.tag.rpartition("}")[2] for element in root.iter()}
    assert "script" not in tags and "path" in tags
    assert not any(key.startswith("on") for element in root.iter() for key in element.attrib)


# the terminal


def test_names_in_tables_steer_no_terminal_and_are_no_markup(example_valve, capsys):
    from dzdesign.terminal.page import Table, new_console
    from dzdesign.terminal.tables import print_valve

    side = example_valve.sides["positive"]
    tests = tuple(replace(test, source=name) for test, name in zip(side.tests, reversed(NAMES), strict=False))
    tests += side.tests[len(tests) :]
    for name in NAMES:
        warning = replace(example_valve.warnings[0], text=name, source=name) if example_valve.warnings else None
        warnings = (warning,) if warning else ()
        print_valve(replace(example_valve, sides={"positive": replace(side, tests=tests)}, warnings=warnings))
        table = Table(name, name)
        table.add_row(name)
        new_console().print(table)
    out = capsys.readouterr().out
    assert all(character.isprintable() or character == "\n" for character in out)
    assert "[/bold][link=file:///etc/passwd]" in re.sub(r"\s", "", out) and ":bomb:" in out


@pytest.mark.parametrize("name", [name for name in NAMES if name.strip() and "\ud800" not in name and len(name) < 250])
def test_a_name_in_an_error(tmp_path, monkeypatch, capsys, name):
    monkeypatch.chdir(tmp_path)
    for words in (["identify", name], ["design", name], ["verify", name], ["codegen", name, "--target", name],
                  ["derive", "--equation", name]):  # fmt: skip
        assert main(words) == 2
        line = capsys.readouterr().err
        assert line.count("\n") == 1 and line.rstrip("\n").isprintable()
    assert list(tmp_path.iterdir()) == []


# the file system

OUTSIDE = [
    "../secret", "core/../../secret", "/etc/passwd", "..", ".", "", "C:/x", "C:\\x", "\\\\host\\x", "..\\secret",
    "core/..\\..\\secret", "a\0b",
]  # fmt: skip


@pytest.fixture
def place(tmp_path):
    """A folder of dzdesign's beside a file of somebody's."""
    (tmp_path / "secret").write_text("years of work")
    digest = "0" * 64
    manifest = FirmwareManifest(
        tool=THIS_TOOL,
        made_from=(),
        target="host",
        law="paper",
        calibration="fixed",
        core=("core/a.c",),
        board=(),
        origin=FirmwareOrigin(compensator_json=digest, valve_json=digest, ramp_tests=()),
        vectors=0,
        files={},
    )
    write_folder(tmp_path / "firmware", {"core/a.c": "int a;\n"}, manifest)
    return tmp_path


def manifest_with(folder: Path, change) -> None:
    manifest = json.loads((folder / MANIFEST_NAME).read_text())
    change(manifest)
    (folder / MANIFEST_NAME).write_text(json.dumps(manifest))


@pytest.mark.parametrize("name", OUTSIDE)
@pytest.mark.parametrize("key", ["files", "core"])
def test_a_manifest_that_names_what_lies_outside(place, name, key, wording):
    folder = place / "firmware"
    digest = sha256_of(b"years of work")
    manifest_with(folder, lambda it: it["files"].update({name: digest}) if key == "files" else it["core"].append(name))
    with pytest.raises(InputError, match=r"which is not a file inside the folder|expected str of length >= 1"):
        read_firmware_manifest(folder)
    if key == "files":
        with wording.refusal(InputError, "hostile names: a folder whose manifest is none"):
            write_folder(folder, {"core/a.c": "int b;\n"}, {"schema": "dzdesign.firmware/1"})
    assert (place / "secret").read_text() == "years of work" and (folder / "core/a.c").read_text() == "int a;\n"


@pytest.mark.skipif(os.name == "nt", reason="links need a privilege on Windows")
@pytest.mark.parametrize("kind", ["link", "folder", "loop", "pipe", "header"])
def test_a_firmware_that_leads_elsewhere_is_not_compiled(place, kind, wording):
    core = place / "firmware" / "core"
    if kind == "folder":
        (place / "other").mkdir()
        shutil.move(core / "a.c", place / "other" / "a.c")
        core.rmdir()
        core.symlink_to(place / "other")
    elif kind == "header":  # not in the manifest, but in reach of an #include
        (core / "b.h").symlink_to(place / "secret")
    else:
        (core / "a.c").unlink()
        if kind == "pipe":
            os.mkfifo(core / "a.c")
        else:
            (core / "a.c").symlink_to(place / "secret" if kind == "link" else core / "a.c")
    with wording.refusal(InputError):
        read_firmware_manifest(place / "firmware")


@pytest.mark.skipif(os.name == "nt", reason="links need a privilege on Windows")
@pytest.mark.parametrize("target", ["core/a.c", "core", "nowhere"])
def test_a_firmware_has_no_link_even_to_a_place_inside(place, wording, target):
    """Seeded: no check follows a link to a folder, a build does."""
    folder = place / "firmware"
    (folder / "more").symlink_to(folder / target)
    check_inside(folder, ["more", "core/missing.c"] if target == "core/a.c" else [], "a test")  # no place outside
    with pytest.raises(InputError) as refused:
        read_firmware_manifest(folder)
    wording("hostile names: a link in a firmware", str(refused.value).replace(str(place), "FOLDER"))


@pytest.mark.skipif(os.name == "nt", reason="links need a privilege on Windows")
def test_nothing_is_written_or_deleted_through_a_link(place, wording):
    folder, secret = place / "firmware", place / "secret"
    (place / "plots").mkdir()
    (place / "plots" / "a.svg").symlink_to(secret)
    write_files(place / "plots", {"a.svg": b"new"}, "--plots")
    assert (place / "plots" / "a.svg").read_text() == "new" and secret.read_text() == "years of work"
    (place / "elsewhere").mkdir()
    (place / "elsewhere" / "notes.txt").write_text("mine")
    (folder / "notes").symlink_to(place / "elsewhere")
    write_folder(folder, {"core/a.c": "int b;\n"}, {"schema": "dzdesign.firmware/1"})
    assert (folder / "notes").is_symlink() and (place / "elsewhere" / "notes.txt").read_text() == "mine"
    with wording.refusal(InputError):
        write_folder(folder, {"core/a.c": "int b;\n", "notes/x": "x"}, {"schema": "dzdesign.firmware/1"})
    assert sorted(path.name for path in (place / "elsewhere").iterdir()) == ["notes.txt"]


def test_hostile_names_in_json_are_data(tmp_path):
    document = {"schema": "dzdesign.valve/1", "names": [name for name in NAMES if "\ud800" not in name]}
    assert json.loads(to_json(document)) == document and "\x1b" not in to_json(document)
