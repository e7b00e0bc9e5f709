"""The report of a lot: what it leads with, that hashes decide what it shows, and that it names what stands out."""

import csv
import io
import json
import re
import shutil
from dataclasses import astuple, replace
from urllib.parse import unquote

import numpy as np
import pytest

from dzdesign.batch.printing import print_lot
from dzdesign.batch.results import Results
from dzdesign.batch.summary import lot_budget
from dzdesign.codegen.project import target_named
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import sha256_of, to_json
from dzdesign.core.artefact_types import as_document
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED, CommandUnit, PressureUnit, RecordedUnits
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.report.lot.folder import read_lot
from dzdesign.report.lot.report import report_of_lot
from dzdesign.report.lot.sections import sections_of
from dzdesign.report.lot.spread import FAR, LEVELS, quantiles, spread_of
from dzdesign.report.lot.summary import LotSettingSummary, SmallestMargin, UntestedPressures
from dzdesign.report.lot.table import SIDE_COLUMNS, frame_of
from dzdesign.report.lot.words import lot_budget_lines, untested_lines
from tests.support.html_pages import HOSTILE, Page
from tests.support.many_valves import recordings, write_lot
from tests.support.schema_checks import overlooked, problems
from tests.support.synthetic_lots import lot_rows, with_figures, write_lot_folder

