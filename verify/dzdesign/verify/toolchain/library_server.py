"""Serve calls of a shared library: the child process of `compiled_library`, which runs this file by itself.

A call is a line of JSON with the function, what it returns, and of each argument its kind and value: a number, or the
octets of a buffer (null: a null pointer); then the buffers that are read. An answer is a line with what was returned,
then the buffers that were written.
"""

import ctypes
import json
import os
import sys
import threading
import time
from typing import BinaryIO


def serve(library: ctypes.CDLL, asks: BinaryIO, answers: BinaryIO) -> None:
    """Answer calls until their pipe ends."""
    for line in asks:
        name, returns, arguments = json.loads(line)
        given: list[object] = []
        written: list[ctypes.Array[ctypes.c_char]] = []
        for kind, value in arguments:
            if kind not in ("in", "out", "both"):
                given.append(_type(kind)(value))
            elif value is None:
                given.append(None)
            else:
                buffer = (ctypes.c_char * max(value, 1))()
                if kind != "out" and asks.readinto(memoryview(buffer)[:value]) != value:  # type: ignore[attr-defined]
                    return
                if kind != "in":
                    written.append(buffer)
                given.append(buffer)
        function = library[name]
        function.restype = None if returns == "void" else _type(returns)
        returned = function(*given)
        answers.write(json.dumps(returned or 0).encode() + b"\n")
        for buffer in written:
            answers.write(buffer)
        answers.flush()


def _type(name: str) -> "type[ctypes._SimpleCData[int]]":
    found: type[ctypes._SimpleCData[int]] = getattr(ctypes, f"c_{name.removesuffix('_t')}")
    return found


def _end_with(parent: int) -> None:
    """End soon after dzdesign, also in a call that hangs; Windows gives no orphan to another process."""
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    # What the C prints is no answer.
    with os.fdopen(os.dup(1), "wb") as pipe:
        os.dup2(2, 1)
        serve(ctypes.CDLL(sys.argv[1]), sys.stdin.buffer, pipe)
