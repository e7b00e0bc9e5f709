"""Acceptance tables of the report: the paper's numbers beside ours, and the user's limits on recordings."""

from typing import Any

from dzdesign.report.sections.cells import Cell, Table, number, verdict

#: Decimals in the unit of a quantity.
DECIMALS = {"%": 2, "L/min": 3, "L/min/V": 4}


def paper_tables(document: dict[str, Any]) -> tuple[Table, ...]:
    """Return the paper's numbers beside ours, one table a valve.

    Parameters
    ----------
    document : dict
        reproduction.json.
    """
    valves = dict.fromkeys(row["valve"] for row in document["rows"])
    return tuple(_paper_table(valve, [row for row in document["rows"] if row["valve"] == valve]) for valve in valves)


def _paper_table(valve: str, rows: list[dict[str, Any]]) -> Table:
    """Return the numbers of one valve; why each may differ stands below, once."""
    notes: dict[str, str] = {}
    cells = []
    for row in rows:
        ours = {each["by"]: _ours(each) for each in row["outcomes"]}
        marks = [notes.setdefault(text, f"[{len(notes) + 1}]") for text in (row["tolerance"], row["why"]) if text]
        cells.append(
            (
                Cell(text=row["quantity"]),
                Cell(text="–" if row["dp_MPa"] is None else f"{row['dp_MPa']:g}", kind="number"),
                Cell(text=f"{row['published']} {'' if row['unit'] == '1' else row['unit']}".strip(), kind="number"),
                *(Cell(text=ours.get(by, "–"), kind="number") for by in ("valve", "paper's law", "product")),
                Cell(text="not required") if row["holds"] is None else verdict(row["holds"]),
                Cell(text=" ".join(marks), kind="number"),
            )
        )
    return Table(
        caption=f"The paper's {valve}",
        columns=("quantity", "dP (MPa)", "published", "bare valve", "paper's law", "product", "agrees", "notes"),
        rows=tuple(cells),
        notes=tuple(f"{mark} {text}" for text, mark in notes.items()),
    )


def _ours(outcome: dict[str, Any]) -> str:
    if outcome["value"] is None:
        return "not compared"
    text = f"{outcome['value']:.2f}"
    return text if outcome["difference"] is None else f"{text} ({outcome['difference']:+.2f})".replace("-", "−")


def limits_table(document: dict[str, Any]) -> Table | None:
    """Return the user's limits with their verdicts; None if none were given.

    Parameters
    ----------
    document : dict
        assessment.json.
    """
    if not document["limits"]:
        return None
    return Table(
        caption="The limits that were set",
        columns=("verdict", "quantity", "where", "limit", "found"),
        rows=tuple(
            (
                verdict(each["holds"]),
                Cell(text=_name(document, each["quantity"])),
                Cell(text=each["place"]),
                Cell(text=f"{each['limit']:.4g} {each['unit']}", kind="number"),
                Cell(text=each["text"]),
            )
            for each in document["limits"]
        ),
    )


def assessed_table(document: dict[str, Any]) -> Table:
    """Return each quantity before and after, at every pressure drop.

    Parameters
    ----------
    document : dict
        assessment.json.
    """
    rows = []
    compared = [item for item in document["pressures"] if any(_is_after(sets) for sets in item["quantities"].values())]
    for item in compared or document["pressures"]:
        for key, sets in item["quantities"].items():
            before, after = (_reading(document, key, sets.get(name)) for name in ("before", "after"))
            if {before, after} - {"–", "not seen"}:
                rows.append(
                    (
                        number(item["dp_MPa"], 2),
                        Cell(text=item["side"]),
                        Cell(text=_name(document, key)),
                        Cell(text=before, kind="number"),
                        Cell(text=after, kind="number"),
                        Cell(text=_unit(document, key)),
                    )
                )
    return Table(
        caption="Recordings without and with the compensator, at the pressure drops that have both",
        columns=("dP (MPa)", "commands", "quantity", "before", "after", "unit"),
        rows=tuple(rows),
    )


def _is_after(sets: Any) -> bool:
    return isinstance(sets, dict) and isinstance(sets.get("after"), dict)


def _entry(document: dict[str, Any], key: str, what: str) -> str:
    entry = document["quantities"].get(key)
    return str(entry[what]) if isinstance(entry, dict) and what in entry else ""


def _name(document: dict[str, Any], key: str) -> str:
    return _entry(document, key, "name") or key


def _unit(document: dict[str, Any], key: str) -> str:
    return _entry(document, key, "unit")


def _reading(document: dict[str, Any], key: str, reading: Any) -> str:
    """Return a value, or the bound of what can't be seen."""
    if not isinstance(reading, dict):
        return "–"
    digits = DECIMALS.get(_unit(document, key), 3)
    if isinstance(reading.get("value"), int | float):
        return number(reading["value"], digits).text
    if isinstance(reading.get("at_most"), int | float):
        return f"≤ {number(reading['at_most'], digits).text}"
    return "not seen" if reading.get("not_observable") else "–"
