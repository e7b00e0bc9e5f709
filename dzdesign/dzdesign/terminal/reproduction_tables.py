"""The paper's numbers beside ours as tables on stdout: one a valve, then tolerances, reasons, parameters."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dzdesign.core.verdicts import verdict_words
from dzdesign.terminal.page import new_console, new_table, put_line, put_table

if TYPE_CHECKING:
    from dzdesign.reproduce.row import Row
    from dzdesign.reproduce.valves import RecoveredValve


def print_reproduction(rows: "Sequence[Row]", valves: "Sequence[RecoveredValve]") -> None:
    """Print the paper's numbers beside ours, valve by valve, the reasons, and the parameters that were recovered."""
    console = new_console()
    tolerances: dict[str, str] = {}
    reasons: dict[str, int] = {}
    for name in dict.fromkeys(row.valve for row in rows):
        table = new_table(
            f"The paper's numbers and ours: {name}", "", "MPa", "published", "in the fit", "valve", "paper's law",
            "product", "within", "", "why",
        )  # fmt: skip
        for row in rows:
            if row.valve == name:
                letter = tolerances.setdefault(row.tolerance, chr(ord("a") + len(tolerances))) if row.tolerance else ""
                note = f"[{reasons.setdefault(row.why, len(reasons) + 1)}]" if row.why else ""
                table.add_row(*_reproduced(row, letter, note))
        put_table(console, table)
    for tolerance, letter in tolerances.items():
        put_line(console, f"({letter}) {tolerance}")
    for why, number in reasons.items():
        put_line(console, f"[{number}] {why}")
    for valve in valves:
        entries = valve.to_document()["parameters"].items()
        recovered = ", ".join(f"{name} {entry['value']:g}" for name, entry in entries if entry["recovered"])
        put_line(console, f"{valve.published.name}, recovered parameters: {recovered}")
    required = [row for row in rows if row.holds is not None]
    missed = sum(not row.holds for row in required)
    verdict = f"{missed} DO NOT" if missed else "all do"
    put_line(console, f"{len(rows)} numbers, of which {len(required)} must agree: {verdict}.")


def _reproduced(row: "Row", letter: str, note: str) -> tuple[str, ...]:
    """Return the cells of one printed number: ours, each with its difference, and one that is missed marked."""
    ours = {}
    for outcome in row.outcomes:
        difference = row.difference(outcome)
        text = "not compared" if outcome.value is None else f"{outcome.value:.2f}"
        text += "" if difference is None else f" ({difference:+.2f})"
        ours[outcome.by] = text + ("!" if outcome.holds is False else "")
    return (
        row.quantity,
        "" if row.dp_MPa is None else f"{row.dp_MPa:g}",
        row.published if row.unit == "1" else f"{row.published} {row.unit}",
        "yes" if row.in_fit else "predicted",
        *(ours.get(by, "") for by in ("valve", "paper's law", "product")),
        f"({letter})" if letter else "",
        "" if row.holds is None else verdict_words(row.holds),
        note,
    )
