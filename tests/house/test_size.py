"""The house stays one that two people can hold: lines, files and options may fall, and rise only in place of something.

Docstrings and blank lines count. A change that makes a number larger says in its commit what it replaces.
"""

from pathlib import Path

import pytest

from tests.support.paths import ROOT

#: Of a room: lines of Python, files of Python, lines of templates, C programs, headers and tables.
ROOM_SIZES = {
    "core": (2510, 15, 0),
    "derivation": (4704, 28, 326),
    "identify": (15684, 90, 986),
    "assess": (1577, 8, 0),
    "design": (7247, 31, 0),
    "codegen": (7980, 50, 7929),
    "verify": (12261, 64, 4630),
    "report": (4403, 20, 517),
    "dzdesign": (9303, 62, 181),
}
#: Lines of Python of what is not shipped, and of the files that the tests compare with.
TEST_LINES, GOLDEN_LINES, BENCHMARK_LINES = 46345, 14591, 8554
#: Options of all commands together; an option of two commands counts twice.
OPTIONS = 172
#: What a number may be above what is there, before it is to be lowered.
SLACK = 0.02
TEXTS = {".jinja", ".c", ".h", ".m", ".ld", ".toml", ".html", ".css", ".js", ".svg", ".md", ".txt"}


def lines(paths: list[Path]) -> int:
    """Return the lines of files."""
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in paths)


def room_size(folder: Path) -> tuple[int, int, int]:
    """Return lines and files of Python, and lines of other text, below a folder."""
    files = [path for path in sorted(folder.rglob("*")) if path.is_file() and "__pycache__" not in path.parts]
    python = [path for path in files if path.suffix == ".py"]
    return lines(python), len(python), lines([path for path in files if path.suffix in TEXTS])


def judged(measured: int, most: int) -> str:
    """Return what is to be done about a number, nothing if it stands."""
    if measured > most:
        return f"{measured}, at most {most}: take something out, or say in the commit what the addition replaces"
    if most > measured * (1 + SLACK) + 5:
        return f"{measured}, far below {most}: lower the number here"
    return ""


@pytest.mark.parametrize("room", ROOM_SIZES)
def test_a_room_does_not_grow(room):
    verdicts = map(judged, room_size(ROOT / room / "dzdesign"), ROOM_SIZES[room])
    assert [verdict for verdict in verdicts if verdict] == []


def test_what_is_not_shipped_does_not_grow():
    roots = (ROOT / "tests" / "goldens", ROOT / "tests" / "goldens_full")
    goldens = [path for root in roots for path in root.rglob("*") if path.is_file()]
    sizes = {
        "tests": (lines(sorted((ROOT / "tests").rglob("*.py"))), TEST_LINES),
        "goldens": (lines(goldens), GOLDEN_LINES),
        "benchmarks": (lines(sorted((ROOT / "benchmarks").rglob("*.py"))), BENCHMARK_LINES),
    }
    assert {name: judged(*size) for name, size in sizes.items() if judged(*size)} == {}


def test_options_do_not_multiply():
    from dzdesign.command_line.parser import COMMANDS, arguments_of_command

    assert judged(sum(len(arguments_of_command(name)) for name in COMMANDS), OPTIONS) == ""


@pytest.mark.parametrize(("measured", "most"), [(101, 100), (100, 120)])
def test_a_number_that_does_not_stand_is_seen(measured, most):
    assert judged(measured, most) and not judged(100, 100)
