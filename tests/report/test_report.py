"""report.html: what it leads with, where its files come from, and that nobody's text becomes markup."""

import json
import re
import shutil
from dataclasses import asdict, replace
from urllib.parse import unquote

import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.design.designing import design
from dzdesign.identify.identification import identify
from dzdesign.report.cells import whole
from dzdesign.report.figure import PALETTE
from dzdesign.report.summary import worst_of
from dzdesign.report.valve_report import REPORT_NAME, report_of_folder
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.loop_results import PressureResult
from dzdesign.verify.requirements import AS_STATED
from tests.support.attacked_firmware import sealed
from tests.support.html_pages import HOSTILE, Page
from tests.support.reported import change_evidence, change_json
from tests.support.synthetic import Truth, needs_compiler, synthetic_ramp

pytestmark = needs_compiler


@pytest.fixture
def copied(reported_demo, tmp_path):
    folder = tmp_path / "demo"
    shutil.copytree(reported_demo, folder)
    return folder


@pytest.fixture(scope="module")
def html(reported_demo):
    return (reported_demo / "evidence" / REPORT_NAME).read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_verdict_and_the_numbers_that_matter_come_first(html, reported_demo):
    evidence = json.loads((reported_demo / "evidence" / "verification.json").read_bytes())
    loops, identified = evidence["closed_loop"]["pressures"], json.loads((reported_demo / "valve.json").read_bytes())
    head = html[: html.index('<section id="characteristic">')]
    checked = f"All {len(evidence['checks'])} requirements that were checked hold"
    assert f"{checked}; the certificate covers the valve as recorded; {AS_STATED}<" in head
    assert "no machine was declared" in head and "Certificate of the valve as recorded<" in head
    # Recorded, not simulated, without the compensator: as in the table of the characteristic.
    before = 10 * max(each["u_onset_rising_V"] for each in identified["sides"]["positive"]["tests"])
    after = 100 * max(each["residual_opening"] for each in loops)
    assert f"{before:.1f} % → {after:.1f} %" in head and "without (simulated recordings) → with (simulated" in head
    assert whole(evidence["inputs"][0]["inputs"]) in head and "99 %" in head and "Flow at zero command" in head


def test_every_section_is_there_with_its_figures_and_tables(html):
    page = Page(html)
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert re.findall(r'<section id="(\w+)">', html) == [
        "characteristic", "conditions", "loop", "thresholds", "beta", "remaining", "checks", "warnings",
        "data", "budget", "law", "integers", "inputs", "provenance",
    ]  # fmt: skip
    figures = ("dead-zone", "loop", "thresholds", "beta", "fit", "budget", "law", "map", "zero")
    of_sections = [f"figure-{name}-positive" for name in figures]
    assert ["figure-characteristic", *of_sections] == [name for name in ids if name.startswith("figure-")]
    links = [each["href"] for each in page.of("a")]
    assert {link[1:] for link in links if link.startswith("#")} <= set(ids)
    manifest_symbols = re.findall(r"<code>([\w.\[\]]+)</code><small>core/dz_valve.h", html)
    assert {"sides[0].slope", "sides[0].offset", "sides[0].nodes"} <= set(manifest_symbols)


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
    assert len(links) == 12  # ten figures, the constants, and the budget's components
    tables = {name: unquote(link.removeprefix("data:text/csv;charset=utf-8,")) for name, link in links.items()}
    evidence = reported_demo / "evidence"
    assert tables["loop-positive.csv"] == (evidence / "closed_loop_positive.csv").read_text()
    assert tables["map-positive.csv"] == (evidence / "input_map_positive.csv").read_text()
    for name, text in tables.items():
        lines = text.splitlines()
        assert len(lines) > 2, name
        words = name.startswith(("constants", "budget-components"))
        assert words or len({line.count(",") for line in lines}) == 1, name


