"""A referee of numbers: tries a statement on every valve and in every situation in which it is meant to hold.

A statement that is proved must be true there, and so must each ground, taken as the statement takes it: then a proof
can't join what never holds together. One that follows on a condition must be true where that holds, false somewhere
else; one that does not follow must be false somewhere.
"""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache

import sympy
from sympy.core.function import AppliedUndef
from sympy.core.relational import Relational

from dzdesign.derivation.account.proof import Verdict, relation_of
from dzdesign.derivation.account.scope import Scope
from dzdesign.derivation.account.situations import Situation, situations
from dzdesign.derivation.account.statement import Ground, Statement
from dzdesign.derivation.symbols import Name, dP, u_i


def hear(verdict: Verdict, statements: Mapping[str, Statement]) -> str:
    """Try a judged statement of an account, given by number; return what the numbers say against it, if anything."""
    statement = verdict.statement
    places = [one for one in situations() if _admits(statement, one) and _conditions_hold(verdict, statements, one)]
    if not places:
        return f"no valve is ever in its scope ({statement.scope or 'everywhere'})"
    for name in statement.condition.for_all if statement.condition is not None else ():
        if len({place.numbers.get(name) for place in places}) == 1:
            return f"it is to hold for every {name}, and its scope ({statement.scope}) leaves one value"
    free, silent = _left_free(statement.scope), set(statement.grounds)
    tried = is_refuted = is_met = is_general = False
    true_unmet: dict[tuple[float, ...], str] = {}
    for place in places:
        objection = _ground_objection(statement, statements, place, silent)
        if objection:
            return objection
        try:
            wrong, meets = _difference(statement, place), _meets(statement, place)
        except NoNumberError:
            continue
        if wrong and verdict.holds and meets:
            return f"{wrong}: {place.words}"
        tried, is_met, is_refuted = True, is_met or meets, is_refuted or bool(wrong)
        is_general = is_general or free <= place.general
        if not meets:
            alike = _alike(statement, place)
            true_unmet[alike] = "" if wrong else true_unmet.get(alike, place.words)
    scope = statement.scope or "everywhere"
    if not tried:
        return f"no situation of its scope ({scope}) has numbers for its symbols"
    if silent:
        return f"no situation of its scope has numbers for its ground {', '.join(sorted(map(str, silent)))}"
    if verdict.holds and not is_met:
        return "no valve in its scope meets its condition"
    if not is_general:
        return (
            f"its scope ({scope}) leaves only special values of {' and '.join(sorted(map(str, free)))}, and says none"
        )
    true_without = next(filter(None, true_unmet.values()), "")
    if true_without:
        return f"it is true without its condition: {true_without}"
    if not is_refuted and (statement.condition is not None or not verdict.holds):
        return "it is true of every valve, also where it should not follow"
    return ""


def _left_free(scope: Scope) -> set[Name]:
    """Return which of command and pressure drop a scope leaves free: no equation of it says a value."""
    said = {name for one in scope.comparisons if isinstance(one, sympy.Eq) for name in one.free_symbols}
    return {u_i, dP} - said


def _admits(statement: Statement, place: Situation) -> bool:
    said = (*statement.scope.comparisons, *statement.provided)
    try:
        return statement.scope.admits(place.settings) and all(holds(one, place) for one in said)
    except NoNumberError:
        return False


def _conditions_hold(verdict: Verdict, statements: Mapping[str, Statement], place: Situation) -> bool:
    """Whether the conditions hold on which the grounds follow, and theirs."""
    try:
        return all(_meets(statements[number], place) for number in verdict.inherited)
    except NoNumberError:
        return False


def _meets(statement: Statement, place: Situation) -> bool:
    condition = statement.condition
    if condition is None:
        return True
    return any(all(holds(equation, place) for equation in alternative) for alternative in condition.any_of)


