"""How sharp the account is: change every statement in every small way, and count the changes that show.

What is changed: formulas, conditions and sign claims; scopes and cases; grounds and the values at which they are taken;
kinds; and the numbers that the paper prints. A changed premise must turn a verdict of a statement that rests on it, or
be refuted by numbers; a changed result must turn its own. The units are not asked, so that the logic is measured by
itself. A change that leaves the meaning as it is (``<`` for ``<=`` where both give the same) is no mutant: it is
compared with the original first.
"""

import math
import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from msgspec import Meta

from dzdesign.core.artefact_types import THIS_TOOL, Artefact
from dzdesign.core.errors import RequirementError
from dzdesign.derivation.account.ledger import find_kind_fault, names_in
from dzdesign.derivation.account.mutation.formula_mutants import formula_mutants, names_of, scope_mutants, unit_of
from dzdesign.derivation.account.mutation.ground_mutants import ground_mutants, kind_mutants
from dzdesign.derivation.account.passages.transcription import find_transcription_faults
from dzdesign.derivation.account.proof import Verdict, judge
from dzdesign.derivation.account.published import transcribed
from dzdesign.derivation.account.referee.referee import hear
from dzdesign.derivation.account.renaming import check_grounds
from dzdesign.derivation.account.statement import Statement
from dzdesign.derivation.symbols import Name

#: Of what is changed.
WAYS = ("formulas", "scopes", "grounds", "kinds", "published numbers")


