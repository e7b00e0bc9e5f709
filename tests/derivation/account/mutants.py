"""How sharp the account is: change every statement in every small way, and count the changes that show.

What is changed: formulas, conditions and sign claims; scopes and cases; grounds and the values at which they are taken.
A changed premise must turn a verdict of a statement that rests on it, or be refuted by numbers; a changed result must
turn its own. The units are not asked, so that the logic is measured by itself. A change that leaves the meaning as it
is (``<`` for ``<=`` where both give the same) is no mutant: it is compared with the original first, and left out. Nor
is another statement in place of a ground: where it is true, it gives another right proof.
"""

import math
import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import sympy
from sympy.core.function import AppliedUndef
from sympy.core.relational import Relational

from dzdesign.core.errors import RequirementError
from dzdesign.derivation.account.proof import Verdict, check_grounds, judge, relation_of
from dzdesign.derivation.account.referee import hear
from dzdesign.derivation.account.scope import EVERYWHERE
from dzdesign.derivation.account.solving import agree
from dzdesign.derivation.account.statement import Condition, Ground, Statement
from dzdesign.derivation.symbols import AT_PRESSURE_DROPS, QUANTITIES, Name, u_max, u_min

#: Of what is changed.
WAYS = ("formulas", "scopes", "grounds")
_FOREIGN = sympy.Symbol("foreign", positive=True)
_SAMPLES, _SEED = 2000, 20261121


def unit_of(name: Name) -> str:
    """Return the unit of a symbol, as the account states it; nothing for a function."""
    return QUANTITIES[name].unit if name in QUANTITIES else ""


def names_of(expression: sympy.Expr) -> set[Name]:
    """Return the symbols and applied functions of an expression."""
    return set(expression.atoms(AppliedUndef) | expression.free_symbols)


def formula_mutants(statement: Statement, neighbours: Mapping[str, list[Name]]) -> Iterator[tuple[Statement, str]]:
    """Yield mutated statements with their text."""
    said = _said(statement)
    for index, member in enumerate(statement.members):
        # A statement used as a ground gives its last member only; of a given one the others say nothing.
        for wrong in _mutated(member, neighbours):
            if not wrong.has(statement.symbol) and not _equivalent(member.xreplace(said), wrong.xreplace(said)):
                members = _with(statement.members, index, wrong)
                yield replace(statement, members=members), f"{statement.symbol} = {sympy.sstr(wrong)}"
    if statement.condition is not None:
        yield from _mutated_conditions(statement, statement.condition, neighbours)
    if isinstance(statement.positive_if, Relational):
        for side, other in ((statement.positive_if.lhs, 0), (statement.positive_if.rhs, 1)):
            for wrong in _mutated(side, neighbours):
                sides = (wrong, statement.positive_if.rhs) if other == 0 else (statement.positive_if.lhs, wrong)
                claim = statement.positive_if.func(*sides)
                if not _equivalent(side, wrong):
                    yield replace(statement, positive_if=claim), f"{statement.symbol} > 0 exactly if {claim}"


def scope_mutants(statement: Statement) -> Iterator[tuple[Statement, str]]:
    """Leave out a case, or what the derivation is said to hold for."""
    for index, case in enumerate(statement.cases):
        others = _without(statement.cases, index)
        if others:
            yield replace(statement, cases=others), f"without the case {case.where}"
    for index, provision in enumerate(statement.provided):
        yield replace(statement, provided=_without(statement.provided, index)), f"without {provision}"
    if statement.scope:
        yield replace(statement, scope=EVERYWHERE), f"without its scope, {statement.scope}"


def _mutated_conditions(
    statement: Statement, condition: Condition, neighbours: Mapping[str, list[Name]]
) -> Iterator[tuple[Statement, str]]:
    for row, alternative in enumerate(condition.any_of):
        others = _without(condition.any_of, row)
        if others:
            yield replace(statement, condition=replace(condition, any_of=others)), f"without condition {alternative}"
        for column, equation in enumerate(alternative):
            for wrong in _mutated(equation.rhs, neighbours):
                wrong_equation = sympy.Eq(equation.lhs, wrong)
                if _equivalent(equation.rhs, wrong) or not isinstance(wrong_equation, sympy.Eq):
                    continue
                changed = _with(condition.any_of, row, _with(alternative, column, wrong_equation))
                mutant = replace(condition, any_of=changed)
                yield replace(statement, condition=mutant), f"follows if {wrong_equation}"


