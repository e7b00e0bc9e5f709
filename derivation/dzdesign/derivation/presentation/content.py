"""What a report on the account holds: built once, written by each format, and as JSON the artefact derivation.json.

Each format writes words its own way: there is one notation for symbols, code and references in a text.
"""

import re
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import sympy
from msgspec import Meta

from dzdesign.core.artefact_types import Artefact, JsonText
from dzdesign.derivation.account.equations import PAPER_NUMBERS
from dzdesign.derivation.account.statement import Kind, Outcome
from dzdesign.derivation.presentation.formulas import to_python, to_text

#: What is no plain text in a sentence: a reference with its words, code, symbols and formulas, a statement's number.
PARTS = re.compile(
    r"\[\[(?P<to>[^|]+)\|(?P<words>.+?)\]\]|`(?P<code>[^`]+)`"
    r"|(?P<before>\(?)\$(?P<formula>[^$]+)\$(?P<behind>[,.;:)]*)"
    r"|(?P<number>\(\d+[a-z]?\)|\b[TL]\d+[a-z]?\b)"
)


class Formula(JsonText):
    """An expression, or a chain of equal ones, on a line of its own."""

    def __init__(self, *sides: sympy.Basic) -> None:
        self.sides = sides

    def __str__(self) -> str:
        return " = ".join(map(to_text, self.sides))

    def json_text(self) -> str:
        return " = ".join(map(to_python, self.sides))


class Words(JsonText):
    """Sentences: ``$u_min0$`` is a symbol, ```paper``` code, ``(18)`` and ``[[S|the definition of $S$]]`` references.

    Examples
    --------
    >>> str(Words("$u_min0$ by [[S|the definition of $S$]] and (18)"))
    'u_min0 by the definition of S and (18)'
    """

    def __init__(self, text: str) -> None:
        self.text = text

    def __bool__(self) -> bool:
        return bool(self.text)

    def __str__(self) -> str:
        return re.sub(r"\[\[[^|]+\||\]\]|\$", "", self.text)

    json_text = __str__


