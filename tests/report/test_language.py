"""The fixed words of a report in German: all are translated, none is stale, and a logo can do no harm."""

import ast
import base64
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import get_args

import pytest

from dzdesign.assess.quantities import QUANTITIES
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.design.machine.budget import Component
from dzdesign.identify.identification import identify
from dzdesign.report.characteristic.curves import ORIGIN_WORDS
from dzdesign.report.figures.characteristic import WITH_WORDS
from dzdesign.report.language import LANGUAGES, current_language, in_language, stays_english, table_of_language, word
from dzdesign.report.logo import LARGEST, logo_uri
from dzdesign.report.lot.report import report_of_lot
from dzdesign.report.lot.table import SideFigures, TableRow
from dzdesign.report.page import SIGNS
from dzdesign.report.sections.characteristic import EXPLAINED, NAMES
from dzdesign.report.sections.conditions import RECORDED
from dzdesign.report.valve_report import report_of_folder
from dzdesign.verify import requirements
from tests.support.html_pages import HOSTILE, Page
from tests.support.paths import ROOT
from tests.support.synthetic import Truth, synthetic_ramp
from tests.support.synthetic_lots import write_lot_folder

REPORT = ROOT / "report" / "dzdesign" / "report"
PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
#: What a figure shows that is no word of a language.
SYMBOLS = {"7 MPa", "7 mV", "k x_max/u_max", "dP (7)"}
#: What is made of words: each of them is translated, and what is made of it.
COMPOSED = {
    "Dead zone on 7", "Dead zone on 7, 7", "Flow at zero command, 7", "No 7 commands were tested.",
    "The plant's parameters; the unit is in the name7", "What the lot setting costs each valve, the dearest first7",
    "extra dead zone7 (%)", "own offset at dP07 (7)", "Certificate of 7",
}  # fmt: skip
#: Rooms whose words a report shows.
SHOWN = ("report", "verify", "assess", "identify", "design", "derivation", "core")
#: Arguments whose texts a page or a figure shows.
KEYWORDS = {"label", "xlabel", "ylabel", "title", "caption", "missing", "subtitle"}
#: Words of English that German lacks.
ENGLISH = re.compile(r"\b(the|of|with|and|which|without|by|from|that|not|were|are|is|at)\b")


@pytest.fixture(scope="module")
def german_demo(reported_demo):
    with in_language("de"):
        return report_of_folder(reported_demo).html


def sources(room: str) -> Iterator[ast.AST]:
    for path in (ROOT / room).rglob("*.py"):
        yield from ast.walk(ast.parse(path.read_text(encoding="utf-8")))


def texts(node: ast.AST) -> Iterator[str]:
    """Return the texts that an expression may have, a number in each of their places."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.IfExp):
        yield from (*texts(node.body), *texts(node.orelse))
    elif isinstance(node, ast.JoinedStr) and all(
        isinstance(each, ast.Constant) or not isinstance(each.value, ast.IfExp) for each in node.values
    ):
        yield "".join(str(each.value) if isinstance(each, ast.Constant) else "7" for each in node.values)


def fixed_texts() -> set[str]:
    """Return the words that stand in the report's code: captions, headings, labels, and what it hands to `word`."""
    found: set[str] = set()
    for call in (each for each in sources("report") if isinstance(each, ast.Call)):
        name = call.func.id if isinstance(call.func, ast.Name) else getattr(call.func, "attr", "")
        shown = [each.value for each in call.keywords if each.arg in KEYWORDS]
        if name in ("table_of", "word", "set_xlabel", "set_ylabel", "set_title"):
            shown += call.args[:1]
        if name == "table_of":
            pairs = (pair for each in call.args[2:] for pair in ast.walk(each) if isinstance(pair, ast.Tuple))
            shown += [pair.elts[0] for pair in pairs if len(pair.elts) == 2]
        found |= {text for each in shown for text in texts(each)}
    for path in (REPORT / "templates").glob("*.jinja"):
        template = path.read_text(encoding="utf-8")
        found |= set(re.findall(r'"([^"\n]+)" \| translated', template))
        named = re.findall(r'\("\w+", "([^"]+)"\)|"\w+": "([^"]+)"', template)  # headings, notes
        found |= {text for pair in named for text in pair if text}
    found |= {each.title for each in vars(requirements).values() if isinstance(each, requirements.Requirement)}
    found |= {*NAMES.values(), *ORIGIN_WORDS.values(), *WITH_WORDS.values(), *RECORDED, *SIGNS, *get_args(Component)}
    found |= {each.name for each in QUANTITIES.values()} | {
        each.formula for key, each in QUANTITIES.items() if key in EXPLAINED
    }
    return {text for text in found if re.search("[A-Za-z]{2}", text) and text not in SYMBOLS | COMPOSED}


def test_every_fixed_word_is_translated():
    with in_language("de"):
        assert sorted(text for text in fixed_texts() if word(text) == text and not is_translated(text)) == []


def words(text: str) -> list[str]:
    return re.findall(r"[a-zβ]{2,}", text.lower())


def neighbours(text: str) -> Iterator[tuple[str, ...]]:
    """Return the words of a text in pairs."""
    return pairwise(words(text))


def is_translated(text: str) -> bool:
    """Return whether the table has it, though German writes it alike."""
    return text in table_of_language("de")


