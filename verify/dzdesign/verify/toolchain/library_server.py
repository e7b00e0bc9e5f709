"""Serve calls of a shared library: the child process of `compiled_library`, which runs this file by itself.

A call is the function, what it returns, and of each argument its kind and value: a number, the octets of a buffer, how
many octets one has that is only written, or None for a null pointer. An answer is what was returned, and the octets of
the buffers that were written. Both are in Python's `marshal`.
"""

import contextlib
import ctypes
import marshal
import os
import sys
from typing import BinaryIO


def serve(library: ctypes.CDLL, asks: BinaryIO, answers: BinaryIO) -> None:
    """Answer calls until their pipe ends, which is an `EOFError`."""
    while True:
        name, returns, arguments = marshal.load(asks)
        given: list[object] = []
        written: list[ctypes.Array[ctypes.c_char]] = []
        for kind, value in arguments:
            if kind not in ("in", "out", "both"):
                given.append(_type(kind)(value))
            elif value is None:
                given.append(None)
            else:
                buffer = (ctypes.c_char * (value if kind == "out" else len(value)))()
                if kind != "out":
                    buffer.raw = value
                written += [buffer] if kind != "in" else []
                given.append(buffer)
        function = library[name]
        function.restype = None if returns == "void" else _type(returns)
        returned = function(*given)
        marshal.dump((returned or 0, [bytes(each) for each in written]), answers)
        answers.flush()


def _type(name: str) -> "type[ctypes._SimpleCData[int]]":
    found: type[ctypes._SimpleCData[int]] = getattr(ctypes, f"c_{name.removesuffix('_t')}")
    return found


if __name__ == "__main__":
    # What the C prints is no answer.
    with os.fdopen(os.dup(1), "wb") as pipe:
        os.dup2(2, 1)
        with contextlib.suppress(EOFError):
            serve(ctypes.CDLL(sys.argv[1]), sys.stdin.buffer, pipe)
