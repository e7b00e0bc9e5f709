"""What a person is told on stderr while there is work: stages, bars after a second, and as much as they asked for."""

import contextlib
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sized

from dzdesign.core.errors import one_line

#: Work that is done sooner shows no bar, s.
PATIENCE = 1.0


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
    _Talk.quiet, _Talk.verbose, _Talk.begin = quiet, verbose, time.perf_counter()
    try:
        with _logging() if verbose else contextlib.nullcontext():
            yield
            if verbose:
                say("end")
    finally:
        _Talk.quiet = _Talk.verbose = False


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
        print(f"dzdesign: {since}{one_line(text)}", file=sys.stderr, flush=True)


def is_watched() -> bool:
    """Tell whether a person sees stderr and wants to: a bar is drawn over itself, which a dumb terminal can't."""
    return sys.stderr.isatty() and not _Talk.quiet and not _Talk.verbose and os.environ.get("TERM") != "dumb"


@contextlib.contextmanager
def stages() -> Iterator[Callable[[str], None]]:
    """Give a `say` after which, once a stage has taken `PATIENCE`, a bar moves until the next stage, with the time."""
    with contextlib.ExitStack() as running:

        def stage(text: str) -> None:
            running.close()
            say(text)
            running.enter_context(_moving(text))

        yield stage


@contextlib.contextmanager
def _moving(text: str) -> Iterator[None]:
    """Show a bar of unknown end while work lasts that takes longer than `PATIENCE`."""
    if not is_watched():
        yield
        return
    import threading

    over = threading.Event()

    def show() -> None:
        if over.wait(PATIENCE):
            return
        bar = _new_bar(known_end=False)
        bar.add_task(text, total=None)
        with bar:
            over.wait()

    thread = threading.Thread(target=show, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


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
