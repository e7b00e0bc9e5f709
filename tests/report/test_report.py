"""report.html: what it leads with, where its files come from, and that nobody's text becomes markup."""

import base64
import json
import re
from dataclasses import replace
from pathlib import Path
from urllib.parse import unquote

import pytest

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.design.designing import design
from dzdesign.identify.identification import identify
from dzdesign.report.artefacts import Chain, Place, read_chain
from dzdesign.report.figure import PALETTE, PressureHues, figure_style
from dzdesign.report.page import LARGEST_LOGO, logo_uri, whole
from dzdesign.report.sections.closed_loop import loop_section, plant_section
from dzdesign.report.sections.inputs import inputs_section
from dzdesign.report.sections.quantities import PressureQuantities
from dzdesign.report.sections.valve import conditions_section, thresholds_section
from dzdesign.report.summary import headline, worst_of
from dzdesign.report.valve_report import REPORT_NAME, make_report
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.requirements import AS_STATED
from tests.support.html_pages import HOSTILE, Page
from tests.support.synthetic import Truth, needs_compiler, synthetic_ramp

pytestmark = needs_compiler


@pytest.fixture(scope="module")
def chain(reported_demo):
    return read_chain(reported_demo)


@pytest.fixture(scope="module")
def html(reported_demo):
    return (reported_demo / "evidence" / REPORT_NAME).read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_verdict_and_the_numbers_that_matter_come_first(html, reported_demo):
    evidence = json.loads((reported_demo / "evidence" / "verification.json").read_bytes())
    loops, identified = evidence["closed_loop"]["pressures"], json.loads((reported_demo / "valve.json").read_bytes())
    head = html[: html.index('<section id="characteristic">')]
    low, high = (identified["sides"]["positive"]["tests"][at]["dp_MPa"] for at in (0, -1))
    assert f"</span> No flow at zero command from {low:.3g} to {high:.3g} MPa, 99 %</p>" in head
    checked = f"All {len(evidence['checks'])} requirements that were checked hold"
    assert f"{checked}; " in head and f"; {AS_STATED}.</p>" in head and "counts as no flow" in head
    assert "The certificate covers the valve as recorded: no machine was declared" in head
    # Recorded, not simulated, without the compensator: as in the table of the characteristic.
    before = 10 * max(each["u_onset_rising_V"] for each in identified["sides"]["positive"]["tests"])
    after = 100 * max(each["residual_opening"] for each in loops)
    assert f"{before:.1f} % → {after:.1f} %" in head
    assert whole(evidence["inputs"][0]["inputs"]) in head
    labels = re.findall(r"<dt>(.*?)</dt>", head)
    assert labels == ["Dead zone on opening", "Largest flow", "Hysteresis", "Flow at zero command"]


def test_every_section_is_there_with_its_figures_and_tables(html):
    page = Page(html)
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert re.findall(r'<section id="(\w+)">', html) == [
        "characteristic", "loop", "thresholds", "conditions", "warnings", "checks", "remaining", "budget", "inputs",
        "plant", "law", "provenance",
    ]  # fmt: skip
    figures = ("loop", "thresholds", "zero", "law")
    of_sections = [f"figure-{name}-positive" for name in figures]
    assert ["figure-characteristic", *of_sections] == [name for name in ids if name.startswith("figure-")]
    links = [each["href"] for each in page.of("a")]
    assert {link[1:] for link in links if link.startswith("#")} <= set(ids)


def test_the_page_needs_nothing_from_outside_and_runs_nothing(html):
    page = Page(html)
    assert not page.of("script") and not page.of("iframe")
    outside = [
        value
        for _, attributes in page.tags
        for key, value in attributes.items()
        if key in ("src", "href", "xlink:href", "action", "data") and not value.startswith(("#", "data:"))
    ]
    assert outside == []
    assert not [key for _, attributes in page.tags for key in attributes if key.startswith("on")]
    assert "@import" not in html and re.findall(r"url\((?!#)", html) == []


def test_the_numbers_of_every_figure_can_be_downloaded(html, reported_demo):
    links = {each["download"]: each["href"] for each in Page(html).of("a") if "download" in each}
    assert len(links) == 6  # five figures, and the budget's components
    tables = {name: unquote(link.removeprefix("data:text/csv;charset=utf-8,")) for name, link in links.items()}
    evidence = reported_demo / "evidence"
    assert tables["loop-positive.csv"] == (evidence / "closed_loop_positive.csv").read_text()
    assert tables["zero-positive.csv"] == (evidence / "zero_command_positive.csv").read_text()
    for name, text in tables.items():
        lines = text.splitlines()
        assert len(lines) > 2, name
        words = name.startswith("budget-components")
        assert words or len({line.count(",") for line in lines}) == 1, name


