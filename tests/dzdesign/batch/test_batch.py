"""Many valves: what can be calibrated is, the rest has its reason; taken up where it was killed; one safe setting."""

import csv
import errno
import io
import json
import os
import re
import shutil
import signal
import stat
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path

import polars
import pytest

from dzdesign.batch.calibration import Task
from dzdesign.batch.command import useful_jobs
from dzdesign.batch.runners import run_local
from dzdesign.batch.valve_folders import Results
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import InputError
from dzdesign.core.placing import ABANDONED_S, UNPLACED
from dzdesign.design.ceiling import DECIMALS
from dzdesign.design.compensator import Compensator
from dzdesign.design.design_choices import DesignChoices
from dzdesign.design.lot_setting import lot_setting
from dzdesign.report.artefacts import read_chain
from dzdesign.report.lot.table import read_manifest
from dzdesign.stages.identify import IdentifyChoices
from dzdesign.verify.requirements import RAMPS
from tests.dzdesign.batch.crashing_work import die_over_bad
from tests.support.many_valves import LOT_TOML, PRESSURES_MPa, lot_bench, lot_options, write_lot
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

pytestmark = pytest.mark.slow

SEED, COUNT = 7, 12
OPTIONS = ["--config", str(LOT_TOML), "--target", "host"]
NOTHING = dict(recordings=(), identify=IdentifyChoices(), design=DesignChoices(), target="host")


