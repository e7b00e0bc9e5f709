"""What a person is told on stderr while there is work: stages, bars after a second, and as much as they asked for."""

import contextlib
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sized

from dzdesign.core.errors import clear_line

#: Work that is done sooner shows no bar, s.
PATIENCE = 1.0
#: Time between two looks at how far a stage is, s.
REFRESH = 0.1


class _Talk:
    """How much is said by the command that runs; a process runs one."""

    quiet = False
    verbose = False
    begin = 0.0


@contextlib.contextmanager
def talking(*, quiet: bool, verbose: bool) -> Iterator[None]:
    """Say as much as a person asked for, while a command runs.

    Parameters
    ----------
    quiet : bool
        Nothing but results and errors, and no bars.
    verbose : bool
        Also what the rooms log: files read and written, the solver's and the compilers' words; each with the time
        since the beginning.
    """
    before = (_Talk.quiet, _Talk.verbose, _Talk.begin)
    _Talk.quiet, _Talk.verbose, _Talk.begin = quiet, verbose, time.perf_counter()
    try:
        with _logging() if verbose else contextlib.nullcontext():
            yield
            if verbose:
                say("end")
    finally:
        _Talk.quiet, _Talk.verbose, _Talk.begin = before


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
    """Tell of progress, on stderr: stdout is for results.

    Parameters
    ----------
    text : str
        One line.
    """
    if not _Talk.quiet:
        since = f"{time.perf_counter() - _Talk.begin:8.3f} s  " if _Talk.verbose else ""
        print(f"dzdesign: {since}{clear_line(text)}", file=sys.stderr, flush=True)


def is_watched() -> bool:
    """Tell whether a person sees stderr and wants to: a bar is drawn over itself, which a dumb terminal can't."""
    return sys.stderr.isatty() and not _Talk.quiet and not _Talk.verbose and os.environ.get("TERM") != "dumb"


@contextlib.contextmanager
def stage_progress() -> "Iterator[StageProgress]":
    """Give a `say` after which, once a stage has taken `PATIENCE`, a bar moves until the next stage, with the time."""
    stage = StageProgress()
    try:
        yield stage
    finally:
        stage.end()


class StageProgress:
    """A `say` for the stages of long work; rich is driven by a thread of its own, as the work may be one call of C."""

    def __init__(self) -> None:
        self._end: Callable[[], None] | None = None
        self._done, self._total = 0, None

    def __call__(self, text: str) -> None:
        """Begin a stage."""
        self.end()
        say(text)
        self._done, self._total = 0, None
        if is_watched():
            import threading

            over = threading.Event()
            thread = threading.Thread(target=self._show, args=(text, over), daemon=True)
            thread.start()
            self._end = lambda: (over.set(), thread.join())

    def each(self, items: Iterable, total: int) -> Iterator:
        """Return the items one by one: the bar of this stage knows its end then.

        Parameters
        ----------
        items : iterable
            Pieces of work, of about the same size.
        total : int
            How many.
        """
        self._total = total
        for self._done, item in enumerate(items):
            yield item

    def end(self) -> None:
        """End the stage, if there is one: its bar is gone."""
        if self._end:
            self._end()
        self._end = None

    def _show(self, text: str, over: "threading.Event") -> None:  # noqa: F821
        if over.wait(PATIENCE):
            return
        with _new_bar(known_end=False) as bar:
            task = bar.add_task(text, total=None)
            while not over.wait(REFRESH):
                bar.update(task, total=self._total, completed=self._done)


def with_bar(
    items: Iterable, what: str, clock: Callable[[], float] = time.monotonic, total: int | None = None
) -> Iterator:
    """Return the items one by one, with a bar on stderr once that has taken `PATIENCE`; none if it is no terminal.

    Parameters
    ----------
    items : iterable
        Pieces of work, of about the same size.
    what : str
        What is done with them.
    clock : callable
        Seconds, for the tests.
    total : int, optional
        How many there are, of an iterable that does not know.
    """
    if not is_watched():
        yield from items
        return
    start, bar = clock(), None
    total = len(items) if isinstance(items, Sized) else total
    try:
        for done, item in enumerate(items):
            if bar is None and done and clock() - start > PATIENCE:
                bar = _new_bar(known_end=True)
                task = bar.add_task(what, total=total)
                bar.start()
            if bar is not None:
                bar.update(task, completed=done)
            yield item
    finally:
        if bar is not None:
            bar.stop()


def _new_bar(*, known_end: bool) -> "Progress":  # noqa: F821
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    clock = TimeRemainingColumn() if known_end else TimeElapsedColumn()
    console = Console(stderr=True)
    return Progress(TextColumn("{task.description}"), BarColumn(), clock, console=console, transient=True)
