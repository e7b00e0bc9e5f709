"""Reference text that can be read once: docstrings of the public names, keys of artefacts, requirements of `verify`."""

import doctest
import inspect
import re
import textwrap
from dataclasses import fields, is_dataclass
from importlib import import_module

import pytest

from docs.generated import API, key_lines
from dzdesign import api
from dzdesign.commands.schema import SCHEMAS, schema_document
from dzdesign.core.artefact_types import Artefact
from tests.docs.sentences import MEAN, MOST, faults_of, words_of
from tests.support.evidence import DECLARED

PUBLIC = [(module, name) for module, names in API for name in names]
#: Examples that run in seconds, on the bundled recordings.
QUICK = ("identify", "init", "simulate")
#: A description that begins like this does not name its thing.
UNFINISHED = re.compile(r"(Its|Of|The same|That|How many|By how much|On|When|Where|Which|As)\b")
SENTENCE = "One " + "two " * (MOST - 1) + "three."


def prose_of(docstring):
    """Yield the paragraphs of a numpydoc docstring: without headings, names with their types, and examples."""
    text = re.split(r"^Examples\n-+\n", inspect.cleandoc(docstring), flags=re.MULTILINE)[0]
    text = re.sub(r"^\S.*\n-{3,}$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^(\S.*)\n(?=    )", "\n", text, flags=re.MULTILINE)
    for paragraph in re.split(r"\n\s*\n", text):
        if paragraph.strip() and ">>>" not in paragraph:
            yield " ".join(textwrap.dedent(paragraph).split())


def documented(thing):
    """Yield the name and the docstring of a function, or of a class and what a user reaches from it."""
    yield thing.__name__, inspect.getdoc(thing) or ""
    if inspect.isclass(thing):
        for name, member in vars(thing).items():
            found = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
            if inspect.isfunction(found) and not name.startswith("_"):
                yield f"{thing.__name__}.{name}", inspect.getdoc(found) or ""


def described_keys(schema):
    """Yield the description of a schema and of everything in it."""
    if isinstance(schema, dict):
        if isinstance(schema.get("description"), str):
            yield schema["description"]
        for value in schema.values():
            yield from described_keys(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from described_keys(value)


def unfinished(texts):
    """Return the texts without a capital or a full stop, and those that leave their thing to the name or key above."""
    return [text for text in texts if not re.fullmatch(r"[^a-z].*\.", text, re.DOTALL) or UNFINISHED.match(text)]


def test_the_prose_of_a_docstring_is_found():
    returns = "Returns\n-------\nint\n    One\n    word.\nstr\n    Two."
    assert list(prose_of(f"Do\nit.\n\nNow.\n\n{returns}")) == ["Do it.", "Now.", "One word.", "Two."]
    assert list(prose_of("Do it.\n\n>>> 1\n1\n\nExamples\n--------\nSo.\n")) == ["Do it."]


@pytest.mark.parametrize(("module", "name"), PUBLIC, ids=[f"{module}.{name}" for module, name in PUBLIC])
def test_a_public_docstring_can_be_read_once(module, name):
    for place, text in documented(getattr(import_module(module), name)):
        blocks = list(prose_of(text))
        assert blocks, f"{place} has no docstring"
        assert [f"{place}: {fault}" for fault in faults_of(blocks) if " words: " in fault] == []
        assert unfinished(blocks[:1]) == []


def test_public_docstrings_are_short_on_average():
    blocks = [
        block
        for module, name in PUBLIC
        for _, text in documented(getattr(import_module(module), name))
        for block in prose_of(text)
    ]
    assert len(blocks) > 400 and faults_of(blocks) == []


@pytest.mark.parametrize("name", SCHEMAS)
def test_the_keys_of_a_file_can_be_read_once(name):
    texts = sorted(set(described_keys(schema_document(name))))
    assert len(texts) > 5 and faults_of(texts) == [] and unfinished(texts) == []


def test_the_keys_of_a_public_result_are_described():
    results = [found for module, name in PUBLIC if is_dataclass(found := getattr(import_module(module), name))]
    artefacts = [each for each in results if issubclass(each, Artefact)]
    assert len(artefacts) >= 5
    for each in artefacts:
        own = {field.name for field in fields(each)}
        assert {line.split()[1].rstrip(":") for line in key_lines(each)} == own


def requirement_texts():
    """Return the title of every requirement, and what to do to have it checked, as sentences."""
    return [f"{each.title[0].upper()}{each.title[1:]}." for each in DECLARED], [each.how for each in DECLARED]


def test_a_requirement_can_be_read_once():
    titles, hows = requirement_texts()
    assert len(titles) > 35 and faults_of([*titles, *hows]) == []
    assert [title for title in titles if len(words_of(title)) > MEAN] == []


@pytest.mark.parametrize("name", QUICK)
def test_an_example_of_the_api_runs(name):
    found = doctest.DocTestFinder(recurse=False).find(getattr(api, name), name, globs={})
    results = [doctest.DocTestRunner().run(each) for each in found]
    assert sum(each.attempted for each in results) > 2 and sum(each.failed for each in results) == 0


def test_a_docstring_that_is_too_long_is_found():
    for docstring in (
        SENTENCE,
        f"Do it.\n\n{SENTENCE}",
        f"Do it.\n\nParameters\n----------\nx : int\n    {SENTENCE}\n",
        f"Do it.\n\nRaises\n------\nInputError\n    {SENTENCE}\n",
    ):
        assert [fault for fault in faults_of(prose_of(docstring)) if fault.startswith(f"{MOST + 1} words: ")]
    assert faults_of(prose_of(f"Do it.\n\nExamples\n--------\n>>> 1  # {SENTENCE}\n")) == []


def test_a_description_that_is_no_phrase_is_found():
    good = ["Standard error of the threshold.", "SHA-256 of the file.", "0 if there is none.", "`x` of the law."]
    bad = ["Its standard error.", "Of the draw.", "The same on closing.", "How many.", "lag of the meter.", "No stop"]
    assert unfinished([*good, *bad]) == bad


def test_a_key_that_is_too_long_is_found():
    schema = {"properties": {"x": {"description": "Short."}, "y": {"anyOf": [{"description": SENTENCE}]}}}
    assert [fault for fault in faults_of(described_keys(schema)) if " words: " in fault] == [
        f"{MOST + 1} words: {SENTENCE}"
    ]
