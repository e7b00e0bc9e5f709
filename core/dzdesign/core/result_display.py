"""Display of results by `print` and in notebooks: a room marks its results, the front door registers how."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(slots=True)
class _Display:
    """How results are displayed; nothing until `dzdesign.api` is imported."""

    heading: Callable[[object], str] | None = None
    text: Callable[[object], str] | None = None
    html: Callable[[object], str] | None = None


_DISPLAY = _Display()


def display_by(
    *, heading: Callable[[object], str], text: Callable[[object], str], html: Callable[[object], str]
) -> None:
    """Set how a result is displayed: one line, some lines of plain text, and HTML with every text escaped."""
    _DISPLAY.heading, _DISPLAY.text, _DISPLAY.html = heading, text, html


class ShownInNotebooks:
    """Base of the four results that a person looks at; adds no field."""

    __slots__ = ()

    def __str__(self) -> str:
        """Return some lines for a person; `repr` of the fields would be pages."""
        return _DISPLAY.text(self) if _DISPLAY.text else repr(self)

    def __repr__(self) -> str:
        """Return one line."""
        return f"<{_DISPLAY.heading(self) if _DISPLAY.heading else type(self).__name__}>"

    def _repr_html_(self) -> str | None:
        """Return a page for a notebook, or None, whereupon the notebook shows the plain text."""
        return _DISPLAY.html(self) if _DISPLAY.html else None
