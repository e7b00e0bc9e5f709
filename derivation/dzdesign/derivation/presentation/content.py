"""What a report on the account holds: built once, written by each format, and as JSON the artefact derivation.json."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import Artefact
from dzdesign.derivation.account.equations import PAPER_NUMBERS
from dzdesign.derivation.account.statement import Kind, Outcome
from dzdesign.derivation.presentation.prose import Formula, Reference, Words, parse_prose

Numbers = tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A sentence, and the formula that it leads to, if any."""

    words: Annotated[Words, Meta(description="The sentence.")]
    formula: Annotated[Formula, Meta(description="What it leads to.")] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Premise:
    """A statement that another one rests on."""

    number: Annotated[str, Meta(description="Its number.")]
    at: Annotated[tuple[Formula, ...], Meta(description="What replaces its symbols.")]
    words: Annotated[Words, Meta(description="The same in words.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Derivation:
    """The derivation of one case."""

    where: Annotated[Words, Meta(description="The case; empty: the only one.")]
    derived: Annotated[Formula, Meta(description="What the premises give for the statement's symbol.")]
    discrepancies: Annotated[tuple[Formula, ...], Meta(description="Derived less published, factored; one a member.")]
    lines: Annotated[tuple[Line, ...], Meta(description="Step by step; a single line: solved all at once.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A number of ours beside the paper's."""

    label: Annotated[Words, Meta(description="What it is.")]
    exact: Annotated[Formula, Meta(description="Ours, exactly.")]
    value: Annotated[float, Meta(description="The same as a number, in `unit`.")]
    unit: Annotated[str, Meta(description="Its unit.")]
    published: Annotated[str, Meta(description="As the paper prints it; empty: not printed.")]
    agrees: Annotated[bool | None, Meta(description="Whether ours rounds to that; null: not printed.")]
    ours: Annotated[str, Meta(description="Ours with four digits and unit.")]
    paper: Annotated[str, Meta(description="The paper's with unit, and how far ours is from it.")]
    remark: Annotated[Words, Meta(description="What explains a difference, or what the number means.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A statement with its verdict and its derivation."""

    number: Annotated[str, Meta(description="The paper's, or ours: T theorem, L law and so on.")]
    title: Annotated[Words, Meta(description="In a few words.")]
    kind: Annotated[Kind, Meta(description="Where it comes from; premises, assumptions and the like are given.")]
    section: Annotated[str, Meta(description="Its section of the account.")]
    statement: Annotated[Formula, Meta(description="A chain of equal formulas that SymPy reads back.")]
    latex: Annotated[str, Meta(description="The same for typesetting.")]
    premises: Annotated[tuple[Premise, ...], Meta(description="What it rests on.")]
    outcome: Annotated[Outcome, Meta(description="What was found.")]
    expected: Annotated[Outcome, Meta(description="What a correct account finds.")]
    as_expected: Annotated[bool, Meta(description="Whether both are the same, and the units agree.")]
    holds: Annotated[bool, Meta(description="Whether other statements may rest on it.")]
    verdict: Annotated[str, Meta(description="What was found, in words.")]
    judgement: Annotated[Words, Meta(description="The same in sentences; empty: the outcome says it all.")]
    rearranges: Annotated[bool, Meta(description="Whether it only rearranges a definition or one premise.")]
    any_of: Annotated[tuple[tuple[Formula, ...], ...], Meta(description="Alternative conditions on which it follows.")]
    ruled_out_by: Annotated[tuple[Formula, ...], Meta(description="Published values at which none of these holds.")]
    necessary: Annotated[bool | None, Meta(description="Whether that is proved necessary; null: no condition.")]
    positive_if: Annotated[Formula, Meta(description="Its left side is positive exactly if this holds.")] | None
    provided: Annotated[tuple[Formula, ...], Meta(description="What must differ.")]
    scope: Annotated[Words, Meta(description="Where it is proved; empty: everywhere.")]
    limited_by: Annotated[Numbers, Meta(description="Statements under it that are proved on a part only.")]
    inherited: Annotated[Numbers, Meta(description="Statements under it that follow on a condition.")]
    unit_error: Annotated[str, Meta(description="What is wrong with its units; empty: nothing.")]
    derivations: Annotated[tuple[Derivation, ...], Meta(description="Case by case.")]
    differences: Annotated[tuple[Line, ...], Meta(description="Derived less published, where they differ.")]
    corrections: Annotated[tuple[Line, ...], Meta(description="What it should read.")]
    corrected_by: Annotated[tuple[Reference, ...], Meta(description="The statement that says so.")]
    see: Annotated[tuple[Reference, ...], Meta(description="Statements that qualify it.")]
    figures: Annotated[tuple[Figure, ...], Meta(description="Its numbers beside the paper's.")]
    signs: Annotated[Mapping[str, tuple[Formula, ...]], Meta(description="What is assumed of its symbols, by sign.")]
    note: Annotated[Words, Meta(description="What a reader should know.")]

    @property
    def name(self) -> Words:
        return parse_prose(self.number)

    @property
    def reference(self) -> Reference:
        return Reference(self.number)

    @property
    def mark(self) -> str:
        """The outcome in two or three words."""
        given = "our choice" if self.kind is Kind.CHOICE else self.kind.value
        return f"given: {given}" if self.outcome is Outcome.GIVEN else self.outcome.value

    @property
    def sign_words(self) -> Words:
        """What is assumed of the signs, in words."""
        by_sign = (Words(f"{sign}: ", Words.join(names)) for sign, names in self.signs.items())
        return Words(Words.join(by_sign, "; "), ".")


@dataclass(frozen=True, slots=True, kw_only=True)
class Term:
    """A symbol, or a function."""

    name: Annotated[str, Meta(description="As it stands in the formulas.")]
    symbol: Annotated[Formula, Meta(description="The symbol; of a function with its argument.")]
    meaning: Annotated[Words, Meta(description="In a few words.")]
    unit: Annotated[str, Meta(description="Its unit.")]
    latex: Annotated[str, Meta(description="For typesetting.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class DerivationReport(Artefact):
    """The account of the paper: every equation re-derived from its premises, and the theorems."""

    FILE_NAME: ClassVar[str] = "derivation.json"
    schema: Annotated[Literal["dzdesign.derivation/2"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.derivation/2"
    )
    title: Annotated[str, Meta(description="Of the account.")]
    source: Annotated[str, Meta(description="The paper.")]
    holds: Annotated[bool, Meta(description="Whether every statement has the verdict expected of it.")]
    summary: Annotated[tuple[Words, ...], Meta(description="What was found, in sentences.")]
    wrong: Annotated[tuple[Words, ...], Meta(description="What does not hold, or should read otherwise.")]
    conditional: Annotated[tuple[Words, ...], Meta(description="What holds on a condition only.")]
    symbols: Annotated[tuple[Term, ...], Meta(description="The symbols that occur, by name.")]
    statements: Annotated[tuple[Entry, ...], Meta(description="In the order of the account.")]

    #: What the marks mean, for the reader of the report.
    LEGEND: ClassVar = (
        ("given", "taken from the paper, or a name or a choice of ours; not derived."),
        ("follows", "the premises that are named, and nothing else, give exactly what is published."),
        ("follows if", "they give it on the condition stated; “only then” means proved to be necessary too."),
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
