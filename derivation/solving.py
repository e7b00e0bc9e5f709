"""Solves the grounds of a statement for its symbol and for what is eliminated, exactly, or says why not."""

from collections.abc import Mapping
from functools import lru_cache

import sympy

from dzdesign.derivation.identity import agree
from dzdesign.derivation.statement import Name
from dzdesign.derivation.steps import Relation

_CONTRADICTION = "the premises contradict each other"
_SEVERAL = "the premises allow several values"


@lru_cache(maxsize=4096)
def solve_relations(relations: tuple[Relation, ...], unknowns: tuple[Name, ...]) -> Mapping[Name, sympy.Expr] | str:
    """Solve relations for unknowns.

    Parameters
    ----------
    relations : tuple of Relation
        The grounds of one case.
    unknowns : tuple of symbols
        What is wanted.

    Returns
    -------
    mapping of symbol to sympy.Expr, or str
        Each unknown in the symbols that remain; or the reason why there is no such thing.
    """
    # A piecewise expression none of whose cases holds is nan to SymPy.
    if any(relation.right.has(sympy.Piecewise, sympy.nan) for relation in relations):
        return "the case of a piecewise premise is not decided"
    solved: dict[Name, sympy.Expr] = {}
    sides = [(relation.left, relation.right) for relation in relations]
    while sides:
        chosen = _choose(sides, unknowns, solved)
        if chosen is None:
            rest = _solve_together(sides, [name for name in unknowns if name not in solved])
            if isinstance(rest, str):
                return rest
            solved.update(rest)
            break
        index, name = chosen
        left, right = sides.pop(index)
        if name is None:  # no unknown is left in it: it must be true by itself
            if not agree(left, right):
                return _CONTRADICTION
            continue
        values = [right] if left == name and not right.has(name) else sympy.solve(left - right, name)
        if len(values) != 1:
            return _SEVERAL if values else _CONTRADICTION
        # SymPy's solver minds the signs that a symbol may have; what is given as it stands is checked here.
        if _has_wrong_sign(name, values[0]):
            return _CONTRADICTION
        solved[name] = values[0]
        sides = [tuple(side.xreplace({name: values[0]}) for side in pair) for pair in sides]
    return _put_back(solved, unknowns)


def _choose(
    sides: list[tuple[sympy.Expr, sympy.Expr]], unknowns: tuple[Name, ...], solved: Mapping[Name, sympy.Expr]
) -> tuple[int, Name | None] | None:
    """Return the next relation and what to solve it for: one that gives an unknown as it stands, or has only one."""
    names = [name for name in unknowns if name not in solved]
    for index, (left, right) in enumerate(sides):
        if left in names and not right.has(left):
            return index, left
    for index, (left, right) in enumerate(sides):
        inside = [name for name in names if left.has(name) or right.has(name)]
        if len(inside) < 2:
            return index, inside[0] if inside else None
    return None


def _solve_together(sides: list[tuple[sympy.Expr, sympy.Expr]], names: list[Name]) -> dict[Name, sympy.Expr] | str:
    solutions = sympy.solve([left - right for left, right in sides], names, dict=True)
    if len(solutions) != 1:
        return _SEVERAL if solutions else _CONTRADICTION
    return solutions[0]


def _put_back(solved: dict[Name, sympy.Expr], unknowns: tuple[Name, ...]) -> dict[Name, sympy.Expr] | str:
    """Put later solutions into earlier ones, so that no unknown is left in any."""
    solution: dict[Name, sympy.Expr] = {}
    for name, value in reversed(solved.items()):
        solution[name] = value.xreplace(solution)
    undetermined = [str(unknown) for unknown in unknowns if unknown not in solution or solution[unknown].has(*unknowns)]
    if undetermined:
        return f"the premises do not determine {', '.join(undetermined)}"
    if any(_has_wrong_sign(name, value) for name, value in solution.items()):
        return _CONTRADICTION
    return solution


def _has_wrong_sign(name: Name, value: sympy.Expr) -> bool:
    """Whether a value is one that its symbol can't have."""
    return bool((name.is_nonnegative and value.is_negative) or (name.is_positive and value.is_nonpositive))
