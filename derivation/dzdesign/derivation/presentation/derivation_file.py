"""derivation.json: the account of the paper for machines."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import Artefact

_Formula = Annotated[str, Meta(description="A formula that SymPy reads back.")]
_Latex = Annotated[str, Meta(description="For typesetting.")]
_Numbers = tuple[str, ...]
_Outcome = Literal["given", "follows", "follows if", "does not follow"]
_Replaced = Annotated[Mapping[str, _Formula], Meta(description="Symbols to what replaces them.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class SymbolRow:
    """A symbol or a function."""

    latex: _Latex
    meaning: Annotated[str, Meta(description="In words; empty where the statement says it.")]
    unit: Annotated[str, Meta(description="As pint reads it; counts are `code`.")]
    sign: Annotated[
        Literal["positive", "nonnegative", "real", "function"], Meta(description="What is known of its sign.")
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundRow:
    """A statement that another one rests on."""

    number: Annotated[str, Meta(description="Its number.")]
    where: Annotated[str, Meta(description="At which values, in words; empty: as it stands.")]
    at: _Replaced


@dataclass(frozen=True, slots=True, kw_only=True)
class StepRow:
    """A step of a derivation."""

    words: Annotated[str, Meta(description="What is done.")]
    used: Annotated[tuple[GroundRow, ...], Meta(description="What is put in; empty: rearranged.")]
    name: Annotated[str, Meta(description="The symbol that this gives.")]
    gives: Annotated[_Formula, Meta(description="Its value.")]
    result: Annotated[_Formula, Meta(description="The statement's symbol after the step.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseRow:
    """One case of a proof."""

    where: Annotated[str, Meta(description="The case in words; empty: the only one.")]
    derived: Annotated[_Formula, Meta(description="What the premises give for the symbol.")]
    discrepancies: Annotated[tuple[_Formula, ...], Meta(description="Derived less published, factored; one a member.")]
    steps: Annotated[tuple[StepRow, ...], Meta(description="Empty: the premises were solved all at once.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionRow:
    """The condition on which a statement follows."""

    any_of: Annotated[
        tuple[tuple[str, ...], ...], Meta(description="Alternatives; the equations of each hold together.")
    ]
    words: Annotated[str, Meta(description="What the paper calls it.")]
    ruled_out_by: Annotated[_Replaced, Meta(description="Published values at which it does not hold.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class ValueRow:
    """A number of ours beside the paper's."""

    label: Annotated[str, Meta(description="What it is.")]
    exact: _Formula
    value: Annotated[float, Meta(description="The same as a number, in `unit`.")]
    unit: Annotated[str, Meta(description="Its unit.")]
    published: Annotated[str, Meta(description="As the paper prints it; empty: not printed.")]
    agrees: Annotated[bool | None, Meta(description="Whether it rounds to what is printed; null: not printed.")]
    remark: Annotated[str, Meta(description="What explains a difference, or what the number means.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class StatementRow:
    """A statement with its verdict and its derivation."""

    number: Annotated[str, Meta(description="The paper's, or ours: T theorem, L law and so on.")]
    title: Annotated[str, Meta(description="In a few words.")]
    kind: Annotated[
        Literal["premise", "assumption", "definition", "choice", "paper", "law", "corrected", "theorem"],
        Meta(description="Where it comes from; the first four are taken as given."),
    ]
    section: Annotated[str, Meta(description="Its section of the account.")]
    statement: Annotated[str, Meta(description="A chain of equal formulas.")]
    latex: _Latex
    premises: Annotated[tuple[GroundRow, ...], Meta(description="What it rests on.")]
    verdict: Annotated[str, Meta(description="What was found, in words.")]
    outcome: Annotated[_Outcome, Meta(description="What was found.")]
    expected: Annotated[_Outcome, Meta(description="What a correct account finds.")]
    as_expected: Annotated[bool, Meta(description="Whether both are the same, and the units agree.")]
    holds: Annotated[bool, Meta(description="Whether other statements may rest on it.")]
    cases: Annotated[tuple[CaseRow, ...], Meta(description="Its derivation, case by case.")]
    condition: Annotated[ConditionRow | None, Meta(description="On which it follows.")]
    positive_if: Annotated[str | None, Meta(description="The left side is positive exactly if this holds.")]
    necessary: Annotated[bool | None, Meta(description="Whether the condition is proved necessary; null: it has none.")]
    scope: Annotated[str, Meta(description="Where it is proved; empty: everywhere.")]
    provided: Annotated[tuple[str, ...], Meta(description="What must differ.")]
    limited_by: Annotated[_Numbers, Meta(description="Statements under it that are proved on a part only.")]
    inherited: Annotated[_Numbers, Meta(description="Statements under it that follow on a condition.")]
    unit_error: Annotated[str, Meta(description="What is wrong with its units; empty: nothing.")]
    corrected_by: Annotated[str, Meta(description="Statement that says what it should read; empty: none.")]
    see: Annotated[_Numbers, Meta(description="Statements that qualify it.")]
    values: Annotated[tuple[ValueRow, ...], Meta(description="Its numbers beside the paper's.")]
    assumptions: Annotated[Mapping[str, tuple[str, ...]], Meta(description="Sign to the symbols that have it.")]
    note: Annotated[str, Meta(description="What a reader should know.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class DerivationFile(Artefact):
    """The account of the paper: every equation re-derived from its premises, and the theorems."""

    FILE_NAME: ClassVar[str] = "derivation.json"
    schema: Annotated[Literal["dzdesign.derivation/2"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.derivation/2"
    )
    title: Annotated[str, Meta(description="Of the account.")]
    source: Annotated[str, Meta(description="The paper.")]
    holds: Annotated[bool, Meta(description="Whether every statement has the verdict expected of it.")]
    summary: Annotated[tuple[str, ...], Meta(description="In sentences.")]
    symbols: Annotated[Mapping[str, SymbolRow], Meta(description="By a name that Python can read.")]
    statements: Annotated[tuple[StatementRow, ...], Meta(description="In the order of the account.")]
