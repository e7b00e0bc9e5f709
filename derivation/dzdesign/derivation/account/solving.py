"""Whether two expressions are one function; the grounds of a statement, solved for its symbol step by step; and what a
discrepancy says.

The steps are the derivation that a reader gets. Nothing is divided by what may be zero: a coefficient must be different
from zero by the signs of its symbols, or by what the statement is provided with.
"""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import sympy

from dzdesign.derivation.account.statement import Condition, Ground, Outcome
from dzdesign.derivation.symbols import Name


def agree(left: sympy.Expr, right: sympy.Expr) -> bool:
    """Decide whether two expressions are identical.

    Exact for rational functions of symbols, of roots of single symbols, and of logarithms and applied functions,
    which count as symbols of their own; logarithms of products are expanded first.

    Examples
    --------
    >>> from dzdesign.derivation.symbols import dP, rho
    >>> agree(sympy.sqrt(2 * dP / rho), sympy.sqrt(2) * sympy.sqrt(dP) / sympy.sqrt(rho))
    True
    """
    if left == right:
        return True
    if left.has(sympy.Piecewise, sympy.nan) or right.has(sympy.Piecewise, sympy.nan):
        return False
    difference = left - right
    if difference.has(sympy.log):
        difference = sympy.expand_log(difference)
    # A root and its symbol are two generators to `cancel`; writing each symbol as a square makes them one.
    bases = {power.base for power in difference.atoms(sympy.Pow) if power.exp.is_Rational and not power.exp.is_Integer}
    squares = {base: sympy.Dummy(positive=True) ** 2 for base in bases if base.is_Symbol and base.is_nonnegative}
    return bool(sympy.cancel(difference.xreplace(squares)) == 0)


class NotDerivedError(Exception):
    """The grounds do not give the symbol; the reason in words."""


_CONTRADICTION = "the premises contradict each other"

Sides = tuple[sympy.Expr, sympy.Expr]


@dataclass(frozen=True, slots=True, kw_only=True)
class Relation:
    """A ground at the values at which it is used: ``left = right``."""

    ground: Ground
    left: sympy.Expr
    right: sympy.Expr


@dataclass(frozen=True, slots=True)
class Step:
    """A ground, the unknown that it was solved for, and the value, in what earlier steps left unknown."""

    ground: Ground
    name: Name
    gives: sympy.Expr
    #: Whether the ground states the unknown as it stands.
    as_stated: bool


@lru_cache(maxsize=4096)
def solve_relations(
    relations: tuple[Relation, ...], unknowns: tuple[Name, ...], nonzero: tuple[sympy.Expr, ...]
) -> tuple[Mapping[Name, sympy.Expr], tuple[Step, ...]]:
    """Solve the grounds of one case for unknowns: their values in the symbols that remain, and how they were found.

    What is `nonzero` may be divided by although its symbols' signs do not tell so.

    Raises
    ------
    NotDerivedError
        If that can't be done.
    """
    # A piecewise expression none of whose cases holds is nan to SymPy.
    if any(relation.right.has(sympy.Piecewise, sympy.nan) for relation in relations):
        raise NotDerivedError("the case of a piecewise premise is not decided")
    solved: dict[Name, sympy.Expr] = {}
    sides = [(relation.left, relation.right) for relation in relations]
    left_over, steps = list(relations), []
    while sides:
        index, name = _choose(sides, [name for name in unknowns if name not in solved], nonzero)
        (left, right), relation = sides.pop(index), left_over.pop(index)
        if name is None:  # no unknown is left in it: it must be true by itself
            if not agree(left, right):
                raise NotDerivedError(_CONTRADICTION)
            continue
        value = solved[name] = _solve_for(name, left, right, nonzero)
        _check_sign(name, value)
        if name.is_nonzero:  # then what it equals is not zero either
            nonzero = (*nonzero, sympy.numer(sympy.factor(value)))
        steps.append(Step(relation.ground, name, value, as_stated=relation.left == name))
        sides = [tuple(side.xreplace({name: value}) for side in pair) for pair in sides]
    return _put_back(solved, unknowns), tuple(steps)


