"""Small changes of a statement's formulas, conditions and scope, each with the changes that leave its meaning."""

import math
import random
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import sympy
from sympy.core.function import AppliedUndef
from sympy.core.relational import Relational

from dzdesign.derivation.account.identity import agree
from dzdesign.derivation.account.scope import EVERYWHERE
from dzdesign.derivation.account.statement import Condition, Statement
from dzdesign.derivation.symbols import QUANTITIES, Name, u_max, u_min

_FOREIGN = sympy.Symbol("foreign", positive=True)
_SAMPLES, _SEED = 2000, 20261121


def unit_of(name: Name) -> str:
    """Return the unit of a symbol, as the account states it; nothing for a function."""
    return QUANTITIES[name].unit if name in QUANTITIES else ""


def names_of(expression: sympy.Expr) -> set[Name]:
    """Return the symbols and applied functions of an expression."""
    return set(expression.atoms(AppliedUndef) | expression.free_symbols)


def formula_mutants(
    statement: Statement, neighbours: Mapping[str, list[Name]]
) -> Iterator[tuple[Statement | None, str]]:
    """Yield mutated statements with their text, or None for a change that leaves the meaning."""
    for index, member in enumerate(statement.members):
        # A statement used as a ground gives its last member only; of a given one the others say nothing.
        for wrong in _mutated(member, neighbours):
            text = f"{statement.symbol} = {sympy.sstr(wrong)}"
            if wrong.has(statement.symbol):
                continue
            if _equivalent(member, wrong):
                yield None, text
                continue
            yield replace(statement, members=_with(statement.members, index, wrong)), text
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
