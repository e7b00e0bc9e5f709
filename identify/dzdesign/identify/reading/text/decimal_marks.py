"""The decimal mark of the columns of one file: what tells 2.001 from two thousand and one.

A cell such as ``2.001`` or ``2,001`` may be a decimal or a number with a mark between its thousands. It is read as a
decimal, unless other cells of the file show the other mark as the decimal one: then it is refused, for nothing tells
which it is, but where the same column shows it (``2.000,5``).
"""

import re
from pathlib import Path
from typing import TYPE_CHECKING, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.table import QUOTED_CHARACTERS

if TYPE_CHECKING:
    from collections.abc import Callable

    import polars as pl

#: Numbers with a mark between thousands, by their decimal mark.
GROUPED = {
    ",": r"^[-+]?(?:\d{1,3}(?:\.\d{3})+|\d+)(?:,\d*)?$",
    ".": r"^[-+]?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d*)?$",
}
#: Numbers with one mark, and those of them whose mark may be one between thousands; 0.123 can't.
WITH_MARK = {".": r"^[-+]?\d*\.\d*(?:[eE][-+]?\d+)?$", ",": r"^[-+]?\d*,\d*(?:[eE][-+]?\d+)?$"}
DOUBTFUL = {".": r"^[-+]?[1-9]\d{0,2}(?:\.\d{3})+$", ",": r"^[-+]?[1-9]\d{0,2}(?:,\d{3})+$"}
#: What stands between thousands and is no decimal mark anywhere: a blank, a narrow or hard one, an apostrophe.
BETWEEN_THOUSANDS = " \u00a0\u202f'\u2019"
OTHER = {".": ",", ",": "."}
NAMES = {".": "points", ",": "commas"}
#: Rows at the beginning of a file that mostly tell.
FEW_ROWS = 200
#: A whole number without a mark that is at least so large, and by so much larger than one with it, tells thousands.
LEAST_WHOLE, FAR_LARGER = 100.0, 20.0
ADVICE = "export numbers with one mark and no separator of thousands"


