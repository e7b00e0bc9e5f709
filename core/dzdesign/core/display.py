"""How results look: the words of a verdict, display in notebooks, and templates in which no name may lack a value."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import jinja2

HOLDS, DOES_NOT_HOLD, NOT_CHECKED = "HOLDS", "DOES NOT HOLD", "NOT CHECKED"
#: Of a check that is made on request: without one nothing is open.
NOT_ASKED_FOR = "NOT RUN (optional)"
#: Of a finding that stands beside a requirement, and on which its verdict does not depend.
NOT_REQUIRED = "NOT REQUIRED"


def verdict_words(holds: bool | None) -> str:
    """Return the words for a verdict; None: it was to be checked, and could not be.

    Examples
    --------
    >>> verdict_words(True), verdict_words(False), verdict_words(None)
    ('HOLDS', 'DOES NOT HOLD', 'NOT CHECKED')
    """
    return NOT_CHECKED if holds is None else HOLDS if holds else DOES_NOT_HOLD


def strict_templates(*packages: str, **syntax: Any) -> "jinja2.Environment":
    """Return a renderer of the folders `templates` of some packages, the first one first.

    `syntax` goes to Jinja: escaping, delimiters, the filter of what is printed.
    """
    import jinja2

    return jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(name, "templates") for name in packages]),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        **syntax,
    )


#: What displays a result, by "heading" (one line), "text" and "html"; nothing until `dzdesign.api` is imported.
_DISPLAY: dict[str, Callable[[object], str]] = {}


def display_by(
    *, heading: Callable[[object], str], text: Callable[[object], str], html: Callable[[object], str]
) -> None:
    """Set how a result is displayed: one line, some lines of plain text, and HTML with every text escaped."""
    _DISPLAY.update(heading=heading, text=text, html=html)


class ShownInNotebooks:
    """Base of the results that a person looks at; adds no field."""

    __slots__ = ()

    def __str__(self) -> str:
        """Return some lines for a person; `repr` of the fields would be pages."""
        return _DISPLAY.get("text", repr)(self)

    def __repr__(self) -> str:
        """Return one line."""
        return f"<{_DISPLAY['heading'](self) if _DISPLAY else type(self).__name__}>"

    def _repr_html_(self) -> str | None:
        """Return a page for a notebook, or None, whereupon the notebook shows the plain text."""
        return _DISPLAY["html"](self) if _DISPLAY else None
