"""A machine that has no room, no memory or no output is one sentence and exit status 2, never a traceback."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import write_file
from dzdesign.core.artefact_types import RuleError
from dzdesign.identify.valve.bound_proof import BoundProof
from tests.support.paths import ROOT

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="shells, devices and limits of Linux")
DZDESIGN = Path(sys.executable).with_name("dzdesign")
RAMPS = ROOT / "examples" / "paper_valve" / "ramps"


def run(words: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a line of a shell, in which ``dz`` is the program, with the buffers that Python has by default."""
    line = words.replace("dz ", f"'{DZDESIGN}' ", 1)
    inherited = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    return subprocess.run(
        ["bash", "-c", line], cwd=folder, env={**inherited, **environment}, text=True, errors="replace",
        capture_output=True, timeout=100, check=False,
    )  # fmt: skip


def sentence(done: subprocess.CompletedProcess[str]) -> str:
    """Return what was said of the fault, and assert that it was one line and exit status 2."""
    assert done.returncode == 2 and "Traceback" not in done.stderr, done.stderr
    lines = done.stderr.strip().splitlines()
    assert lines[-1].startswith("dzdesign: "), done.stderr
    return lines[-1]


@pytest.mark.parametrize("words", ["dz --help", "dz codegen --help", "dz doctor"])
def test_an_output_that_is_full(tmp_path, words):
    assert "can't be printed: No space left" in sentence(run(f"{words} > /dev/full", tmp_path))


def test_a_full_output_names_what_was_written_before(tmp_path):
    done = run("dz simulate --dp '1 MPa' --ramp-time '5 s' -o ramps > /dev/full", tmp_path)
    assert "written before that: 'ramps'" in sentence(done)
    assert (tmp_path / "ramps/manifest.json").is_file()


def test_a_closed_output_is_said_before_any_work(tmp_path):
    assert "closed" in sentence(run("dz simulate --dp '1 MPa' --ramp-time '5 s' -o ramps >&-", tmp_path))
    assert not list(tmp_path.iterdir())


def test_a_closed_standard_error_says_nothing_and_does_the_work(tmp_path):
    done = run("dz simulate --dp '1 MPa' --ramp-time '5 s' -o ramps 2>&-", tmp_path)
    assert done.returncode == 0 and (tmp_path / "ramps/manifest.json").is_file()


def test_a_full_standard_error_says_nothing_and_does_the_work(tmp_path):
    done = run("dz simulate --dp '1 MPa' --ramp-time '5 s' -o ramps 2>/dev/full", tmp_path)
    assert done.returncode == 0 and (tmp_path / "ramps/manifest.json").is_file()
    assert run("dz design absent.json 2>/dev/full", tmp_path).returncode == 2


def test_an_interrupt_names_what_was_written_before(tmp_path, monkeypatch, capsys):
    def interrupted(*_) -> int:
        write_file(tmp_path / "valve.json", "{}")
        raise KeyboardInterrupt

    monkeypatch.setattr("dzdesign.core.artefact_files.written", [])
    monkeypatch.setattr("dzdesign.commands.doctor.run", interrupted)
    monkeypatch.setattr("signal.signal", lambda *_: None)
    assert main(["doctor"]) == 130
    said = capsys.readouterr().err
    place = tmp_path / "valve.json"
    assert said == f"dzdesign: interrupted; nothing half-written was left; written before that: '{place}'\n"


@pytest.mark.parametrize(("blocks", "said"), [(0, "no folder for temporary files"), (8, "a temporary file can't be")])
def test_no_room_for_temporary_files(tmp_path, blocks, said):
    done = run(
        f"ulimit -f {blocks}; '{DZDESIGN}' simulate --dp '1 MPa' -o ramps", tmp_path, XDG_CACHE_HOME=str(tmp_path / "c")
    )
    assert said in sentence(done) and "TMPDIR" in sentence(done) and not (tmp_path / "ramps").exists()


def test_a_compiler_that_is_no_command(tmp_path):
    assert "$CC" in run("dz doctor", tmp_path, CC='gcc "').stdout


def test_a_working_folder_whose_name_is_not_utf_8(tmp_path):
    folder = os.fsencode(tmp_path) + b"/bad\xff"
    os.mkdir(folder)
    done = run("dz simulate --dp '1 MPa' --ramp-time '5 s' -o ramps", Path(os.fsdecode(folder)))
    assert done.returncode == 0, done.stderr


def test_a_result_that_dzdesign_refuses_itself_is_its_own_fault(tmp_path, monkeypatch, capsys):
    """Not the recordings': one sentence, and not the exit status of bad input."""

    def refuse(*_):
        raise RuleError("the bound does not follow")

    monkeypatch.setattr(BoundProof, "check", refuse)
    ramps = [str(RAMPS / f"ramp_dP{dp}_1.csv.gz") for dp in (1, 5)]
    assert main(["identify", *ramps, "--curve", "line", "-o", str(tmp_path / "valve.json")]) == 1
    *_, last = capsys.readouterr().err.strip().splitlines()
    assert "internal error" in last and "does not follow" in last
    assert not list(tmp_path.iterdir())
