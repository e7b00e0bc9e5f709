"""C functions that are called as data: linked to a program of their own, which runs within limits beside dzdesign.

Nothing of the code is loaded into dzdesign. The functions are declared here, and what is linked with them serves their
calls over pipes (programs/served_calls.c). What comes back are octets of sizes that are known before.
"""

import struct
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.verify.toolchain.host_compiler import built, host_compiler, words_of
from dzdesign.verify.toolchain.served_process import ServedProcess

SERVER = "served_calls.c"
#: A call that takes longer hangs, s.
CALL_S = 60.0
#: Types of numbers.
NUMBERS = ("int16_t", "uint16_t", "int32_t", "uint32_t", "int64_t")
#: Kinds of buffers: the functions read them, write them from zeros on, or read and write them. How C has each, and its
#: letter in the server.
BUFFERS = {"in": ("const void *", "i"), "out": ("void *", "o"), "both": ("void *", "b")}
#: Frames of served_calls.c.
ASKED, ANSWERED = struct.Struct("=QII"), struct.Struct("=QqQ")
#: What a function may be given.
Given = int | np.ndarray | bytes | None


@dataclass(frozen=True, slots=True)
class Function:
    """A function in C: of each argument one of `NUMBERS` or `BUFFERS`, and one of `NUMBERS` or void that it returns."""

    name: str
    arguments: tuple[str, ...] = ()
    returns: str = "void"

    def in_c(self, place: int) -> str:
        """Return its declaration, and the function that calls it with values from a frame."""
        types = [BUFFERS[each][0] if each in BUFFERS else each for each in self.arguments]
        values = [
            f"values[{at}].buffer" if each in BUFFERS else f"({each})values[{at}].number"
            for at, each in enumerate(self.arguments)
        ]
        call = f"{self.name}({', '.join(values)})"
        body = f"    {call};\n    return 0;\n" if self.returns == "void" else f"    return (int64_t){call};\n"
        unused = "" if values else "    (void)values;\n"
        return (
            f"{self.returns} {self.name}({', '.join(types) or 'void'});\n"
            f"static int64_t call_{place}(const union value *values)\n{{\n{unused}{body}}}\n"
        )

    @property
    def letters(self) -> str:
        """A letter of each argument, as the server has them."""
        return "".join(BUFFERS[each][1] if each in BUFFERS else "n" for each in self.arguments)


def calls_in_c(functions: Sequence[Function]) -> str:
    """Return calls.h, with which the server is compiled."""
    rows = ", ".join(f'{{call_{place}, "{each.letters}"}}' for place, each in enumerate(functions))
    texts = [each.in_c(place) for place, each in enumerate(functions)]
    return "\n".join([*texts, f"static const struct function functions[] = {{{rows}}};\n"])


class ConfinedLibrary:
    """C files, compiled with the headers among them; the program starts with the first call.

    It stays until this object goes, so that what the C keeps in static memory stays as well. A program that has ended,
    by whatever it did, is not started again: each further call is the same `RequirementError`. A library serves one
    call after another; for calls side by side there are several.
    """

    def __init__(
        self, sources: Mapping[str, str], functions: Sequence[Function], what: str, options: Sequence[str] = ()
    ) -> None:
        self._what, self._lock = what, Lock()
        self._functions = {each.name: (place, each) for place, each in enumerate(functions)}
        own = {SERVER: _server(), "calls.h": calls_in_c(functions)}
        texts = {name: text.encode(errors="surrogateescape") for name, text in {**sources, **own}.items()}
        units = [name for name in texts if name.endswith(".c")]
        command = [*words_of(host_compiler()), "-std=c99", "-O2", *options, *units, "-lm"]
        self._program = built(f"served{'.exe' if sys.platform == 'win32' else ''}", command, texts, what)
        self._process: ServedProcess | None = None
        self._failure: RequirementError | None = None
        self._serial = 0

    def call(self, name: str, *given: Given, timeout_s: float | None = None) -> int:
        """Call a function and return what it returns, 0 if that is nothing.

        A number is an int; a buffer an array whose items lie one after another, into which is written what the function
        wrote, octets that are read alone, or None for a null pointer. A function that crashes, hangs, ends the program,
        takes too much memory or answers with anything else is a `RequirementError`.
        """
        place, function = self._functions[name]
        asked, written = _frame(function, given)
        size = sum(each.nbytes for each in written)
        with self._lock:
            if self._failure is not None:
                raise RequirementError(str(self._failure))
            self._serial += 1
            head = ASKED.pack(self._serial, place, len(given))
            try:
                found = self._answer(head + asked, size, CALL_S if timeout_s is None else timeout_s)
            except RequirementError as error:
                self._failure = error
                raise
        returned, at = ANSWERED.unpack_from(found)[1], ANSWERED.size
        for each in written:
            each.reshape(-1).view(np.uint8)[:] = np.frombuffer(found, np.uint8, each.nbytes, at)
            at += each.nbytes
        return int(returned)

    def _answer(self, asked: bytes, size: int, timeout_s: float) -> bytearray:
        """Return the frame of an answer with so many octets of buffers; any other is an error."""
        if self._process is None:
            self._process = ServedProcess(self._program, self._what)
        found = self._process.answer(asked, ANSWERED.size + size, timeout_s)
        serial, _, octets = ANSWERED.unpack_from(found)
        if (serial, octets) != (self._serial, size):
            self._process.end()
            raise RequirementError(
                f"{self._what} answered with other data than a call returns: {octets} octets of call {serial}, "
                f"expected {size} of call {self._serial}"
            )
        return found


def _frame(function: Function, given: Sequence[Given]) -> tuple[bytes, list[np.ndarray]]:
    """Return values and buffers of a call, and the arrays that its answer is written to."""
    values: list[int] = []
    sent: list[bytes] = []
    written: list[np.ndarray] = []
    for kind, value in zip(function.arguments, given, strict=True):
        if kind not in BUFFERS:
            if not isinstance(value, int):
                raise TypeError(f"{function.name}() takes {kind}, got {type(value).__name__}")
            values.append(value)
            continue
        if value is None:
            values.append(-1)
            continue
        array = np.frombuffer(value, np.uint8) if isinstance(value, bytes) else np.asarray(value)
        if not array.flags.c_contiguous or (kind != "in" and not array.flags.writeable):
            raise TypeError(f"{function.name}() takes arrays whose items lie in order, and writes into no octets")
        values.append(array.nbytes)
        if kind != "out":
            sent.append(array.tobytes())
        if kind != "in":
            written.append(array)
    return b"".join([struct.pack(f"={len(values)}q", *values), *sent]), written


def _server() -> str:
    return (Path(__file__).parent / "programs" / SERVER).read_text(encoding="utf-8")
