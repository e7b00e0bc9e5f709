"""What a logger writes below the samples of a table of text: words and statistics, after which no sample follows."""

import logging
import re
from collections.abc import Sequence
from pathlib import Path
from typing import final

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.table import QUOTED_CHARACTERS, clean_label
from dzdesign.identify.reading.text.cells import is_number, is_value
from dzdesign.identify.reading.text.header import Header
from dzdesign.identify.reading.text.header_search import MOST_LINES

#: What the first cell of a row of statistics says, in English and German, without what stands in brackets behind it.
STATISTIC = re.compile(
    r"(?:arithm\w*\W{0,2})?(?:mean|avg|average|mittel(?:wert)?|durchschnitt|median)(?:[ _]?value)?"
    r"|(?:min|max)(?:imum|imal)?(?:[ _-]?(?:value|wert))?|peak(?:[ -]to[ -]peak)?|pk-?pk|spitze-spitze"
    r"|(?:std|standard|st)[ ._-]{0,2}(?:dev|abw)\w{0,8}|std|sigma|var(?:iance|ianz)|spannweite"
    r"|rms|eff(?:ektiv)?wert|sum|summe|count|anzahl",
    re.IGNORECASE,
)
#: What a logger draws below a table, where nothing else stands in the row.
RULE = re.compile(r"[-*=_\u2013\u2014]{2,}")
logger = logging.getLogger(__name__)


def is_no_sample(cells: Sequence[str]) -> bool:
    """Tell whether a row is a word of the logger, alone in its first cell, or one of statistics.

    Examples
    --------
    >>> is_no_sample(["End", "", ""]), is_no_sample(["Mittelwert:", "5,0", "1,0"]), is_no_sample(["x", "5,0", "1,0"])
    (True, True, False)
    """
    first = clean_label(cells[0])
    if not first or (is_value(first) and not RULE.fullmatch(first)):
        return False
    return not any(map(clean_label, cells[1:])) or _is_statistic(first)


def _is_statistic(cell: str) -> bool:
    bare = re.sub(r"[\[(].{0,40}$", "", cell[:QUOTED_CHARACTERS]).strip(" :=.")
    return STATISTIC.fullmatch(bare) is not None


@final
class Footer:
    """The lines below the samples of one file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._begun = False  # whether there was a sample
        self._error: InputError | None = None
        self._count = 0

    def add(self, number: int, cells: Sequence[str], header: Header) -> None:
        """Take a line that is no sample; refuse one that begins as a sample does."""
        error = _wrong_row(cells, number, header, self.path, first=not self._begun)
        if is_number(clean_label(cells[0])):
            raise error
        logger.debug("'%s' row %d is passed over: %s", self.path, number, " ".join(cells)[:QUOTED_CHARACTERS])
        self._error = self._error or error
        self._count += 1
        if self._count > MOST_LINES:
            raise self._error

    def refuse_samples_below(self) -> None:
        """Refuse samples below such lines, unless they are the first: between header and samples some stand as well."""
        if not self._begun:
            self._begun, self._error, self._count = True, None, 0
        if self._error is not None:
            raise self._error


def _wrong_row(cells: Sequence[str], number: int, header: Header, path: Path, *, first: bool) -> InputError:
    """Return the error for a row that has too many or too few cells, or is a word of the logger amid samples.

    `first`: no sample stands above it, so the header may be none.
    """
    width, word = len(header.labels), clean_label(cells[0])[:QUOTED_CHARACTERS]
    the_header = f"the header, row {header.line} ('{', '.join(header.labels)[:QUOTED_CHARACTERS]}')"
    begin = f"'{path}' row {number} has"
    if len(cells) != width:
        comma = header.separator == "," and len(cells) == 2 * width
        advice = [
            "decimal commas need ';' or a tab between the cells" if comma else "",
            "complete the row, or delete it, as a logger that was stopped may have left half of one"
            if len(cells) < width and is_number(word) and not first
            else "correct the row, or begin it with # if it is no sample",
            "--skip-rows says how many rows stand above the header" if first else "",
        ]
        found = f"{len(cells)} cell{'s' if len(cells) > 1 else f', {word!r}'}"
        return InputError(f"{begin} {found}, expected {width} as in {the_header}; {'; '.join(filter(None, advice))}")
    kind = "a statistic" if _is_statistic(word) else "a word and no number"
    return InputError(
        f"{begin} {kind}, '{word}', and samples below it, expected nothing but samples below {the_header}; begin the "
        "row with # if it is no sample, or delete it; --skip-rows says how many rows stand above the header"
    )
