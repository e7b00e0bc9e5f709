"""A program that is waited for ends with the process that started it: by a kill, in time, and with its own children."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from dzdesign.core.processes.running import run_program

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no groups of processes")
#: A program that starts another one; both write their numbers and sleep.
PARENT = """
import os, subprocess, sys, time
from pathlib import Path
Path(sys.argv[1], str(os.getpid())).touch()
if len(sys.argv) == 2:
    subprocess.Popen([sys.executable, __file__, sys.argv[1], "child"])
time.sleep(60)
"""
RUN = "import sys; from dzdesign.core.processes.running import run_program; run_program(sys.argv[1:], timeout=60)"
PATIENCE_S = 20.0


@pytest.fixture
def program(tmp_path):
    (tmp_path / "numbers").mkdir()
    path = tmp_path / "program.py"
    path.write_text(PARENT, encoding="utf-8")
    return [sys.executable, str(path), str(tmp_path / "numbers")]


def running(folder: Path) -> list[int]:
    return [int(path.name) for path in folder.iterdir() if is_running(int(path.name))]


def is_running(number: int) -> bool:
    try:
        return psutil.Process(number).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def wait_for(count: int, folder: Path) -> None:
    end = time.monotonic() + PATIENCE_S
    while len(running(folder)) != count and time.monotonic() < end:
        time.sleep(0.05)
    assert len(running(folder)) == count


@pytest.mark.parametrize("by", [signal.SIGKILL, signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_kill_leaves_no_program(by, program):
    process = subprocess.Popen([sys.executable, "-c", RUN, *program], stderr=subprocess.DEVNULL)
    wait_for(2, Path(program[-1]))
    process.send_signal(by)
    process.wait()
    wait_for(0, Path(program[-1]))


def test_a_late_program_ends_with_what_it_has_started(program):
    begin = time.monotonic()
    with pytest.raises(subprocess.TimeoutExpired):
        run_program(program, timeout=2.0)
    assert time.monotonic() - begin < PATIENCE_S
    wait_for(0, Path(program[-1]))


def test_what_a_program_says_and_how_it_ends(tmp_path):
    words = "import os, sys; print(os.getcwd(), os.environ.get('A')); print('no', file=sys.stderr); sys.exit(3)"
    done = run_program([sys.executable, "-c", words], timeout=60, cwd=tmp_path, env={"A": "b"})
    assert (done.returncode, done.stdout, done.stderr) == (3, f"{tmp_path} b\n", "no\n")
    with pytest.raises(OSError):
        run_program([str(tmp_path / "absent")], timeout=60)


def test_a_program_that_has_ended_is_not_looked_for_any_more(tmp_path):
    """Its number may be another program's by then."""
    words = "from dzdesign.core.processes import running; import sys; told = []; "
    words += "running._tell = lambda *a: told.append(a); running.run_program([sys.executable, '-c', ''], timeout=60); "
    words += "print([sign for sign, _ in told])"
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['+', '-']"


FIRST = """
import os, signal, subprocess, sys
from dzdesign.core.processes import running
started = subprocess.Popen
def dies(command, **options):
    process = started(command, **options)
    if command[-1] != running.WATCH:  # the program has begun, and nothing more was done
        os.kill(os.getpid(), signal.SIGKILL)
    print("watch", flush=True)
    return process
subprocess.Popen = dies
running.run_program([sys.executable, "-c", ""], timeout=60)
"""


def test_no_program_begins_before_the_watch():
    done = subprocess.run([sys.executable, "-c", FIRST], capture_output=True, text=True, check=False)
    assert done.stdout == "watch\n" and done.returncode == -signal.SIGKILL
