"""What the product makes wrong of a corpus, counted by kinds of recordings."""

import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol, TypeVar

from scoreboard import Row, print_rows, say


class Case(Protocol):
    """One valve's recordings."""

    @property
    def name(self) -> str: ...

    @property
    def kind(self) -> str: ...


C = TypeVar("C", bound=Case)


def print_faults(title: str, cases: Sequence[C], fault_of: Callable[[C, Path], str]) -> list[Row]:
    """Print and return a row for every kind of recording, and one of all.

    `fault_of` returns "" for a case that is read as it is, or a text that begins with "refused" or "misread".
    """
    counts = {kind: Counter() for kind in dict.fromkeys(case.kind for case in cases)}
    with tempfile.TemporaryDirectory() as folder:
        for case in cases:
            fault = fault_of(case, Path(folder))
            counts[case.kind][fault.partition(":")[0]] += 1
            if fault:
                say(f"{case.name}: {fault}")
    counts["all"] = sum(counts.values(), Counter())
    rows = [
        Row(
            what=kind, value=float(found.total() - found[""]), limit=0.0,
            note=f"of {found.total()}: {found['refused']} refused, {found['misread']} misread",
        )
        for kind, found in counts.items()
    ]  # fmt: skip
    print_rows(title, rows)
    return rows
