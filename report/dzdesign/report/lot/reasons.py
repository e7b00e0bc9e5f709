"""Reasons why valves were not calibrated, those of one kind together."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from dzdesign.report.lot.summary import DOES_NOT_HOLD
from dzdesign.report.lot.table import TableRow

#: What differs between two reasons of one kind: names in quotes, and numbers.
PARTICULAR = re.compile(r"'[^']*'|\d+(?:\.\d+)?(?:e[+-]?\d+)?")
GAP = "…"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReasonGroup:
    """Valves with one kind of reason: what is wrong, and what to do; a gap stands for what differs between the valves.

    `valves` has the name of each, and what is particular to it: what stands in the gaps.
    """

    status: str
    what: str
    advice: str
    valves: tuple[tuple[str, str], ...]


def reason_groups(failed: Sequence[TableRow]) -> tuple[ReasonGroup, ...]:
    """Return the groups, the largest first.

    Examples
    --------
    >>> rows = [
    ...     TableRow(name=name, status="failed", reason=f"'{file}.csv' row 7: no number; correct it", sides={})
    ...     for name, file in (("V1", "a"), ("V2", "b"))
    ... ]
    >>> (group,) = reason_groups(rows)
    >>> group.what, group.advice, group.valves
    ('… row 7: no number', 'correct it', (('V1', 'a.csv'), ('V2', 'b.csv')))
    """
    kinds: dict[tuple[str, str], list[TableRow]] = {}
    for row in failed:
        kinds.setdefault((row.status, PARTICULAR.sub(GAP, row.reason)), []).append(row)
    groups = [_group(status, rows) for (status, _), rows in kinds.items()]
    return tuple(sorted(groups, key=lambda group: -len(group.valves)))


def _group(status: str, rows: Sequence[TableRow]) -> ReasonGroup:
    found = [PARTICULAR.findall(row.reason) for row in rows]
    shared = [len(set(parts)) == 1 for parts in zip(*found, strict=True)]
    places = iter(shared)
    text = PARTICULAR.sub(lambda part: part[0] if next(places) else GAP, rows[0].reason)
    what, _, advice = text.rpartition("; ")
    if status == DOES_NOT_HOLD:
        what, advice = text, "see the report of the valve: a requirement of its verification is not met"
    elif text.startswith("unexpected "):
        what, advice = text, "a fault of dzdesign, not of the recordings: the next run tries the valve again"
    elif not what:  # nothing to be done is said, but what was expected
        what, expected, advice = text.partition(", expected ")
        advice = expected.removeprefix(", ") + advice
    valves = []
    for row, parts in zip(rows, found, strict=True):
        particular = [part.strip("'") for part, same in zip(parts, shared, strict=True) if not same]
        valves.append((row.name, ", ".join(dict.fromkeys(part for part in particular if part != row.name))))
    return ReasonGroup(status=status, what=what, advice=advice, valves=tuple(valves))
