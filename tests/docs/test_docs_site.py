"""The documentation's site: it builds without a warning, loads nothing from elsewhere, and leaves nothing out."""

import ast
import html
import os
import re
import subprocess
import sys
from urllib.parse import unquote

import pytest

from docs.generated import SCHEMAS, schema_document, schema_text
from dzdesign.command_line.parser import COMMANDS, arguments_of_command
from dzdesign.core.version import __version__
from tests.support.html_pages import Page
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

pytest.importorskip("sphinx", reason="the site needs the packages of the extra `docs`")
pytest.importorskip("myst_parser", reason="the site needs the packages of the extra `docs`")

DOCS = ROOT / "docs"
#: Tag -> attribute by which a page loads something; a link that a reader may follow is not among them.
LOADS = {"link": "href", "script": "src", "img": "src", "source": "src", "iframe": "src", "object": "data"}

pytestmark = [pytest.mark.slow, needs_compiler]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built as `make docs` does, of a copy of the pages without the derivation's account."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
    command += ["-d", str(folder / "doctrees"), str(DOCS), str(folder / "html")]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    return folder / "html"


@pytest.fixture(scope="module")
def pages(site):
    paths = (path.resolve() for path in site.rglob("*.html") if "derivation" not in path.parts)
    return {path: Page(path.read_text(encoding="utf-8")) for path in paths}


def test_nothing_is_loaded_from_elsewhere(site, pages):
    assert len(pages) > 20
    tags = [(path.name, *tag) for path, page in pages.items() for tag in page.tags]
    loaded = {(name, given[LOADS[tag]]) for name, tag, given in tags if tag in LOADS and given.get(LOADS[tag])}
    assert loaded and [each for each in loaded if re.match(r"([a-z]+:)?//", each[1])] == []
    styles = "".join(path.read_text(encoding="utf-8") for path in site.rglob("*.css"))
    assert styles and re.findall(r"@import|url\(\s*['\"]?(?:https?:)?//[^)]*", styles) == []
    assert list(site.rglob("*.woff*")) == [], "no web fonts"


def test_every_link_leads_somewhere(site, pages):
    broken, tried = [], 0
    places = {path: {*page.ids()} for path, page in pages.items()}
    account = {"index.html", "derivation.json"}
    for path, page in pages.items():
        for link in page.links():
            tried += 1
            target, _, place = unquote(link).partition("#")
            if re.match(r"[a-z]+:", target):
                continue
            where = (path.parent / target).resolve() if target else path
            if where.parent.name == "derivation" and where.name in account:
                continue
            if not where.is_file() or (place and where in pages and place not in places[where]):
                broken.append(f"{path.name}: {link}")
    assert broken == [] and tried > 500


def test_the_reference_has_every_command_with_every_option(site):
    page = (site / "reference" / "commands.html").read_text(encoding="utf-8")
    for name in COMMANDS:
        section = page.partition(f'<section id="{name}">')[2].partition("</section>")[0]
        assert section, name
        for argument in arguments_of_command(name):
            word = argument.option.metavar if argument.is_positional else argument.flag
            assert word in section, f"{name} {word}"


def test_the_schemas_are_published_and_every_key_is_in_the_reference(site):
    page = (site / "reference" / "files.html").read_text(encoding="utf-8")
    text = html.unescape(re.sub(r"<[^>]+>", "", page))
    for name in SCHEMAS:
        assert (site / "schemas" / f"{name}.schema.json").read_text(encoding="utf-8") == schema_text(name)
        described = list(described_keys(schema_document(name)))
        assert len(described) > 10
        missing = [key for key, words in described if key not in text or words.replace("`", "") not in text]
        assert missing == [], name


def described_keys(schema):
    """Yield every key of a schema with its description."""
    for key, value in schema.items():
        if key == "properties":
            yield from ((name, given["description"]) for name, given in value.items() if "description" in given)
        if isinstance(value, dict):
            yield from described_keys(value)


def test_every_note_of_assess_is_documented_and_none_is_invented():
    text = (DOCS / "reference" / "warnings.md").read_text(encoding="utf-8")
    made = {
        word.value.value
        for source in (ROOT / "assess").rglob("*.py")
        for node in ast.walk(ast.parse(source.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Warning_"
        for word in node.keywords
        if word.arg == "code" and hasattr(word.value, "value")
    }
    assert len(made) > 5
    assert set(re.findall(r"^\| `(\S+)` \|", text, re.MULTILINE)) == made


def test_every_page_shows_the_version(site, pages):
    for path in pages:
        assert f"dzdesign {__version__}" in path.read_text(encoding="utf-8"), path
    named = re.findall(r"dzdesign-(\d+\.\d+\.\d+)", "".join(
        (ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "docs/index.md")
    ))  # fmt: skip
    assert len(named) >= 2 and {*named} == {__version__}
