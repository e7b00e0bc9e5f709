"""The process that reads binary files ends with the one that asks it, and imports nothing from the working folder."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.dzdesign.batch.test_working_folder import is_there
from tests.identify.reading.test_file_formats import GOOD

#: What the reader, and what starts it, import.
MODULES = ("numpy", "scipy", "h5py", "polars", "nptdms", "joblib", "pickle", "signal", "threading", "typing")
DZDESIGN = Path(sys.executable).with_name("dzdesign.exe" if sys.platform == "win32" else "dzdesign")
#: It asks a reader that does not answer; under `nohup` a hangup would end nothing.
ASKING = """
import os, signal, time
signal.signal(getattr(signal, "SIGHUP", signal.SIGTERM), signal.SIG_DFL)
from dzdesign.core.processes import interrupts_kept_waiting
from dzdesign.identify.reading.binary_table import _reader
with interrupts_kept_waiting():
    reader = _reader(os.getpid())
    answer = reader.submit(time.sleep, 60)
print(*reader._processes, flush=True)
answer.result()
"""
#: An orphan is gone after this, s.
SOON_S = 5.0


@pytest.mark.skipif(sys.platform == "win32", reason="signals are of POSIX")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_a_busy_reader_ends_with_the_process_that_asks_it_and_nothing_is_said(tmp_path, number):
    with open(tmp_path / "said", "wb") as said:
        asking = subprocess.Popen([sys.executable, "-c", ASKING], stdout=subprocess.PIPE, stderr=said, text=True)
    reader = int(asking.stdout.readline())
    time.sleep(0.5)  # until it asks
    asking.send_signal(number)
    asking.wait(timeout=30)
    asking.stdout.close()
    end = time.monotonic() + SOON_S
    while (there := is_there(reader)) and time.monotonic() < end:
        time.sleep(0.05)
    if there:
        os.kill(reader, signal.SIGKILL)
    assert not there
    time.sleep(1)  # the helpers of joblib end after it
    assert (tmp_path / "said").read_text() == ""


@pytest.mark.parametrize("name", ["mat 5", "parquet"])
def test_no_module_of_the_working_folder_is_imported(tmp_path, name):
    mark = tmp_path / "imported"
    for module in MODULES:
        text = f"open({str(mark)!r}, 'a').write({module!r} + '\\n')\nraise SystemExit(3)\n"
        (tmp_path / f"{module}.py").write_text(text, encoding="utf-8")
    (tmp_path / "ramp.mat").write_bytes(GOOD[name])
    words = [DZDESIGN, "init", "ramp.mat"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert not mark.exists(), mark.read_text()
    assert done.returncode == 0 and "dP_MPa" in done.stdout, done.stderr
