"""Pages and help that can be read once: sentences of a length that one reading holds, each help text a sentence."""

import doctest
import re

import pytest

from dzdesign.command_line.command_table import COMMANDS
from dzdesign.command_line.parser import CommonArguments, arguments_of_command
from dzdesign.core.options import arguments_of
from dzdesign.identify.data_quality.catalogue import catalogue
from tests.docs import sentences
from tests.docs.prose_lint import pages
from tests.docs.sentences import MEAN, MOST, blocks_of, clauses_of, faults_of, sentences_of, too_long
from tests.support.paths import ROOT
from tests.support.wording import read_messages

#: Words of a message between full stops and semicolons, on average over all messages and at most.
MESSAGE_MEAN, MESSAGE_MOST = 12, 35
LONG, SHORT = "One " + "two " * MOST, "One two."


def test_the_examples_of_the_counting_hold():
    assert doctest.testmod(sentences) == (0, 3)


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.relative_to(ROOT).as_posix())
def test_a_page_has_sentences_that_can_be_read_once(page):
    assert faults_of(blocks_of(page.read_text("utf-8"))) == []


def test_the_pages_have_prose():
    blocks = {page.relative_to(ROOT).as_posix(): list(blocks_of(page.read_text("utf-8"))) for page in pages()}
    assert {"README.md", "docs/index.md", "docs/tutorial.md", "docs/concepts/glossary.md"} <= set(blocks)
    assert [page for page, found in blocks.items() if not found] == ["docs/reference/index.md"], "a list of pages alone"


def helps_of(name):
    """Return the texts of a command's help: its own line, and each of an argument or option with its default."""
    arguments = (*arguments_of_command(name), *arguments_of(CommonArguments))
    return [f"{COMMANDS[name].help}.", *(argument.described(argument.default_text) for argument in arguments)]


def unfinished(text):
    """Return whether a text is no sentence: without a capital or a full stop."""
    return not re.fullmatch(r"[A-Z].*[^.]\.", text)


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_can_be_read_once(name):
    line, *options = helps_of(name)
    assert faults_of([line, *options]) == [] and [text for text in options if unfinished(text)] == []
    assert not unfinished(f"{line[0].upper()}{line[1:]}") and len(line) < 90, "a line of `dzdesign --help`"


def test_a_help_text_that_is_no_sentence_is_found():
    texts = ("Full command (default: 10 V).", "full command.", "Full command", "Full command..", "File; see `a.json`.")
    assert [text for text in texts if unfinished(text)] == list(texts[1:4])


def test_what_a_warning_means_can_be_read_once():
    said = [" ".join(text.split()) for entry in catalogue().values() for text in (entry.meaning, entry.remedy)]
    assert len(said) > 80 and faults_of(said) == []


def faults_of_messages(messages):
    """Return what makes messages hard to read; those that differ in figures alone count once."""
    clauses = {re.sub(r"\d+", "0", clause): clause for text in messages for clause in clauses_of(text)}
    return too_long(list(clauses.values()), mean=MESSAGE_MEAN, most=MESSAGE_MOST)


def test_a_message_can_be_read_once():
    messages = read_messages()
    assert len(messages) > 700 and faults_of_messages(messages.values()) == []


def test_a_message_that_is_too_long_is_found():
    filler = " ".join(["long"] * (MESSAGE_MOST - 3))
    good, seeded = f"'a b.csv': the {filler} end; keep one", f"'a b.csv': the very {filler} end; keep one"
    assert faults_of_messages([good, *("give one", "keep one", "see --help")] * 2) == []
    (fault,) = faults_of_messages([seeded, "give one", "see --help"])
    assert fault.startswith(f"{MESSAGE_MOST + 1} words: Quotation: the very long")
    assert faults_of_messages([good, "two"]) == ["12.7 words in a sentence on average"]


def test_a_sentence_that_is_too_long_is_found_wherever_it_stands():
    for page in (f"{LONG}.", f"- {SHORT}\n- {LONG}.", f"# T\n\nterm\n: {LONG}", f"{SHORT} {SHORT} ({LONG}).\n"):
        (fault,) = faults_of([*blocks_of(page), *[SHORT] * 9])
        assert fault.startswith(f"{MOST + 1} words: ")
    assert faults_of([LONG[4:], *[SHORT] * 9]) == [] and faults_of([]) == []


def test_sentences_that_are_long_on_average_are_found():
    limit = "One " * (MEAN - 1) + "two. "
    assert faults_of([limit * 3]) == []
    assert faults_of([limit * 3, "More " + limit]) == ["18.2 words in a sentence on average"]


def test_what_is_no_prose_is_not_counted():
    code = f"```text\n{LONG}\n```\n\n    {LONG}\n\n<!-- {LONG} -->\n\n| {LONG} |\n\n## {LONG}\n"
    assert list(blocks_of(f"{SHORT}\n\n{code}\n- {SHORT} Three: four.")) == [SHORT, f"{SHORT} Three: four."]
    assert sentences_of(f"Take `{LONG}. And` or [it]({'x' * 99}).") == ["Take Code or it."]
