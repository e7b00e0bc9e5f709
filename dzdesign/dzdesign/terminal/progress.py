"""Progress on stderr: stages, bars, and as much of a log as was asked for."""

import contextlib
import os
import sys
import time
from collections.abc import Iterable, Iterator, Sized
from typing import TYPE_CHECKING, TextIO, TypeVar

from dzdesign.core.errors import clear_line

if TYPE_CHECKING:
    from rich.progress import Progress

T = TypeVar("T")


class _Verbosity:
    """How much the running command reports; a process runs one."""

    quiet = False
    verbose = False
    begin = 0.0


@contextlib.contextmanager
def reporting(*, quiet: bool, verbose: bool) -> Iterator[None]:
    """Report with the requested detail while a command runs: nothing if quiet; if verbose also the log, with times."""
    before = (_Verbosity.quiet, _Verbosity.verbose, _Verbosity.begin)
    _Verbosity.quiet, _Verbosity.verbose, _Verbosity.begin = quiet, verbose, time.perf_counter()
    try:
        with _logging() if verbose else contextlib.nullcontext():
            yield
            if verbose:
                say("end")
    finally:
        _Verbosity.quiet, _Verbosity.verbose, _Verbosity.begin = before


@contextlib.contextmanager
def _logging() -> Iterator[None]:
    """Send what the rooms log to stderr."""
    import logging

    class ToStderr(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            say(f"  {record.getMessage()}")

    logger, handler = logging.getLogger("dzdesign"), ToStderr()
    level = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.DEBUG)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)


def say(text: str) -> None:
    """Report progress on stderr; stdout is for results."""
    if not _Verbosity.quiet:
        since = f"{time.perf_counter() - _Verbosity.begin:8.3f} s  " if _Verbosity.verbose else ""
        say_on_stderr(f"{since}{clear_line(text)}")


def say_on_stderr(text: str) -> None:
    """Print a line on stderr; one on a full disk, or that nobody reads any more, ends no work: it is given up."""
    try:
        print(f"dzdesign: {text}", file=sys.stderr, flush=True)
    except OSError:
        lead_nowhere(sys.stderr)


def lead_nowhere(stream: TextIO) -> None:
    """Lead a standard stream nowhere: Python would try once more to print what it holds, at its end, and fail."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def is_verbose() -> bool:
    """Tell whether all details were asked for."""
    return _Verbosity.verbose


def is_watched() -> bool:
    """Tell whether a person sees stderr and wants to: a bar is drawn over itself, which a dumb terminal can't."""
    return sys.stderr.isatty() and not _Verbosity.quiet and not _Verbosity.verbose and os.environ.get("TERM") != "dumb"


@contextlib.contextmanager
def stage_progress(first: str = "") -> Iterator["StageProgress"]:
    """Give a `say` after which a bar moves until the next stage, with the time.

    The `first` stage, if it is named, begins at once.
    """
    stage = StageProgress()
    try:
        if first:
            stage(first)
        yield stage
    finally:
        stage.end()


class StageProgress:
    """A `say` for the stages of long work; rich moves the bar by a thread, as the work may be one call of C."""

    def __init__(self) -> None:
        self._bar: Progress | None = None

    def __call__(self, text: str) -> None:
        """Begin a stage."""
        say(text)
        self.begin(text)

    def begin(self, text: str, total: int | None = None) -> None:
        """Begin a stage of which nothing is told but by its bar."""
        self.end()
        if is_watched():
            from rich.console import Console
            from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

            columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
            self._bar = Progress(*columns, console=Console(stderr=True), transient=True)
            self._bar.add_task(text, total=total)
            self._bar.start()

    def each(self, items: Iterable[T], total: int | None) -> Iterator[T]:
        """Return the items one by one: the bar of this stage knows its end then."""
        for done, item in enumerate(items):
            if self._bar is not None:
                self._bar.update(self._bar.task_ids[0], total=total, completed=done)
            yield item

    def end(self) -> None:
        """End the stage, if there is one: its bar is gone."""
        if self._bar is not None:
            self._bar.stop()
        self._bar = None


def with_bar(items: Iterable[T], what: str, total: int | None = None) -> Iterator[T]:
    """Return the items one by one, with a bar on stderr; none if it is no terminal."""
    with stage_progress() as stage:
        stage.begin(what)
        yield from stage.each(items, len(items) if isinstance(items, Sized) else total)
