"""The record of a test, who and what: kept as it was said, shown, and of no effect on any number or on the C."""

import json
import tomllib
from pathlib import Path

import pytest

from dzdesign import api
from dzdesign.command_line.cli import main
from dzdesign.command_line.invocation import merged_entries
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import as_document, to_json_bytes
from dzdesign.core.documents import sha256_of, to_json
from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.test_record import LONGEST_NAME, LONGEST_TEXT, MOST_ENTRIES, checked_record
from dzdesign.stages.identify import record_of
from tests.support.attacked_firmware import sealed
from tests.support.html_pages import Page
from tests.support.schema_checks import problems
from tests.support.synthetic import Truth, synthetic_ramp

#: Each would matter where it came to C, to a page or to a terminal.
HOSTILE = {
    "*/ int evil; /*": "*/ #error evil",
    "<script>evil</script>": '"><img src=x onerror=evil()>',
    "\\": "??/ evil",
}


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    test = synthetic_ramp(1.0, Truth(noise=0.02), ramp_s=20, rate_Hz=25)
    rows = zip(test.time, test.u, test.dp / 1e6, test.q * 6e4, strict=True)
    Path("ramp.csv").write_text(
        "time_s,u_V,dP_MPa,Q_Lmin\n" + "\n".join(",".join(f"{value:.5f}" for value in row) for row in rows)
    )
    return tmp_path


def test_the_command_line_goes_before_the_file_entry_by_entry(here, capsys):
    Path("dzdesign.toml").write_text(
        '[record]\nserial = 4711\noil = "HLP 46, 40\u00a0°C"\nviscosity = 46.10\ndate = 2026-01-31\n'
    )
    words = ["--config", "dzdesign.toml", "--record", "serial = 0815", "--record", "bench=2 = west"]
    assert main(["-v", "identify", "ramp.csv", *words]) == 0
    said = {"serial": "0815", "oil": "HLP 46, 40 °C", "viscosity": "46.10", "date": "2026-01-31", "bench": "2 = west"}
    found = json.loads(Path("valve.json").read_text())
    assert found["record"] == said and list(found["record"]) == list(said)
    shown = "record: serial 0815; oil HLP 46, 40 °C; viscosity 46.10; date 2026-01-31; bench 2 = west"
    assert shown in capsys.readouterr().out
    assert problems("valve", found) == []
    valve = api.identify("ramp.csv", record={**said, "date": tomllib.loads("d = 2026-01-31")["d"]}, output="api.json")
    assert Path("api.json").read_bytes() == Path("valve.json").read_bytes()
    assert "HLP 46" in valve._repr_html_()


def test_no_number_hangs_on_it(here):
    test = synthetic_ramp(1.0, Truth(noise=0.02), ramp_s=20, rate_Hz=25)
    with_record, without = as_document(identify([test], record=HOSTILE)), as_document(identify([test]))
    assert with_record.pop("record") == HOSTILE and without.pop("record") == {}
    assert with_record.pop("content_sha256") != without.pop("content_sha256")
    assert with_record == without


def test_valve_json_is_read_back_with_it(here, wording):
    valve = identify([synthetic_ramp(1.0, Truth(noise=0.02), ramp_s=20, rate_Hz=25)], record=HOSTILE)
    document = as_document(valve)
    assert as_document(read_artefact(to_json(document).encode(), ValveModel, "valve.json")) == document
    for wrong in ([], {"serial": 4711}, {"": "x"}, {"a": "b\nc"}, {"a": "x" * 201}, {str(n): "x" for n in range(41)}):
        with wording.refusal(InputError):
            read_artefact(to_json({**document, "record": wrong}).encode(), ValveModel, "valve.json")
        if wrong != {"a": "b\nc"}:  # a schema counts, and does not look at characters
            assert problems("valve", {**document, "record": wrong}) != []


def test_none_of_it_reaches_the_c(here):
    """Its one way into a firmware folder is compensator.json, whose valve is that of the hash."""
    valve = identify([synthetic_ramp(1.0, Truth(noise=0.02), ramp_s=20, rate_Hz=25)], record=HOSTILE)
    Path("valve.json").write_bytes(to_json_bytes(valve))
    for target in ("f28335", "host"):
        files = api.generate(api.design("valve.json", target=target), target=target).files
        compensator = json.loads(files["compensator.json"])
        assert compensator["valve"]["record"] == HOSTILE
        assert compensator["made_from"][0]["sha256"] == sha256_of(Path("valve.json").read_bytes())
        reached = [name for name, text in files.items() if "evil" in text or "??/" in text]
        assert reached == ["compensator.json"]