def tree(folder: Path) -> dict[str, str]:
    """Return every file of a folder and its hash."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): sha256_of(path.read_bytes()) for path in paths}


def rows(folder: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO((folder / "valves.csv").read_text(encoding="utf-8"))))


@pytest.fixture(scope="module")
def lot(tmp_path_factory):
    """12 valves, three of them broken."""
    folder = tmp_path_factory.mktemp("lot")
    return folder, write_lot(folder, COUNT, 3, SEED)


@pytest.fixture(scope="module")
def made(lot, tmp_path_factory):
    folder, _ = lot
    output = tmp_path_factory.mktemp("made") / "out"
    assert main(["batch", str(folder), "-o", str(output), "--jobs", "1", *OPTIONS]) == 1
    return output


@pytest.fixture
def copy(made, tmp_path):
    shutil.copytree(made, tmp_path / "out")
    return tmp_path / "out"


def test_what_is_good_is_calibrated_and_what_is_broken_has_its_reason(lot, made):
    _, broken = lot
    table = rows(made)
    assert [row["name"] for row in table] == [f"V{number:04d}" for number in range(COUNT)]
    failed = {row["name"]: row["reason"] for row in table if row["status"] == "failed"}
    assert set(failed) == set(broken) and sum(row["status"] == "ok" for row in table) == COUNT - 3
    words = {"no recording": "has no recording", "no flow": "has no column of Q", "no pressure drop": "no column of dP"}
    for name, kind in broken.items():
        assert words[kind] in failed[name]
        assert (made / "valves" / name / "reason.txt").read_text(encoding="utf-8") == failed[name] + "\n"
        assert "/tmp" not in failed[name]
    document = json.loads((made / "batch.json").read_text(encoding="utf-8"))
    assert (document["valves"], document["calibrated"], len(document["failed"])) == (COUNT, COUNT - 3, 3)


def test_the_table_says_what_the_artefacts_say(made):
    frame = polars.read_parquet(made / "valves.parquet")
    assert frame.equals(polars.read_csv(made / "valves.csv", schema=frame.schema))
    row = frame.row(by_predicate=polars.col("name") == "V0001", named=True)
    valve = json.loads((made / "valves/V0001/valve.json").read_text())["sides"]["positive"]
    assert (row["knee_opening_V"], row["trend"]) == (valve["tests"][0]["u_knee_rising_V"], valve["trend"])
    assert (row["beta_at_highest_dp"], row["highest_dp_MPa"]) == (valve["beta"]["beta"][-1], PRESSURES_MPa[-1])
    assert row["valve_json_sha256"] == sha256_of((made / "valves/V0001/valve.json").read_bytes())
    assert row["offset_V"] <= row["bound_V"] + 1e-6 <= valve["reference"]["u_min_V"]
    bench = lot_bench(1, SEED)
    assert abs(row["knee_opening_V"] - bench.opening_V(1.0)) < 6 * row["knee_se_V"] + 0.005


def test_a_valve_of_a_batch_has_the_bytes_of_the_commands(lot, made, tmp_path, monkeypatch, capsys):
    folder, _ = lot
    monkeypatch.chdir(tmp_path)
    assert main(["identify", str(folder / "V0001" / "*.csv"), "--meter-lag", "0.1 s"]) == 0
    assert main(["design", "valve.json", "--target", "host"]) == 0
    assert main(["codegen", "compensator.json"]) == 0
    assert Path("valve.json").read_bytes() == (made / "valves/V0001/valve.json").read_bytes()
    assert tree(Path("firmware")) == tree(made / "valves/V0001/firmware")


def test_order_and_parts_in_the_options_file_count_for_every_valve(lot, tmp_path, monkeypatch, capsys):
    """Seeded: a batch that leaves them out makes another valve.json, of which the order is not known."""
    folder, _ = lot
    monkeypatch.chdir(tmp_path)
    shutil.copytree(folder / "V0001", "lot/V0001")
    names = sorted(path.name for path in Path("lot/V0001").iterdir())
    order = ", ".join(f'"{name}"' for name in (*names[1:], names[0]))
    Path("dz.toml").write_text(f'order = [{order}]\nmeter-lag = "0.1 s"\nto = "1000 s"\n[from]\n"*.csv" = "0.05 s"\n')
    assert main(["batch", "lot", "-o", "out", "--jobs", "1", "--target", "host", "--config", "dz.toml"]) == 0
    assert main(["identify", "lot/V0001/*.csv", "--config", "dz.toml"]) == 0
    assert Path("valve.json").read_bytes() == Path("out/valves/V0001/valve.json").read_bytes()
    options = json.loads(Path("valve.json").read_text())["options"]
    assert options["lists"]["order"] == [*names[1:], names[0]] and options["tables"]["from_"] == {"*.csv": "0.05 s"}
    Path("dz.toml").write_text('low-flow = "5 +- 1 mL/min at 5.16 V, 5 MPa, closing"\n')
    assert main(["batch", "lot", "-o", "other", "--config", "dz.toml"]) == 2
    assert "'dz.toml': low-flow is of one valve, and batch has no such option" in capsys.readouterr().err


def test_the_report_of_one_valve_is_of_that_valve(made):
    """Its folder has a manifest, as firmware has; what lies beside it is of other valves, not what it was made from."""
    folder = made / "valves" / "V0003"
    chain = read_chain(folder)
    hashes = {role: each.sha256 for role, each in chain.places.items()}
    files = {"firmware": "firmware/manifest.json", "compensator": "compensator.json", "valve": "valve.json"}
    assert hashes == {role: sha256_of((folder / name).read_bytes()) for role, name in files.items()}


def test_only_what_changed_is_done_again(lot, copy, tmp_path, capsys):
    folder = shutil.copytree(lot[0], tmp_path / "lot")
    before = tree(copy)
    stamps = {path: path.stat().st_ino for path in (copy / "valves").iterdir()}

    def again(*options: str) -> str:
        assert main(["batch", str(folder), "-o", str(copy), "--jobs", "1", *OPTIONS, *options]) == 1
        read = capsys.readouterr()
        return read.err + read.out

    assert "12 valves, 12 of them done before" in again()
    assert tree(copy) == before and stamps == {path: path.stat().st_ino for path in stamps}
    shutil.copy(folder / "V0003" / "ramp_dP1.csv", folder / "V0001" / "ramp_dP1.csv")
    (copy / "valves" / "V9999").mkdir()
    said = again()
    assert "12 valves, 11 of them done before" in said and "odd: V0001, V0003 share a recording" in said
    assert "holds V9999, not of this lot" in " ".join(said.split())
    (copy / "valves" / "V9999").rmdir()
    changed = {name.split("/")[1] for name, digest in tree(copy).items() if before.get(name) != digest and "/" in name}
    assert changed == {"V0001"}
    (copy / "valves" / "V0004" / "valve.json").write_text("{}")  # somebody's, so it is not written over
    assert "11 of them done before" in again()
    reasons = {row["name"]: row["reason"] for row in rows(copy)}
    assert "was changed since dzdesign wrote it" in reasons["V0004"]


def test_two_batches_do_not_share_a_folder(lot, copy, capsys):
    fcntl = pytest.importorskip("fcntl", reason="this system has no such locks")
    before = tree(copy)
    other = os.open(copy, os.O_RDONLY)
    try:
        fcntl.flock(other, fcntl.LOCK_EX)
        assert main(["batch", str(lot[0]), "-o", str(copy), *OPTIONS]) == 2
    finally:
        os.close(other)
    assert "another batch is writing into" in capsys.readouterr().err and tree(copy) == before


def test_options_are_inputs_too(lot, copy, tmp_path, monkeypatch):
    seen = []

    def nothing(tasks, jobs):
        for task in tasks:
            seen.append(task.name)
            yield task.outcome("failed", "not tried", again=True)

    monkeypatch.setattr("dzdesign.batch.command.run_local", nothing)
    command = ["batch", str(lot[0]), "-o", str(copy), *OPTIONS, *lot_options(tmp_path, 'guard = "mean"')]
    assert main(command) == 1
    assert len(seen) == COUNT
    assert {row["status"] for row in rows(copy)} == {"failed"}
    assert not (copy / "lot_compensator.json").exists()  # of no valve now
    seen.clear()  # such an outcome is no last word: it is tried again
    assert main(command) == 1
    assert len(seen) == COUNT


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL is of POSIX")
def test_a_killed_run_leaves_whole_folders_and_is_taken_up_by_more_jobs(lot, made, tmp_path, capsys):
    output = tmp_path / "out"
    command = ["batch", str(lot[0]), "-o", str(output), *OPTIONS, "--jobs"]
    code = "import sys; from dzdesign.command_line.cli import main; sys.exit(main(sys.argv[1:]))"
    with subprocess.Popen([sys.executable, "-c", code, *command, "1"], stderr=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 120
        while len(list(output.glob("valves/V*/manifest.json"))) < 3 and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
    found = sorted(path.name for path in (output / "valves").iterdir() if not path.name.startswith("."))
    assert 3 <= len(found) < COUNT and "unfinished" in json.loads((output / "batch.json").read_text())["schema"]
    results = Results(output)
    assert all(results.is_done(name, read_manifest(results.of(name)).inputs_sha256) for name in found)
    torn = output / "valves" / f"{UNPLACED}abcd1234"  # as a kill in the middle of a write leaves it
    kept = output / "valves" / ".V0001.original"  # somebody's own
    for each in (torn, kept):
        each.mkdir()
    long_ago = time.time() - 2 * ABANDONED_S
    for each in output.rglob(f"{UNPLACED}*"):
        os.utime(each, (long_ago, long_ago))
    assert main([*command, "2"]) == 1
    kept.rmdir()
    assert tree(output) == tree(made) and not torn.exists()
    said = capsys.readouterr()
    assert f"9 of {COUNT} valves calibrated, 3 not" in said.out
    assert f"{len(found)} of them done before" in said.err
    waiting = COUNT - len(found)  # in a pipe a line for each of them
    lines = re.findall(r"valve (\d+) of (\d+): (V\d+|\S+): \S", said.err)
    assert [(int(number), int(count)) for number, count, _ in lines] == [(n, waiting) for n in range(1, waiting + 1)]
    assert len({name for *_, name in lines} - set(found)) == waiting
    assert "does not hold: 3 of 12 valves are not calibrated" in said.err


def offsets_above_their_bounds(common, made: Path, names) -> list[str]:
    """Return the valves that a compensator over-compensates: its own arithmetic, from valve.json alone."""
    found = []
    for name in names:
        side = json.loads((made / "valves" / name / "valve.json").read_text())["sides"]["positive"]
        curve = side["certified"]["closing"]
        nodes, lower = ([Fraction(repr(value)) for value in curve[key]] for key in ("bound_dp_MPa", "bound_V"))
        for code in range(common.signals.pair(1).largest_difference + 1):
            dp = common.signals.pair(1).dp_MPa(code)
            bounds = [
                low + (high - low) * (dp - left) / (right - left)
                for left, right, low, high in zip(nodes, nodes[1:], lower, lower[1:], strict=False)
                if left <= dp <= right
            ]
            offset = common.beta(code) * common.positive.u_min0_over_u_max * common.u_max_V
            if bounds and offset > min(bounds) + DECIMALS:
                found.append(name)
                break
    return found


def test_the_common_setting_over_compensates_no_valve(lot, made, tmp_path, capsys):
    names = [row["name"] for row in rows(made) if row["status"] == "ok"]
    path = made / "lot_compensator.json"
    common = read_artefact(path.read_bytes(), Compensator, str(path))
    assert offsets_above_their_bounds(common, made, names) == []
    for name in names:  # nor where the truth is known
        bench = lot_bench(int(name[1:]), SEED)
        for dp_MPa in (1.0, 1.7, 2.5, 4.0, 5.0):
            code = round(common.signals.pair(1).dp_code(Fraction(dp_MPa)))
            assert float(common.drive(0, code)) * 10 < bench.closing_V(dp_MPa)
    assert main(["codegen", str(path), "--target", "host", "-o", str(tmp_path / "firmware")]) == 0  # proved again there


def test_a_setting_without_the_lowest_valve_over_compensates_it(made):
    """The check above sees what it must see: the valve that holds the setting down is the one that is hurt."""
    results = Results(made)
    names = [row["name"] for row in rows(made) if row["status"] == "ok"]
    batch = {name: results.read(name, {}).compensator for name in names}
    binding = lot_setting(batch).binding
    higher = lot_setting({name: each for name, each in batch.items() if name not in binding}).compensator
    assert set(offsets_above_their_bounds(higher, made, names)) & set(binding)


def test_what_one_setting_costs(made):
    table = [row for row in rows(made) if row["status"] == "ok"]
    extra = {row["name"]: float(row["lot_extra_dead_zone_percent"]) for row in table}
    common = json.loads((made / "batch.json").read_text())["lot_setting"]
    assert min(extra, key=extra.get) in common["binding"]
    lowest = min(float(row["offset_V"]) for row in table)
    # In per cent of command: to the knee, over the gain that is left, about 0.46; a valve's own law has a transition.
    # That is of dP0 alone; elsewhere the bound of a valve may lie further below its knee.
    for row in table:
        left = 10 * (float(row["knee_opening_V"]) - lowest) / 0.46 - float(row["dead_zone_opening_percent"])
        assert extra[row["name"]] == pytest.approx(left, abs=1.6)
    assert max(extra.values()) > 2


def test_valves_without_one_setting_are_told_why(lot, made, tmp_path, capsys):
    listing = tmp_path / "valves.csv"
    good = [name for name in ("V0000", "V0001") if name not in lot[1]]
    lines = [f"{name},{lot[0]}/{name}/*.csv,{guard}" for name, guard in zip(good, ("closing", "mean"), strict=True)]
    listing.write_text("name,files,guard\n" + "\n".join(lines) + "\n")
    assert main(["batch", str(listing), "-o", str(tmp_path / "out"), "--jobs", "1", *OPTIONS, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert "another guard, so no setting serves both" in document["why_no_lot_setting"]


def test_a_list_names_valves_with_options_of_their_own(lot, tmp_path, capsys):
    listing = tmp_path / "list.csv"
    ramps = Path(os.path.relpath(lot[0], tmp_path))
    listing.write_text(
        "name,files,meter-lag,x_max\n"
        f"fast,{ramps}/V0000/*.csv,0.1 s,1.8 mm\n"
        f"slow,{ramps}/V0000/ramp_dP1.csv; {ramps}/V0000/ramp_dP5.csv,0.3 s,\n"
        f"odd,{ramps}/V0000/*.csv,0.3 V,\n"
    )
    assert main(["batch", str(listing), "-o", str(tmp_path / "out"), "--jobs", "1", "--target", "host"]) == 1
    assert "failed  odd: --meter-lag is '0.3 V'" in capsys.readouterr().out
    fast, slow = (json.loads((tmp_path / "out/valves" / name / "valve.json").read_text()) for name in ("fast", "slow"))
    assert (fast["meter"]["lag_s"], slow["meter"]["lag_s"]) == (0.1, 0.3)
    assert fast["sides"]["positive"]["k_V_mm"] and not slow["sides"]["positive"]["k_V_mm"]
    assert len(slow["made_from"]) == 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name,files,meterlag\n", "(did you mean 'meter_lag'?)"),
        ("name,file\n", "(did you mean 'files'?)"),
        ("name\nv\n", "expected name and files"),
        ("name,files\nv,a,b\n", "row 2 has 3 cells"),
        ("name,files\n../v,a\n", "a valve named '../v'"),
        ("name,files\n=v,a\n", "a valve named '=v'"),
        ("name,files\nCON,a\n", "a valve named 'CON'"),
        ("name,files\nv,a\nV,b\n", "has the valves 'v' and 'V'"),
        ("name,files\n", "names no valve"),
        ("", "is empty, expected a list of valves"),
        ("name;files\nv;a\n", "parts its columns by ';', expected a comma"),
        ("name\tfiles\nv\ta\n", "parts its columns by a tab, expected a comma"),
        ("name,files\nv,a\nv,b\n", "has two valves named 'v'"),
        ('name,files\n"v\nw",a\n', "a valve named 'v w'"),
        ("\udcff", "is no CSV in UTF-8"),
    ],
)
def test_a_bad_list_stops_before_anything_is_written(text, words, tmp_path, capsys):
    listing = tmp_path / "list.csv"
    listing.write_bytes(text.encode(errors="surrogateescape"))
    assert main(["batch", str(listing), "-o", str(tmp_path / "out")]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--jobs", "0"], "--jobs is '0'"),
        (["--jobs", "2", "--dask", "tcp://127.0.0.1:1"], "leave it out"),
        (["--plant", "p.toml"], "or --verify"),
        (["--meter-lag", "3 s"], "takes --meter-lag from the file of --config"),
        ('meter-lag = "3 V"', "options.toml': meter-lag is '3 V'"),
        ('guard = "opning"', "did you mean 'opening'?"),
        (["--target", "f28334"], "did you mean 'f28335'?"),
        (["-o", "SOURCE/out"], "whose subfolders are the valves"),
        (["-o", "SOURCE/../foreign"], "no folder of a batch, so it is left alone"),
    ],
)
def test_bad_usage_stops_before_anything_is_written(options, words, lot, tmp_path, capsys):
    if isinstance(options, str):
        (tmp_path / "options.toml").write_text(options, encoding="utf-8")
        options = ["--config", str(tmp_path / "options.toml")]
    foreign = lot[0].parent / "foreign"
    foreign.mkdir(exist_ok=True)
    (foreign / "thesis.txt").write_text("mine")
    before = tree(lot[0])
    options = [option.replace("SOURCE", str(lot[0])) for option in options]
    assert main(["batch", str(lot[0]), *([] if "-o" in options else ["-o", str(foreign / "out")]), *options]) == 2
    assert words in capsys.readouterr().err
    assert tree(lot[0]) == before and [path.name for path in foreign.iterdir()] == ["thesis.txt"]


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL is of POSIX")
def test_a_valve_that_kills_its_process_is_named_and_no_other_is_lost():
    names = ["a", "b", "bad1", "c", "d", "bad2", "e"]
    outcomes = list(run_local((Task(name=name, **NOTHING) for name in names), 2, die_over_bad))
    assert sorted(outcome.name for outcome in outcomes) == sorted(names)
    dead = {outcome.name: outcome.manifest for outcome in outcomes if outcome.manifest.status != "ok"}
    assert set(dead) == {"bad1", "bad2"}
    assert all("ended without a word" in each.reason and each.inputs_sha256 is None for each in dead.values())


def test_an_unexpected_fault_is_a_reason_and_is_tried_again(lot, tmp_path, monkeypatch):
    def broken(*_args, **_options):
        raise ZeroDivisionError("a fault\nof ours")

    monkeypatch.setattr("dzdesign.stages.identify.identify", broken)
    assert main(["batch", str(lot[0]), "-o", str(tmp_path / "out"), "--jobs", "1"]) == 1
    row = rows(tmp_path / "out")[0]
    assert row["reason"] == "unexpected ZeroDivisionError: a fault of ours" and row["inputs_sha256"] == ""


@needs_compiler
def test_a_firmware_that_does_not_hold_is_no_calibrated_valve(lot, tmp_path, capsys):
    """The plant of another valve: verification sees that it is not the one of the ramp tests."""
    folder = tmp_path / "lot"
    (folder / "V0000").mkdir(parents=True)
    shutil.copy(lot[0] / "V0000" / "ramp_dP1.csv", folder / "V0000")
    plant = tmp_path / "plant.toml"
    plant.write_text("overlap_mm = 0.6\n")
    options = ["--verify", "--plant", str(plant), *OPTIONS]
    assert main(["batch", str(folder), "-o", str(tmp_path / "out"), "--jobs", "1", *options]) == 1
    (row,) = rows(tmp_path / "out")
    assert row["status"] == "does not hold" and row["reason"]
    evidence = json.loads((tmp_path / "out/valves/V0000/evidence/verification.json").read_text())
    assert evidence["holds"] is False
    (again,) = [check for check in evidence["checks"] if check["id"] == RAMPS.id]
    assert again["holds"] is True and "in this run" in again["text"]


def test_patterns_that_overlap_are_named_with_what_to_do(lot, tmp_path, capsys):
    listing = tmp_path / "list.csv"
    ramps = Path(os.path.relpath(lot[0], tmp_path))
    listing.write_text(
        "name,files\n"
        f"one,{ramps}/V000[13]/*.csv\n"
        f"other,{ramps}/V0003/*.csv\n"
        f"twice,{ramps}/V0001/*.csv;{ramps}/V0001/ramp*1.csv\n"
    )
    assert main(["batch", str(listing), "-o", str(tmp_path / "out"), "--jobs", "1", *OPTIONS]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "failed twice: valve 'twice' takes the file 'ramp_dP1.csv' twice, by '*.csv' and by 'ramp*1.csv'" in said
    assert "odd: one, other take the same file, 'ramp_dP1.csv' and 2 more: in the column files" in said
    assert "byte for byte" not in said


def test_a_valve_that_lacks_a_pressure_is_named_with_the_range_without_it(lot, tmp_path, capsys):
    listing = tmp_path / "list.csv"
    ramps = Path(os.path.relpath(lot[0], tmp_path))
    low, middle, high = (f"ramp_dP{dp:g}.csv" for dp in PRESSURES_MPa)
    listing.write_text(
        f"name,files\na,{ramps}/V0001/*.csv\nb,{ramps}/V0003/*.csv\nc,{ramps}/V0004/*.csv\n"
        f"short,{ramps}/V0005/{low};{ramps}/V0005/{middle}\n"
        f"coarse,{ramps}/V0007/{low};{ramps}/V0007/{high}\n"
    )
    out = tmp_path / "out"
    assert main(["batch", str(listing), "-o", str(out), "--jobs", "1", *lot_options(tmp_path, 'curve = "line"')]) == 0
    said = " ".join(capsys.readouterr().out.split())
    words = (
        "short was not tested at 5 MPa, as the lot was: so the lot setting holds for all from 1 to 2.5 MPa, and "
        "without these from 1 to 5 MPa; record what is missing, or calibrate them apart",
        "it lies under the bounds of each of the 5 valves, at every pressure code of its tests; nearest is ",
    )
    report = " ".join((out / "report.html").read_text(encoding="utf-8").split())
    assert all(each in said for each in words) and words[0] in report
    common = json.loads((out / "batch.json").read_text(encoding="utf-8"))["lot_setting"]
    assert [(each["name"], each["dp_MPa"]) for each in common["untested"]] == [("short", [5.0])]
    assert (common["dp_MPa"], common["dp_without_MPa"]) == ([1.0, 2.5], [1.0, 5.0])
    assert common["checked"]["valves"] == 5 and common["checked"]["smallest_margin_V"] >= 0


def test_a_link_to_nothing_is_a_valve_with_a_reason_and_no_place_to_write(lot, tmp_path, capsys):
    folder = tmp_path / "lot"
    folder.mkdir()
    try:
        (folder / "gone").symlink_to(tmp_path / "nowhere")
    except OSError:
        pytest.skip("this system makes no links")
    (folder / "V0001").symlink_to(lot[0] / "V0001")
    out = tmp_path / "out"
    assert main(["batch", str(folder), "-o", str(out), "--jobs", "1", *OPTIONS]) == 1
    assert {row["name"]: row["status"] for row in rows(out)} == {"V0001": "ok", "gone": "failed"}
    assert main(["batch", str(folder), "-o", str(folder / "gone"), *OPTIONS]) == 2
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    assert main(["batch", str(folder), "-o", str(tmp_path / "link"), *OPTIONS]) == 2
    assert "which is gone; choose another with -o" in capsys.readouterr().err


def test_a_full_disk_stops_the_batch_with_what_to_do_and_keeps_what_is_done(lot, tmp_path, monkeypatch, capsys):
    out, written = tmp_path / "out", []

    def full(self, outcome):
        if len(written) == 2:
            raise InputError("can't be written") from OSError(errno.ENOSPC, "No space left on device")
        written.append(outcome.name)
        whole(self, outcome)

    whole = Results.write
    monkeypatch.setattr(Results, "write", full)
    command = ["batch", str(lot[0]), "-o", str(out), "--jobs", "1", *OPTIONS]
    assert main(command) == 2
    said = capsys.readouterr().err
    assert f"no space is left to write into '{out}'; make room and give the same command again" in said
    assert not (out / "valves.csv").exists() and sorted(each.name for each in (out / "valves").iterdir()) == written
    monkeypatch.setattr(Results, "write", whole)
    assert main(command) == 1
    assert f"{COUNT} valves, 2 of them done before" in capsys.readouterr().err


def test_no_more_processes_than_have_something_to_do(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    assert [useful_jobs(jobs, 60) for jobs in (1, 2, 8, 1000)] == [1, 2, 8, 8]
    assert [useful_jobs(1000, waiting) for waiting in (0, 1, 3)] == [2, 2, 3]  # one alone would be this very process


@pytest.mark.parametrize(("jobs", "quiet"), [("1", True), ("2", False)])
def test_a_batch_in_a_pipe_says_a_line_a_valve_and_none_if_quiet(jobs, quiet, tmp_path):
    """In a process of its own: of a worker, stderr is that of the process and not a test's."""
    write_lot(tmp_path / "lot", 2, 0, SEED)
    code = "import sys; from dzdesign.command_line.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, "batch", "lot", "-o", "out", "--jobs", jobs, *OPTIONS, *["--quiet"] * quiet]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0
    said = sorted(line.partition(" of 2: ")[2] or line for line in done.stderr.splitlines())
    lines = ["V0000: calibrated", "V0001: calibrated", "dzdesign: 2 valves, 0 of them done before"]
    assert said == ([] if quiet else lines)


