"""The report of a lot: what it leads with, that hashes decide what it shows, and that it names what stands out."""

import csv
import io
import json
import re
import shutil
from dataclasses import astuple
from urllib.parse import unquote

import numpy as np
import polars
import pytest

from dzdesign.batch.printing import print_quantiles
from dzdesign.batch.valve_folders import Results
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import as_document
from dzdesign.core.documents import sha256_of, to_json
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED, CommandUnit, PressureUnit, RecordedUnits
from dzdesign.report.figure import figure_style
from dzdesign.report.lot.folder import read_lot
from dzdesign.report.lot.page import certified_lines, report_of_lot, untested_lines
from dzdesign.report.lot.spread import FAR, LEVELS, quantiles, spread_figure, spreads_of
from dzdesign.report.lot.summary import LotSettingSummary, SmallestMargin, UntestedPressures
from dzdesign.report.lot.table import SIDE_COLUMNS, frame_of
from tests.support.html_pages import HOSTILE, Page
from tests.support.many_valves import LOT_TOML, write_lot
from tests.support.schema_checks import overlooked, problems
from tests.support.synthetic_lots import lot_rows, with_figures, write_lot_folder

OPTIONS = ["--config", str(LOT_TOML), "--target", "host", "--jobs", "1"]


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
    return html[: html.index('<section id="spread">')]


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
    assert re.findall(r'<section id="(\w+)">', html) == ["spread", "setting", "valves", "warnings", "provenance"]
    assert len(ids) == len(set(ids))
    assert {link["href"][1:] for link in Page(html).of("a") if link["href"].startswith("#")} <= set(ids)
    text = " ".join(Page(html).text.split())
    assert "valve 'V0001' has no recording; expected files such as ramp_1MPa.csv" in text
    assert report_of_lot(made).html == html  # same input, same bytes
    hashes = [document["files"]["valves.csv"], document["lot_setting"]["sha256"]]
    assert all(digest in html for digest in (*hashes, sha256_of((made / "batch.json").read_bytes())))


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
    shown = list(csv.DictReader(io.StringIO(tables["spread.csv"])))
    opening = {row["valve"]: row["value"] for row in shown if row["quantity"] == "knee_opening_V"}
    assert opening == {row["name"]: row["knee_opening_V"] for row in rows if row["status"] == "ok"}
    assert set(tables) == {"spread.csv", "valves.csv"}


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
    (copied / "valves.parquet").unlink()
    assert "the table is not here" in report_of_lot(copied).verdict


@pytest.mark.parametrize("change", ["not a table", "lacks a column"])
def test_a_table_that_is_none_is_named(change, copied, wording):
    """Of another version: its hash is the stated one."""
    path = copied / "valves.parquet"
    if change == "not a table":
        path.write_bytes(b"PAR1")
    else:
        polars.read_parquet(path).drop("offset_V").write_parquet(path)
    document = json.loads((copied / "batch.json").read_bytes())
    document["files"][path.name] = sha256_of(path.read_bytes())
    (copied / "batch.json").write_text(to_json(document))
    with wording.refusal(InputError):
        report_of_lot(copied)


# --- lots of every kind ----------------------------------------------------------------------------------------------


MISSED = {"status": "does not hold", "reason": "no flow at zero command: 0.2 L/min at 1 MPa"}


@pytest.mark.parametrize(
    ("rows", "verified", "kind", "holds", "said"),
    [
        (lot_rows(8), True, "good", True, "8 of 8 valves calibrated, and the firmware of each is verified"),
        (lot_rows(1), False, "open", None, "1 of 1 valves calibrated; their firmware is NOT VERIFIED"),
        (lot_rows(5, failed=range(5)), False, "bad", False, "NONE of 5 valves calibrated"),
        ([*lot_rows(7), {**lot_rows(8)[7], **MISSED}], True, "bad", False, "7 of 8 valves calibrated, 1 NOT"),
    ],
    ids=["verified", "not verified", "none calibrated", "one does not hold"],
)
def test_good_is_only_a_lot_that_is_calibrated_and_verified(rows, verified, kind, holds, said, on_paper):
    report = report_of_lot(on_paper(rows, verified=verified))
    assert (report.kind, report.holds) == (kind, holds) and report.verdict.startswith(said)
    assert "There is no lot setting" in report.html and report.html.count("<figure") == (0 if said[0] == "N" else 1)
    assert ("1 does not hold: V0007" in head(report.html)) is ("1 NOT" in said)


