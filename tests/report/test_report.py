"""report.html: what it leads with, where its files come from, and that nobody's text becomes markup."""

import json
import re
import shutil
from dataclasses import asdict, replace
from pathlib import Path
from urllib.parse import unquote

import pytest

from dzdesign.assess.assessment import (
    Assessment,
    BeforeAfter,
    MeterTaken,
    PressureAssessment,
    RampSet,
    Recording,
    Request,
)
from dzdesign.assess.limits import LimitResult
from dzdesign.assess.quantities import Quantity, Reading
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import MANIFEST_NAME, sha256_of, to_json
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import THIS_TOOL, to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.design.designing import design
from dzdesign.identify.identification import identify
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.artefact_chain import chain_of
from dzdesign.report.artefact_folder import read_artefact_folder
from dzdesign.report.figures.figure import PALETTE, csv_text
from dzdesign.report.reproduction import Outcome, PaperNumber, Reproduction
from dzdesign.report.sections.cells import whole
from dzdesign.report.summary import headline, worst_of
from dzdesign.report.valve_report import REPORT_NAME, report_of_folder
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.loop_results import PressureResult
from dzdesign.verify.requirements import AS_STATED
from tests.support.html_pages import HOSTILE, Page
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


def change_json(path: Path, change) -> bytes:
    document = json.loads(path.read_bytes())
    change(document)
    content = to_json(document).encode()
    path.write_bytes(content)
    return content


def change_evidence(folder: Path, change) -> None:
    """Change verification.json as if `verify` had found it so: the folder's manifest fits."""
    content = change_json(folder / "evidence" / "verification.json", change)
    change_json(
        folder / "evidence" / MANIFEST_NAME,
        lambda manifest: manifest["files"].update({"verification.json": sha256_of(content)}),
    )


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


def test_a_figure_of_a_good_report_shows_no_over_compensation(html):
    assert "requirements that were checked hold" in html and "OVER-COMPENSATED" not in html
    assert "red and hatched where not (0 codes)" in html


def test_figures_take_their_colours_from_the_page(html):
    drawings = re.findall(r'<svg class="drawing".*?</svg>', html, re.DOTALL)
    assert len(drawings) == 10
    light = {shade for shade, _ in PALETTE.values()}
    for drawing in drawings:
        assert not {shade for shade in light if shade in drawing}
        assert "var(--fig-ink)" in drawing and 'aria-label="' in drawing
    assert html.count("--fig-ink: ") == 2  # light and dark


@pytest.mark.slow
def test_same_input_same_bytes_whichever_folder_is_named(reported_demo, html, copied):
    assert report_of_folder(copied).html == html
    chain = chain_of(read_artefact_folder(copied))
    for folder in (reported_demo, reported_demo / "evidence", reported_demo / "firmware"):
        assert chain_of(read_artefact_folder(folder)) == chain


@pytest.mark.slow
def test_report_makes_the_page_again_and_the_folder_still_fits(copied, capsys):
    page = copied / "evidence" / REPORT_NAME
    before = page.read_bytes()
    assert main(["report", str(copied / "evidence")]) == 0
    assert page.read_bytes() == before
    (copied / "assessment.json").write_text("{}")  # no artefact: not looked at
    change_evidence(copied, lambda evidence: evidence["checks"][0].update(text="17 files, seen again"))
    assert main(["report", str(copied)]) == 0
    assert "seen again" in page.read_text(encoding="utf-8")
    listed = json.loads((copied / "evidence" / MANIFEST_NAME).read_bytes())["files"]
    assert listed[REPORT_NAME] == sha256_of(page.read_bytes())
    assert main(["report", str(copied), "-o", str(copied / "other.html"), "--json"]) == 0
    out = capsys.readouterr().out
    assert json.loads(out[out.index("{") :])["holds"] is True
    assert (copied / "other.html").read_bytes() == page.read_bytes()


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
def test_a_missed_limit_of_recordings_does_not_hold(copied):
    valve = read_artefact((copied / "valve.json").read_bytes(), ValveModel, "valve.json")
    after = Reading(value=4.5, se=None, at_most=None, not_observable=None, note=None, where=None)
    ramps = RampSet(source="ramp.csv", ramps=("ramp.csv 1",), dp_MPa=1.0)
    assessment = Assessment(
        tool=THIS_TOOL,
        made_from=tuple(Recording(source=each.source, sha256=each.sha256, set="before") for each in valve.made_from),
        options=Request(
            u_max_V=10.0, after_u_max_V=10.0, knee_window=(0.1, 0.5), linearity_window=(0.1, 0.9),
            reading_flow_L_min=None, reading_share=0.01, same_pressure_within=0.05,
        ),
        meter=MeterTaken(floor_L_min=0.1, lag_s=0.0, lag_is="unknown"),
        quantities={"hysteresis": Quantity(name="hysteresis", unit="%", formula="f")},
        pressures=(
            PressureAssessment(
                side="positive", dp_MPa=1.0, reading_flow_L_min=0.1, rated_flow_L_min=15.0, before=ramps, after=ramps,
                quantities={"hysteresis": BeforeAfter(before=None, after=after, change=None)},
            ),
        ),
        limits=(
            LimitResult(
                quantity="hysteresis", place="1 MPa", limit=4.0, unit="%", holds=False, text="4.5 %, more than 4 %"
            ),
        ),
        notes=(),
    )  # fmt: skip
    (copied / "assessment.json").write_bytes(to_json_bytes(assessment))
    report = report_of_folder(copied)
    assert report.kind == "bad" and "4.5 %, more than 4 %" in report.html
    assert "hysteresis</td><td class=\"number\">–</td><td class=\"number\">4.50</td>" in report.html
    other = replace(assessment, made_from=(Recording(source="other.csv", sha256="0" * 64, set="before"),))
    (copied / "assessment.json").write_bytes(to_json_bytes(other))
    report = report_of_folder(copied)  # of another valve that lies about: said, not shown, and no fault of this one
    assert any("compares others, so it is not shown" in line for line in report.missing)
    assert report.kind == "good" and "4.5 %, more than 4 %" not in report.html