@pytest.mark.parametrize(
    "entries",
    [
        ["serial"],
        ["= 4711"],
        ["serial = "],
        ["serial = 1", "serial = 1"],
        ["serial = 1", "Serial = 2"],
        ["a = b\nc"],
        ["a = \x1b[2J"],
        ["a = \u202egnp"],
        [f"{'n' * (LONGEST_NAME + 1)} = x"],
        [f"a = {'x' * (LONGEST_TEXT + 1)}"],
        [f"n{n} = x" for n in range(MOST_ENTRIES + 1)],
        {"tested": True},
        {"bench": {"number": 2}},
        {7: "x"},
    ],
)
def test_what_is_no_record_is_refused(entries, wording):
    with wording.refusal(InputError):
        record_of(entries) if isinstance(entries, dict) else merged_entries("--record", None, entries)


def test_a_name_of_the_file_and_of_the_command_line_that_differ_in_a_capital_are_refused(wording):
    with wording.refusal(InputError):
        merged_entries("--record", {"Serial": "1"}, ["serial = 2"])


def test_the_largest_record_is_one():
    entries = [(f"{n:0{LONGEST_NAME}}", "x" * LONGEST_TEXT) for n in range(MOST_ENTRIES)]
    assert checked_record(entries, "here") == dict(entries)


@pytest.mark.parametrize(
    ("text", "record"),
    [
        ("[record]\n", None),  # all its entries still comments
        ('record = "serial = 4711"', {"serial": "4711"}),
        ('record = ["serial = 4711", "bench = 2"]', {"serial": "4711", "bench": "2"}),
        ("[record]\na = 1_000.50\nb = 1979-05-27T07:32:00Z\nc = 07:32:00\n",
         {"a": "1000.50", "b": "1979-05-27 07:32:00+00:00", "c": "07:32:00"}),
    ],
)  # fmt: skip
def test_what_the_file_may_hold(here, text, record):
    Path("dzdesign.toml").write_text(text)
    assert main(["-q", "identify", "ramp.csv", "--config", "dzdesign.toml"]) == 0
    assert json.loads(Path("valve.json").read_text())["record"] == (record or {})


def test_the_file_that_init_writes_has_a_record_to_fill_in(here):
    assert main(["-q", "init", "ramp.csv"]) == 0
    text = Path("dzdesign.toml").read_text("utf-8")
    assert "record" not in tomllib.loads(text)
    head, mark, lines = text.partition("# [record]\n")
    Path("dzdesign.toml").write_text(head + "[record]\n" + lines.replace("# ", ""), "utf-8")
    assert main(["-q", "identify", "ramp.csv", "--config", "dzdesign.toml"]) == 0
    record = json.loads(Path("valve.json").read_text())["record"]
    assert mark and record["date"] == "2026-01-31" and record["oil-temperature"] == "40 °C" and len(record) == 9


def test_each_valve_of_a_list_has_its_own_beside_that_of_all(here, wording):
    from dzdesign.batch.command import _task
    from dzdesign.batch.valves import valves_of
    from dzdesign.command_line.invocation import parse

    Path("lot.csv").write_text("name,files,record.serial,record.oil-type\na,ramp.csv,4711,\nb,ramp.csv,4712,HLP 32\n")
    Path("options.toml").write_text('[record]\nbench = "2"\noil-type = "HLP 46"\n')
    args = parse(["batch", "lot.csv", "--config", "options.toml"]).arguments
    tasks = [_task(valve, args, None, ()) for valve in valves_of(Path("lot.csv"), None, ())]
    assert [task.identify.record for task in tasks] == [
        {"bench": "2", "oil-type": "HLP 46", "serial": "4711"},
        {"bench": "2", "oil-type": "HLP 32", "serial": "4712"},
    ]
    assert tasks[0].digest != tasks[1].digest
    Path("lot.csv").write_text("name,files,record.\na,ramp.csv,4711\n")
    with wording.refusal(InputError):
        valves_of(Path("lot.csv"), None, ())


def test_the_report_shows_it_under_the_title_and_as_text(here):
    from dzdesign.report.valve_report import report_of_folder

    valve = identify([synthetic_ramp(1.0, Truth(noise=0.02), ramp_s=20, rate_Hz=25)], record=HOSTILE)
    Path("lone").mkdir()
    Path("lone/valve.json").write_bytes(to_json_bytes(valve))
    html = report_of_folder(Path("lone")).html
    head = Page(html[html.index('<p class="subtitle">') : html.index('<div class="verdict')])
    assert all(f"{name}: {text}" in head.text for name, text in HOSTILE.items())
    assert len([each for each in head.of("span") if each.get("class") == "entry"]) == len(HOSTILE)
    assert not Page(html).of("script") and not Page(html).of("img")
    assert [word for word in ("Tested by", "Checked by", "Date") if f"<p>{word}</p>" not in html] == []
    Path("lone/valve.json").write_text(to_json(sealed({**as_document(valve), "record": {}})))
    assert 'class="entry"' not in report_of_folder(Path("lone")).html