def _alike(statement: Statement, place: Situation) -> tuple[float, ...]:
    """Return the numbers that a condition is about: places are alike where only what it is to hold for differs."""
    condition = statement.condition
    if condition is None:
        return ()
    asked = {name for alternative in condition.any_of for one in alternative for name in one.free_symbols}
    names = (condition.discrepancy.free_symbols | asked) - set(condition.for_all)
    return tuple(place.numbers[name] for name in sorted(names, key=str) if name in place.numbers)


def _ground_objection(
    statement: Statement, statements: Mapping[str, Statement], place: Situation, silent: set[Ground]
) -> str:
    """Say which ground is not true in a place; those that have numbers there leave `silent`."""
    for ground in statement.grounds:
        relation = relation_of(statements[ground.number], ground)
        try:
            left, right = evaluate(relation.left, place), evaluate(relation.right, place)
        except NoNumberError:
            continue
        silent.discard(ground)
        if not agree(left, right):
            return f"its ground {ground} does not hold in its scope ({left:.6g}, {right:.6g}): {place.words}"
    return ""


def _difference(statement: Statement, place: Situation) -> str:
    """Say which member differs from the symbol; nothing if none does."""
    left = evaluate(statement.symbol, place)
    for member in statement.members:
        right = evaluate(member, place)
        if not agree(left, right):
            return f"{sympy.sstr(statement.symbol)} is {left:.6g} and not {right:.6g}"
    if statement.positive_if is not None and (left > 1e-9) != holds(statement.positive_if, place):
        return f"{sympy.sstr(statement.symbol)} is {left:.6g}, but {statement.positive_if} says otherwise"
    return ""


# --- numbers in expressions and comparisons -----------------------------------------------------------------

#: Equal up to this, of numbers near 1; sensitivities are difference quotients.
_TOLERANCE = 1e-7


class NoNumberError(Exception):
    """A situation has no number for a symbol, or a formula has none at its numbers."""


def agree(left: float, right: float) -> bool:
    """Return whether two numbers are one, to the rounding of doubles through a formula."""
    return math.isclose(left, right, rel_tol=_TOLERANCE, abs_tol=_TOLERANCE)


def evaluate(expression: sympy.Expr, situation: Situation) -> float:
    """Return an expression's number in a situation.

    Raises
    ------
    NoNumberError
        If there is none: the situation says nothing of it.
    """
    compiled, names = _compiled(expression)
    try:
        value = compiled(*(_number(name, situation) for name in names))
    except (ZeroDivisionError, ValueError, OverflowError) as error:
        raise NoNumberError(f"{expression}: {error}") from error
    if value is None or isinstance(value, complex) or not math.isfinite(value):
        raise NoNumberError(f"{expression} has no value")
    return float(value)


def holds(comparison: Relational, situation: Situation) -> bool:
    """Whether a comparison holds in a situation."""
    left, right = evaluate(comparison.lhs, situation), evaluate(comparison.rhs, situation)
    if isinstance(comparison, sympy.Eq | sympy.Ne):
        return agree(left, right) == isinstance(comparison, sympy.Eq)
    if agree(left, right):
        return comparison.rel_op in ("<=", ">=")
    return (left < right) == (comparison.rel_op in ("<", "<="))


def _number(name: sympy.Expr, situation: Situation) -> float:
    if isinstance(name, AppliedUndef):
        if name.func not in situation.functions:
            raise NoNumberError(f"{name} has no number")
        return situation.functions[name.func](evaluate(name.args[0], situation))
    if name not in situation.numbers:
        raise NoNumberError(f"{name} has no number")
    return situation.numbers[name]


@lru_cache(maxsize=16384)
def _compiled(expression: sympy.Expr) -> tuple[Callable[..., float | None], tuple[sympy.Expr, ...]]:
    stand_ins = {function: sympy.Dummy() for function in expression.atoms(AppliedUndef)}
    plain = expression.xreplace(stand_ins)
    names = {stand_in: function for function, stand_in in stand_ins.items()}
    arguments = sorted(plain.free_symbols, key=str)
    return sympy.lambdify(arguments, plain, modules="math"), tuple(names.get(one, one) for one in arguments)
