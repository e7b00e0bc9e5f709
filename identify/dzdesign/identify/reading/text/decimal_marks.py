"""The decimal mark of one file, from column to column and block to block: what tells 2.001 from two thousand and one.

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
#: Rows at the beginning of a block that mostly tell.
FEW_ROWS = 200
#: A whole number without a mark that is at least so large, and by so much larger than one with it, tells thousands.
LEAST_WHOLE, FAR_LARGER = 100.0, 20.0
ADVICE = "export numbers with one mark and no separator of thousands"


@final
class DecimalMarks:
    """What the columns of one file have shown so far.

    Parameters
    ----------
    path : Path
        For messages.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._shown: dict[str, tuple[str, str]] = {}  # label -> decimal mark, a cell that shows it
        self._grouped: set[str] = set()  # labels with a cell that shows both marks
        self._doubtful: dict[str, tuple[str, str, str]] = {}  # label -> mark, cell, where it stands

    def has_commas(self, label: str) -> bool:
        """Tell whether a column has shown that its decimal mark is a comma."""
        return self._shown.get(label, ("", ""))[0] == ","

    def see_points(
        self,
        label: str,
        numbers: np.ndarray,
        first_cells: "Callable[[], pl.Series]",
        cell: "Callable[[int], str]",
        place: "Callable[[int], str]",
    ) -> None:
        """Take a column that was read with decimal points.

        Parameters
        ----------
        label : str
            Of the column.
        numbers : (N,) array
            As read.
        first_cells : callable
            Gives its first cells as they stand in the file.
        cell : callable
            Row -> its cell as it stands in the file.
        place : callable
            Row -> where it stands, for messages.

        Raises
        ------
        InputError
            If this column's points may stand between thousands, and other columns have decimal commas, or other cells
            of its own are whole numbers that are far larger without a point.
        """
        if label in self._shown or label in self._doubtful:
            return
        for some in (numbers[:FEW_ROWS], numbers):
            broken = np.flatnonzero(np.isfinite(some) & (some != np.rint(some)))
            parts = np.abs(some[broken])
            # In a decimal below 1, from 1000 on or with four digits behind it the point stands between no thousands.
            told = np.flatnonzero((parts < 1) | (parts >= 1000) | (np.abs(1e3 * parts - np.rint(1e3 * parts)) > 1e-6))
            if told.size:
                self._show(label, ".", f"{some[broken[told[0]]]:g}")
                return
        cells = first_cells()
        if not self._take(label, ".", cells, place) and broken.size:
            row = int(broken[0])
            self._doubt(label, ".", cells[row] if row < len(cells) else f"{numbers[row]:.3f}", place(row))
        if broken.size:
            self._refuse_whole_ones_beside(label, numbers, broken, cell, place)

    def _refuse_whole_ones_beside(
        self,
        label: str,
        numbers: np.ndarray,
        broken: np.ndarray,
        cell: "Callable[[int], str]",
        place: "Callable[[int], str]",
    ) -> None:
        """Refuse a column in which 998 and 1.001 stand: nothing measured goes from one to the other."""
        if label not in self._doubtful:
            return
        whole = np.where(np.isfinite(numbers) & (numbers == np.rint(numbers)), np.abs(numbers), 0.0)
        largest, marked = int(np.argmax(whole)), int(broken[np.argmin(np.abs(numbers[broken]))])
        if whole[largest] < LEAST_WHOLE or abs(numbers[marked]) > whole[largest] / FAR_LARGER:
            return
        one, other = cell(largest), cell(marked)
        if "." not in one:
            raise InputError(
                f"'{self._path}' {place(marked)}, column '{label}': '{other[:QUOTED_CHARACTERS]}' stands in one column "
                f"with '{one[:QUOTED_CHARACTERS]}', so it may be {re.sub('[.]', '', other)[:QUOTED_CHARACTERS]} or a "
                f"decimal; {ADVICE}"
            )

    def with_points(self, label: str, texts: "pl.Series", place: "Callable[[int], str]") -> "pl.Series":
        """Return numbers with a decimal point, whatever their decimal mark is, and without one between thousands.

        Parameters
        ----------
        label : str
            Of the column.
        texts : polars.Series
            Its cells.
        place : callable
            Row -> where it stands, for messages.

        Raises
        ------
        InputError
            If which mark is the decimal one can't be told.
        """
        point = texts.str.contains(".", literal=True).fill_null(False)
        if not point.any() and self.has_commas(label):
            return texts.str.replace(",", ".", literal=True)
        comma = texts.str.contains(",", literal=True).fill_null(False)
        if point.any() and comma.any():
            return self._of_two_marks(label, texts, point, comma, place)
        mark = "." if point.any() else "," if comma.any() else ""
        if not mark:
            return texts
        decimal, shown = self._shown.get(label, (mark, ""))
        if decimal == mark:
            if not shown:
                self._take(label, mark, texts, place)
            return texts.str.replace(",", ".", literal=True)
        marked = point if mark == "." else comma
        if label not in self._grouped or not texts.filter(marked).str.contains(GROUPED[decimal]).all():
            raise self._unclear(label, int(marked.arg_true()[0]), texts, shown, place)
        return texts.str.replace_all(mark, "", literal=True)

    def _of_two_marks(
        self, label: str, texts: "pl.Series", point: "pl.Series", comma: "pl.Series", place: "Callable[[int], str]"
    ) -> "pl.Series":
        """Return numbers with a decimal point, of a column in which both marks stand."""
        both = texts.filter(comma & point)
        shown = both[0] if len(both) else texts.filter(comma)[0]
        decimal = max(",.", key=shown.rfind)
        wrong = (~texts.str.contains(GROUPED[decimal]).fill_null(True) & (texts != "")).arg_true()
        grouped = len(both) or (label in self._grouped and self._shown[label][0] == decimal)
        if not grouped or len(wrong):
            raise self._unclear(label, int(wrong[0]) if len(wrong) else int(point.arg_true()[0]), texts, shown, place)
        if self._shown.get(label, (decimal, ""))[0] != decimal:
            raise self._unclear(label, int((comma & point).arg_true()[0]), texts, self._shown[label][1], place)
        self._grouped.add(label)
        self._show(label, decimal, shown)
        return texts.str.replace_all(OTHER[decimal], "", literal=True).str.replace(decimal, ".", literal=True)

    def _take(self, label: str, mark: str, texts: "pl.Series", place: "Callable[[int], str]") -> bool:
        """Take cells with one mark, and tell whether one of them has it."""
        for some in (texts.head(FEW_ROWS), texts):
            marked = some.str.contains(WITH_MARK[mark]).fill_null(False)
            told = (marked & ~some.str.contains(DOUBTFUL[mark]).fill_null(False)).arg_true()
            if len(told):
                self._show(label, mark, some[int(told[0])])
                return True
        # Several points or commas in a number are no decimal ones: left to whoever reads it to refuse.
        if marked.any() and label not in self._doubtful:
            row = int(marked.arg_true()[0])
            self._doubt(label, mark, texts[row], place(row))
        return bool(marked.any())

    def _show(self, label: str, mark: str, cell: str) -> None:
        self._shown.setdefault(label, (mark, cell))
        if self._doubtful.get(label, (mark,))[0] == mark:
            self._doubtful.pop(label, None)
        self._refuse_a_contradiction()

    def _doubt(self, label: str, mark: str, cell: str, place: str) -> None:
        self._doubtful[label] = mark, cell, place
        self._refuse_a_contradiction()

    def _refuse_a_contradiction(self) -> None:
        """Refuse a column whose mark may be one of thousands where another cell shows the other as the decimal one."""
        for label, (mark, cell, place) in self._doubtful.items():
            for other, (decimal, shown) in self._shown.items():
                if decimal != mark:
                    either = re.sub(r"[.,]", "", cell)
                    raise InputError(
                        f"'{self._path}' {place}, column '{label}': '{cell[:QUOTED_CHARACTERS]}' may be "
                        f"{either[:QUOTED_CHARACTERS]} or a decimal, as column '{other[:QUOTED_CHARACTERS]}' has "
                        f"decimal {NAMES[decimal]} ('{shown[:QUOTED_CHARACTERS]}'); {ADVICE}"
                    )

    def _unclear(
        self, label: str, row: int, texts: "pl.Series", shown: str, place: "Callable[[int], str]"
    ) -> InputError:
        return InputError(
            f"'{self._path}' {place(row)}, column '{label}': '{texts[row][:QUOTED_CHARACTERS]}' stands in one "
            f"column with '{shown[:QUOTED_CHARACTERS]}', so which mark is the decimal one can't be told; {ADVICE}"
        )
