"""Pages, help and messages that can be read once: sentences of a length that one reading holds."""

import doctest
import re
import subprocess
import sys

import pytest

from dzdesign.command_line.parser import COMMANDS, CommonArguments, arguments_of_command
from dzdesign.core.options import arguments_of
from dzdesign.identify.data_quality.catalogue import catalogue
from tests.docs import prose
from tests.docs.prose import MEAN, MOST, blocks_of, clauses_of, faults_of, pages
from tests.support.paths import ROOT
from tests.support.wording import read_messages

LONG, SHORT = "One " + " ".join(["two", "three"] * (MOST // 2)), "One two."


def test_the_examples_of_the_counting_hold():
    assert doctest.testmod(prose) == (0, 3)


def test_pages_have_sentences_that_can_be_read_once():
    blocks = {page.relative_to(ROOT).as_posix(): list(blocks_of(page.read_text("utf-8"))) for page in pages()}
    assert {"README.md", "docs/tutorial.md", "docs/concepts/glossary.md"} <= {*blocks}
    assert [page for page, found in blocks.items() if not found] == []
    assert {page: faults for page, found in blocks.items() if (faults := faults_of(found))} == {}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_can_be_read_once(name):
    """Its own line, and each of an argument or option with its default."""
    line = f"{COMMANDS[name].help}."
    arguments = (*arguments_of_command(name), *arguments_of(CommonArguments))
    options = [argument.described(argument.default_text) for argument in arguments]
    assert faults_of([line, *options]) == [] and len(line) < 90
    assert [text for text in (line.capitalize(), *options) if not re.fullmatch(r"[A-Z].*[^.]\.", text)] == []


def test_what_a_warning_means_can_be_read_once():
    said = [" ".join(text.split()) for entry in catalogue().values() for text in (entry.meaning, entry.remedy)]
    assert len(said) > 80 and faults_of(said) == []


def test_a_message_can_be_read_once():
    """Between full stops and semicolons; those that differ in figures alone count once."""
    messages = read_messages().values()
    clauses = {re.sub(r"\d+", "0", clause): clause for text in messages for clause in clauses_of(text)}
    assert len(messages) > 700 and faults_of(clauses.values(), mean=12, most=35) == []


@pytest.mark.parametrize(
    "page",
    [f"{LONG}.", f"- {SHORT}\n- {LONG}.", f"# T\n\nterm\n: {LONG}", f"{SHORT} {SHORT} ({LONG}).\n", "It is is one.",
     f"{'One more ' * (MEAN // 2)}word. " * 9],
)  # fmt: skip
def test_a_seeded_fault_is_found(page):
    assert len(faults_of([*blocks_of(page), *[SHORT] * (0 if page.startswith("One more") else 9)])) == 1


def test_what_is_no_prose_is_not_counted():
    code = f"```text\n{LONG}\n```\n\n    {LONG}\n\n<!-- {LONG} -->\n\n| {LONG} |\n\n## {LONG}\n"
    assert list(blocks_of(f"{SHORT}\n\n{code}\n- {SHORT} Three: four.")) == [SHORT, f"{SHORT} Three: four."]
    assert faults_of([f"Take `{LONG}. And` or `a` `a` [it]({'x' * 99}).", LONG.partition(" ")[2]]) == []


def test_a_word_that_is_spelled_wrong_is_found(tmp_path):
    command = [sys.executable, "-m", "codespell_lib", "--toml", str(ROOT / "pyproject.toml")]
    page = tmp_path / "page.md"
    for text, status in (("The valve opens.", 0), ("The vavle opens.", 65)):
        page.write_text(text)
        assert subprocess.run([*command, str(page)], capture_output=True, check=False).returncode == status
