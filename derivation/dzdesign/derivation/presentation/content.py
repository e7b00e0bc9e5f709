"""What a report holds, in words and formulas; how they look is for each format to decide."""

from collections.abc import Mapping
from dataclasses import dataclass

import sympy

from dzdesign.derivation.account.proof import CaseProof, Verdict
from dzdesign.derivation.account.steps import Step
from dzdesign.derivation.presentation.prose import Formula, Reference, Words

SOURCE = "The paper: Wu et al. 2022, doi 10.11916/j.issn.1005-9113.20063."
#: What the marks mean, for the reader of the report.
LEGEND = (
    ("given", "taken from the paper, or a name or a choice of ours; not derived."),
    ("follows", "the premises that are named, and nothing else, give exactly what is published."),
    ("follows if", "they give it on the condition stated; “only then” means proved to be necessary too."),
    ("does not follow", "they give something else: the difference stands there, and what holds instead."),
)
#: How the report names what is known of the signs of symbols.
SIGNS = {"positive": "positive", "nonnegative": "zero or positive", "real": "of either sign"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A sentence, and the formula that it leads to, if any."""

    words: Words
    display: Formula | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Derivation:
    """The derivation of one case.

    Attributes
    ----------
    where : Words
        The case; empty if there is one only.
    proof : CaseProof
    steps : tuple of Step
        Empty if the premises could only be solved all at once.
    lines : tuple of Line
        One per step, then the published form where a case has changed it; or a single one.
    """

    where: Words
    proof: CaseProof
    steps: tuple[Step, ...]
    lines: tuple[Line, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A number of ours beside the paper's."""

    label: Words
    ours: str
    paper: str
    remark: Words


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One statement as the report shows it.

    Attributes
    ----------
    verdict : Verdict
    name, title : Words
    mark : str
        The outcome in two or three words.
    chain : Formula
        The statement as published.
    judgement : Words
        The outcome with its condition or reason; empty where `mark` says it all.
    scope : Words
        Where it is proved, if not everywhere.
    premises : tuple of Words
    derivations : tuple of Derivation
    differences, corrections : tuple of Line
        Derived minus published, where they differ; what it should read.
    signs : mapping of str to tuple of sympy.Symbol
        What is assumed of the symbols: a key of `SIGNS`, and those of which no more is assumed.
    figures : tuple of Figure
    note : Words
    see : tuple of Reference
    """

    verdict: Verdict
    name: Words
    title: Words
    mark: str
    chain: Formula
    judgement: Words
    scope: Words
    premises: tuple[Words, ...]
    derivations: tuple[Derivation, ...]
    differences: tuple[Line, ...]
    corrections: tuple[Line, ...]
    signs: Mapping[str, tuple[sympy.Symbol, ...]]
    figures: tuple[Figure, ...]
    note: Words
    see: tuple[Reference, ...]

    @property
    def number(self) -> str:
        return self.verdict.number

    @property
    def reference(self) -> Reference:
        return Reference(self.number)

    @property
    def corrected_by(self) -> tuple[Reference, ...]:
        number = self.verdict.statement.corrected_by
        return (Reference(number),) if number else ()

    @property
    def sign_words(self) -> Words:
        """What is assumed of the signs, in words."""
        words: list = []
        for sign, names in self.signs.items():
            words += ["; " if words else "", f"{SIGNS[sign]}: "]
            words += [part for name in names for part in (", ", Formula((name,)))][1:]
        return (*words, ".") if words else ()


@dataclass(frozen=True, slots=True)
class Term:
    """A symbol with its meaning and its unit."""

    symbol: Formula
    meaning: Words
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Content:
    """The whole report.

    Attributes
    ----------
    title, source : str
    summary : tuple of Words
        How many statements are as expected, and how many of the paper's equations follow.
    findings : tuple of (str, tuple of Words)
        What does not follow or should read otherwise; what follows on a condition only. Each with its heading.
    legend : tuple of (str, str)
        What the marks mean.
    table : tuple of Entry
        The paper's equations, in the paper's order.
    glossary : tuple of Term
        The symbols that occur, by name.
    sections : tuple of (str, tuple of Entry)
    """

    title: str
    source: str = SOURCE
    summary: tuple[Words, ...]
    findings: tuple[tuple[str, tuple[Words, ...]], ...]
    legend: tuple[tuple[str, str], ...] = LEGEND
    table: tuple[Entry, ...]
    glossary: tuple[Term, ...]
    sections: tuple[tuple[str, tuple[Entry, ...]], ...]

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All statements, in order."""
        return tuple(entry for _, entries in self.sections for entry in entries)
