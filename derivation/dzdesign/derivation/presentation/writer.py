"""Writes words and formulas in one notation, and fills the template that holds the structure of a document."""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from typing import Any, ClassVar

from dzdesign.core.strict_templates import strict_templates
from dzdesign.derivation.presentation.content import DerivationReport
from dzdesign.derivation.presentation.prose import Code, Formula, Part, Reference, Words


class Writer(ABC):
    """A notation; `linked` are the numbers of the statements in the document: those that can be pointed to."""

    #: The template of a whole document.
    TEMPLATE: ClassVar[str]
    #: What sets this template's syntax apart.
    SYNTAX: ClassVar[Mapping[str, Any]] = {}

    def __init__(self, linked: Collection[str] = ()) -> None:
        self.linked = linked

    def words(self, *parts: Part) -> str:
        """Return words in this notation."""
        return "".join(map(self._part, Words(*parts).parts))

    def _part(self, part: str | Formula | Reference | Code) -> str:
        match part:
            case Formula():
                return self.formula(part)
            case Code(text):
                return self.code(text)
            case Reference(number, words):
                return self.link(number, self.words(words)) if number in self.linked else self.words(words)
        return self.text(part)

    @abstractmethod
    def text(self, text: str) -> str:
        """Return plain words, escaped."""

    @abstractmethod
    def formula(self, formula: Formula) -> str:
        """Return a formula within a sentence."""

    @abstractmethod
    def display(self, formula: Formula) -> str:
        """Return a formula on a line of its own; a chain has one member a line."""

    @abstractmethod
    def code(self, text: str) -> str:
        """Return a word of the command line or of a file."""

    @abstractmethod
    def link(self, number: str, text: str) -> str:
        """Return a text that leads to a statement of the document."""

    def filters(self) -> dict[str, Callable[..., Any]]:
        """Return what the template may apply."""
        return {"words": self.words, "display": self.display, "references": self.references, "anchor": anchor}

    def references(self, references: Collection[Reference], by_number: bool = False) -> str:
        """Return references with commas between, by their numbers alone or by the words that name them."""
        return self.words(Words.join(Reference(one.number) if by_number else one for one in references))


def write(kind: type[Writer], report: DerivationReport) -> str:
    """Return a whole document in a notation."""
    environment = strict_templates("dzdesign.derivation.presentation", lstrip_blocks=True, **kind.SYNTAX)
    environment.filters.update(kind({entry.number for entry in report.statements}).filters())
    return str(environment.get_template(kind.TEMPLATE).render(content=report))


def anchor(number: str) -> str:
    """Return the name by which a statement can be linked to: ``eq-18``, ``T3b``.

    Examples
    --------
    >>> anchor("(18)"), anchor("T3b"), anchor("Fig. 3, line")
    ('eq-18', 'T3b', 'Fig-3-line')
    """
    slug = re.sub(r"\W+", "-", number).strip("-")
    return f"eq-{slug}" if number.startswith("(") else slug