@final
class DecimalMarks:
    """What the columns of one file that were read have shown."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._certain: dict[str, tuple[str, str]] = {}  # label -> decimal mark, a cell that shows it
        self._doubtful: dict[str, tuple[str, str, str]] = {}  # label -> mark, cell, where it stands

    def check_points(
        self, label: str, numbers: np.ndarray, texts: "Callable[[], pl.Series]", place: "Callable[[int], str]"
    ) -> None:
        """Check a column that was read with decimal points.

        `texts` gives its cells as they stand in the file, which takes longer; `place` says where a row stands.

        Raises
        ------
        InputError
            If this column's points may stand between thousands, and other columns have decimal commas, or other cells
            of its own are whole numbers that are far larger without a point.
        """
        for some in (numbers[:FEW_ROWS], numbers):
            broken = np.flatnonzero(np.isfinite(some) & (some != np.rint(some)))
            parts = np.abs(some[broken])
            # In a decimal below 1, from 1000 on or with four digits behind it the point stands between no thousands.
            plain = np.flatnonzero((parts < 1) | (parts >= 1000) | (np.abs(1e3 * parts - np.rint(1e3 * parts)) > 1e-6))
            if plain.size:
                self._add_certain(label, ".", f"{some[broken[plain[0]]]:g}")
                return
        cells = texts()
        self._take(label, ".", cells, place)
        if broken.size and label in self._doubtful:
            self._refuse_whole_numbers_beside(label, numbers, broken, cells, place)

    def _refuse_whole_numbers_beside(
        self,
        label: str,
        numbers: np.ndarray,
        broken: np.ndarray,
        cells: "pl.Series",
        place: "Callable[[int], str]",
    ) -> None:
        """Refuse a column in which 998 and 1.001 stand: nothing measured goes from one to the other."""
        whole = np.where(np.isfinite(numbers) & (numbers == np.rint(numbers)), np.abs(numbers), 0.0)
        largest, marked = int(np.argmax(whole)), int(broken[np.argmin(np.abs(numbers[broken]))])
        if whole[largest] < LEAST_WHOLE or abs(numbers[marked]) > whole[largest] / FAR_LARGER:
            return
        one, other = cells[largest], cells[marked]
        if "." not in one:
            raise InputError(
                f"'{self._path}' {place(marked)}, column '{label}': '{other[:QUOTED_CHARACTERS]}' stands in one column "
                f"with '{one[:QUOTED_CHARACTERS]}', so it may be {re.sub('[.]', '', other)[:QUOTED_CHARACTERS]} or a "
                f"decimal; {ADVICE}"
            )

    def with_points(self, label: str, texts: "pl.Series", place: "Callable[[int], str]") -> "pl.Series":
        """Return numbers with a decimal point, whatever their decimal mark is, and without one between thousands.

        Raises
        ------
        InputError
            If which mark is the decimal one can't be told.
        """
        point, comma = (texts.str.contains(mark, literal=True).fill_null(False) for mark in ".,")
        if point.any() and comma.any():
            return self._of_two_marks(label, texts, point, comma, place)
        if point.any():
            self._take(label, ".", texts, place)
            return texts
        if comma.any():
            self._take(label, ",", texts, place)
        return texts.str.replace(",", ".", literal=True)

    def _of_two_marks(
        self, label: str, texts: "pl.Series", point: "pl.Series", comma: "pl.Series", place: "Callable[[int], str]"
    ) -> "pl.Series":
        """Return numbers with a decimal point, of a column in which both marks stand."""
        both = texts.filter(comma & point)
        cell = both[0] if len(both) else texts.filter(comma)[0]
        decimal = max(",.", key=cell.rfind)
        wrong = (~texts.str.contains(GROUPED[decimal]).fill_null(True) & (texts != "")).arg_true()
        if not len(both) or len(wrong):
            row = int(wrong[0]) if len(wrong) else int(point.arg_true()[0])
            raise InputError(
                f"'{self._path}' {place(row)}, column '{label}': '{texts[row][:QUOTED_CHARACTERS]}' stands in one "
                f"column with '{cell[:QUOTED_CHARACTERS]}', so which mark is the decimal one can't be told; {ADVICE}"
            )
        self._add_certain(label, decimal, cell)
        return texts.str.replace_all(OTHER[decimal], "", literal=True).str.replace(decimal, ".", literal=True)

    def _take(self, label: str, mark: str, texts: "pl.Series", place: "Callable[[int], str]") -> None:
        """Take the cells of a column that has one mark."""
        for some in (texts.head(FEW_ROWS), texts):
            marked = some.str.contains(WITH_MARK[mark]).fill_null(False)
            plain = (marked & ~some.str.contains(DOUBTFUL[mark]).fill_null(False)).arg_true()
            if len(plain):
                self._add_certain(label, mark, some[int(plain[0])])
                return
        # Several points or commas in a number are no decimal ones: left to whoever reads it to refuse.
        if marked.any():
            row = int(marked.arg_true()[0])
            self._doubtful[label] = mark, texts[row], place(row)
            self._refuse_a_contradiction()

    def _add_certain(self, label: str, mark: str, cell: str) -> None:
        self._certain[label] = mark, cell
        self._refuse_a_contradiction()

    def _refuse_a_contradiction(self) -> None:
        """Refuse a column whose mark may be one of thousands where another cell shows the other as the decimal one."""
        for label, (mark, cell, place) in self._doubtful.items():
            for other, (decimal, example) in self._certain.items():
                if decimal != mark:
                    either = re.sub(r"[.,]", "", cell)
                    raise InputError(
                        f"'{self._path}' {place}, column '{label}': '{cell[:QUOTED_CHARACTERS]}' may be "
                        f"{either[:QUOTED_CHARACTERS]} or a decimal, as column '{other[:QUOTED_CHARACTERS]}' has "
                        f"decimal {NAMES[decimal]} ('{example[:QUOTED_CHARACTERS]}'); {ADVICE}"
                    )