def inline(*sides: sympy.Basic) -> str:
    """Return a formula as a part of a sentence; an equation as its two sides."""
    parts = sides[0].args if len(sides) == 1 and isinstance(sides[0], sympy.Eq) else sides
    return f"${' = '.join(map(to_text, parts))}$"


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A sentence, and the formula to which it leads, if any."""

    words: Annotated[Words, Meta(description="Sentence of the step.")]
    formula: Annotated[Formula, Meta(description="Formula that the sentence leads to.")] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Premise:
    """A statement on which another one rests."""

    number: Annotated[str, Meta(description="Number of the statement that is the premise.")]
    words: Annotated[Words, Meta(description="Premise and the substitutions for its symbols.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Derivation:
    """The derivation of one case."""

    where: Annotated[Words, Meta(description="Case that the derivation covers; empty if it is the only one.")]
    lines: Annotated[tuple[Line, ...], Meta(description="Steps of the derivation.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A number of dzdesign beside that of the paper."""

    label: Annotated[Words, Meta(description="Quantity that is compared.")]
    value: Annotated[float, Meta(description="Value of dzdesign, in `unit`.")]
    unit: Annotated[str, Meta(description="Unit of the value.")]
    published: Annotated[str, Meta(description="Value as printed in the paper; empty if it is not printed.")]
    agrees: Annotated[bool | None, Meta(description="Whether the value rounds to the printed one; null without one.")]
    ours: Annotated[str, Meta(description="Value of dzdesign with four digits and unit.")]
    paper: Annotated[str, Meta(description="Value of the paper with unit, and the difference from it.")]
    remark: Annotated[Words, Meta(description="Reason for a difference, or meaning of the number.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A statement with its verdict and its derivation."""

    number: Annotated[str, Meta(description="Number in the paper, or of an added statement: T a theorem, L a law.")]
    title: Annotated[Words, Meta(description="Short title of the statement.")]
    kind: Annotated[Kind, Meta(description="Origin of the statement. Premises and assumptions are given.")]
    section: Annotated[str, Meta(description="Section of the account in which the statement appears.")]
    statement: Annotated[Formula, Meta(description="Chain of equal formulas, in a form that SymPy can read.")]
    premises: Annotated[tuple[Premise, ...], Meta(description="Premises on which the statement rests.")]
    outcome: Annotated[Outcome, Meta(description="Outcome of the derivation.")]
    as_expected: Annotated[bool, Meta(description="Whether a correct account has this outcome, with right units.")]
    judgement: Annotated[Words, Meta(description="Outcome in full sentences; empty if the outcome alone suffices.")]
    rearranges: Annotated[bool, Meta(description="Whether it only rearranges a definition or one premise.")]
    necessary: Annotated[bool | None, Meta(description="Whether its condition is proved necessary; null without one.")]
    scope: Annotated[Words, Meta(description="Range in which it is proved; empty if it is proved everywhere.")]
    derivations: Annotated[tuple[Derivation, ...], Meta(description="Derivation of each case.")]
    differences: Annotated[tuple[Line, ...], Meta(description="Derived minus published, and the corrected form.")]
    corrected_by: Annotated[str, Meta(description="Statement that gives the correction; empty if there is none.")]
    see: Annotated[tuple[str, ...], Meta(description="Statements that qualify this one.")]
    figures: Annotated[tuple[Figure, ...], Meta(description="Numbers of dzdesign beside those of the paper.")]
    note: Annotated[Words, Meta(description="Remark for the reader.")]

    @property
    def mark(self) -> str:
        """The outcome in two or three words."""
        given = "our choice" if self.kind is Kind.CHOICE else self.kind.value
        return f"given: {given}" if self.outcome is Outcome.GIVEN else self.outcome.value


@dataclass(frozen=True, slots=True, kw_only=True)
class Term:
    """A symbol, or a function."""

    name: Annotated[str, Meta(description="Name of the symbol in the formulas.")]
    symbol: Annotated[Formula, Meta(description="The symbol; for a function, with its argument.")]
    meaning: Annotated[Words, Meta(description="Short description of the symbol.")]
    unit: Annotated[str, Meta(description="Unit of the symbol.")]
    sign: Annotated[str, Meta(description="Assumed sign of the symbol.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class DerivationReport(Artefact):
    """The account of the paper: every equation re-derived from its premises, and the theorems."""

    FILE_NAME: ClassVar[str] = "derivation.json"
    schema: Annotated[Literal["dzdesign.derivation/2"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.derivation/2"
    )
    title: Annotated[str, Meta(description="Title of the account.")]
    source: Annotated[str, Meta(description="Reference of the paper.")]
    holds: Annotated[bool, Meta(description="Whether every outcome is that of a correct account.")]
    summary: Annotated[tuple[Words, ...], Meta(description="Summary of the outcomes, in sentences.")]
    wrong: Annotated[tuple[Words, ...], Meta(description="Statements that do not hold or need a correction.")]
    conditional: Annotated[tuple[Words, ...], Meta(description="Statements that hold only on a condition.")]
    symbols: Annotated[tuple[Term, ...], Meta(description="All symbols that occur, by name.")]
    statements: Annotated[tuple[Entry, ...], Meta(description="All statements, in the order of the account.")]

    #: What the marks mean, for the reader of the report.
    LEGEND: ClassVar = (
        ("given", "taken from the paper, or a name or a choice of ours; not derived."),
        ("follows", "the premises that are named, and nothing else, give exactly what is published."),
        ("follows if", 'they give it on the condition stated; "only then" means proved to be necessary too.'),
        ("does not follow", "they give something else: the difference stands there, and what holds instead."),
    )

    @property
    def findings(self) -> tuple[tuple[str, tuple[Words, ...]], ...]:
        """What is not simply so, under its headings."""
        return ("What does not hold", self.wrong), ("What holds on a condition only", self.conditional)

    @property
    def table(self) -> tuple[Entry, ...]:
        """The paper's equations, in the paper's order."""
        by_number = {entry.number: entry for entry in self.statements}
        return tuple(by_number[number] for number in PAPER_NUMBERS if number in by_number)

    @property
    def sections(self) -> dict[str, list[Entry]]:
        """The statements by section."""
        found: dict[str, list[Entry]] = {}
        for entry in self.statements:
            found.setdefault(entry.section, []).append(entry)
        return found