def _with(items: tuple[Any, ...], index: int, item: object) -> tuple[Any, ...]:
    return (*items[:index], item, *items[index + 1 :])


def _without(items: tuple[Any, ...], index: int) -> tuple[Any, ...]:
    return (*items[:index], *items[index + 1 :])


def _mutated(expression: sympy.Expr, neighbours: Mapping[str, list[Name]]) -> list[sympy.Expr]:
    """Return expressions that differ by a coefficient, a sign, a term, a factor, a power, a symbol or a comparison."""
    wrong = [2 * expression, -expression, expression + _FOREIGN] if not expression.has(sympy.Piecewise) else []
    wrong += _changed_inside(expression, neighbours)
    return list(dict.fromkeys(other for other in wrong if other != expression))


def _changed_inside(expression: sympy.Basic, neighbours: Mapping[str, list[Name]]) -> list[sympy.Basic]:
    changed = list(_changed_here(expression, neighbours))
    if expression.is_Symbol or isinstance(expression, AppliedUndef):
        return changed
    for index, argument in enumerate(expression.args):
        for wrong in _changed_inside(argument, neighbours):
            changed.append(expression.func(*_with(expression.args, index, wrong)))
    return changed


def _changed_here(part: sympy.Basic, neighbours: Mapping[str, list[Name]]) -> Iterator[sympy.Basic]:
    if part.is_Symbol or isinstance(part, AppliedUndef):
        unit = unit_of(part)
        yield _FOREIGN
        yield from (other for other in neighbours.get(unit, ()) if other != part)
    elif part.is_Add:
        yield from (part - term for term in part.args)
        yield from (part - 2 * term for term in part.args)
    elif part.is_Mul:
        yield from (part / factor for factor in part.args)
    elif part.is_Pow:
        yield part.base ** (part.exp + 1)
        yield part.base ** (-part.exp)
    elif part.is_Integer and part not in (-1, 0):
        yield part + 1
    elif isinstance(part, Relational):
        yield part.negated
        yield {">": sympy.Ge, "<": sympy.Le, ">=": sympy.Gt, "<=": sympy.Lt}[part.rel_op](part.lhs, part.rhs)


def _said(statement: Statement) -> dict[Name, Name]:
    """Return which symbols are one where a statement is meant to hold."""
    equations = (one for one in statement.scope.comparisons if isinstance(one, sympy.Eq))
    return {one.lhs: one.rhs for one in equations if one.lhs.is_Symbol and one.rhs.is_Symbol}


def _equivalent(original: sympy.Expr, mutant: sympy.Expr) -> bool:
    if not original.has(sympy.Piecewise):
        return not mutant.has(sympy.nan, sympy.zoo) and agree(original, mutant)
    return _same_at_samples(original, mutant)


def _same_at_samples(original: sympy.Expr, mutant: sympy.Expr) -> bool:
    """Compare piecewise expressions at many points; small integers put enough of them on the boundaries."""
    names = sorted(names_of(original) | names_of(mutant), key=str)
    left, right = (sympy.lambdify(names, side, modules="math") for side in (original, mutant))
    draw = random.Random(_SEED)
    for _ in range(_SAMPLES):
        point = [draw.randint(1, 3) if name.is_positive else draw.randint(-9, 9) for name in names]
        values = dict(zip(names, point, strict=True))
        if values.get(u_min, 0) > values.get(u_max, math.inf):
            continue  # a threshold above full command: no valve
        try:
            expected, found = left(*point), right(*point)
        except (ZeroDivisionError, ValueError):  # outside the domain of the formula
            continue
        # Where no branch of the original holds, a point is outside its domain and says nothing.
        if expected is not None and (found is None or not math.isclose(expected, found, rel_tol=1e-12)):
            return False
    return True


_DROPS = {names[index]: names[1 - index] for names in AT_PRESSURE_DROPS.values() for index in (0, 1)}