def test_figures_take_their_colours_from_the_page(html):
    drawings = re.findall(r'<svg [^>]*class="drawing".*?</svg>', html, re.DOTALL)
    assert len(drawings) == 10
    light = {shade for shade, _ in PALETTE.values()}
    for drawing in drawings:
        assert not {shade for shade in light if shade in drawing}
        assert "var(--fig-ink)" in drawing and 'aria-label="' in drawing
    assert html.count("--fig-ink: ") == 2  # light and dark


# --- a verdict that is not good ---------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_requirement_that_does_not_hold_is_loud(copied):
    def fail(evidence):
        evidence["holds"] = False
        check = next(one for one in evidence["checks"] if one["id"] == "exact-law")
        check.update(holds=False, text="33550336 inputs checked, 7 wrong")
        evidence["inputs"][0].update(wrong=7, first_wrong="command code 9")

    change_evidence(copied, fail)
    assert main(["report", str(copied)]) == 1
    html = (copied / "evidence" / REPORT_NAME).read_text(encoding="utf-8")
    assert '<div class="verdict bad"' in html and "DOES NOT HOLD: 1 of" in html
    assert "First wrong: command code 9" in html
    assert "requirements that were checked hold" not in html


@pytest.mark.slow
def test_what_was_not_checked_is_not_green(copied):
    def leave_open(evidence):
        evidence["holds"] = False
        check = next(one for one in evidence["checks"] if one["name"].endswith("after any required scenario"))
        check.update(holds=None, text="no falling branch was recorded")

    change_evidence(copied, leave_open)
    assert main(["report", str(copied)]) == 1
    html = (copied / "evidence" / REPORT_NAME).read_text(encoding="utf-8")
    assert '<div class="verdict open"' in html and 'class="verdict good"' not in html
    assert "NOT CHECKED: no flow at zero command after any required scenario: no falling branch was recorded" in html
    assert '<td class="open">? NOT CHECKED</td>' in html


@pytest.mark.slow
def test_what_was_not_tried_is_said(copied):
    """Without --plant the closed loop is of a stand-in, which has load steps where there are several pressure drops."""
    report = report_of_folder(copied)
    assert report.kind == "good"
    said = report.html[report.html.index('class="verdict good"') : report.html.index('<dl class="numbers">')]
    command = '<code>verify <span class="tied">--plant</span></code>'
    assert f"the closed-loop requirements hold with the machine&#39;s plant: {command}" in said
    assert "load steps" not in said  # of recordings at several pressure drops
    assert "machine code of other processors" in said

    def with_plant(evidence):
        evidence["closed_loop"].update(plant={**asdict(Plant()), "K_a": 1.0}, plant_sha256="5" * 64, dynamics=None)
        of_avr = {"id": "machine-code", "name": "machine code of AVR", "holds": True, "text": "", "not_required": []}
        evidence["checks"].append(of_avr)
        evidence["tool"]["version"] = "0.0.9"  # which had words of its own

    change_evidence(copied, with_plant)
    html = report_of_folder(copied).html
    said = html[html.index('class="verdict good"') : html.index('<dl class="numbers">')]
    assert "machine&#39;s own" not in said and "machine code" not in said
    assert f"SHA-256 {'5' * 64}" in html and "m_e_kg" in html[html.index('id="loop"') :]


# --- hostile text -------------------------------------------------------------------------------------------------


def is_of_the_number_of_texts(tag, given):
    """Tell what there is one of for each text, or each long word of a cell: rows, lines, places to break."""
    return tag in ("li", "ul", "p", "tr", "td", "small", "wbr") or (tag, given) == ("span", {"class": "breaks"})


