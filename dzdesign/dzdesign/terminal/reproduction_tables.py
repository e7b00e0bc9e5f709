"""The paper's numbers beside ours as tables on stdout: one a valve, then tolerances, reasons, parameters."""

from typing import TYPE_CHECKING

from dzdesign.core.verdicts import verdict_words
from dzdesign.terminal.page import Table, new_console, put_line, put_table

if TYPE_CHECKING:
    from dzdesign.report.reproduction import PaperNumber, Reproduction


def print_reproduction(reproduction: "Reproduction") -> None:
    """Print the paper's numbers beside ours, valve by valve, the reasons, and the parameters that were recovered."""
    console = new_console()
    tolerances: dict[str, str] = {}
    reasons: dict[str, int] = {}
    numbers = reproduction.numbers
    for name in dict.fromkeys(number.valve for number in numbers):
        table = Table(
            f"The paper's numbers and ours: {name}", "", "MPa", "published", "in the fit", "valve", "paper's law",
            "product", "within", "", "why",
        )  # fmt: skip
        for item in numbers:
            if item.valve == name:
                letter = ""
                if item.tolerance:
                    letter = tolerances.setdefault(item.tolerance, chr(ord("a") + len(tolerances)))
                note = f"[{reasons.setdefault(item.why, len(reasons) + 1)}]" if item.why else ""
                table.add_row(*_cells(item, letter, note))
        put_table(console, table)
    for tolerance, letter in tolerances.items():
        put_line(console, f"({letter}) {tolerance}")
    for why, number in reasons.items():
        put_line(console, f"[{number}] {why}")
    for valve in reproduction.valves:
        recovered = ", ".join(f"{name} {each.value:g}" for name, each in valve.parameters.items() if each.recovered)
        put_line(console, f"{valve.valve}, recovered parameters: {recovered}")
    required = [item for item in numbers if item.holds is not None]
    missed = sum(not item.holds for item in required)
    verdict = f"{missed} DO NOT" if missed else "all do"
    put_line(console, f"{len(numbers)} numbers, of which {len(required)} must agree: {verdict}.")


def _cells(item: "PaperNumber", letter: str, note: str) -> tuple[str, ...]:
    """Return the cells of one printed number: ours, each with its difference, and one that is missed marked."""
    ours = {}
    for outcome in item.outcomes:
        text = "not compared" if outcome.value is None else f"{outcome.value:.2f}"
        text += "" if outcome.difference is None else f" ({outcome.difference:+.2f})"
        ours[outcome.by] = text + ("!" if outcome.holds is False else "")
    return (
        item.quantity,
        "" if item.dp_MPa is None else f"{item.dp_MPa:g}",
        item.published if item.unit == "1" else f"{item.published} {item.unit}",
        "yes" if item.in_fit else "predicted",
        *(ours.get(by, "") for by in ("valve", "paper's law", "product")),
        f"({letter})" if letter else "",
        "" if item.holds is None else verdict_words(item.holds),
        note,
    )
