"""The paper's numbers beside ours as tables on stdout: one a valve, then tolerances, reasons, parameters."""

from typing import TYPE_CHECKING

from dzdesign.terminal.page import Table, new_console, put_line, put_table

if TYPE_CHECKING:
    from dzdesign.reproduce.artefact import PaperNumber, Reproduction


AGREES, MISSED, UNEXPLAINED = "agrees", "MISSED", "MISSED, NOBODY KNOWS WHY"


def print_reproduction(reproduction: "Reproduction") -> None:
    """Print the paper's numbers beside ours, valve by valve, the reasons, and the parameters that were recovered."""
    console = new_console()
    tolerances: dict[str, str] = {}
    notes: dict[str, int] = {}
    numbers = reproduction.numbers
    for name in dict.fromkeys(number.valve for number in numbers):
        table = Table(
            f"The paper's numbers and ours, without / with hysteresis: {name}", "", "MPa", "published", "", "within",
            "valve", "paper's law", "product", "", "why",
        )  # fmt: skip
        for item in numbers:
            if item.valve == name:
                letter = ""
                if item.tolerance:
                    letter = tolerances.setdefault(item.tolerance, chr(ord("a") + len(tolerances)))
                texts = dict.fromkeys([*(one.reason for one in item.outcomes), item.why])
                places = [f"[{notes.setdefault(text, len(notes) + 1)}]" for text in texts if text]
                table.add_row(*_cells(item, letter), "".join(places))
        put_table(console, table)
    for tolerance, letter in tolerances.items():
        put_line(console, f"({letter}) {tolerance}")
    for note, number in notes.items():
        put_line(console, f"[{number}] {note}")
    put_line(console, "Assumed, as the paper does not say it:")
    for assumption in reproduction.assumptions:
        put_line(console, f"- {assumption}")
    for valve in reproduction.valves:
        if not valve.hysteresis_V:
            recovered = ", ".join(f"{name} {each.value:g}" for name, each in valve.parameters.items() if each.recovered)
            put_line(console, f"{valve.valve}, recovered parameters: {recovered}")
    for line in summary(reproduction):
        put_line(console, line)


def summary(reproduction: "Reproduction") -> list[str]:
    """Return how many numbers are of which kind, and how many of the predicted ones agree, in all and of whom."""
    numbers = reproduction.numbers
    predicted = [item for item in numbers if item.kind == "predicted"]
    agree = sum(item.agrees is True for item in predicted)
    kinds = {kind: sum(item.kind == kind for item in numbers) for kind in ("fitted", "predicted", "given", "in words")}
    lines = [
        f"{len(numbers)} numbers: " + ", ".join(f"{count} {kind}" for kind, count in kinds.items()) + ".",
        f"Of {len(predicted)} predicted {agree} agree and {len(predicted) - agree} are missed.",
    ]
    for by in ("valve", "paper's law", "product"):
        counts = []
        for with_hysteresis in (False, True):
            compared = [
                one.agrees
                for item in predicted
                for one in item.outcomes
                if one.by == by and one.agrees is not None and (one.hysteresis_V > 0) == with_hysteresis
            ]
            counts.append(f"{sum(compared)} of {len(compared)}")
        lines.append(f"{by}: {counts[0]} agree, with the assumed hysteresis {counts[1]}")
    unknown = sum(item.holds is False for item in numbers)
    lines.append(f"{unknown} MISSED FOR NO REASON THAT REACHES SO FAR." if unknown else "Every miss has its reason.")
    return lines


def _cells(item: "PaperNumber", letter: str) -> tuple[str, ...]:
    """Return the cells of one number: ours without / with hysteresis where these differ; one that misses is marked."""
    ours: dict[str, list[str]] = {}
    for outcome in item.outcomes:
        text = "not compared" if outcome.value is None else f"{outcome.value:.2f}"
        ours.setdefault(outcome.by, []).append(text + ("!" if outcome.agrees is False else ""))
    return (
        item.quantity,
        "" if item.dp_MPa is None else f"{item.dp_MPa:g}",
        with_unit(item),
        item.kind,
        f"({letter})" if letter else "",
        *(" / ".join(dict.fromkeys(ours.get(by, ()))) for by in ("valve", "paper's law", "product")),
        verdict_of(item),
    )


def with_unit(item: "PaperNumber") -> str:
    """Return a printed number with its unit; words have none."""
    return f"{item.published} {item.unit}" if item.published[0].isdigit() else item.published


def verdict_of(item: "PaperNumber") -> str:
    """Return what became of a number: nothing that was fitted, given or has no digits agrees."""
    if item.holds is False:
        return UNEXPLAINED
    if item.kind != "predicted":
        return ""
    return AGREES if item.agrees else MISSED