@pytest.mark.slow
def test_evidence_without_its_manifest_is_said(copied):
    (copied / "evidence" / MANIFEST_NAME).unlink()
    assert any("nothing tells whether that is as written" in line for line in report_of_folder(copied).missing)


@pytest.mark.slow
def test_a_valve_that_was_edited_within_the_compensator_is_found(copied):
    """The hash that it states is the genuine one's."""

    def higher(compensator):
        for test in compensator["valve"]["sides"]["positive"]["tests"]:
            test["q_max_L_min"] *= 2

    content = change_json(copied / "compensator.json", higher)
    (copied / "firmware" / "compensator.json").write_bytes(content)
    manifest = change_json(
        copied / "firmware" / MANIFEST_NAME,
        lambda each: (each["origin"].update(compensator_json=sha256_of(content)),
                      each["files"].update({"compensator.json": sha256_of(content)})),
    )  # fmt: skip
    change_evidence(copied, lambda each: each["made_from"][0].update(sha256=sha256_of(manifest)))
    report = report_of_folder(copied)
    said = "'valve_sha256' is"
    assert any(said in fault for fault in report.faults), (report.faults, report.missing)
    assert report.kind == "bad"


@pytest.mark.slow
def test_a_compensator_that_was_edited_by_hand_is_found(copied):
    """With every hash of the chain made to fit."""
    content = change_json(copied / "compensator.json", lambda one: one["sides"]["positive"].update(
        drive_range_over_u_max=[3, 5]))  # fmt: skip
    (copied / "firmware" / "compensator.json").write_bytes(content)
    manifest = change_json(
        copied / "firmware" / MANIFEST_NAME,
        lambda each: (each["origin"].update(compensator_json=sha256_of(content)),
                      each["files"].update({"compensator.json": sha256_of(content)})),
    )  # fmt: skip
    change_evidence(copied, lambda each: each["made_from"][0].update(sha256=sha256_of(manifest)))
    report = report_of_folder(copied)
    assert report.kind == "bad"
    assert any("'sides.positive.drive_range_over_u_max' is 0.600000, but" in fault for fault in report.faults)


@pytest.mark.slow
def test_of_a_firmware_its_own_evidence_is_taken(copied):
    """Two firmware folders side by side, each with its evidence: the one that was named decides."""
    chain = chain_of(read_artefact_folder(copied / "firmware"))
    for stage in ("firmware", "evidence"):
        shutil.copytree(copied / stage, copied / f"{stage}_b")
    manifest = change_json(copied / "firmware_b" / MANIFEST_NAME, lambda each: each.update(note="another"))
    digest = sha256_of(manifest)
    content = change_json(
        copied / "evidence_b" / "verification.json", lambda each: each["made_from"][0].update(sha256=digest)
    )
    change_json(
        copied / "evidence_b" / MANIFEST_NAME,
        lambda each: each["files"].update({"verification.json": sha256_of(content)}),
    )
    assert chain_of(read_artefact_folder(copied / "firmware")) == chain
    other = chain_of(read_artefact_folder(copied / "firmware_b"))
    assert other.places["evidence"].name == "evidence_b/verification.json"
    assert other.places["firmware"].sha256 == digest and not other.faults


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
        removed = "the drive follows its model"
        evidence["checks"] = [one for one in evidence["checks"] if one["name"] != removed]
        evidence["holds"] = False  # for that one
        evidence["tool"]["version"] = "0.0.9"  # which had words of its own

    change_evidence(copied, with_plant)
    html = report_of_folder(copied).html
    said = html[html.index('class="verdict open"') : html.index('<dl class="numbers">')]
    assert "machine&#39;s own" not in said and "machine code" not in said and "the drive follows its model" in said
    assert f"SHA-256 {'5' * 64}" in html and "m_e_kg" in html[html.index('id="loop"') :]


