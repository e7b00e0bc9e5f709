"""A batch imports nothing from the folder it is started in, leaves no process behind, and takes large recordings."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dzdesign.batch.runners import _in_processes
from dzdesign.core.documents import MOST_DOCUMENT, read_recording
from dzdesign.core.errors import InputError
from dzdesign.core.processes import end_with
from tests.support.many_valves import LOT_TOML, recordings

#: What a start of Python, NumPy, joblib or CasADi imports.
MODULES = ("json", "socket", "numpy", "joblib", "casadi", "msgspec", "sitecustomize", "encodings", "pickle", "typing")
DZDESIGN = Path(sys.executable).with_name("dzdesign.exe" if sys.platform == "win32" else "dzdesign")
CHILD = """
import os, sys, time
from dzdesign.core.processes import end_with
from dzdesign.core.placing import process_folder
end_with(os.getppid())
print(os.getpid(), process_folder(), flush=True)
time.sleep(600)
"""
#: Under `nohup` a hangup would end nothing.
PARENT = f"""
import signal, subprocess, sys, time
signal.signal(getattr(signal, "SIGHUP", signal.SIGTERM), signal.SIG_DFL)
subprocess.Popen([sys.executable, "-c", {CHILD!r}])
time.sleep(600)
"""


@pytest.mark.slow
def test_no_module_of_the_working_folder_is_imported(tmp_path):
    for number in range(2):
        (folder := tmp_path / f"lot/V{number}").mkdir(parents=True)
        for name, content in recordings(number, 7).items():
            (folder / name).write_bytes(content)
    mark = tmp_path / "imported"
    for name in MODULES:
        text = f"open({str(mark)!r}, 'a').write({name!r} + '\\n')\nraise SystemExit(3)\n"
        (tmp_path / f"{name}.py").write_text(text, encoding="utf-8")
    (tmp_path / "matplotlibrc").write_text("backend: module://socket\n", encoding="utf-8")
    words = ["batch", "lot", "--jobs", "2", "--target", "host", "--config", str(LOT_TOML), "-o", "out"]
    done = subprocess.run([DZDESIGN, *words], cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert not mark.exists(), mark.read_text()
    assert done.returncode == 0 and (tmp_path / "out/valves.csv").is_file(), done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="signals are of POSIX")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_a_worker_ends_with_its_parent_and_its_scratch_folder_too(number):
    parent = subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True)
    worker, folder = parent.stdout.readline().split()
    parent.send_signal(number)
    parent.wait(timeout=30)
    end = time.monotonic() + 5
    while (is_there(int(worker)) or Path(folder).exists()) and time.monotonic() < end:
        time.sleep(0.05)
    parent.stdout.close()
    assert not is_there(int(worker)) and not Path(folder).exists()


def is_there(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{process}/stat")  # a zombie has ended
    return not (stat.is_file() and stat.read_text().rpartition(")")[2].split()[0] == "Z")


@pytest.mark.skipif(sys.platform == "win32", reason="signals are of POSIX")
def test_an_interrupt_is_for_the_command_and_for_no_worker():
    """A worker that heard it as it starts would write pages of its own."""
    found = list(_in_processes(range(2), 2, lambda _: signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())))
    assert found == [True, True]
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_watching_a_parent_that_lives_ends_nothing():
    end_with(os.getppid())
    time.sleep(1.2)


def test_a_recording_larger_than_a_document_is_read(tmp_path, monkeypatch):
    path = tmp_path / "ramp.csv"
    with open(path, "wb") as file:
        file.truncate(MOST_DOCUMENT + 1)
    assert len(read_recording(path, "ramp file")) == MOST_DOCUMENT + 1
    monkeypatch.setattr("dzdesign.core.documents.MOST_RECORDING", 1000)
    with pytest.raises(InputError, match="identify"):
        read_recording(path, "ramp file")
