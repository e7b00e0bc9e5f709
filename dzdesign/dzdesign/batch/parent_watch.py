"""A worker process that ends when the process that started it does, however that ended: no worker is left behind."""

import os
import sys
import threading
import time

from dzdesign.core.scratch import remove_scratch

#: How often a worker looks for its parent.
LOOK_S = 0.5


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