@pytest.mark.slow
def test_the_plant_of_the_tests_stands_in_the_closed_loop(copied):
    html = report_of_folder(copied).html
    loop = html[html.index('<section id="loop"') : html.index('<section id="thresholds"')]
    assert "its coil and spool; the flow is the recorded one" in loop and "m_e_kg" in loop and "preload_N" not in loop
    assert "below 0.65" in loop and "an ideal line rises straight from zero command" in loop


@pytest.mark.slow
def test_the_papers_numbers_are_shown_where_they_lie(copied):
    ours = Outcome(by="product", value=54.1, difference=0.2, allowed=(53.8, 54.0))
    row = PaperNumber(
        valve="first valve", quantity="dead zone", unit="%", dp_MPa=1.0, published="53.9", kind="predicted",
        outcomes=(ours,), tolerance="0.1", why="because",
    )  # fmt: skip
    paper = Reproduction(tool=THIS_TOOL, made_from=(), paper="10.1/x", assumptions=(), numbers=(row,), valves=())
    folder = copied / "paper"
    folder.mkdir()
    content = to_json_bytes(paper)
    (folder / "reproduction.json").write_bytes(content)
    # As `reproduce -o` writes it: of the same schema, and before it in the alphabet.
    manifest = {"schema": paper.schema, "tool": asdict(THIS_TOOL), "files": {"reproduction.json": sha256_of(content)}}
    (folder / MANIFEST_NAME).write_text(to_json(manifest))
    html = report_of_folder(copied).html
    assert "lacks the key" not in html
    assert "54.10 (+0.20)" in html and "The paper&#39;s first valve" in html
    assert html.count('<td class="bad">✗ DOES NOT HOLD</td>') == 1


# --- files that do not fit ----------------------------------------------------------------------------------------


def spoil(path: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b"5", b"6", 1))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("evidence/verification.json", "was changed since `dzdesign verify` wrote it"),
        ("evidence/closed_loop_positive.csv", "closed_loop_positive.csv was changed"),
        ("firmware/core/dz_comp.c", "firmware/core/dz_comp.c was changed since it was generated"),
        ("firmware/manifest.json", "but the evidence is of one of"),
    ],
)
def test_a_file_that_was_changed_is_said_and_no_verdict_stands(copied, name, said, wording):
    spoil(copied / name)
    chain = chain_of(read_artefact_folder(copied))
    assert any(said in fault for fault in chain.faults), chain.faults
    assert headline(chain).kind == "bad"
    wording("report: files of several chains", headline(chain).text)


@pytest.mark.slow
def test_a_page_of_files_that_do_not_fit_says_so_first(copied):
    spoil(copied / "firmware" / "core" / "dz_drive.c")
    assert main(["report", str(copied), "-o", str(copied / "r.html")]) == 1
    html = (copied / "r.html").read_text(encoding="utf-8")
    assert "THE FILES DO NOT BELONG TOGETHER" in html[: html.index('<dl class="numbers">')]
    assert "requirements that were checked hold" not in html


def test_artefacts_are_found_by_their_hash_and_not_by_their_name(copied):
    (copied / "valve.json").rename(copied / "bench_7.json")
    found = chain_of(read_artefact_folder(copied)).places["valve"]
    assert found.name == "bench_7.json"
    other = json.loads((copied / "bench_7.json").read_bytes())
    other["u_max_V"] = 11.0
    (copied / "bench_7.json").unlink()
    (copied / "valve.json").write_text(to_json(other))
    chain = chain_of(read_artefact_folder(copied))  # the compensator holds its valve; the file beside it is another
    assert chain.valve.u_max_V == 10.0
    assert [fault for fault in chain.faults if "valve.json has the SHA-256" in fault]


def test_a_manifest_reaches_no_file_outside_its_folder(copied, tmp_path):
    (tmp_path / "secret.txt").write_text("secret")
    outside = {"../../secret.txt": "0", str(tmp_path / "secret.txt"): "0"}
    change_json(copied / "firmware" / MANIFEST_NAME, lambda manifest: manifest["files"].update(outside))
    assert not [name for name in read_artefact_folder(copied) if "secret" in name]


