"""The words that the outputs use: a glossary that is short, and one table of the words of a verdict."""

import itertools
import re

from tests.support.paths import ROOMS, ROOT

GLOSSARY = (ROOT / "docs/concepts/glossary.md").read_text("utf-8")
FIRMWARE = (ROOT / "docs/reference/firmware.md").read_text("utf-8")


def test_the_glossary_is_short_and_has_no_word_twice():
    terms = [
        re.sub(r"\[(.*)\]\(.*\)", r"\1", line)
        for line, after in itertools.pairwise(GLOSSARY.splitlines())
        if after.startswith(": ")
    ]
    assert len(terms) <= 40, "a glossary that is read has few entries"
    assert re.findall(r"^## (.*)", GLOSSARY, re.MULTILINE) == ["Valve", "Law", "Firmware", "Files and verdicts"]
    words = [word for term in terms for word in term.split(", ")]
    assert len(words) == len(set(words)), "a word stands there twice"


def test_every_word_of_a_verdict_is_in_one_table():
    """Each as the outputs print it; a word that none prints any more is not kept."""
    table = FIRMWARE.partition("\n## Words of a verdict\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| ([^|]+) \| ([^|]+\.) \|$", table, re.MULTILINE)
    words = [word for row, _ in rows for word in row.split(", ")]
    assert words == [
        "HOLDS", "DOES NOT HOLD", "NOT CHECKED", "NOT RUN (optional)", "NOT REQUIRED", "NOT VERIFIED", "CHANGED",
        "SIMULATED", "ACCEPTED", "OVER-COMPENSATED",
        "not required: the firmware cannot detect it", "agrees", "MISSED",
    ]  # fmt: skip
    sources = [path for room in ROOMS for path in (ROOT / room).rglob("*") if path.suffix in {".py", ".jinja"}]
    printed = " ".join(" ".join(path.read_text("utf-8") for path in sources).split())
    assert [word for word in words if word.rpartition(": ")[2] not in printed] == []