@pytest.mark.slow
def test_nobodys_text_becomes_markup(copied):
    name = " ".join(HOSTILE)

    def poison(evidence):
        evidence["closed_loop"]["plant_source"] = name
        evidence["checks"][0].update(name=name, text=name)
        evidence["scenarios"][0]["name"] = name
        evidence["inputs"][0]["first_wrong"] = name

    def poison_valve(valve):
        valve["made_from"][0]["source"] = name
        valve["warnings"].append({"code": name, "text": name, "source": name})
        for test in valve["sides"]["positive"]["tests"]:
            test["source"] = name

    change_evidence(copied, lambda evidence: evidence["tool"].update(version="0.0.9"))  # which had words of its own
    clean = Page(report_of_folder(copied).html)
    change_evidence(copied, poison)
    page = Page(report_of_folder(copied).html)
    folder = copied / "alone"
    folder.mkdir()
    shutil.copy(copied / "valve.json", folder)
    clean_valve = Page(report_of_folder(folder).html)
    change_json(folder / "valve.json", poison_valve)
    change_json(folder / "valve.json", sealed)
    valve = Page(report_of_folder(folder).html)
    for dirty, before in ((page, clean), (valve, clean_valve)):
        words, expected = ([tag for tag, given in each.tags if not is_of_the_number_of_texts(tag, given)] for each in (
            dirty, before,
        ))  # fmt: skip
        assert words == expected
        assert not [key for _, attributes in dirty.tags for key in attributes if key.startswith("on")]
        assert " ".join(name.split()) in " ".join(dirty.text.split())


# ---- few tests, and two sides ----


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """Reports of a valve of one ramp test, and of one with two sides of two tests each, without firmware."""

    one, other = (synthetic_ramp(dp, Truth(), seed=7, rate_Hz=10.0) for dp in (1.0, 4.0))
    mirrored = [replace(test, source=f"minus_{test.source}", u=-test.u, q=-test.q) for test in (one, other)]
    found = {}
    for name, ramps in (("one", [one]), ("both", [one, other, *mirrored])):
        folder = tmp_path_factory.mktemp(name)
        (folder / "valve.json").write_bytes(to_json_bytes(identify(ramps)))
        found[name] = report_of_folder(folder).html
    return found


@pytest.mark.slow
def test_one_ramp_test_is_one(reports):
    text = Page(reports["one"]).text
    assert "1 ramp test; full command" in text and "1 ramp tests" not in text and "1 pressure drops" not in text
    assert "staircase" not in text and "One pressure drop was tested, and nothing is certified at another." in text


def test_an_assumed_repeatability_stands_beside_the_certificate(html, tmp_path):
    one = identify([synthetic_ramp(1.0, Truth(), seed=7, rate_Hz=10.0)])
    valve_json = to_json_bytes(one)
    (tmp_path / "valve.json").write_bytes(valve_json)
    (tmp_path / "compensator.json").write_bytes(to_json_bytes(design(one)))
    page = report_of_folder(tmp_path).html
    heads = [text[: text.index('<section id="data">')] for text in (page, html)]
    certificate, of_repeats = (head[head.index("Certificate") :] for head in heads)
    assert "repeats to 25 mV" in certificate and "(assumed-scatter)" in certificate
    assert "assumed-scatter" not in of_repeats
    assert "from ramp to ramp: standard deviation 25.0 mV (assumed" in page
    assert "degrees of freedom), included in the bounds" in html


def test_figures_of_two_sides_say_which_they_are_of(reports):
    for side in ("positive", "negative"):
        start = reports["both"].index(f'id="figure-fit-{side}"')
        assert f"{side} commands</text>" in reports["both"][start : reports["both"].index("</svg>", start)]
    assert "commands</text>" not in reports["one"]


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
    one = PressureResult(
        side="positive", dp_MPa=1.0, dead_zone_opening=0.5, dead_zone_closing=0.5, residual_opening=0.1,
        residual_closing=0.1, reading_flow_L_min=0.6, reading_opening_without=0.5, reading_closing_without=0.5,
        reading_opening=0.1, reading_closing=0.1, ideal_line=0.04, unseen_below_L_min=None, flow_miss=0.0,
        flow_miss_at=0.0, leak_L_min=0.0, allowed_at_zero_L_min=None, q_zero_L_min=0.0, q_zero_without_beta_L_min=0.0,
        q_max_direct_L_min=1.0, q_max_L_min=1.0,
    )  # fmt: skip
    runs = [replace(one, side=side, dp_MPa=1.0 + n) for side, count in sides.items() for n in range(count)]
    assert worst_of(runs, AS_COMPUTED) == said
