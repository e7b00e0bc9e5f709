"""Worker processes of loky: they import nothing from the working folder, hear no Ctrl-C, and end with their parent."""

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from dzdesign.core.scratch import remove_scratch

#: How often a worker looks for its parent.
LOOK_S = 0.5
#: Python then looks for modules neither in the working folder nor beside a script.
SAFE_PATH = "PYTHONSAFEPATH"


def end_with(parent: int) -> None:
    """Let this process end soon after its parent, whose number is given; its scratch folders go too."""
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    if sys.platform == "win32":
        _wait_for_end(parent)
    else:
        while os.getppid() == parent:  # an orphan is given to another process
            time.sleep(LOOK_S)
    remove_scratch()
    os._exit(1)  # from another thread than the main one nothing else ends a process


def _wait_for_end(process: int) -> None:
    """Wait for the end of a process of Windows, which gives no orphan to another."""
    import ctypes

    synchronize, forever = 0x00100000, 0xFFFFFFFF
    kernel = ctypes.windll.kernel32  # type: ignore[attr-defined,unused-ignore]
    kernel.OpenProcess.restype = ctypes.c_void_p
    kernel.WaitForSingleObject.argtypes = (ctypes.c_void_p, ctypes.c_uint32)
    handle = kernel.OpenProcess(synchronize, False, process)
    if handle:  # none: it has ended already
        kernel.WaitForSingleObject(handle, forever)


@contextmanager
def safe_path() -> Iterator[None]:
    """Let processes that are started meanwhile import no module from the working folder: recordings lie there."""
    with _environment(SAFE_PATH, "1"):
        yield


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        os.environ.pop(name)
        if before is not None:
            os.environ[name] = before


@contextmanager
def interrupts_kept_waiting() -> Iterator[None]:
    """Let processes that are started meanwhile hear no Ctrl-C, which is for this one: as they start it is a traceback.

    The helpers of joblib, which allow it again as they start, are started before; they say nothing of what is left to
    clean up where this process is killed.
    """
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker

    from joblib.externals.loky.backend import resource_tracker as loky_tracker

    with _environment("PYTHONWARNINGS", "ignore"):
        resource_tracker.ensure_running()
        loky_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
