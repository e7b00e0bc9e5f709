"""A result that a notebook shows as a table: the room says that it may be shown, the front door says how."""

from collections.abc import Callable, Mapping
from typing import Any

#: Name of a result's class -> what writes its HTML; empty until `dzdesign.api` is imported.
_WRITERS: dict[str, Callable[[Any], str]] = {}


def show_by(writers: Mapping[str, Callable[[Any], str]]) -> None:
    """Say how results are shown.

    Parameters
    ----------
    writers : mapping
        Name of the class to a function that returns its HTML; every text that comes from a file is escaped in it.
    """
    _WRITERS.update(writers)


class ShownInNotebooks:
    """Base of the four results that a person looks at; adds no field."""

    __slots__ = ()

    def _repr_html_(self) -> str | None:
        """Return a table for a notebook, or None, whereupon the notebook shows the plain text."""
        write = _WRITERS.get(type(self).__name__)
        return write(self) if write else None