def _choose(sides: Sequence[Sides], names: Sequence[Name], nonzero: Sequence[sympy.Expr]) -> tuple[int, Name | None]:
    """Return the next relation and what to solve it for, None if no unknown is left in it.

    One that gives an unknown as it stands comes first, then one with a single unknown, then one that can be solved.
    """
    for index, (left, right) in enumerate(sides):
        if left in names and not right.has(left):
            return index, left
    inside = [[name for name in names if left.has(name) or right.has(name)] for left, right in sides]
    for index, found in enumerate(inside):
        if len(found) < 2:
            return index, found[0] if found else None
    for index, (left, right) in enumerate(sides):
        for name in inside[index]:
            with contextlib.suppress(NotDerivedError):
                _solve_for(name, left, right, nonzero)
                return index, name
    return 0, inside[0][0]


def _solve_for(name: Name, left: sympy.Expr, right: sympy.Expr, nonzero: Sequence[sympy.Expr]) -> sympy.Expr:
    """Return the only value at which two sides are equal."""
    if left == name and not right.has(name):
        return right
    difference = sympy.factor(left - right)
    coefficient = sympy.factor(sympy.diff(difference, name))
    if not coefficient.has(name):
        found = [sympy.factor(-difference.xreplace({name: sympy.S.Zero}) / coefficient)] if coefficient != 0 else []
        divisors = [coefficient]
    else:
        found = sympy.solve(difference, name)
        # What SymPy's solver divides by without a word: the factors without the unknown, and its result's denominator.
        divisors = [factor for factor in sympy.Mul.make_args(difference) if not factor.has(name)]
        divisors += [sympy.denom(sympy.together(value)) for value in found]
    if len(found) != 1:
        raise NotDerivedError("the premises allow several values" if found else _CONTRADICTION)
    for zero in (factor for divisor in divisors for factor in _possible_zeros(divisor, nonzero)):
        raise NotDerivedError(f"{sympy.sstr(zero)}, by which the derivation divides, may be zero")
    return _turned(found[0])


def _turned(value: sympy.Expr) -> sympy.Expr:
    """Return -(a - b) c as (b - a) c: which of them SymPy gives may change from run to run."""
    sums = [factor for factor in sympy.Mul.make_args(value) if factor.is_Add]
    differences = [one for one in sums if any(term.could_extract_minus_sign() for term in one.args)]
    if len(sums) == len(differences) == 1 and value.as_coeff_Mul()[0].is_negative:
        return -value.xreplace({sums[0]: -sums[0]})
    return value


def _possible_zeros(divisor: sympy.Expr, nonzero: Sequence[sympy.Expr]) -> Iterator[sympy.Expr]:
    """Yield the factors that may be zero."""
    for factor in sympy.Mul.make_args(sympy.factor(divisor)):
        base, exponent = factor.as_base_exp()
        base = sympy.logcombine(base)
        if isinstance(base, sympy.log):  # zero exactly where its argument is one
            base = sympy.numer(sympy.together(base.args[0] - 1))
        if not (base.is_nonzero or exponent.is_negative or any(_divides(base, known) for known in nonzero)):
            yield base


def _divides(factor: sympy.Expr, product: sympy.Expr) -> bool:
    """Whether a product that is not zero has a factor, which then is not zero either."""
    others = sympy.Mul.make_args(sympy.factor(product))
    return any(sympy.cancel(factor / other.as_base_exp()[0]).is_nonzero for other in others)


def _put_back(solved: dict[Name, sympy.Expr], unknowns: tuple[Name, ...]) -> dict[Name, sympy.Expr]:
    """Put later solutions into earlier ones, so that no unknown is left in any."""
    solution: dict[Name, sympy.Expr] = {}
    for name, value in reversed(solved.items()):
        solution[name] = value.xreplace(solution)
    undetermined = [str(unknown) for unknown in unknowns if unknown not in solution or solution[unknown].has(*unknowns)]
    if undetermined:
        raise NotDerivedError(f"the premises do not determine {', '.join(undetermined)}")
    for name, value in solution.items():
        _check_sign(name, value)
    return solution


def _check_sign(name: Name, value: sympy.Expr) -> None:
    """Refuse a value that its symbol can't have."""
    if (name.is_nonnegative and value.is_negative) or (name.is_positive and value.is_nonpositive):
        raise NotDerivedError(_CONTRADICTION)


# --- on which condition a discrepancy vanishes, and whether it vanishes on no other ----------------------------------
#
# A condition suffices if putting it in makes every discrepancy zero. It is necessary if each discrepancy, for every
# value of the symbols that the statement is meant for, is zero only there: either the equations have no other solution,
# or the discrepancy is a product in which each factor is one of the condition's, or cannot be zero by the signs of its
# symbols.


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
