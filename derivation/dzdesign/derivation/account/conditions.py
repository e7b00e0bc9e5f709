"""What a discrepancy says: on which condition it vanishes, and whether it vanishes on no other.

A condition suffices if putting it in makes every discrepancy zero. It is necessary if each discrepancy, for every value
of the symbols that the statement is meant for, is zero only there: either the equations have no other solution, or the
discrepancy is a product in which each factor is one of the condition's, or cannot be zero by the signs of its symbols.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy

from dzdesign.derivation.account.solving import agree
from dzdesign.derivation.account.statement import Condition, Outcome


@dataclass(frozen=True, slots=True)
class Finding:
    """Outcome of a judgement, in words, and whether something about it is not as the statement claims."""

    outcome: Outcome
    words: str
    flawed: bool = False
    necessary: bool | None = None


def judge_condition(condition: Condition, differences: Sequence[sympy.Expr]) -> Finding:
    """Judge a statement by its condition; `differences` are what was derived minus what is published."""
    words = " or ".join(
        " and ".join(f"{sympy.sstr(equation.lhs)} = {sympy.sstr(equation.rhs)}" for equation in alternative)
        for alternative in condition.any_of
    ) + (f" {condition.words}" if condition.words else "")
    if not differences:
        return Finding(Outcome.FOLLOWS, f"follows, also without {words}", flawed=True)
    for solved in map(_solved, condition.any_of):
        if solved is None or not all(agree(value.subs(solved), sympy.S.Zero) for value in differences):
            return Finding(Outcome.DOES_NOT_FOLLOW, f"does not follow, not even if {words}", flawed=True)
    if not agree(differences[0], condition.discrepancy):
        return Finding(Outcome.DOES_NOT_FOLLOW, "does not follow, and the difference is another one", flawed=True)
    necessary = _is_necessary(condition, differences)
    if condition.ruled_out_by and not any(_is_published(condition, one) for one in condition.any_of):
        put_in = ", ".join(f"{symbol} = {sympy.sstr(value)}" for symbol, value in condition.ruled_out_by)
        words = f"does not follow ({put_in}): it would {'only if' if necessary else 'if'} {words}"
        return Finding(Outcome.DOES_NOT_FOLLOW, words, not necessary, necessary)
    proved = "necessary" if necessary else "sufficient; not proved necessary"
    return Finding(Outcome.FOLLOWS_IF, f"follows if {words} ({proved})", not necessary, necessary)


def _is_published(condition: Condition, alternative: Sequence[sympy.Eq]) -> bool:
    """Whether an alternative holds at the published values that may rule it out."""
    published = dict(condition.ruled_out_by)
    return all(sympy.simplify((equation.lhs - equation.rhs).subs(published)) == 0 for equation in alternative)


def _solved(alternative: Sequence[sympy.Eq]) -> dict[sympy.Symbol, sympy.Expr] | None:
    """Return replacements that make the equations true: each equation solved for its left-most symbol that can be."""
    names = [next(iter(sorted(equation.lhs.free_symbols, key=str)), None) for equation in alternative]
    if None in names:
        return None
    solutions = sympy.solve([equation.lhs - equation.rhs for equation in alternative], names, dict=True)
    return solutions[0] if len(solutions) == 1 and set(solutions[0]) == set(names) else None


def _is_necessary(condition: Condition, differences: Sequence[sympy.Expr]) -> bool:
    # All of these must vanish for the statement to hold.
    must_vanish = [
        coefficient
        for value in differences
        for coefficient in _coefficients(value.xreplace(dict(condition.witness)).doit(), condition.for_all)
    ]
    if len(condition.any_of) > 1:
        roots = [equation for alternative in condition.any_of for equation in alternative]
        single = all(len(alternative) == 1 for alternative in condition.any_of)
        return single and any(_vanishes_only_with(value, roots) for value in must_vanish)
    # All equations of the one alternative: each is forced in turn, given those that were forced before.
    open_equations = list(condition.any_of[0])
    while open_equations:
        nonzero = [value for value in must_vanish if value != 0]
        forced = [one for one in open_equations if any(_vanishes_only_with(value, [one]) for value in nonzero)]
        if not forced:
            return False
        open_equations.remove(forced[0])
        must_vanish = [sympy.factor(value.subs(_solved(forced[:1]))) for value in must_vanish]
    return True


def _coefficients(value: sympy.Expr, for_all: Sequence[sympy.Symbol]) -> list[sympy.Expr]:
    numerator = sympy.numer(sympy.together(value))
    names = [name for name in for_all if numerator.has(name)]
    return sympy.Poly(numerator, *names).coeffs() if names else [numerator]


def _vanishes_only_with(value: sympy.Expr, roots: Sequence[sympy.Eq]) -> bool:
    """Whether a product is zero only if one of the equations holds."""
    factors = [factor.as_base_exp()[0] for factor in sympy.Mul.make_args(sympy.factor(value))]
    return all(factor.is_nonzero or any(_is_root(factor, root) for root in roots) for factor in factors)


def _is_root(factor: sympy.Expr, root: sympy.Eq) -> bool:
    margin = root.lhs - root.rhs
    if sympy.cancel(factor / margin).is_nonzero:
        return True
    # A transcendental equation in one unknown, with no other symbol that might make it vanish.
    if factor.free_symbols != {root.lhs} or not root.rhs.is_number:
        return False
    solutions = sympy.solveset(factor, root.lhs, sympy.Reals)
    return isinstance(solutions, sympy.FiniteSet) and all(agree(value, root.rhs) for value in solutions)
