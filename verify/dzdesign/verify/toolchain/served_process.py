"""A program within limits that stays and answers: octets over pipes of its own, each answer of a known size, in time.

Whatever it does, ends, hangs, answers too little or unasked, is one sentence. Its standard output goes nowhere, and its
pipes have other numbers than that, but on Windows, where they are its standard input and output.
"""

import contextlib
import os
import select
import subprocess
import sys
import tempfile
import time
import weakref
from pathlib import Path
from threading import Timer

from dzdesign.core.errors import RequirementError
from dzdesign.core.processes.running import ended_with_this_process, start_watch
from dzdesign.verify.toolchain.confinement import (
    MOST_MEMORY,
    end_program,
    limited_environment,
    limits,
    reason_of,
    text_of,
)
from dzdesign.verify.toolchain.host_compiler import build_folder

#: CPU time that a program which stays may take over all its calls, s.
LIFETIME_S = 86_400.0
#: Characters of its complaint that a sentence has.
LONGEST = 200
#: What a pipe holds on Linux: the arrays of a run have megabytes.
PIPE_OCTETS = 1 << 20
#: Whether a pipe can be waited for; else a timer ends the program, and with it the pipe.
POLLS = sys.platform != "win32"


class ServedProcess:
    """One program; it ends with this object, and with dzdesign."""

    def __init__(self, program: Path, what: str) -> None:
        self._what, self._polls = what, POLLS
        with contextlib.ExitStack() as stack:
            self._folder = Path(
                stack.enter_context(
                    tempfile.TemporaryDirectory(prefix="served-", dir=build_folder(), ignore_cleanup_errors=True)
                )
            )
            self._start(program, stack)
            self._ends = weakref.finalize(self, stack.pop_all().close)

    def _start(self, program: Path, stack: contextlib.ExitStack) -> None:
        """Start the program, and have everything that it holds go with the stack."""
        (self._folder / "empty").mkdir()
        asks, answers, theirs = _pipes(stack) if sys.platform != "win32" else (-1, -1, ())
        numbers, streams = tuple(map(str, theirs)), (subprocess.DEVNULL if theirs else subprocess.PIPE)
        command = [*limits(LIFETIME_S, MOST_MEMORY, None), str(program), *numbers]
        start_watch()
        try:
            with (self._folder / "err").open("wb") as err:
                self._process = subprocess.Popen(
                    command, stdin=streams, stdout=streams, stderr=err, cwd=self._folder / "empty", bufsize=0,
                    env=limited_environment(), pass_fds=theirs, start_new_session=sys.platform != "win32",
                )  # fmt: skip
        except OSError as error:
            raise RequirementError(f"{self._what} did not start: {error}") from error
        finally:
            for each in theirs:
                os.close(each)
        stack.enter_context(ended_with_this_process(self._process.pid))
        stack.callback(end_program, self._process)
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stack.callback(stream.close)
        if self._process.stdin and self._process.stdout:
            asks, answers = self._process.stdin.fileno(), self._process.stdout.fileno()
        self._asks, self._answers = asks, answers
        if self._polls:
            os.set_blocking(asks, False)
            os.set_blocking(answers, False)

    def answer(self, asked: bytes, size: int, timeout_s: float) -> bytearray:
        """Return the octets of an answer, so many; no such answer in time is a `RequirementError`, and its end."""
        try:
            found = self._polled(asked, size, timeout_s) if self._polls else self._timed(asked, size, timeout_s)
        except BaseException:
            self.end()
            raise
        return found

    def end(self) -> None:
        """End the program, with all that it has started in its group."""
        self._ends()

    def _polled(self, asked: bytes, size: int, timeout_s: float) -> bytearray:
        """Ask and read side by side: a program that answers before it has read must not stop both."""
        until, rest = time.monotonic() + timeout_s, memoryview(asked)
        found = bytearray(size)
        room, poll = memoryview(found), select.poll()
        poll.register(self._answers, select.POLLIN)
        if poll.poll(0):
            raise self._other("unasked, or has ended") if self._reads(memoryview(bytearray(1))) else self._ended()
        rest = rest[self._writes(rest) :]
        if rest:
            poll.register(self._asks, select.POLLOUT)
        while rest or room:
            ready = poll.poll(max(until - time.monotonic(), 0.0) * 1e3)
            if not ready:
                raise self._late(timeout_s)
            if rest:
                rest = rest[self._writes(rest) :]
                if not rest:
                    poll.unregister(self._asks)
            if any(each == self._answers for each, _ in ready):
                if not room:
                    raise self._other("before it was asked")
                count = self._reads(room)
                if not count:
                    raise self._ended()
                room = room[count:]
        return found

    def _timed(self, asked: bytes, size: int, timeout_s: float) -> bytearray:
        """Ask, then read, while a timer stands by."""
        late, found = [], bytearray(size)

        def end_late() -> None:
            late.append(True)
            self._process.kill()

        timer = Timer(timeout_s, end_late)
        timer.start()
        try:
            rest, room = memoryview(asked), memoryview(found)
            while rest:
                rest = rest[self._writes(rest) :]
            while room:
                count = self._reads(room)
                if not count:
                    raise self._late(timeout_s) if late else self._ended()
                room = room[count:]
        except RequirementError:
            if late:
                raise self._late(timeout_s) from None
            raise
        finally:
            timer.cancel()
        return found

    def _writes(self, rest: memoryview) -> int:
        """Write what fits into the pipe, and return how much; to a program that has ended is an error."""
        try:
            return os.write(self._asks, rest[: 1 << 24])
        except BlockingIOError:
            return 0
        except OSError as error:
            raise self._ended() from error

    def _reads(self, room: memoryview) -> int:
        """Read what there is, and return how much; 0: the program has closed its pipe."""
        try:
            return os.readv(self._answers, [room]) if self._polls else self._read_into(room)
        except OSError as error:
            raise self._ended() from error

    def _read_into(self, room: memoryview) -> int:
        found = os.read(self._answers, min(len(room), 1 << 20))
        room[: len(found)] = found
        return len(found)

    def _ended(self) -> RequirementError:
        """Return the sentence of a program whose pipe has ended, which it does with it or before."""
        try:
            reason = reason_of(self._process.wait(timeout=1.0)) or "exit status 0"
        except subprocess.TimeoutExpired:
            return RequirementError(f"{self._what} answers no longer, and has not ended")
        complaint = " ".join(text_of(self._folder / "err").split())[:LONGEST]
        return RequirementError(f"{self._what} ended with {reason}" + (f": {complaint}" if complaint else ""))

    def _late(self, timeout_s: float) -> RequirementError:
        return RequirementError(f"{self._what} did not end within {timeout_s:g} s")

    def _other(self, when: str) -> RequirementError:
        return RequirementError(f"{self._what} answered {when}")


def _pipes(stack: contextlib.ExitStack) -> tuple[int, int, tuple[int, int]]:
    """Return this process's ends of two pipes, which go with the stack, and the other ends, for reading and writing."""
    read, asks = os.pipe()
    stack.callback(os.close, asks)
    answers, write = os.pipe()
    stack.callback(os.close, answers)
    if sys.platform == "linux":
        import fcntl

        for each in (asks, answers):
            with contextlib.suppress(OSError):  # what a user's pipes may hold together is limited
                fcntl.fcntl(each, fcntl.F_SETPIPE_SZ, PIPE_OCTETS)
    return asks, answers, (read, write)