def test_a_bipolar_lot_shows_both_sides(on_paper):
    rows = lot_rows(12, bipolar=True)
    rows[4] = with_figures(rows[4], "negative", **dict.fromkeys(SIDE_COLUMNS))
    html = report_of_lot(on_paper(rows)).html
    assert all(f'id="figure-spread-{side}"' in html for side in ("positive", "negative"))
    assert "Negative commands: dP0 is at 1 MPa" in html
    table = list(csv.DictReader(io.StringIO(downloads(html)["spread-negative.csv"])))
    assert len([row for row in table if row["quantity"] == "negative_offset_V"]) == 11
    assert re.search(r"all from [\d.]+ to [\d.]+ and from [\d.]+ to [\d.]+ %", head(html))


# --- what stands out -------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_valve_far_from_the_rest_is_named_and_no_other(on_paper):
    rows = lot_rows(60, seed=5)
    rows[7] = with_figures(rows[7], offset_V=4.2)
    (spread,) = (each for each in spreads_of(frame_of(rows)) if each.column == "offset_V")
    ((_, _, distance),) = spread.far.iter_rows()
    far = -distance
    assert far > FAR
    html = report_of_lot(on_paper(rows)).html
    text = " ".join(Page(html).text.split())
    assert re.findall(r"far from the rest: (.*?s\.d\.)", text) == [f"offset at dP0 (V): −{far:.1f} s.d."]
    assert ">V0007</text>" in html  # in the figure too
    assert "1 beyond 3.5 robust s.d." in head(html)
    rows = re.findall(r"<tr><td class=\"text\">(V\d+)</td>", html)
    assert rows[:3] == ["V0007", "V0000", "V0001"] and len(rows) == 50
    html = report_of_lot(on_paper(lot_rows(60, seed=5))).html
    assert "far from the rest: " not in html


def test_of_forty_valves_nine_may_be_anywhere():
    """Mean and standard deviation would hide them, median and MAD do not."""
    rows = lot_rows(40)
    rows[:9] = (with_figures(row, knee_opening_V=9.0) for row in rows[:9])
    spread = spreads_of(frame_of(rows))[0]
    assert set(spread.far["name"]) == {row["name"] for row in rows[:9]}
    assert 0.06 < spread.deviation < 0.3  # of the others: 0.12


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
        dp_without_MPa=dp_without_MPa, carrier="V1", binding=("V8",),
        checked=SmallestMargin(valves=3, worst="V8", dp_MPa=1.0, smallest_margin_V=0.0),
    )  # fmt: skip


def test_a_valve_that_lacks_a_pressure_is_named_with_what_that_costs():
    short = UntestedPressures(name="V8", side="positive", dp_MPa=(5.0,))
    (line,) = untested_lines(setting_with(short, (1.0003, 4.0), (1.0, 5.0)), AS_COMPUTED)
    assert line.startswith("V8 was not tested at 5 MPa, as the lot was: so the lot setting holds for all from 1 to 4 ")
    assert "without these from 1 to 5 MPa; record what is missing" in line


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


@pytest.mark.parametrize(("count", "few"), [(10, True), (20, False)])
def test_of_few_valves_each_dot_has_its_name(count, few):
    with figure_style():
        figure = spread_figure("spread", spreads_of(frame_of(lot_rows(count)))[:1], "")
    assert (">V0001</text>" in figure.svg) is few and ("5 and 95 %" in figure.svg) is not few


def test_the_median_of_an_even_lot_is_the_mean_of_the_two_middle_ones():
    assert quantiles([4.0, 1.0, 2.0, 9.0]).median == 3.0 and quantiles([4.0, 1.0, 2.0]).median == 2.0
    values = list(np.random.default_rng(5).normal(5, 1, 61).round(7))
    for count in (1, 2, 3, 20, 21, 61):
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
    spread = spreads_of(lot.calibrated, lot.units)[0]
    assert spread.text(5.0) == "12.000" and spread.heading == "knee on opening (mA)"
    assert spread.shown(5.0) == pytest.approx(12.0)
    html = report_of_lot(folder).html
    text = " ".join(Page(html).text.split())
    assert "knee on opening (mA)" in text and f"{4 + 1.6 * spread.at.median:.3f}" in text and "dP0 is at 10 bar" in text
    assert not re.search(r"\(V\)| MPa\b", re.sub(r"<svg.*?</svg>|data:[^\"']*", "", html, flags=re.DOTALL))
    print_quantiles(lot.summary)
    printed = capsys.readouterr().out
    assert "knee opening (mA)" in printed and f"{4 + 1.6 * spread.at.median:.3f}" in printed
    assert f",{rows[0]['knee_opening_V']}," in lot.text


def test_a_lot_without_a_machine_says_so_and_a_mixed_one_says_both():
    bare, machine = "the valve as recorded", "the valve as recorded and the declared machine"
    assert "no machine was declared" in certified_lines((bare,))[0]
    assert certified_lines((machine,)) == (f"The certificates cover {machine}.",)
    assert certified_lines((bare, machine)) == (f"The certificates cover {bare}, of others {machine}.",)
    assert certified_lines(()) == ()
