"""The table of a batch: valves in the order that people count in, and their records, of whatever text."""

import csv
import io
import json
import shutil

import polars
import pytest

from dzdesign.batch.valves import valves_of
from dzdesign.command_line.cli import main
from dzdesign.report.lot.page import report_of_lot
from dzdesign.report.lot.table import by_name, frame_of, read_table, table_files
from tests.dzdesign.batch.test_batch import rows as rows_of
from tests.support.html_pages import Page
from tests.support.many_valves import LOT_TOML, lot_options, write_lot
from tests.support.synthetic_lots import lot_rows, write_lot_folder

pytestmark = pytest.mark.slow

OPTIONS = ["--config", str(LOT_TOML), "--target", "host"]
COUNTED = ["V1", "V2", "V9", "V10", "V11"]
#: What a spreadsheet, CSV or a page could take for something else.
HOSTILE = ["=cmd|'/c calc'!A0", "'=1", "''", "-1", "@SUM(A1)", "+49 89 1", 'a,"b"; c', "<b>x</b>", "0815", "ü"]


def test_numbers_in_names_sort_as_numbers():
    names = ["V10", "V2", "1", "V1b", "V1", "V01", "V", "10 a", "9 b", "V1.5", "V1.10", "٣", "V" + "9" * 99]
    counted = ["1", "9 b", "10 a", "V", "V01", "V1", "V1.5", "V1.10", "V1b", "V2", "V10", "V" + "9" * 99, "٣"]
    assert sorted(names, key=by_name) == sorted(reversed(names), key=by_name) == counted
    assert by_name("V" + "1" * 9999) < by_name("V" + "2" * 9999)  # of a table that somebody changed


def test_a_folder_and_a_list_are_in_that_order(tmp_path):
    for name in COUNTED:
        (tmp_path / "lot" / name).mkdir(parents=True)
    assert [valve.name for valve in valves_of(tmp_path / "lot", None, ())] == COUNTED
    (tmp_path / "list.csv").write_text("name,files\n" + "".join(f"{name},x\n" for name in reversed(COUNTED)))
    assert [valve.name for valve in valves_of(tmp_path / "list.csv", None, ())] == COUNTED


@pytest.fixture(scope="module")
def counted(tmp_path_factory):
    """A lot whose valves are V9, V10 and so on, two of five broken; and what batch makes of it."""
    folder = tmp_path_factory.mktemp("counted")
    write_lot(folder / "made", 5, 2, 7)
    (folder / "lot").mkdir()
    for path, name in zip(sorted((folder / "made").iterdir()), COUNTED, strict=True):
        shutil.copytree(path, folder / "lot" / name)
    options = lot_options(folder, """[record]\nserial = "0815"\noil = '=HLP 46, "40"'""")
    assert main(["batch", str(folder / "lot"), "-o", str(folder / "out"), "--jobs", "1", *options]) == 1
    return folder


def test_all_that_batch_writes_is_in_that_order_and_has_the_records(counted):
    table = rows_of(counted / "out")
    assert [row["name"] for row in table] == COUNTED and {row["status"] for row in table} == {"ok", "failed"}
    assert {(row["record.serial"], row["record.oil"]) for row in table} == {("0815", '\'=HLP 46, "40"')}
    frame = polars.read_parquet(counted / "out" / "valves.parquet")
    assert frame["name"].to_list() == COUNTED and set(frame["record.oil"]) == {'=HLP 46, "40"'}
    document = json.loads((counted / "out" / "batch.json").read_text(encoding="utf-8"))
    assert [each["source"] for each in document["made_from"]] == [f"valves/{name}/manifest.json" for name in COUNTED]
    assert document["warnings"]["simulated"] == [row["name"] for row in table if row["status"] == "ok"]
    lot = json.loads((counted / "out" / "lot_compensator.json").read_text(encoding="utf-8"))["lot"]
    assert [each["name"] for each in lot] == document["warnings"]["simulated"]
    text = Page((counted / "out" / "report.html").read_text(encoding="utf-8")).text
    assert "0815" in text and "serial" in text


def test_no_cell_is_a_formula_and_every_text_comes_back(tmp_path):
    rows = [{**row, **{f"record.{text}": text for text in HOSTILE}} for row in lot_rows(4, failed=[2])]
    rows[0]["record.serial"] = HOSTILE[0]
    rows[2]["reason"] = "--meter-lag is '0.3 V'"
    frame = frame_of(rows)
    content = table_files(frame)["valves.csv"]
    for line in csv.reader(io.StringIO(content.decode())):
        assert not any(cell.startswith(("=", "+", "-", "@")) for cell in line)
    first = next(csv.DictReader(io.StringIO(content.decode())))
    marked = {text: first[f"record.{text}"] for text in HOSTILE}
    assert marked["-1"] == "'-1" and marked["'=1"] == "''=1" and marked["''"] == "''" and marked["0815"] == "0815"
    folder = write_lot_folder(tmp_path / "out", rows)
    assert read_table(folder / "valves.parquet").equals(frame)
    html = report_of_lot(folder).html
    assert "=cmd|" in html and "<b>x</b>" not in html


def test_a_record_that_can_be_none_is_not_in_the_table(counted, tmp_path):
    """The valve fails, and says why; the other has its own serial number."""
    listing = tmp_path / "list.csv"
    good = next(row["name"] for row in rows_of(counted / "out") if row["status"] == "ok")
    files = f"{counted}/lot/{good}/*.csv"
    listing.write_text(f'name,files,record.serial\nbad,{files},"{"x" * 300}"\ngood,{files},4711\nnone,{files},\n')
    assert main(["batch", str(listing), "-o", str(tmp_path / "out"), "--jobs", "1", *OPTIONS]) == 1
    table = {row["name"]: row for row in rows_of(tmp_path / "out")}
    assert {name: row["record.serial"] for name, row in table.items()} == {"bad": "", "good": "4711", "none": ""}
    assert "300 characters" in table["bad"]["reason"]