def test_figures_take_their_colours_from_the_page(html):
    drawings = re.findall(r'<svg [^>]*class="drawing".*?</svg>', html, re.DOTALL)
    assert len(drawings) == 5
    light = {shade for shade, _ in PALETTE.values()}
    for drawing in drawings:
        assert not {shade for shade in light if shade in drawing}
        assert "var(--fig-ink)" in drawing and 'aria-label="' in drawing
    assert html.count("--fig-ink: ") == 2  # light and dark


# --- the verdict ----------------------------------------------------------------------------------------------


def judged(chain, **changes):
    """Return the verdict on evidence of which the named requirements have other outcomes."""
    checks = tuple(replace(one, **changes.get(one.id.replace("-", "_"), {})) for one in chain.evidence.checks)
    return headline(replace(chain, evidence=replace(chain.evidence, checks=checks)))


def test_a_requirement_that_does_not_hold_is_loud_and_what_was_not_checked_is_not_green(chain):
    wrong = judged(chain, exact_law={"holds": False, "text": "33550336 inputs checked, 7 wrong"})
    assert wrong.kind == "bad" and wrong.text.startswith("DOES NOT HOLD: 1 of ")
    assert wrong.reasons == ("DOES NOT HOLD: equals the exactly rounded law: 33550336 inputs checked, 7 wrong",)
    unknown = judged(chain, exact_law={"holds": None, "text": "no compiler"})
    assert unknown.kind == "open" and unknown.text.startswith("NOT CHECKED in full: 1 of ")
    assert unknown.reasons == ("NOT CHECKED: equals the exactly rounded law: no compiler",)
    both = judged(chain, exact_law={"holds": None}, reproduced={"holds": False})
    assert both.kind == "bad" and [line.split(":")[0] for line in both.reasons] == ["DOES NOT HOLD", "NOT CHECKED"]
    inputs = replace(chain.evidence.inputs[0], wrong=7, first_wrong="command code 9")
    seen = replace(chain, evidence=replace(chain.evidence, inputs=(inputs,)))
    with figure_style():
        assert "First wrong: command code 9." in inputs_section(seen).lines


def test_what_was_not_tried_is_said(chain):
    """Without --plant the closed loop is of a stand-in, which has load steps where there are several pressure drops."""
    said = " ".join(headline(chain).untried)
    assert "the closed-loop requirements hold with the machine's plant: `verify --plant" in said
    assert "load steps" not in said and "machine code of other processors" in said
    loop = replace(chain.evidence.closed_loop, plant=Plant(), plant_sha256="5" * 64, dynamics=None)
    tried = replace(chain.evidence.checks[0], id="machine-code", name="machine code of AVR")
    kept = tuple(one for one in chain.evidence.checks if one.name != "the drive follows its model")
    evidence = replace(chain.evidence, closed_loop=loop, checks=(*kept, tried))
    said = " ".join(headline(replace(chain, evidence=evidence)).untried)
    assert "machine's plant" not in said and "machine code" not in said and "the drive follows its model" in said
    with figure_style():
        section = loop_section(replace(chain, evidence=evidence), PressureHues(()))
    assert f"SHA-256 {'5' * 64}" in section.lines[0]
    (table, *_) = plant_section(evidence).tables
    assert any(cell.text == "m_e_kg" for row in table.rows for cell in row)


# --- hostile text -------------------------------------------------------------------------------------------------


def is_of_the_number_of_texts(tag, given):
    """Tell what there is one of for each text, or each long word of a cell: rows, lines, places to break."""
    return tag in ("li", "ul", "p", "tr", "td", "small", "wbr") or (tag, given) == ("span", {"class": "breaks"})


@pytest.mark.slow
def test_nobodys_text_becomes_markup(chain, html):
    name = " ".join(HOSTILE)
    evidence = chain.evidence
    poisoned = replace(
        evidence,
        checks=(replace(evidence.checks[0], name=name, text=name), *evidence.checks[1:]),
        inputs=(replace(evidence.inputs[0], first_wrong=name),),
        scenarios=(replace(evidence.scenarios[0], name=name), *evidence.scenarios[1:]),
        closed_loop=replace(evidence.closed_loop, plant_source=name),
    )
    side, valve = chain.valve.sides["positive"], chain.valve
    tests = (replace(side.tests[0], ramps=(name,)), *side.tests[1:])
    warning = replace(valve.warnings[0], code=name, text=name, source=name)
    source = replace(valve.made_from[0], source=name)
    hostile = replace(
        valve, sides={"positive": replace(side, tests=tests)}, warnings=(*valve.warnings, warning),
        made_from=(source, *valve.made_from[1:]),
    )  # fmt: skip
    dirty = Page(make_report(replace(chain, evidence=poisoned, valve=hostile)).html)
    words, expected = (
        [tag for tag, given in each.tags if not is_of_the_number_of_texts(tag, given)] for each in (dirty, Page(html))
    )
    assert words == expected
    assert not [key for _, attributes in dirty.tags for key in attributes if key.startswith("on")]
    assert " ".join(name.split()) in " ".join(dirty.text.split())