def test_a_board_file_that_was_filled_in_stays_and_its_valve_with_it(tmp_path, capsys):
    lot = tmp_path / "lot"
    write_lot(lot, 2, 0, SEED)
    out = tmp_path / "out"
    command = ["batch", str(lot), "-o", str(out), "--jobs", "1", *OPTIONS[:-1], "cortex-m4"]
    assert main(command) == 0
    board = out / "valves" / "V0001" / "firmware" / "cortex_m4" / "dz_board.c"
    board.write_text(filled := board.read_text() + "/* mine */\n")
    common = (out / "lot_compensator.json").read_bytes()
    assert main(command) == 0
    assert "2 of them done before" in capsys.readouterr().err
    assert main([*command, *lot_options(tmp_path, 'guard = "mean"')]) == 0  # designed anew
    assert board.read_text() == filled
    assert main(command) == 0
    assert board.read_text() == filled and (out / "lot_compensator.json").read_bytes() == common


@pytest.mark.skipif(sys.platform == "win32", reason="pipes and sockets of the file system")
@pytest.mark.parametrize("pattern", [None, "*.csv*"])
def test_no_valve_is_calibrated_on_a_part_of_its_recordings(tmp_path, pattern, capsys):
    """What can't be read has a name like a recording's: the valve is refused, and the thing named."""
    lot, out = tmp_path / "lot", tmp_path / "out"
    makers = {
        "dangling": lambda path: path.symlink_to(tmp_path / "gone.csv"),
        "loop": lambda path: path.symlink_to(path),
        "pipe": os.mkfifo,
        "socket": lambda path: os.mknod(path, 0o600 | stat.S_IFSOCK),
    }
    for kind, make in makers.items():
        (lot / kind).mkdir(parents=True)
        for pressure in (1, 5):
            name = f"ramp_dP{pressure}_1.csv.gz"
            (lot / kind / name).symlink_to(ROOT / "examples" / "paper_valve" / "ramps" / name)
        make(lot / kind / "ramp_dP3_1.csv")
        (lot / kind / "old.csv").mkdir()
    options = [] if pattern is None else ["--pattern", pattern]
    begin = time.monotonic()
    assert main(["batch", str(lot), "-o", str(out), "--jobs", "1", *OPTIONS, *options]) == 1
    assert time.monotonic() - begin < 25, "nothing is waited for"
    found = {row["name"]: (row["status"], row["reason"]) for row in rows(out)}
    assert found.keys() == makers.keys()
    assert all(status == "failed" and "ramp_dP3_1.csv" in reason for status, reason in found.values()), found