@dataclass(frozen=True, slots=True, kw_only=True)
class StatementMutants:
    """Changes of one statement of one kind, and how many were detected."""

    number: Annotated[str, Meta(description="Number of the statement, or name of a number printed in the paper.")]
    changed: Annotated[str, Meta(description="Part of the statement that was changed.")]
    mutants: Annotated[int, Meta(description="Number of changes that alter the meaning.")]
    caught: Annotated[int, Meta(description="Number of those changes that were detected.")]
    survivors: Annotated[tuple[str, ...], Meta(description="Changes that were not detected.")]
    equivalent: Annotated[
        tuple[str, ...], Meta(description="Number of changes that do not alter the meaning and so can't be detected.")
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class AccountMutants(Artefact):
    """Number of wrong statements that the account detects."""

    FILE_NAME: ClassVar[str] = "mutants.json"
    schema: Annotated[Literal["dzdesign.mutation/1"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.mutation/1"
    )
    mutants: Annotated[int, Meta(description="Number of wrong statements and numbers that were tried.")]
    caught: Annotated[int, Meta(description="Number of those that were detected.")]
    statements: Annotated[
        tuple[StatementMutants, ...], Meta(description="Results by kind of change, in the order of the account.")
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Account:
    """A proved account, by number."""

    statements: Mapping[str, Statement]
    verdicts: Mapping[str, Verdict]

    def shows(self, statement: Statement, mutant: Statement) -> bool:
        """Whether a statement's verdict turns if a mutant stands in the account."""
        statements = {**self.statements, mutant.number: mutant}
        try:
            if statement.grounds:
                check_grounds(statement, _before(statement, statements), list(statements))
            return not judge(statement, statements, self.verdicts).as_expected
        except RequirementError:
            return True

    def is_refuted(self, mutant: Statement) -> bool:
        """Whether numbers speak against a mutant."""
        statements = {**self.statements, mutant.number: mutant}
        return bool(hear(judge(mutant, statements, self.verdicts), statements))


class _Tried(NamedTuple):
    """Mutants of one statement or number in one way, each with its text (None: it changes nothing), and their judge."""

    number: str
    changed: str
    mutants: Iterable[tuple[Any, str]]
    is_caught: Callable[[Any], bool]


def score_mutations(verdicts: Sequence[Verdict], share: float = 1.0, seed: int = 0) -> AccountMutants:
    """Mutate every statement of a proved account, and every number transcribed, and see which mutants are caught.

    Of the mutants a `share` is tried, drawn with a `seed` in two stages, statements and mutants of these: all of them,
    unless a smaller one is given.
    """
    account = _Account(
        statements={verdict.number: verdict.statement for verdict in verdicts},
        verdicts={verdict.number: verdict for verdict in verdicts},
    )
    ways: tuple[Callable[[Statement, _Account], _Tried], ...] = (_formulas, _scopes, _grounds, _kinds)
    tried = [way(statement, account) for way in ways for statement in account.statements.values()]
    tried += [_of_number(name) for name in transcribed()]
    scores = [_score(one, share, seed) for one in tried]
    return AccountMutants(
        tool=THIS_TOOL,
        made_from=(),
        mutants=sum(score.mutants for score in scores),
        caught=sum(score.caught for score in scores),
        statements=tuple(score for score in scores if score.mutants or score.equivalent),
    )


def _formulas(statement: Statement, account: _Account) -> _Tried:
    users = [
        user
        for user in account.statements.values()
        if statement.number in {ground.number for ground in user.grounds} and not statement.grounds
    ]
    users.sort(key=lambda user: len(user.grounds) * max(1, len(user.cases)))  # the quick ones first
    neighbours = _neighbours((statement, *users), account.statements)
    judged = users if statement.kind.is_given else [statement]

    def is_caught(mutant: Statement) -> bool:
        found = (account.shows(mutant if user is statement else user, mutant) for user in judged)
        return any(found) or account.is_refuted(mutant)

    return _Tried(statement.number, "formulas", formula_mutants(statement, neighbours), is_caught)


def _scopes(statement: Statement, account: _Account) -> _Tried:
    return _Tried(statement.number, "scopes", scope_mutants(statement), lambda one: _is_caught(one, account))


def _grounds(statement: Statement, account: _Account) -> _Tried:
    mutants = ground_mutants(statement, account.statements)
    return _Tried(statement.number, "grounds", mutants, lambda one: _is_caught(one, account))


def _kinds(statement: Statement, account: _Account) -> _Tried:
    known = {name for one in _before(statement, account.statements).values() for name in names_in(one)}
    return _Tried(statement.number, "kinds", kind_mutants(statement), lambda one: bool(find_kind_fault(one, known)))


def _is_caught(mutant: Statement, account: _Account) -> bool:
    return account.shows(mutant, mutant) or account.is_refuted(mutant)


def _of_number(name: str) -> _Tried:
    """Change the last digit of a number, shift its point, and put another one in its place."""
    printed = transcribed()
    number = printed[name]
    digits = {f"{number[:-1]}{(int(number[-1]) + step) % 10}" for step in (1, 9)}
    wrong = (digits | {f"{number}0", *printed.values()}) - {number}
    mutants = [(one, f"{one} for {number}") for one in sorted(wrong)]
    return _Tried(
        name, "published numbers", mutants, lambda one: bool(find_transcription_faults({**printed, name: one}))
    )


def _score(these: _Tried, share: float, seed: int) -> StatementMutants:
    draw = random.Random(f"{seed} {these.changed} {these.number}")
    part = math.sqrt(share)
    is_drawn = draw.random() < part
    tried, equivalent, survivors = 0, [], []
    for mutant, text in these.mutants if is_drawn else ():  # to make them is half the work
        if draw.random() >= part:
            continue
        if mutant is None:
            equivalent.append(text)
            continue
        tried += 1
        if not these.is_caught(mutant):
            survivors.append(text)
    return StatementMutants(
        number=these.number,
        changed=these.changed,
        mutants=tried,
        caught=tried - len(survivors),
        survivors=tuple(survivors),
        equivalent=tuple(equivalent),
    )


def _before(statement: Statement, statements: Mapping[str, Statement]) -> dict[str, Statement]:
    order = list(statements)
    return {number: statements[number] for number in order[: order.index(statement.number)]}


def _neighbours(users: Sequence[Statement], statements: Mapping[str, Statement]) -> dict[str, list[Name]]:
    """Symbols that stand near a statement, by unit: what a slip of the pen would write for each other."""
    near = {
        name
        for user in users
        for statement in (user, *(statements[ground.number] for ground in user.grounds))
        for expression in (statement.symbol, *statement.members)
        for name in names_of(expression)
    }
    by_unit: dict[str, list[Name]] = {}
    for name in sorted(near, key=str):
        by_unit.setdefault(unit_of(name), []).append(name)
    return by_unit
