"""A result that `print` sums up and a notebook shows as a table: the room says that it may be, the front door how."""

from collections.abc import Callable, Mapping
from typing import Any

#: Name of a result's class -> what writes its HTML, and what sums it up; empty until `dzdesign.api` is imported.
_WRITERS: dict[str, Callable[[Any], str]] = {}
_SUMMARIES: dict[str, Callable[[Any], str]] = {}


def show_by(writers: Mapping[str, Callable[[Any], str]], summaries: Mapping[str, Callable[[Any], str]]) -> None:
    """Say how results are shown.

    Parameters
    ----------
    writers : mapping
        Name of the class to a function that returns its HTML; every text that comes from a file is escaped in it.
    summaries : mapping
        Name of the class to a function that returns some lines of plain text; the first alone stands for the result.
    """
    _WRITERS.update(writers)
    _SUMMARIES.update(summaries)


class ShownInNotebooks:
    """Base of the four results that a person looks at; adds no field."""

    __slots__ = ()

    def __str__(self) -> str:
        """Return some lines for a person; `repr` of the fields would be pages."""
        write = _SUMMARIES.get(type(self).__name__)
        return write(self) if write else repr(self)

    def __repr__(self) -> str:
        """Return one line."""
        write = _SUMMARIES.get(type(self).__name__)
        return f"<{write(self).partition(chr(10))[0]}>" if write else f"<{type(self).__name__}>"

    def _repr_html_(self) -> str | None:
        """Return a table for a notebook, or None, whereupon the notebook shows the plain text."""
        write = _WRITERS.get(type(self).__name__)
        return write(self) if write else None
