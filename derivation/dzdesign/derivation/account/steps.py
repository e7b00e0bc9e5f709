"""A derivation that can be read: one ground after another is put in until only what is known remains.

`proof.py` judges by solving all grounds at once; this does it again, one substitution at a time, for the reader.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy

from dzdesign.derivation.account.identity import agree
from dzdesign.derivation.account.statement import Ground, Statement
from dzdesign.derivation.symbols import Name


@dataclass(frozen=True, slots=True, kw_only=True)
class Relation:
    """A ground at the values at which it is used: ``left = right``."""

    ground: Ground
    left: sympy.Expr
    right: sympy.Expr

    def has(self, name: Name) -> bool:
        return bool(self.left.has(name) or self.right.has(name))


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One step: what was used, and what the symbol is after it."""

    #: The grounds put in; empty where the last result was only rearranged.
    used: tuple[Ground, ...]
    #: What the ground was used for: the symbol that it gives.
    name: Name
    #: The value that it gives for `name`.
    gives: sympy.Expr
    #: The statement's symbol after the step.
    result: sympy.Expr


def derive_in_steps(
    relations: Sequence[Relation], statement: Statement, solution: Mapping[Name, sympy.Expr], reached: sympy.Expr
) -> tuple[Step, ...]:
    """Derive a statement's symbol by substitution, one relation at a time, up to the form `reached`.

    The steps must agree with `solution`, what solving all relations at once gives. They are empty if no order of
    substitutions leads there: then there is nothing to read, though the solution stands.
    """
    symbol = statement.symbol
    remaining = list(relations)
    unknown, result = symbol, symbol
    steps: list[Step] = []
    used: tuple[Ground, ...]
    while unknown is not None:
        if steps and unknown == symbol:  # it came back on the right: collect it
            used, solutions = (), sympy.solve(symbol - result, symbol)
            if len(solutions) != 1:
                return ()
            gives = result = sympy.factor(solutions[0])
        else:
            found = _take(remaining, unknown)
            if found is None:
                return ()
            used, gives = (found[0],), found[1]
            result = _shorter(result.xreplace({unknown: gives}))
        steps.append(Step(used=used, name=unknown, gives=gives, result=result))
        unknown = _next_unknown(result, symbol, statement.eliminate)
    if not agree(result, solution[symbol]):
        return ()
    if result != reached:
        used = tuple(relation.ground for relation in remaining)
        steps.append(Step(used=used, name=symbol, gives=reached, result=reached))
    return tuple(steps)


def _shorter(result: sympy.Expr) -> sympy.Expr:
    """Return a result with a factor cancelled that is also the denominator of a term: a (b + c/a) is a b + c."""
    cancels = any(
        sympy.denom(term) in product.args
        for product in result.atoms(sympy.Mul)
        for factor in product.args
        if factor.is_Add
        for term in factor.args
    )
    flat = sympy.cancel(result) if cancels else result
    return flat if flat.count_ops() < result.count_ops() else result


def _next_unknown(result: sympy.Expr, symbol: Name, eliminate: Sequence[Name]) -> Name | None:
    others = (name for name in eliminate if result.has(name))
    return next(others, symbol if result.has(symbol) else None)


def _take(remaining: list[Relation], name: Name) -> tuple[Ground, sympy.Expr] | None:
    """Remove the relation that gives `name` most directly, and return what it gives."""
    for relation in remaining:
        if relation.left == name and not relation.right.has(name):
            remaining.remove(relation)
            return relation.ground, relation.right
    for relation in remaining:
        if relation.has(name):
            solutions = sympy.solve(relation.left - relation.right, name)
            if len(solutions) == 1:
                remaining.remove(relation)
                return relation.ground, sympy.factor(solutions[0])
    return None
