"""What came of mutants, as rows: how many each check caught, and the share that no input tells apart."""

from collections.abc import Mapping

from scoreboard import Row

#: How a mutant is called that gives the right answers everywhere.
EQUAL = "equal on every input"
#: Share of mutants: of the sixty of the example's block three were equal. A check that saw less would let more pass.
MOST_EQUAL = 0.15


def rows_of(case: str, found: Mapping[str, int]) -> list[Row]:
    """Return the rows of one output: what caught its mutants, to how many."""
    count = sum(found.values())
    rows = [
        Row(what=f"{case}: caught by {name}", value=number, note=f"of {count}")
        for name, number in sorted(found.items())
        if name != EQUAL
    ]
    equal = found.get(EQUAL, 0)
    note = f"{equal} of {count}"
    return [*rows, Row(what=f"{case}: share of mutants {EQUAL}", value=equal / count, limit=MOST_EQUAL, note=note)]
