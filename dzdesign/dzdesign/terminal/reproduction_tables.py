"""The paper's numbers beside ours as tables on stdout: one a valve, then reasons, assumptions and the count."""

from typing import TYPE_CHECKING

from dzdesign.terminal.page import Column, new_console, put_line, put_rows

if TYPE_CHECKING:
    from dzdesign.reproduce.artefact import PaperNumber, Reproduction

AGREES, MISSED, UNEXPLAINED = "agrees", "MISSED", "MISSED, NOBODY KNOWS WHY"


def print_reproduction(reproduction: "Reproduction") -> None:
    """Print the paper's numbers beside ours, valve by valve, and the reasons."""
    console = new_console()
    notes: dict[str, int] = {}

    def verdict(item: "PaperNumber") -> str:
        texts = filter(None, (item.reason, item.why))
        return f"{verdict_of(item)} {''.join(f'[{notes.setdefault(each, len(notes) + 1)}]' for each in texts)}".strip()

    columns: dict[str, Column[PaperNumber]] = {
        "": lambda item: item.quantity,
        "MPa": lambda item: "" if item.dp_MPa is None else f"{item.dp_MPa:g}",
        "paper": with_unit,
        "ours": lambda item: f"{item.value:.2f}",
        "of": lambda item: item.by,
        "ideal line": lambda item: "" if item.ideal_line is None else f"{item.ideal_line:.2f}",
        "verdict": verdict,
    }
    for valve in reproduction.valves:
        of_valve = [item for item in reproduction.numbers if item.valve == valve.valve]
        read = f"; dead zones read at {valve.level_L_min:g} L/min" if valve.level_L_min else ""
        put_rows(console, f"The paper's numbers and ours: {valve.valve}{read}", of_valve, columns, words=(0, 4, 6))
    for note, number in notes.items():
        put_line(console, f"[{number}] {note}")
    put_line(console, f"Assumed, as the paper does not say it: {'; '.join(reproduction.assumptions)}")
    for line in summary(reproduction):
        put_line(console, line)


def summary(reproduction: "Reproduction") -> list[str]:
    """Return how many numbers are of which kind, and how many of the predicted ones agree."""
    numbers = reproduction.numbers
    predicted = [item.agrees for item in numbers if item.kind == "predicted"]
    kinds = {kind: sum(item.kind == kind for item in numbers) for kind in ("fitted", "predicted", "given", "in words")}
    unknown = sum(item.holds is False for item in numbers)
    return [
        f"{len(numbers)} numbers: " + ", ".join(f"{count} {kind}" for kind, count in kinds.items()) + ".",
        f"Of {len(predicted)} predicted {predicted.count(True)} agree and {predicted.count(False)} are missed.",
        f"{unknown} MISSED FOR NO REASON THAT REACHES SO FAR." if unknown else "Every miss has its reason.",
    ]


def with_unit(item: "PaperNumber") -> str:
    """Return a printed number with its unit; words have none."""
    return f"{item.published} {item.unit}" if item.published[0].isdigit() else item.published


def verdict_of(item: "PaperNumber") -> str:
    """Return what became of a number: nothing that was fitted, given or has no digits agrees."""
    if item.holds is False:
        return UNEXPLAINED
    if item.kind != "predicted":
        return item.kind
    return AGREES if item.agrees else MISSED
