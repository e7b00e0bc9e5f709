"""Reference text that can be read once: docstrings of the public names, keys of artefacts, requirements of `verify`."""

import doctest
import inspect
import re
import textwrap
from dataclasses import fields, is_dataclass
from importlib import import_module

import pytest

from docs.generated import API, SCHEMAS, key_lines, schema_document
from dzdesign import api
from dzdesign.core.artefact_types import Artefact
from dzdesign.verify import requirements
from dzdesign.verify.requirements import Requirement
from tests.docs.prose import MEAN, MOST, faults_of, words_of

PUBLIC = [(module, name) for module, names in API for name in names]
#: Examples that run in seconds, on the bundled recordings.
QUICK = ("identify", "init", "simulate")
#: A description that begins like this does not name its thing.
UNFINISHED = re.compile(r"(Its|Of|The same|That|How many|By how much|On|When|Where|Which|As)\b")
SENTENCE = "One " + "two three " * (MOST // 2) + "four."


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


def test_public_docstrings_can_be_read_once():
    found = {}
    for module, name in PUBLIC:
        for place, text in documented(getattr(import_module(module), name)):
            found[f"{module}.{place}"] = list(prose_of(text))
    assert [place for place, blocks in found.items() if not blocks or unfinished(blocks[:1])] == []
    blocks = [block for each in found.values() for block in each]
    assert len(blocks) > 350 and faults_of(blocks) == []


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


def test_a_requirement_can_be_read_once():
    found = [each for each in vars(requirements).values() if isinstance(each, Requirement)]
    titles, hows = [f"{each.title[0].upper()}{each.title[1:]}." for each in found], [each.how for each in found]
    assert len(titles) > 35 and faults_of([*titles, *hows]) == []
    assert [title for title in titles if len(words_of(title)) > MEAN] == []


@pytest.mark.parametrize("name", QUICK)
def test_an_example_of_the_api_runs(name):
    found = doctest.DocTestFinder(recurse=False).find(getattr(api, name), name, globs={})
    results = [doctest.DocTestRunner().run(each) for each in found]
    assert sum(each.attempted for each in results) > 2 and sum(each.failed for each in results) == 0


def test_a_seeded_fault_is_found():
    for docstring in (
        SENTENCE,
        f"Do it.\n\n{SENTENCE}",
        f"Do it.\n\nParameters\n----------\nx : int\n    {SENTENCE}\n",
        f"Do it.\n\nRaises\n------\nInputError\n    {SENTENCE}\n",
    ):
        assert faults_of(prose_of(docstring))
    assert faults_of(prose_of(f"Do it.\n\nExamples\n--------\n>>> 1  # {SENTENCE}\n")) == []
    schema = {"properties": {"x": {"description": "Short."}, "y": {"anyOf": [{"description": SENTENCE}]}}}
    assert list(described_keys(schema)) == ["Short.", SENTENCE]
    bad = ["Its standard error.", "Of the draw.", "The same on closing.", "How many.", "lag of the meter.", "No stop"]
    assert unfinished(["Standard error of the threshold.", "SHA-256 of the file.", "0 if none.", *bad]) == bad
