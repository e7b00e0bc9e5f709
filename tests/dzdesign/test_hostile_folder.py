"""Every command in a folder of hostile things: nothing of it runs, and nothing is written but the output.

A command ends with status 0, 1 or 2, with 2 in one sentence, and writes no control character to the terminal.
"""

import csv
import hashlib
import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from dzdesign.command_line.cli import main
from tests.dzdesign.hostile_folder import RECORD, hostile_folder
from tests.support.html_pages import Page
from tests.support.paths import ROOT

pytestmark = pytest.mark.skipif(os.name == "nt", reason="links, pipes and names that Windows has not")
PROGRAM = Path(sys.executable).with_name("dzdesign")
RAMPS = sorted((ROOT / "examples/paper_valve/ramps").glob("ramp_dP[15]_1.csv.gz"))
AFTER = [path.with_name(path.name.replace("_1.csv", "_2.csv")) for path in RAMPS]
#: Each command, given one hostile file or folder; `{}` is its name, `{out}` a new place for the output.
OF_ONE_INPUT = (
    "init {} -o {out}.toml",
    "identify {} -o {out}.json --u-max 10V",
    "identify {good} -o {out}.json --config {}",
    "design {} -o {out}.json",
    "codegen {} -o {out}",
    "calibration {} -o {out}.hex",
    "calibration --read {}",
    "export {} --to csv -o {out}.csv",
    "verify {} -o {out}",
    "batch {} -o {out} --jobs 1",
    "assess {} --after {} -o {out}.json",
    "report {} -o {out}.html",
    "simulate --plant {} -o {out}",
    "load {} --port absent",
)  # fmt: skip
#: On a terminal: what moves the cursor, sets a title or reads backwards.
CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f\x80-\x9f\u202a-\u202e\u2066-\u2069]")
#: Processor time of one command and its children, s: one that reads a device to its end takes for ever.
PATIENCE_S = 20.0


def snapshot(*folders: Path) -> dict[str, tuple]:
    """Return what lies in folders: kind, size, time of change and content of each file."""
    found = {}
    for folder in folders:
        for place, names, files in os.walk(folder):
            for name in (*names, *files):
                path = os.path.join(place, name)
                status = os.lstat(path)
                regular = stat.S_ISREG(status.st_mode)
                content = hashlib.sha256(Path(path).read_bytes()).hexdigest() if regular else ""
                times = status.st_mtime_ns if not stat.S_ISDIR(status.st_mode) else 0
                found[path] = (stat.S_IFMT(status.st_mode), status.st_size if regular else 0, times, content)
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = hostile_folder(tmp_path_factory.mktemp("hostile"))
    assert made.things() >= 60
    return made


def run_in_process(words, capfd):
    """Run a command; return its status and what it said."""
    begin = sum(os.times()[:4])
    try:
        status = main(words)
    except SystemExit as error:
        status = error.code
    said = capfd.readouterr()
    assert sum(os.times()[:4]) - begin < PATIENCE_S, words
    return status, said.out, said.err


