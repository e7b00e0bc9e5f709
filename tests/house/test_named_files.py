"""Files of the clone that a comment, a docstring or a page names are there."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.paths import ROOMS, ROOT

FOLDERS = (*ROOMS, "benchmarks", "docs", "examples", "release", "tests")
#: A path from the clone's root, to a file; C and JSON under such names stand in a firmware's folder.
NAMED = re.compile(
    rf"(?<![\w./<{{*-])(?:{'|'.join(FOLDERS)})/(?:[\w.-]+/)*[\w.-]+\.(?:py|md|toml|jinja|txt|ipynb|svg|gz|csv)\b"
)
#: What has a reader make files of his own.
RECIPES = {ROOT / "docs" / "howto" / f"add-{what}.md" for what in ("file-format", "law", "statement", "target")}


def texts() -> list[Path]:
    """Return the files that are read by people."""
    found = [ROOT / "Makefile", *ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    for folder in (*ROOMS, "benchmarks", "release", "tests"):
        found += [path for kind in ("*.py", "*.jinja", "*.toml") for path in (ROOT / folder).rglob(kind)]
    return sorted({*found} - RECIPES - {Path(__file__)})


def missing(text: str) -> Iterator[str]:
    """Yield line and name of each file that is not there."""
    for match in NAMED.finditer(text):
        if not (ROOT / match[0]).exists():
            yield f"line {text.count(chr(10), 0, match.start()) + 1}: {match[0]}"


def test_every_file_that_is_named_is_there():
    read = {path: path.read_text(encoding="utf-8") for path in texts()}
    assert sum(len(NAMED.findall(text)) for text in read.values()) > 60
    assert [f"{path.relative_to(ROOT)}, {one}" for path, text in read.items() for one in missing(text)] == []


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("errors set (benchmarks/identify/no_premises.py).", ["line 1: benchmarks/identify/no_premises.py"]),
        ("\nsee docs/howto/gone.md, and docs/index.md", ["line 2: docs/howto/gone.md"]),
        ("`tests/goldens/messages.txt` and `demo/core/dz_comp.c`", []),
    ],
)
def test_a_seeded_one_is_found(text, found):
    assert list(missing(text)) == found