@pytest.mark.parametrize("language", [each for each in LANGUAGES if each != "en"])
def test_no_translation_is_stale(language):
    """Of the pairs of words in a phrase half stand in the code or in a template, at least: it may be put together."""
    known = {each.value for room in SHOWN for each in sources(room)
             if isinstance(each, ast.Constant) and isinstance(each.value, str)}  # fmt: skip
    known |= {path.read_text(encoding="utf-8") for path in (REPORT / "templates").glob("*.jinja")}
    pairs = {pair for text in known for pair in neighbours(text)} | {(each,) for text in known for each in words(text)}
    stale = []
    for key in table_of_language(language):
        asked = [pair for part in key.split("{}") for pair in neighbours(part)]
        asked = asked if len(asked) > 1 else [(each,) for each in words(key)]
        if 2 * sum(each in pairs for each in asked) < len(asked):
            stale.append(key)
    assert stale == []
    for key, text in table_of_language(language).items():
        assert text.strip() == text and text, key
        text.format(*key.split("{}")[1:])  # no more places than the English has


@pytest.mark.parametrize("tag", ["h1", "h2", "h3", "th", "caption", "figcaption", "dt", "summary", "text"])
def test_no_fixed_word_of_a_german_report_is_english(german_demo, tag):
    found = re.findall(rf"<{tag}\b[^>]*>(.*?)</{tag}>", german_demo, re.DOTALL)
    assert found
    plain = [re.sub(r"<[^>]+>", "", each) for each in found]
    assert [each for each in plain if ENGLISH.search(each)] == []


def test_a_legend_fits_its_figure_in_german_too(german_demo):
    """No text begins left of the drawing: a legend that is wider than its figure would."""
    drawings = re.findall(r'<svg class="drawing".*?</svg>', german_demo, re.DOTALL)
    starts = [float(x) for each in drawings for x in re.findall(r"text-anchor: start[^>]* x=\"(-?[\d.]+)\"", each)]
    assert len(starts) > 30 and min(starts) > 0


def test_a_german_report_says_where_findings_are_english(german_demo):
    words = "Befunde im Wortlaut der Nachweise, englisch."
    checks = german_demo[german_demo.index('<section id="checks">') :]
    assert words in checks[: checks.index("</section>")]
    lines = re.findall(r"<li([^>]*)>(.*?)</li>", german_demo, re.DOTALL)
    named = re.compile(r"<code>.*?</code>|<[^>]+>|\"[^\"]*\"")
    unmarked = [text for attribute, text in lines if not attribute and 'class="formula"' not in text]
    assert [text for text in unmarked if ENGLISH.search(named.sub("", text))] == []


@pytest.mark.parametrize(
    "text",
    [
        "the generated files are unchanged and something else", "a valve of the lot and another one",
        "command: ADC code 0 is zero, 4095 is 10 V; every code is valid", "the worst of all that was tried",
    ],
)  # fmt: skip
def test_no_sentence_is_translated_in_part(text):
    with in_language("de"):
        assert word(text) == text and stays_english(text)


def test_a_language_holds_for_one_report_only():
    with in_language("de"):
        assert word("Hysteresis") == "Hysterese" and current_language() == "de"
    assert word("Hysteresis") == "Hysteresis" and current_language() == "en"
    with pytest.raises(InputError, match="expected en or de"), in_language("fr"):
        pass


@pytest.fixture
def valve_folder(tmp_path):
    record = {"serial": HOSTILE[0], "type": HOSTILE[2], "note": HOSTILE[1]}
    valve = identify([synthetic_ramp(1.0, Truth(noise=0.02), ramp_s=20, rate_Hz=25)], record=record)
    (tmp_path / "valve.json").write_bytes(to_json_bytes(valve))
    (tmp_path / "logo.png").write_bytes(PNG)
    return tmp_path


def test_a_german_report_with_a_logo_needs_nothing_from_outside(valve_folder, capsys):
    page = valve_folder / "bericht.html"
    options = ["-o", str(page), "--language", "de", "--logo", str(valve_folder / "logo.png")]
    assert main(["report", str(valve_folder), *options]) == 1  # not verified
    html = page.read_text(encoding="utf-8")
    assert '<html lang="de">' in html and "NICHT VERIFIZIERT: kein Nachweis vorhanden" in html and ">Kennlinie<" in html
    assert "Volumenstrom Q" in html and "Geprüft von" in html
    (image,) = Page(html).of("img")
    assert base64.b64decode(image["src"].removeprefix("data:image/png;base64,")) == PNG
    assert not Page(html).of("script")
    style = html[html.index("<style>") + len("<style>") : html.index("</style>")]
    # The title stands in the sheet's header, every sign of it escaped.
    assert "<" not in style and "alert\\28 1\\29 " in style
    assert "counter(page)" in style and "counter(pages)" in style
    again = page.read_bytes()
    assert main(["report", str(valve_folder), *options]) == 1
    assert page.read_bytes() == again
    capsys.readouterr()


def test_a_lot_has_a_logo_too(tmp_path):
    (tmp_path / "logo.png").write_bytes(PNG)
    rows = [TableRow(name="V1", status="failed", reason="no recording", sides={"": SideFigures()})]
    html = report_of_lot(write_lot_folder(tmp_path / "lot", rows), logo_uri(tmp_path / "logo.png")).html
    (image,) = Page(html).of("img")
    assert base64.b64decode(image["src"].removeprefix("data:image/png;base64,")) == PNG


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("logo.svg", b"<svg xmlns='http://www.w3.org/2000/svg' onload='alert(1)'/>"),
        ("logo.png", b"<script>alert(1)</script>"),
        ("large.png", PNG + bytes(LARGEST)),
        ("empty.png", b""),
    ],
    ids=["SVG", "no image", "too large", "empty"],
)
def test_what_is_no_raster_image_is_refused(tmp_path, name, content):
    path: Path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match="--logo"):
        logo_uri(path)