# --- parts of a chain ------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_valve_alone_is_reported_and_what_is_missing_said(copied, tmp_path):
    folder = tmp_path / "valve only"
    folder.mkdir()
    shutil.copy(copied / "valve.json", folder)
    report = report_of_folder(folder)
    assert report.kind == "open" and "only an identified valve" in report.verdict
    assert [line.partition(":")[0] for line in report.missing] == ["evidence", "firmware", "compensator"]
    assert report.html.count("<figure") == 4
    shutil.copy(copied / "compensator.json", folder)
    report = report_of_folder(folder)
    assert report.html.count("<figure") == 6 and "only a design" in report.verdict
    assert main(["report", str(folder)]) == 1
    assert (folder / REPORT_NAME).read_text(encoding="utf-8") == report.html


def test_evidence_alone_shows_its_figures_and_misses_the_rest(copied, tmp_path):
    alone = tmp_path / "elsewhere" / "evidence"
    shutil.copytree(copied / "evidence", alone)
    report = report_of_folder(alone)
    assert any(line.startswith("firmware of SHA-256") for line in report.missing)
    assert report.kind == "good"  # all that the evidence says, and it fits its manifest
    assert "missing or not used" in report.html


@pytest.mark.slow
def test_evidence_of_an_earlier_version_without_curves(copied):
    for path in (copied / "evidence").glob("*.csv"):
        path.unlink()
    html = report_of_folder(copied).html
    assert "closed_loop_positive.csv is missing" in html and html.count("<figure") == 7


def test_a_neighbour_that_can_not_be_read_does_not_hinder_the_rest(copied):
    (copied / "assessment.json").write_text('{"schema": "dzdesign.assessment/1", "holds": 3}')
    chain = chain_of(read_artefact_folder(copied))
    assert headline(chain).kind == "good"
    assert [line for line in chain.missing if "assessment of recordings: 'assessment.json'" in line]


@pytest.mark.slow
def test_of_two_pieces_of_evidence_one_must_be_named(copied, wording):
    chain = chain_of(read_artefact_folder(copied))
    shutil.copytree(copied / "evidence", copied / "evidence of May")
    with wording.refusal(InputError):
        report_of_folder(copied)
    assert chain_of(read_artefact_folder(copied / "evidence")) == chain


def test_a_folder_without_artefacts_is_refused(tmp_path, wording):
    with wording.refusal(InputError):
        report_of_folder(tmp_path)
    with wording.refusal(InputError):
        report_of_folder(tmp_path / "missing")
    assert main(["report", str(tmp_path)]) == 2
    (tmp_path / "valve.json").write_text('{"schema": "dzdesign.valve/1"}')
    assert main(["report", str(tmp_path)]) == 2
    assert not (tmp_path / REPORT_NAME).exists()


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
    valve = Page(report_of_folder(folder).html)
    for dirty, before in ((page, clean), (valve, clean_valve)):
        words, expected = ([tag for tag, given in each.tags if not is_of_the_number_of_texts(tag, given)] for each in (
            dirty, before,
        ))  # fmt: skip
        assert words == expected
        assert not [key for _, attributes in dirty.tags for key in attributes if key.startswith("on")]
        assert " ".join(name.split()) in " ".join(dirty.text.split())


def test_numbers_of_a_figure_are_a_table_whatever_stands_in_them():
    assert csv_text(("a", "b"), [[1, 'x"\n,'], [None, 2.5]]) == 'a,b\n1,"x""\n,"\n,2.5\n'


def test_the_headline_is_good_only_if_all_was_checked(copied):
    assert headline(chain_of(read_artefact_folder(copied))).kind == "good"
    change_evidence(copied, lambda evidence: evidence["checks"][0].update(holds=None) or evidence.update(holds=False))
    assert headline(chain_of(read_artefact_folder(copied))).kind == "open"


@pytest.mark.slow
def test_a_series_of_plants_is_shown(copied):
    spread = {"p01": 0.01, "p05": 0.011, "p50": 0.021, "p95": 0.033, "p99": 0.0345, "worst": 0.04, "worst_plant": {}}
    one = {
        "side": "positive", "dp_MPa": 1.0, "plants": 200, "leaking": 3,
        "residual_opening": spread, "residual_closing": spread, "q_zero_L_min": spread, "q_max_L_min": spread,
    }  # fmt: skip
    series = {"plants": 200, "seed": 1, "spreads": {}, "pressures": [one]}
    change_evidence(copied, lambda evidence: evidence.update(monte_carlo=series))
    html = report_of_folder(copied).html
    assert "2.10 (1.00 to 3.45)" in html and "3 of 200" in html


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
    (tmp_path / "compensator.json").write_bytes(to_json_bytes(design(one, None, valve_json)))
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