OPTIONS = ["--meter-lag", "0.1 s", "--target", "host", "--jobs", "1"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Six valves through the command, two of them broken."""
    folder = tmp_path_factory.mktemp("lot report")
    write_lot(folder / "lot", 6, 2, 7)
    assert main(["batch", str(folder / "lot"), "-o", str(folder / "out"), *OPTIONS]) == 1
    return folder / "out"


@pytest.fixture
def copied(made, tmp_path):
    return shutil.copytree(made, tmp_path / "out")


@pytest.fixture
def on_paper(tmp_path):
    def write(rows, **options):
        return write_lot_folder(tmp_path / "paper", rows, **options)

    return write


def downloads(html: str) -> dict[str, str]:
    links = {each["download"]: each["href"] for each in Page(html).of("a") if "download" in each}
    return {name: unquote(link.removeprefix("data:text/csv;charset=utf-8,")) for name, link in links.items()}


def head(html: str) -> str:
    return html[: html.index('<section id="failed">')]


# --- what the command leaves -----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_batch_writes_the_report_and_it_leads_with_the_verdict(made):
    html = (made / "report.html").read_text(encoding="utf-8")
    document = json.loads((made / "batch.json").read_bytes())
    top = head(html)
    assert "4 of 6 valves calibrated, 2 NOT" in top and "2 failed: V0001, V0004" in top
    assert "SIMULATED recordings, not of measured valves: V0000" in top
    assert document["warnings"]["simulated"] == [f"V000{at}" for at in (0, 2, 3, 5)]
    for column in ("dead_zone_opening_percent", "dead_zone_closing_percent", "lot_extra_dead_zone_percent"):
        at = document["quantiles"][column]
        assert f"{at['median']:.2f} %" in top and f"all from {at['least']:.2f} to {at['largest']:.2f} %" in top
    ids = [attributes["id"] for _, attributes in Page(html).tags if "id" in attributes]
    assert re.findall(r'<section id="(\w+)">', html) == [
        "failed", "spread", "far", "left", "setting", "valves", "recordings", "warnings", "provenance",
    ]  # fmt: skip
    assert len(ids) == len(set(ids))
    assert {link["href"][1:] for link in Page(html).of("a") if link["href"].startswith("#")} <= set(ids)
    text = " ".join(Page(html).text.split())
    assert "valve 'V0001' has no recording" in text and "expected files such as ramp_1MPa.csv" in text
    assert report_of_lot(made).html == html  # same input, same bytes
    hashes = [document["files"]["valves.csv"], document["lot_setting"]["sha256"]]
    assert all(digest in html for digest in (*hashes, sha256_of((made / "batch.json").read_bytes())))


def test_a_table_too_large_for_a_page_is_one_sentence_and_leaves_no_page_of_an_earlier_run(
    made, tmp_path, monkeypatch, capsys, wording
):
    out = shutil.copytree(made, tmp_path / "out")
    size = (out / "valves.csv").stat().st_size
    monkeypatch.setattr("dzdesign.report.lot.folder.MOST_TABLE", size - 1)
    assert main(["batch", str(made.parent / "lot"), "-o", str(out), *OPTIONS]) == 1  # of the valves, not of the page
    said = capsys.readouterr()
    (line,) = [line for line in said.err.splitlines() if "no report.html" in line]
    assert "too large for one page; read the table itself, or calibrate the lot in parts" in line
    assert not (out / "report.html").exists() and "to be read" not in said.out
    assert main(["report", str(out)]) == 2
    wording.of_test(capsys.readouterr().err)
    monkeypatch.setattr("dzdesign.report.lot.folder.MOST_TABLE", size)
    assert main(["report", str(out)]) == 1 and (out / "report.html").exists()


@pytest.mark.slow
def test_what_is_odd_is_in_the_verdict_and_all_of_it_below(copied, tmp_path, wording):
    document = json.loads((copied / "batch.json").read_bytes())
    assert document["anomalies"] == [] and "odd:" not in head(report_of_lot(copied).html)
    document["anomalies"] = [f"V{at}, <b>V{at + 1}</b> share a recording" for at in range(5)]
    (copied / "batch.json").write_text(json.dumps(document))
    html = report_of_lot(copied).html
    assert head(html).count("share a recording") == 3 and "odd: 2 more" in head(html)
    assert html.count("share a recording.") == 5 and "<b>V1</b>" not in html
    document["anomalies"] = "two"
    (copied / "batch.json").write_text(json.dumps(document))
    with wording.refusal(InputError):
        report_of_lot(copied)


def test_batch_json_fits_its_schema_and_every_fault_in_it_is_seen(made):
    document = json.loads((made / "batch.json").read_bytes())
    assert problems("batch", document) == []
    assert overlooked("batch", document) == []
    for key in document:
        assert problems("batch", {name: value for name, value in document.items() if name != key}), key
    setting = document["lot_setting"]
    assert setting["without_binding"]["left_out"]
    for key in setting:
        lacking = {name: value for name, value in setting.items() if name != key}
        assert problems("batch", {**document, "lot_setting": lacking}), key
    assert problems("batch", {**document, "lot_setting": {**setting, "without_binding": None}}) == []


@pytest.mark.parametrize(
    "change",
    [
        {"calibrated": 5},
        {"valves": 1},
        {"why_no_lot_setting": "both"},
        {"lot_setting": None},
        {"quantiles": {"offset_V": {"least": 1.0}}},
        {"calibrated": 6, "failed": []},
    ],
)
def test_a_batch_json_that_contradicts_itself_is_refused(change, copied, wording):
    document = json.loads((copied / "batch.json").read_bytes())
    (copied / "batch.json").write_text(to_json({**document, **change}))
    with wording.refusal(InputError):
        report_of_lot(copied)


@pytest.mark.slow
def test_one_valve_of_the_lot_has_its_own_report_and_one_without_calibration_its_reason(made, tmp_path, capsys):
    assert "dzdesign report valves/NAME" in (made / "report.html").read_text(encoding="utf-8")
    page = tmp_path / "one.html"
    assert main(["report", str(made / "valves" / "V0002"), "-o", str(page)]) == 1  # not verified
    html = page.read_text(encoding="utf-8")
    for name in ("valve.json", "compensator.json", "firmware/manifest.json"):
        assert sha256_of((made / "valves" / "V0002" / name).read_bytes()) in html
    assert main(["report", str(made / "valves" / "V0001"), "-o", str(page)]) == 2
    assert "was not calibrated: valve 'V0001' has no recording" in capsys.readouterr().err


def test_the_tables_in_the_page_are_the_files(made):
    tables = downloads((made / "report.html").read_text(encoding="utf-8"))
    assert tables["valves.csv"] == (made / "valves.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(io.StringIO(tables["valves.csv"])))
    shown = list(csv.DictReader(io.StringIO(tables["thresholds.csv"])))
    opening = {row["valve"]: row["value"] for row in shown if row["quantity"] == "knee_opening_V"}
    assert opening == {row["name"]: row["knee_opening_V"] for row in rows if row["status"] == "ok"}
    assert {"law.csv", "left.csv", "lot-setting.csv", "spread.csv", "not-calibrated.csv"} <= set(tables)


# --- files that do not fit -------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("valves.csv", "valves.csv' was changed since `dzdesign batch` wrote it"),
        ("valves.parquet", "valves.parquet' was changed since"),
        ("lot_compensator.json", "lot_compensator.json' was changed since"),
        ("valves/V0002/valve.json", "V0002/valve.json"),
        ("valves/V0002/firmware/core/dz_comp.c", "V0002/firmware: changed or missing: core/dz_comp.c"),
        ("valves/V0003/firmware/manifest.json", "V0003/firmware/manifest.json"),
    ],
)
def test_of_a_lot_that_was_changed_there_is_no_report(copied, name, said):
    content = (copied / name).read_bytes()
    is_json = name.endswith(".json")  # of which spacing is no content
    (copied / name).write_bytes(content.replace(b"{", b'{"added": 0, ', 1) if is_json else content + b"\n")
    with pytest.raises(InputError, match=re.escape(said)):
        report_of_lot(copied)


def test_files_that_are_gone_are_missing(copied):
    shutil.rmtree(copied / "valves")
    (copied / "lot_compensator.json").unlink()
    report = report_of_lot(copied)
    assert "4 of 6 valves" in report.verdict
    assert [line.partition(":")[0] for line in report.missing] == [
        "lot_compensator.json", "the folders of the valves", "the evidence of each valve"
    ]  # fmt: skip
    (copied / "valves.csv").unlink()
    assert "the table is not here" in report_of_lot(copied).verdict


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("5.", "wide", 1),
        lambda text: text.replace("1.0,", "nan,", 1),
        lambda text: text.replace("1.0,", "1e300,", 1),
        lambda text: text.replace("offset_V", "ofset_V", 1),
        lambda text: text + "V9,ok\n",
        lambda text: text.partition("\n")[0] + "\n",
        lambda text: "",
        lambda text: text.replace(",ok,", ",fine,", 1),
        lambda text: text.replace("ok", "\ud800"),
    ],
)
def test_a_table_that_is_none_is_named(change, copied, capsys, wording):
    text = change((copied / "valves.csv").read_text(encoding="utf-8"))
    content = text.encode(errors="surrogatepass")
    (copied / "valves.csv").write_bytes(content)
    document = json.loads((copied / "batch.json").read_bytes())
    document["files"]["valves.csv"] = sha256_of(content)
    (copied / "batch.json").write_text(to_json(document))
    with wording.refusal(InputError):
        report_of_lot(copied)
    assert main(["report", str(copied)]) == 2 and "Traceback" not in capsys.readouterr().err




# --- lots of every kind ----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_good_is_only_a_lot_that_is_calibrated_and_verified(on_paper):
    report = report_of_lot(on_paper(lot_rows(8), verified=True))
    assert (report.kind, report.holds) == ("good", True)
    report = report_of_lot(on_paper(lot_rows(8)))
    assert (report.kind, report.holds) == ("open", None) and "NOT VERIFIED" in report.verdict
    rows = lot_rows(8)
    rows[3] |= {"status": "does not hold", "reason": "no flow at zero command: 0.2 L/min at 1 MPa"}
    report = report_of_lot(on_paper(rows, verified=True))
    assert (report.kind, report.holds) == ("bad", False) and "1 does not hold: V0003" in head(report.html)


def test_a_bipolar_lot_shows_both_sides(on_paper):
    rows = lot_rows(12, bipolar=True)
    rows[4] = with_figures(rows[4], "negative", **dict.fromkeys(SIDE_COLUMNS))
    html = report_of_lot(on_paper(rows)).html
    names = ("thresholds", "law", "left")
    assert all(f'id="figure-{name}-{side}"' in html for name in names for side in ("positive", "negative"))
    assert "Negative commands: dP0 is 1 MPa" in html
    table = csv.DictReader(io.StringIO(downloads(html)["spread.csv"]))
    assert {row["quantity"]: row["valves"] for row in table}["negative_offset_V"] == "11"


def mirrored(content: bytes) -> bytes:
    """Return a ramp file of the other sign: command and flow are negative."""
    table = [line.split(b",") for line in content.splitlines()]
    turned = [
        line if line[0][:1] in b"#t" else [line[0], b"-" + line[1], line[2], b"-" + line[3].lstrip(b"-")]
        for line in table
    ]
    return b"\n".join(b",".join(line) for line in turned) + b"\n"


@pytest.mark.slow
def test_bipolar_valves_through_the_command(tmp_path, capsys):
    for number in range(2):
        folder = tmp_path / "lot" / f"V{number}"
        folder.mkdir(parents=True)
        for name, content in recordings(number, 7).items():
            (folder / name).write_bytes(content)
            (folder / f"negative_{name}").write_bytes(mirrored(content))
    signal = ["--command-signal", "-10..10 V x 0.15 + 1.5 V"]
    assert main(["batch", str(tmp_path / "lot"), "-o", str(tmp_path / "out"), *OPTIONS, *signal]) == 0
    html = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "2 of 2 valves calibrated" in head(html) and "Negative side: it leaves" in html
    assert 'id="figure-lot-setting"' in html and 'id="figure-left-negative"' in html
    assert "positive: all from " in head(html) and "negative: all from " in head(html)


# --- what stands out -------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_valve_far_from_the_rest_is_named_and_no_other(on_paper):
    rows = lot_rows(60, seed=5)
    rows[7] = with_figures(rows[7], offset_V=4.2)
    html = report_of_lot(on_paper(rows)).html
    (found,) = csv.DictReader(io.StringIO(downloads(html)["far-from-the-rest.csv"]))
    assert (found["valve"], found["quantity"]) == ("V0007", "offset_V") and float(found["robust_sd_from_median"]) < -FAR
    assert ">V0007</text>" in html  # in the figure too
    assert "1 beyond 3.5 robust s.d." in head(html)
    html = report_of_lot(on_paper(lot_rows(60, seed=5))).html
    assert "far-from-the-rest.csv" not in html and "No valve lies there." in html


def test_of_forty_valves_nine_may_be_anywhere():
    """Mean and standard deviation would hide them, median and MAD do not."""
    rows = lot_rows(40)
    rows[:9] = (with_figures(row, knee_opening_V=9.0) for row in rows[:9])
    spread = spread_of(frame_of(rows), "knee_opening_V", "")
    assert {name for name, _ in spread.far()} == {row["name"] for row in rows[:9]}
    assert 0.06 < spread.deviation < 0.3  # of the others: 0.12


def test_reasons_of_one_kind_stand_together(on_paper):
    rows = lot_rows(20, failed=range(2, 20, 2))
    rows[3] |= {"status": "failed", "reason": "unexpected ZeroDivisionError: of ours"}
    rows[5] |= {"status": "does not hold", "reason": "every input: 7 wrong; see there"}
    rows[7] |= {"status": "failed", "reason": "'a.csv' has 13 complete rows, expected at least 20 of a ramp test"}
    (table,) = sections_of(read_lot(on_paper(rows)), ())["failed"].tables
    found = [[cell.text for cell in row[1:4]] for row in table.rows]
    assert found[0] == ["9", "'ramp_dP1.csv' row …, column 'u_V': 'overload' is not a number",
                        "correct it, or leave the cell blank"]  # fmt: skip
    assert "V0004 (4)" in table.rows[0][-1].text
    assert found[1][2].startswith("a fault of dzdesign") and found[2][1] == "every input: 7 wrong; see there"
    assert found[3][1:] == ["'a.csv' has 13 complete rows", "expected at least 20 of a ramp test"]


@pytest.mark.parametrize(
    ("rows", "kind", "said"),
    [
        (lot_rows(5, failed=range(5)), "bad", "NONE of 5 valves calibrated"),
        (lot_rows(1), "open", "1 of 1 valves calibrated"),
    ],
)
def test_lots_of_failures_and_of_one_valve(on_paper, rows, kind, said):
    report = report_of_lot(on_paper(rows))
    assert report.kind == kind and report.verdict.startswith(said) and "There is no lot setting" in report.html
    assert report.html.count("<figure") == (3 if kind == "open" else 0)


def test_a_batch_that_was_stopped_has_no_report_and_names_its_command(copied, capsys, wording):
    Results(copied).begin(["V0001"])
    assert main(["report", str(copied)]) == 2
    wording.of_test(capsys.readouterr().err)


def test_a_name_that_is_a_way_out_is_said_and_not_followed(on_paper, tmp_path):
    rows = lot_rows(9)
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret" / "valve.json").write_text("{}")
    rows[0] |= {"name": "../../secret", "valve_json_sha256": sha256_of(b"{}")}
    folder = on_paper(rows)
    (folder / "valves").mkdir()
    with pytest.raises(InputError, match=r"\.\./\.\./secret"):
        read_lot(folder)


# --- the lot setting in words -----------------------------------------------------------------------------------------


def setting_with(untested, dp_MPa, dp_without_MPa=None):
    """Return a lot setting in which a valve lacks a pressure drop."""
    return LotSettingSummary(
        file="lot_compensator.json", sha256="0" * 64, dp_MPa=dp_MPa, untested=(untested,),
        dp_without_MPa=dp_without_MPa, carrier="V1", binding=("V8",), smallest_margin_V={}, without_binding=None,
        checked=SmallestMargin(valves=3, worst="V8", dp_MPa=1.0, smallest_margin_V=0.0),
    )  # fmt: skip


V8 = UntestedPressures(name="V8", side="positive", dp_MPa=(2.0,), narrows=False, coarser_V=0.034, cost_percent=0.74)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"narrows": True}, "holds for all from 1 to 4 MPa; record what is missing"),
        ({}, "about 34 mV under what a test would show, and V8 holds the lot setting down: that may cost each valve "
             "up to 0.74 % of command"),
        ({"cost_percent": 0.0}, "which costs nothing"),
        ({"cost_percent": 0.0, "coarser_V": 0.0}, "that costs the lot setting nothing"),
    ],
)  # fmt: skip
def test_what_lacks_between_two_tests_is_said_with_its_cost(change, said):
    (line,) = untested_lines(setting_with(replace(V8, **change), (1.0003, 4.0)), AS_COMPUTED)
    assert line.startswith("V8 was not tested at 2 MPa, as the lot was: ") and said in line
    assert ("holds for all" in line) == bool(change.get("narrows"))


# --- hostile text ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_nobodys_text_becomes_markup(on_paper):
    """A table and a batch.json of somebody's making: their hashes fit."""
    rows = lot_rows(20, failed=(3, 4))
    clean = Page(report_of_lot(on_paper(rows)).html)
    for place, name in enumerate(HOSTILE):
        of = {"name": name + "x" * 300 * (place == 2), "warnings": "<b>x</b> no-saturation"}
        rows[10 + place] = {**with_figures(rows[10 + place], offset_V=1.0 + place / 10), **of}
    rows[3] |= {"name": HOSTILE[0] + "y", "reason": " ".join(HOSTILE)}
    html = report_of_lot(on_paper(rows)).html
    page = Page(html)
    kinds = {tag for tag, _ in page.tags}
    drawn = {"g", "defs", "use", "text", "path", "rect", "clippath", "td", "span", "wbr"}
    assert kinds <= {tag for tag, _ in clean.tags} | drawn
    assert not [key for _, attributes in page.tags for key in attributes if key.startswith("on")]
    assert "<script" not in html and "<img" not in html
    outside = [
        value
        for _, attributes in page.tags
        for key, value in attributes.items()
        if key in ("src", "href", "xlink:href", "action") and not value.startswith(("#", "data:"))
    ]
    assert outside == []
    assert HOSTILE[0] in page.text


@pytest.mark.slow
@pytest.mark.parametrize(("count", "few"), [(2, True), (10, True), (11, False), (60, False)])
def test_of_few_valves_each_dot_has_its_name_and_of_many_there_are_bars(count, few, tmp_path):
    html = report_of_lot(write_lot_folder(tmp_path / "lot", lot_rows(count))).html
    figure = re.search('id="figure-thresholds".*?</figure>', html, re.DOTALL)[0]
    assert (">valves</text>" not in figure) is few  # the axis that counts them
    assert (">V0001</text>" in figure) is few
    assert ("5 and 95 %" in figure) is (count >= 20)
    assert ("at one in twenty" in html or "5 to 95 % of the valves" in html) is (count >= 20)


def test_the_median_of_an_even_lot_is_the_mean_of_the_two_middle_ones():
    assert quantiles([4.0, 1.0, 2.0, 9.0]).median == 3.0 and quantiles([4.0, 1.0, 2.0]).median == 2.0
    values = list(np.random.default_rng(5).normal(5, 1, 61).round(7))
    for count in range(1, len(values)):
        at = quantiles(values[:count])
        assert (at.least, at.largest) == (min(values[:count]), max(values[:count]))  # of valves, that can be named
        np.testing.assert_allclose(astuple(at), np.quantile(values[:count], LEVELS), atol=1e-7)


# --- units of the recordings -----------------------------------------------------------------------------------


def test_a_lot_is_shown_in_the_units_of_its_recordings(tmp_path, capsys):
    """Files stay in V; thresholds, their spread and what was tested are in mA and bar, the page and the terminal."""
    units = RecordedUnits(
        command=CommandUnit(unit="mA", at_zero=4.0, factor=1.6), pressure=PressureUnit(unit="bar", factor=10.0)
    )
    rows = lot_rows(20)
    folder = write_lot_folder(tmp_path / "lot", rows)
    document = json.loads((folder / "batch.json").read_text(encoding="utf-8"))
    assert document["recorded_units"]["command"]["unit"] == "V"
    document["recorded_units"] = as_document(units)
    (folder / "batch.json").write_text(json.dumps(document), encoding="utf-8")
    lot = read_lot(folder)
    spread = spread_of(lot.calibrated, "knee_opening_V", "", lot.units)
    assert spread.text(5.0) == "12.000" and spread.heading == "knee on opening (mA)"
    assert spread.shown().at.median == pytest.approx(4 + 1.6 * spread.at.median)
    assert spread.shown().deviation == pytest.approx(1.6 * spread.deviation)
    html = report_of_lot(folder).html
    text = " ".join(Page(html).text.split())
    assert "knee on opening (mA)" in text and f"{4 + 1.6 * spread.at.median:.3f}" in text and "dP0 is 10 bar" in text
    assert not re.search(r"\(V\)| MPa\b", re.sub(r"<svg.*?</svg>|data:[^\"']*", "", html, flags=re.DOTALL))
    print_lot(lot.summary, folder, None)
    printed = capsys.readouterr().out
    assert "knee opening (mA)" in printed and f"{4 + 1.6 * spread.at.median:.3f}" in printed
    assert f",{rows[0]['knee_opening_V']}," in lot.text


# --- the budgets of its valves as one ---


def designed(valve, **texts):
    return design(valve, options_of(texts, target_named("f28335").inputs()))


@pytest.fixture(scope="module")
def designs(example_valve):
    return {
        "a": designed(example_valve, amplifier="1 %"),
        "b": designed(example_valve, amplifier="3 %", ageing="0.1 %"),
    }


def test_a_line_has_the_least_the_median_and_the_largest_of_all_valves(designs):
    budget = lot_budget(designs)
    lines = {line.component: line for line in budget.lines}
    for component, line in lines.items():
        every = (one for each in designs.values() for one in each.positive.budget.lines)
        of_valves = [one for one in every if one.component == component]
        prices = [100 * one.price for one in of_valves]
        assert line.price_percent == pytest.approx((min(prices), sum(prices) / 2, max(prices)), abs=1e-5)
        assert line.contribution_mV == pytest.approx(max(max(one.contribution_mV) for one in of_valves), abs=1e-4)
    assert lines["ageing"].origin == ("default", "declared")
    assert lines["amplifier"].price_percent[2] > 2 * lines["amplifier"].price_percent[0]


def test_a_lot_without_a_machine_says_so_and_a_mixed_one_says_both(designs, example_compensator):
    bare = lot_budget({"a": example_compensator})
    assert "no machine was declared" in lot_budget_lines(bare)[0]
    (line,) = lot_budget_lines(lot_budget(designs))
    assert line == "The certificates cover the valve as recorded and the declared machine."
    mixed = lot_budget({**designs, "c": example_compensator})
    assert len(mixed.certified_of) == 2 and "of some valves" in lot_budget_lines(mixed)[0]
    assert lot_budget({}) is None and lot_budget_lines(None) == ()
