"""Which part of its range a proof covers: a statement that is proved on a part of it only has to say on which."""

from collections.abc import Mapping
from functools import cache

import sympy
from sympy.core.relational import Relational
from sympy.logic.boolalg import Boolean

from dzdesign.derivation.account.statement import Case, Statement
from dzdesign.derivation.symbols import DISTANCES


@cache
def is_exhaustive(cases: tuple[Case, ...], within: Boolean) -> bool:
    """Return whether cases leave nothing out of what a statement is meant for.

    Each case replaces symbols by others plus a distance of known sign, as ``dP1 = dP0 + above``; so it says which
    comparisons hold, as `within` says which ones hold wherever the statement is meant to. The cases are exhaustive if
    propositional logic alone shows that one of them is true; a case that can't be read as comparisons shows nothing.
    """
    if not cases:
        return True
    claims = [_claim(case) for case in cases]
    if None in claims:
        return False
    # An equation narrows what is meant; without it the cases have to cover more.
    meant = sympy.And(
        *(one for one in sympy.And.make_args(within) if not isinstance(one, sympy.Eq | sympy.Ne))
    ).replace(
        lambda part: isinstance(part, Relational),
        lambda part: _is_above(part.gts - part.lts, isinstance(part, sympy.StrictGreaterThan | sympy.StrictLessThan)),
    )
    return not sympy.satisfiable(sympy.And(meant, *(sympy.Not(claim) for claim in claims)))


def branch_conditions(member: sympy.Expr) -> list[sympy.Basic]:
    """Return the conditions of a piecewise member's branches; none of any other."""
    return [condition for _, condition in member.args] if isinstance(member, sympy.Piecewise) else []


def meets_all_branches(statement: Statement, earlier: Mapping[str, Statement]) -> bool:
    """Return whether each branch of each piecewise ground is met in one of the cases."""
    for ground in statement.grounds:
        member = earlier[ground.number].members[ground.member]
        branches = [condition.xreplace(dict(ground.at)) for condition in branch_conditions(member)]
        decided = [[one.xreplace(dict(case.at)) == sympy.true for one in branches] for case in statement.cases_to_prove]
        # The first that is true is met; the last one's condition is often just "otherwise".
        if branches and {case.index(True) if True in case else None for case in decided} != set(range(len(branches))):
            return False
    return True


def _claim(case: Case) -> sympy.Basic | None:
    """Return what a case says of the symbols that it replaces, or None if that can't be read off."""
    distances: dict[sympy.Symbol, sympy.Expr] = {}
    claims = []
    for name, value in case.at:
        margin = name - value.xreplace(distances)
        unknown = [distance for distance in DISTANCES if margin.has(distance)]
        if not unknown:
            claims += [_is_above(margin, strictly=False), _is_above(-margin, strictly=False)]
            continue
        solutions = sympy.solve(margin, unknown[0]) if len(unknown) == 1 else []
        if len(solutions) != 1:
            return None
        distances[unknown[0]] = solutions[0]
    for distance, value in distances.items():
        claims.append(_is_above(value, strictly=distance.is_positive))
    return sympy.And(*claims)


def _is_above(margin: sympy.Expr, strictly: bool) -> Boolean:
    """Return the claim that a margin is positive, or zero or more; equal margins give the same one."""
    if strictly:
        return sympy.Not(_is_above(-margin, strictly=False))
    margin = sympy.expand(margin)
    if not margin.could_extract_minus_sign():
        return _proposition(margin, "zero or more")
    # Of a margin and its negative one at least is zero or more: negative, or zero.
    return sympy.Not(_proposition(-margin, "zero or more")) | _proposition(-margin, "zero")


@cache
def _proposition(margin: sympy.Expr, what: str) -> sympy.Dummy:
    return sympy.Dummy(what)
