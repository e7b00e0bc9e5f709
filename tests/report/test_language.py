"""The fixed words of a report in German: all are translated, none is stale, and a logo can do no harm."""

import ast
import base64
import re
from pathlib import Path

import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify
from dzdesign.report.characteristic.curves import ORIGIN_WORDS
from dzdesign.report.figures.characteristic import WITH_WORDS
from dzdesign.report.language import LANGUAGES, current_language, in_language, table_of_language, word
from dzdesign.report.logo import LARGEST, logo_uri
from dzdesign.report.page import SIGNS
from dzdesign.report.sections.characteristic import NAMES, VERDICTS
from dzdesign.report.sections.conditions import RECORDED
from tests.support.html_pages import HOSTILE, Page
from tests.support.paths import ROOT
from tests.support.synthetic import Truth, synthetic_ramp

REPORT = ROOT / "report" / "dzdesign" / "report"
PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
#: Words that are chosen by a value: of a side, a branch, a row.
CHOSEN = {
    *NAMES.values(), *ORIGIN_WORDS.values(), *WITH_WORDS.values(), *RECORDED, *SIGNS,
    *(text for _, text, _ in VERDICTS.values()), "Positive commands", "Negative commands", "recordings",
    "No negative commands were tested.", "No positive commands were tested.", "Ramp rate", "Sampling", "Samples",
    "Flow meter", "Dither", "With", "Without", "Lot of", "valve", "valves",
    *(f"{what}, {of}" for what in ("Dead zone on opening", "Dead zone on closing", "Flow at zero command")
      for of in ("measured", "simulated recordings")),
}  # fmt: skip
#: Labels and headings that the page translates as they come.
AS_THEY_COME = {
    "Dead zone on opening", "Dead zone on closing", "Dead zone of the valve", "Simulated closed loop", "Inputs checked",
    "Calibrated", "Need a look", "Dead zone left on opening", "Dead zone left on closing", "Cost of one lot setting",
    "Threshold: knee on opening", "Certificate",
    "Certificate of the recording", "Flow at zero command", "quantity", "verdict", "limit",
}  # fmt: skip


def literals() -> set[str]:
    """Return every text that the code or a template hands over to be translated."""
    found = set()
    for path in REPORT.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "word":
                found |= {
                    each.value
                    for each in ast.walk(node.args[0])
                    if isinstance(each, ast.Constant) and isinstance(each.value, str)
                    and not any(each in ast.walk(part) for part in ast.walk(node) if isinstance(part, ast.JoinedStr))
                }  # fmt: skip
    for path in (REPORT / "templates").glob("*.jinja"):
        found |= set(re.findall(r'"([^"\n]+)" \| translated', path.read_text(encoding="utf-8")))
    return found


def headings() -> set[str]:
    found = set()
    for name in ("valve", "lot"):
        text = (REPORT / "templates" / f"{name}.html.jinja").read_text(encoding="utf-8")
        found |= set(re.findall(r'\("\w+", "([^"]+)"\)', text[text.index("headings") : text.index("appendices")]))
    return found


@pytest.mark.parametrize("language", [each for each in LANGUAGES if each != "en"])
def test_every_fixed_word_is_translated_and_no_translation_is_stale(language):
    table = table_of_language(language)
    asked = literals() | CHOSEN | headings()
    assert sorted(asked - table.keys()) == []
    assert sorted(table.keys() - asked - AS_THEY_COME) == []
    assert all(text.strip() == text and text for text in table.values())


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
    assert '<html lang="de">' in html and "Nicht vollständig geprüft" in html and ">Kennlinie<" in html
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