def ground_mutants(statement: Statement, statements: Mapping[str, Statement]) -> Iterator[tuple[Statement, str]]:
    """Yield a statement on other grounds, with its text."""
    for index, ground in enumerate(statement.grounds):
        others = statement.grounds[:index], statement.grounds[index + 1 :]
        if len(statement.grounds) > 1:
            yield replace(statement, grounds=(*others[0], *others[1])), f"without its ground {ground}"
        for wrong in _other_grounds(ground):
            if not _says_the_same(ground, wrong, statement, statements):
                yield replace(statement, grounds=(*others[0], wrong, *others[1])), f"{wrong} for its ground {ground}"


def _other_grounds(ground: Ground) -> Iterator[Ground]:
    for index, (name, value) in enumerate(ground.at):
        rest = ground.at[:index], ground.at[index + 1 :]
        yield replace(ground, at=(*rest[0], *rest[1]))
        if value in _DROPS:
            yield replace(ground, at=(*rest[0], (name, _DROPS[value]), *rest[1]))
        if value.is_number:
            yield replace(ground, at=(*rest[0], (name, value + 1), *rest[1]))


def _says_the_same(ground: Ground, other: Ground, user: Statement, statements: Mapping[str, Statement]) -> bool:
    """Whether two grounds are one where their user is meant to hold: a constant threshold is one at every drop."""
    one, two = (relation_of(statements[each.number], each) for each in (ground, other))
    said = _said(user)
    sides = [(one.left.xreplace(said), two.left.xreplace(said)), (one.right.xreplace(said), two.right.xreplace(said))]
    return all(left == right or agree(left, right) for left, right in sides)


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
                check_grounds(statement, _before(statement, statements))
            return not judge(statement, statements, self.verdicts).as_expected
        except RequirementError:
            return True

    def is_refuted(self, mutant: Statement) -> bool:
        """Whether numbers speak against a mutant."""
        statements = {**self.statements, mutant.number: mutant}
        return bool(hear(judge(mutant, statements, self.verdicts), statements))

    def is_caught(self, mutant: Statement) -> bool:
        """Whether its own verdict turns, or numbers speak against it."""
        return self.shows(mutant, mutant) or self.is_refuted(mutant)


class Tried(NamedTuple):
    """Mutants of one statement in one way, each with its text, and their judge."""

    number: str
    changed: str
    mutants: Iterable[tuple[Statement, str]]
    is_caught: Callable[[Any], bool]


class Score(NamedTuple):
    """How many mutants of a statement were tried, and the texts of those that were not caught."""

    number: str
    changed: str
    mutants: int
    survivors: tuple[str, ...]


def score_mutations(verdicts: Sequence[Verdict], share: float = 1.0, seed: int = 0) -> list[Score]:
    """Mutate every statement of a proved account and see which mutants are caught.

    Of the mutants a `share` is tried, drawn with a `seed` in two stages, statements and mutants of these: all of them,
    unless a smaller one is given.
    """
    account = _Account(
        statements={verdict.number: verdict.statement for verdict in verdicts},
        verdicts={verdict.number: verdict for verdict in verdicts},
    )
    ways = (_formulas, _scopes, _grounds)
    scores = [score(way(statement, account), share, seed) for way in ways for statement in account.statements.values()]
    return [one for one in scores if one.mutants]


def _formulas(statement: Statement, account: _Account) -> Tried:
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

    return Tried(statement.number, "formulas", formula_mutants(statement, neighbours), is_caught)


def _scopes(statement: Statement, account: _Account) -> Tried:
    return Tried(statement.number, "scopes", scope_mutants(statement), account.is_caught)


def _grounds(statement: Statement, account: _Account) -> Tried:
    return Tried(statement.number, "grounds", ground_mutants(statement, account.statements), account.is_caught)


def score(these: Tried, share: float, seed: int) -> Score:
    """Try the mutants of one statement."""
    draw = random.Random(f"{seed} {these.changed} {these.number}")
    part = math.sqrt(share)
    mutants = these.mutants if draw.random() < part else ()  # to make them is half the work
    drawn = [each for each in mutants if draw.random() < part]
    survivors = tuple(text for mutant, text in drawn if not these.is_caught(mutant))
    return Score(these.number, these.changed, len(drawn), survivors)


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