@pytest.mark.parametrize("command", OF_ONE_INPUT, ids=lambda each: " ".join(each.split()[:2]))
def test_a_command_that_is_given_a_hostile_thing(command, folder, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(folder.place)
    for name in ("HOME", "TMPDIR", "XDG_CACHE_HOME"):
        (tmp_path / name).mkdir()
        monkeypatch.setenv(name, str(tmp_path / name))
    before = snapshot(folder.place, folder.outside, folder.canary)
    wrong = []
    for number, name in enumerate(folder.inputs):
        given = f"./{name}" if name.startswith("-") else name
        parts = {"{}": given, "{good}": str(RAMPS[0])}
        words = [parts.get(word, word.replace("{out}", str(tmp_path / f"out{number}"))) for word in command.split()]
        status, out, err = run_in_process(words, capfd)
        if status not in (0, 1, 2) or "Traceback" in out + err:
            wrong.append((name, status, err[-300:]))
        if status == 2 and (len(err.splitlines()) != 1 or not err.startswith("dzdesign") or out.strip()):
            wrong.append((name, status, f"not one sentence: {err[:300]!r} {out[:100]!r}"))
        if found := CONTROL.findall((out + err).replace("\r", "")):
            wrong.append((name, status, f"writes {found!r} to the terminal: {err[:300]!r}"))
        if (folder.place / name).is_dir() and "SECRET" in out + err:
            wrong.append((name, status, "shows what lies outside"))
    assert wrong == [], "\n".join(map(str, wrong))
    assert snapshot(folder.place, folder.outside, folder.canary) == before
    assert list(folder.canary.iterdir()) == []


#: Commands of a working day, in the hostile folder itself; `{out}` is the folder of the outputs.
OF_A_DAY = (
    ("init", *map(str, RAMPS), "-o", "{out}/dzdesign.toml"),
    ("identify", *map(str, RAMPS), "--curve", "line", "-o", "{out}/valve.json", "--plots", "{out}/plots",
     *(word for key, text in RECORD.items() for word in ("--record", f"{key} = {text}"))),
    ("design", "{out}/valve.json", "-o", "{out}/compensator.json"),
    ("codegen", "{out}/compensator.json", "--target", "f28335", "-o", "{out}/firmware"),
    ("codegen", "{out}/compensator.json", "--target", "iec61131", "-o", "{out}/plc"),
    ("codegen", "{out}/compensator.json", "--target", "matlab", "-o", "{out}/matlab"),
    ("calibration", "{out}/compensator.json", "-o", "{out}/block.hex"),
    ("calibration", "--read", "{out}/block.hex"),
    ("codegen", "{out}/compensator.json", "--target", "amplifier", "--device", "csv", "-o", "{out}/amplifier"),
    ("verify", "{out}/plc", "-o", "{out}/plc_evidence"),
    ("verify", "{out}/matlab", "-o", "{out}/matlab_evidence"),
    ("batch", "{lot}/valves.csv", "-o", "{out}/lot", "--jobs", "2", "--target", "host"),
    ("assess", *map(str, RAMPS), "--after", *map(str, AFTER), "-o", "{out}/assessment.json"),
    ("report", "{out}", "-o", "{out}/report.html"),
    ("report", "{out}/lot", "-o", "{out}/lot.html"),
    ("simulate", "--dp", "1 MPa", "-o", "{out}/simulated"),
    ("doctor",),
)  # fmt: skip


@pytest.fixture(scope="module")
def worked(folder):
    """Run the commands of a working day; return what each said, and what lay around them before and after."""
    out, home, scratch, lot = (folder.root / name for name in ("out", "home", "scratch", "lot"))
    for each in (out, home, scratch, lot):
        each.mkdir()
    _write_lot(lot)
    around = (folder.place, folder.outside, folder.canary, home, lot)
    before = snapshot(*around)
    environment = {**os.environ, "HOME": str(home), "TMPDIR": str(scratch), "PYTHONDONTWRITEBYTECODE": "1"}
    for name in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME"):  # of libraries, and of what is compiled once
        environment[name] = str(folder.root / name)
    for name in ("MPLCONFIGDIR", "PYTHONPATH"):
        environment.pop(name, None)
    said = []
    for words in OF_A_DAY:
        words = [word.replace("{out}", str(out)).replace("{lot}", str(lot)) for word in words]
        done = subprocess.run(
            [PROGRAM, *words], cwd=folder.place, env=environment, capture_output=True, text=True, timeout=900,
            stdin=subprocess.DEVNULL, check=False,
        )  # fmt: skip
        said.append((words[0], done.returncode, done.stdout + done.stderr))
    return said, before, snapshot(*around), out, scratch


def _write_lot(lot: Path) -> None:
    """Write a table of two valves, of whom one can't be calibrated; files and record have names that could be run."""
    hostile = lot / "{{7*7}}=<img src=x onerror=alert(1)>.csv"
    hostile.write_bytes(b"@SUM(1+1),u_V\n")
    with open(lot / "valves.csv", "w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(["name", "files", *(f"record.{key}" for key in RECORD)])
        table.writerow(["plain", str(RAMPS[0].with_name("ramp_dP[15]_*.csv.gz")), *RECORD.values()])
        table.writerow(["broken", f"{lot}/*=<img*.csv", *RECORD.values()])


@pytest.mark.slow
def test_a_working_day_in_a_hostile_folder(worked, folder):
    said, before, after, out, scratch = worked
    assert {path: (before.get(path), after.get(path)) for path in before.keys() | after.keys()
            if before.get(path) != after.get(path)} == {}  # fmt: skip
    assert list(folder.canary.iterdir()) == [] and list(scratch.iterdir()) == []
    for command, status, text in said:
        assert status in (0, 1) and "Traceback" not in text and "taken from" not in text, (command, status, text)
        assert not CONTROL.findall(text), (command, text)
    assert (out / "plc_evidence").is_dir() and (out / "lot" / "valves.csv").is_file()


@pytest.mark.slow
def test_pages_and_tables_of_that_day_run_nothing(worked):
    *_, out, _ = worked
    pages = sorted(out.rglob("*.html"))
    assert {path.name for path in pages} >= {"report.html"} and len(pages) >= 2
    assert any(RECORD["customer"] in Page(path.read_text(encoding="utf-8")).text for path in pages)
    assert f"'{RECORD['serial']}" in (out / "lot" / "valves.csv").read_text(encoding="utf-8")
    for path in pages:
        page = Page(path.read_text(encoding="utf-8"))
        assert not any(name == "img" and attributes.get("src") == "x" for name, attributes in page.tags), path
        assert not any(key.startswith("on") for _, attributes in page.tags for key in attributes), path
        assert "<script>alert" not in path.read_text(encoding="utf-8"), path
        assert "49" not in re.findall(r"customer|bench (\S+)", page.text), path
    for path in sorted(out.rglob("*.csv")):
        rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
        cells = [cell for row in rows for cell in row if not row[0].startswith("#")]
        formulas = [cell for cell in cells if cell[:1] in ("=", "+", "@") or (cell[:1] == "-" and not is_number(cell))]
        assert formulas == [], path


def is_number(cell: str) -> bool:
    return re.fullmatch(r"-?[\d.]+(e-?\d+)?", cell) is not None
