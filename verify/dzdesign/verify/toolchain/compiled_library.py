"""C functions that are called as data: compiled to a library, which a child process loads and serves.

Nothing of the code is loaded into dzdesign: a crash of it is one sentence, and a call that hangs is ended.
"""

import contextlib
import json
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Lock, Timer

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.verify.toolchain.host_compiler import built, host_compiler, words_of
from dzdesign.verify.toolchain.machines import HOST_FLAGS, reason_of

SERVER = Path(__file__).with_name("library_server.py")
#: A call that takes longer hangs, s.
CALL_S = 60.0
#: Kinds of buffers: the functions read them, write them from zeros on, or read and write them.
BUFFERS = ("in", "out", "both")
#: On Windows a function is exported by a word to the linker, which GCC's, LLVM's and Microsoft's take from an object.
EXPORTED = '__asm__(".section .drectve,\\"yn\\"\\n\\t.ascii \\" -export:{}\\"");\n'
#: What a pipe is asked to hold where that can be said: the arrays of a run have megabytes.
PIPE_OCTETS = 1 << 20
#: Characters of a complaint that a sentence has.
LONGEST = 200
#: What a function may be given.
Given = int | np.ndarray | bytes | None


@dataclass(frozen=True, slots=True)
class Function:
    """A function in C: of each argument a type of numbers such as int16_t, or one of `BUFFERS`; and what it returns."""

    name: str
    arguments: tuple[str, ...] = ()
    returns: str = "void"


class CompiledLibrary:
    """C files, compiled with the headers among them, and objects; the child process starts with the first call.

    It stays until this object goes, so that what the C keeps in static memory stays as well. A process that has ended
    is not started again: each further call is the same `RequirementError`. A library serves one call after another; for
    calls side by side there are several.
    """

    def __init__(
        self, sources: Mapping[str, str], functions: Sequence[Function], what: str, options: Sequence[str] = (),
        objects: Sequence[Path] = (),
    ) -> None:  # fmt: skip
        self._what, self._lock, self._failure = what, Lock(), ""
        self._functions = {each.name: each for each in functions}
        exports = "".join(map(EXPORTED.format, self._functions)) if sys.platform == "win32" else ""
        texts = {name: text.encode(errors="surrogateescape") for name, text in sources.items()}
        texts |= {"dz_exports.c": exports.encode()} if exports else {}
        units = [name for name in texts if name.endswith(".c")]
        command = [*words_of(host_compiler()), "-shared", *HOST_FLAGS, *options, *units, *map(str, objects), "-lm"]
        self._library = built(f"library{'.dll' if sys.platform == 'win32' else '.so'}", command, texts, what)
        self._process: subprocess.Popen[bytes] | None = None

    def call(self, name: str, *given: Given, timeout_s: float | None = None) -> int:
        """Call a function and return what it returns, 0 if that is nothing.

        A number is an int; a buffer an array whose items lie one after another, into which is written what the function
        wrote, octets that are read alone, or None for a null pointer. A function that crashes, hangs or ends the
        process is a `RequirementError`.
        """
        asked, written = _frame(self._functions[name], given)
        with self._lock:
            if not self._failure:
                returned = self._answer(asked, written, CALL_S if timeout_s is None else timeout_s)
            if self._failure:
                raise RequirementError(self._failure)
        return returned

    def _answer(self, asked: Sequence[bytes], written: Sequence[np.ndarray], timeout_s: float) -> int:
        """Ask, fill the arrays and return what was returned; the first failure is kept in words."""
        process = self._process = self._process or self._started()
        asks, answers = process.stdin, process.stdout
        if asks is None or answers is None:
            raise RequirementError(f"{self._what} has no pipes")
        late = Event()

        def end_late() -> None:
            late.set()
            process.kill()

        timer = Timer(timeout_s, end_late)
        timer.start()
        try:
            for each in asked:
                asks.write(each)
            asks.flush()
            line = answers.readline()
            octets = [answers.readinto(each.reshape(-1).view(np.uint8)) for each in written]  # type: ignore[attr-defined]
            if line.endswith(b"\n") and octets == [each.nbytes for each in written]:
                return int(line)
        except OSError:  # the pipe of a process that has ended
            pass
        except BaseException:
            self._ends()
            raise
        finally:
            timer.cancel()
        reason = reason_of(process.wait()) or "exit status 0"
        self._errors.seek(0)
        complaint = self._errors.read().decode(errors="replace").strip().rpartition("\n")[2][:LONGEST]
        self._failure = f"{self._what} ended with {reason}" + (f": {complaint}" if complaint else "")
        if late.is_set():
            self._failure = f"{self._what} did not end within {timeout_s:g} s"
        self._ends()
        return 0

    def _started(self) -> "subprocess.Popen[bytes]":
        """Start the child process, and have it end with this object; with dzdesign it ends by itself."""
        with contextlib.ExitStack() as stack:
            self._errors = stack.enter_context(tempfile.TemporaryFile())
            process = subprocess.Popen(
                [sys.executable, "-I", "-S", str(SERVER), str(self._library)], stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=self._errors, start_new_session=sys.platform != "win32",
            )  # fmt: skip
            stack.callback(_end, process)
            _widen(process)
            self._ends = weakref.finalize(self, stack.pop_all().close)
        return process


def _widen(process: "subprocess.Popen[bytes]") -> None:
    if sys.platform == "linux":
        import fcntl

        for pipe in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):  # what a user's pipes may hold together is limited
                fcntl.fcntl(pipe or -1, fcntl.F_SETPIPE_SZ, PIPE_OCTETS)


def _end(process: "subprocess.Popen[bytes]") -> None:
    """End a process and close its pipes, which may hold what it never read."""
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        with contextlib.suppress(OSError):
            if pipe is not None:
                pipe.close()


def _frame(function: Function, given: Sequence[Given]) -> tuple[list[bytes], list[np.ndarray]]:
    """Return the parts of a call, and the arrays that its answer is written to."""
    values: list[tuple[str, int | None]] = []
    sent: list[bytes] = []
    written: list[np.ndarray] = []
    for kind, value in zip(function.arguments, given, strict=True):
        if kind not in BUFFERS:
            if not isinstance(value, int):
                raise TypeError(f"{function.name}() takes {kind}, got {type(value).__name__}")
            values.append((kind, value))
        elif value is None:
            values.append((kind, None))
        else:
            array = np.frombuffer(value, np.uint8) if isinstance(value, bytes) else np.asarray(value)
            if not array.flags.c_contiguous or (kind != "in" and not array.flags.writeable):
                raise TypeError(f"{function.name}() takes arrays whose items lie in order, and writes into no octets")
            values.append((kind, array.nbytes))
            if kind != "out":
                sent.append(array.tobytes())
            if kind != "in":
                written.append(array)
    head = json.dumps([function.name, function.returns, values]).encode() + b"\n"
    return [head, *sent], written