# ---- few tests, and two sides ----


def test_one_ramp_test_is_one_and_figures_of_two_sides_say_which_they_are_of(chain):
    one, other = (synthetic_ramp(dp, Truth(), seed=7, rate_Hz=10.0) for dp in (1.0, 4.0))
    mirrored = [replace(test, source=f"minus_{test.source}", u=-test.u, q=-test.q) for test in (one, other)]
    alone = identify([one])
    valves = (alone, identify([one, other, *mirrored]))
    with figure_style():
        of_one, of_both = (thresholds_section(valve, None, None) for valve in valves)
    data = conditions_section(alone, None).lines
    assert data[0].startswith("1 ramp test; full command")
    assert of_one.figures == [None] and "nothing is certified at another" in of_one.lines[0]
    for side, drawn in zip(("positive", "negative"), of_both.figures, strict=True):
        assert drawn.name == f"thresholds-{side}" and f"{side} commands</text>" in drawn.svg
    assert of_both.lines[0].startswith("Premise, both sides: 2 pressure drops were tested")
    # An assumed repeatability stands with the verdict.
    said = [
        " ".join(headline(of).cautions)
        for of in (Chain(compensator=design(alone), valve=alone), replace(chain, evidence=None))
    ]
    assert "repeats to 25 mV" in said[0] and "(assumed-scatter)" in said[0] and "assumed-scatter" not in said[1]
    assert any("from ramp to ramp: standard deviation 25.0 mV (assumed" in line for line in data)


@pytest.mark.parametrize(
    ("sides", "said"),
    [
        ({"positive": 1}, "at 1.00 MPa, the one pressure drop tested"),
        ({"positive": 6}, "the worst of 6 pressure drops"),
        ({"positive": 2, "negative": 2}, "the worst of 2 pressure drops on each side"),
        ({"positive": 1, "negative": 1}, "the worst of 1 pressure drop on each side"),
        ({"positive": 3, "negative": 1}, "the worst of 3 pressure drops positive and 1 pressure drop negative"),
    ],
)
def test_of_how_many_runs_a_figure_is_the_worst(sides, said):
    runs = [
        PressureQuantities(side=side, dp_MPa=1.0 + n, reading_flow_L_min=0.6, before={}, after={})
        for side, count in sides.items()
        for n in range(count)
    ]
    assert worst_of(runs, AS_COMPUTED) == said


# ---- a logo ----

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


def test_a_report_with_a_logo_needs_nothing_from_outside(tmp_path):
    """And a record of somebody's own stands in the sheet's header with every sign of it escaped."""
    record = {"serial": HOSTILE[0], "type": HOSTILE[2], "note": HOSTILE[1]}
    valve = identify([synthetic_ramp(1.0, Truth(noise=0.02), ramp_s=20, rate_Hz=25)], record=record)
    (tmp_path / "logo.png").write_bytes(PNG)
    chain = Chain(valve=valve, places={"valve": Place("valve.json", "0" * 64)})
    html = make_report(chain, logo=logo_uri(tmp_path / "logo.png")).html
    (image,) = Page(html).of("img")
    assert base64.b64decode(image["src"].removeprefix("data:image/png;base64,")) == PNG
    assert not Page(html).of("script")
    style = html[html.index("<style>") + len("<style>") : html.index("</style>")]
    assert "<" not in style and "alert\\28 1\\29 " in style
    assert "counter(page)" in style and "counter(pages)" in style


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("logo.svg", b"<svg xmlns='http://www.w3.org/2000/svg' onload='alert(1)'/>"),
        ("logo.png", b"<script>alert(1)</script>"),
        ("large.png", PNG + bytes(LARGEST_LOGO)),
        ("empty.png", b""),
    ],
    ids=["SVG", "no image", "too large", "empty"],
)
def test_what_is_no_raster_image_is_refused(tmp_path, name, content):
    path: Path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match="--logo"):
        logo_uri(path)
