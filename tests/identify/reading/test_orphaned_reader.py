"""The process that reads binary files ends with the one that asks it, whatever it is doing."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

#: It asks a reader that does not answer; under `nohup` a hangup would end nothing.
ASKING = """
import os, signal
signal.signal(getattr(signal, "SIGHUP", signal.SIGTERM), signal.SIG_DFL)
from dzdesign.identify.reading.binary.reader_process import ReaderProcess
from dzdesign.identify.reading.binary.reader_server import Request
reader = ReaderProcess()
os.kill(reader.process.pid, signal.SIGSTOP)
print(reader.process.pid, flush=True)
reader.ask(Request(place="", path="", format_name="TDMS"), 60.0)
"""
#: An orphan is gone after this, s.
SOON_S = 5.0


@pytest.mark.skipif(sys.platform == "win32", reason="signals are of POSIX")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_a_busy_reader_ends_with_the_process_that_asks_it(number):
    asking = subprocess.Popen([sys.executable, "-c", ASKING], stdout=subprocess.PIPE, text=True)
    reader = int(asking.stdout.readline())
    time.sleep(0.5)  # until it asks
    asking.send_signal(number)
    asking.wait(timeout=30)
    asking.stdout.close()
    end = time.monotonic() + SOON_S
    while (there := _is_there(reader)) and time.monotonic() < end:
        time.sleep(0.05)
    if there:
        os.kill(reader, signal.SIGKILL)
    assert not there


def _is_there(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{process}/stat")  # a zombie has ended
    return not (stat.is_file() and stat.read_text().rpartition(")")[2].split()[0] == "Z")
