"""Progress on stderr: a bar for work that takes longer than a second, where a person can see it."""

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

Item = TypeVar("Item")

#: Work that is done sooner shows no bar, s.
PATIENCE = 1.0


def with_bar(items: Sequence[Item], what: str, clock: Callable[[], float] = time.monotonic) -> Iterator[Item]:
    """Return the items one by one, with a bar on stderr once that has taken `PATIENCE`; none if it is no terminal.

    Parameters
    ----------
    items : sequence
        Pieces of work, of about the same size.
    what : str
        What is done with them.
    clock : callable
        Seconds, for the tests.
    """
    if not sys.stderr.isatty():
        yield from items
        return
    start, bar = clock(), None
    try:
        for done, item in enumerate(items):
            if bar is None and done and clock() - start > PATIENCE:
                from rich.console import Console
                from rich.progress import Progress

                bar = Progress(console=Console(stderr=True), transient=True)
                task = bar.add_task(what, total=len(items))
                bar.start()
            if bar is not None:
                bar.update(task, completed=done)
            yield item
    finally:
        if bar is not None:
            bar.stop()
