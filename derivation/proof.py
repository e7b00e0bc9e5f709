"""Proves statements from the premises that they name, and from nothing else.

A statement is ``symbol = member = ... = member``. A premise has no grounds and is taken as given; anything
else follows if its grounds, solved for the symbol, give each of its members exactly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import sympy

from dzdesign.core.errors import RequirementError


class Kind(StrEnum):
    """Where a statement comes from; the first four are taken as given."""

    PREMISE = "premise"  # an equation that the paper starts from
    ASSUMPTION = "assumption"  # a reading of a figure, or an approximation that the paper makes
    DEFINITION = "definition"  # the meaning of a new name
    CHOICE = "choice"  # ours, not the paper's
    PAPER = "paper"  # an equation that the paper derives
    LAW = "law"  # ties the law of `law.py` to the paper's equations
    BEYOND = "beyond the paper"  # what the paper does not say

    @property
    def is_given(self) -> bool:
        return self in (Kind.PREMISE, Kind.ASSUMPTION, Kind.DEFINITION, Kind.CHOICE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """A statement used as a premise of another one, at certain values of its symbols.

    Parameters
    ----------
    number : str
        Number of the statement used.
    at : tuple of (sympy.Symbol, sympy.Expr)
        What replaces its symbols: ``((dP, dP0),)`` takes it at the reference pressure drop. Values whose
        signs SymPy knows also decide between the cases of a piecewise statement.
    where : str
        The same in words.
    """

    number: str
    at: tuple[tuple[sympy.Symbol, sympy.Expr], ...] = ()
    where: str = ""

    def __str__(self) -> str:
        return f"{self.number} {self.where}" if self.where else self.number


@dataclass(frozen=True, slots=True, kw_only=True)
class Equation:
    """A statement as published, with the grounds from which it is to follow.

    Parameters
    ----------
    number : str
        The paper's number, or a name for what has none.
    title : str
        What it says, in words.
    kind : Kind
        Where it comes from.
    symbol : sympy.Symbol
        Left-hand side.
    members : tuple of sympy.Expr
        Right-hand sides ``symbol = member = ... = member``, as published. A statement that rests on this
        one uses the last.
    grounds : tuple of Ground
        The premises; empty for what is taken as given.
    eliminate : tuple of sympy.Symbol
        Symbols of the grounds that are solved for along with `symbol`.
    note : str
        What a reader should know beyond the verdict.

    Raises
    ------
    ValueError
        If the statement defines its symbol by itself, or has grounds that do not fit its kind.
    """

    number: str
    title: str
    kind: Kind
    symbol: sympy.Symbol
    members: tuple[sympy.Expr, ...]
    grounds: tuple[Ground, ...] = ()
    eliminate: tuple[sympy.Symbol, ...] = ()
    note: str = ""

    def __post_init__(self) -> None:
        if not self.members or any(member.has(self.symbol) for member in self.members):
            raise ValueError(f"{self.number}: needs right-hand sides that are free of {self.symbol}")
        if self.kind.is_given == bool(self.grounds):
            wanted = "has no" if self.kind.is_given else "needs"
            raise ValueError(f"{self.number}: a statement of kind {self.kind} {wanted} grounds")

    @property
    def published(self) -> sympy.Eq:
        """The equation in its last published form, the one that other statements use."""
        return sympy.Eq(self.symbol, self.members[-1], evaluate=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What the engine found about one statement.

    Parameters
    ----------
    number, title, kind, symbol, members, grounds, note
        As in `Equation`.
    holds : bool
        Whether it may be relied on; true for what is taken as given.
    verdict : str
        ``follows``, ``does not follow``, ``rests on ...``, or the kind of what is taken as given.
    derived : sympy.Expr or None
        What the grounds give for `symbol`.
    discrepancy : sympy.Expr or None
        Derived minus published, exactly, where they differ.
    """

    number: str
    title: str
    kind: Kind
    symbol: sympy.Symbol
    members: tuple[sympy.Expr, ...]
    grounds: tuple[Ground, ...]
    note: str
    holds: bool
    verdict: str
    derived: sympy.Expr | None = None
    discrepancy: sympy.Expr | None = None

    @property
    def statement(self) -> str:
        """The statement as plain text."""
        return " = ".join(sympy.sstr(side) for side in (self.symbol, *self.members))

    @property
    def premises(self) -> tuple[str, ...]:
        """The grounds in words."""
        return tuple(str(ground) for ground in self.grounds)


def prove(equations: Sequence[Equation]) -> tuple[Verdict, ...]:
    """Judge each statement from its grounds.

    Parameters
    ----------
    equations : sequence of Equation
        Premises and statements; each stands after its grounds.

    Returns
    -------
    tuple of Verdict
        One per statement, in order. A statement holds only if everything it rests on holds.

    Raises
    ------
    RequirementError
        If a number appears twice, or a statement rests on itself, on a later one, on an unknown one, or on a
        copy of itself. As each statement rests on earlier ones only, no chain of premises can be circular.
    """
    earlier: dict[str, Equation] = {}
    verdicts: dict[str, Verdict] = {}
    order = [equation.number for equation in equations]
    for equation in equations:
        if equation.number in earlier:
            raise RequirementError(f"{equation.number} is stated twice")
        _check_grounds(equation, earlier, order)
        verdicts[equation.number] = _judge(equation, earlier, verdicts)
        earlier[equation.number] = equation
    return tuple(verdicts.values())


def _check_grounds(equation: Equation, earlier: Mapping[str, Equation], order: Sequence[str]) -> None:
    for ground in equation.grounds:
        if ground.number == equation.number:
            raise RequirementError(f"{equation.number} is its own premise")
        if ground.number in order and ground.number not in earlier:
            raise RequirementError(
                f"{equation.number} rests on {ground.number}, which stands after it: that may be circular"
            )
        if ground.number not in earlier:
            raise RequirementError(f"{equation.number} rests on {ground.number}, which is not stated")
        # A tie between `law.py` and the paper compares two transcriptions, so there a copy is the point.
        # A special case of an earlier statement is a result; the statement itself is not.
        premise = earlier[ground.number]
        is_copy = premise.symbol == equation.symbol and _agree(premise.members[-1], equation.members[-1])
        if is_copy and equation.kind is not Kind.LAW:
            raise RequirementError(f"{equation.number} rests on a copy of itself, {ground.number}")


def _judge(equation: Equation, earlier: Mapping[str, Equation], verdicts: Mapping[str, Verdict]) -> Verdict:
    def verdict(text: str, holds: bool = False, **found: sympy.Expr) -> Verdict:
        return Verdict(
            number=equation.number,
            title=equation.title,
            kind=equation.kind,
            symbol=equation.symbol,
            members=equation.members,
            grounds=equation.grounds,
            note=equation.note,
            holds=holds,
            verdict=text,
            **found,
        )

    if equation.kind.is_given:
        return verdict(equation.kind.value, holds=True)
    relations = [_relation(earlier[ground.number], ground) for ground in equation.grounds]
    solution = _solve(relations, (equation.symbol, *equation.eliminate))
    if isinstance(solution, str):
        return verdict(f"does not follow: {solution}")
    derived = solution[equation.symbol]
    for member in equation.members:
        published = member.xreplace(solution)
        if not _agree(derived, published):
            return verdict("does not follow", derived=derived, discrepancy=sympy.factor(derived - published))
    unsound = [ground.number for ground in equation.grounds if not verdicts[ground.number].holds]
    if unsound:
        return verdict(f"rests on {', '.join(unsound)}, which does not follow", derived=derived)
    return verdict("follows", holds=True, derived=derived)


def _relation(equation: Equation, ground: Ground) -> tuple[sympy.Expr, sympy.Expr]:
    # xreplace replaces all symbols at once, so that u_i -> -u_i does not eat its own result.
    replacements = dict(ground.at)
    return equation.symbol.xreplace(replacements), equation.members[-1].xreplace(replacements)


def _solve(
    relations: Sequence[tuple[sympy.Expr, sympy.Expr]], unknowns: tuple[sympy.Symbol, ...]
) -> dict[sympy.Symbol, sympy.Expr] | str:
    """Return each unknown in the symbols that remain, or the reason why there is no such thing."""
    # A piecewise expression none of whose cases holds is nan to SymPy.
    if any(value.has(sympy.Piecewise, sympy.nan) for _, value in relations):
        return "the case of a piecewise premise is not decided"
    solutions = sympy.solve([symbol - value for symbol, value in relations], unknowns, dict=True)
    if len(solutions) != 1:
        return "the premises contradict each other" if not solutions else "the premises allow several values"
    solution = {unknown: sympy.factor(value) for unknown, value in solutions[0].items()}
    undetermined = [
        str(unknown)
        for unknown in unknowns
        if unknown not in solution or solution[unknown].free_symbols & set(unknowns)
    ]
    if undetermined:
        return f"the premises do not determine {', '.join(undetermined)}"
    return solution


def _agree(left: sympy.Expr, right: sympy.Expr) -> bool:
    """Whether two rational functions of symbols, and of roots of single symbols, are identical."""
    if left.has(sympy.Piecewise) or right.has(sympy.Piecewise):
        return left == right
    # A root and its symbol are two generators to `cancel`; writing each symbol as a square makes them one.
    squares = {symbol: sympy.Dummy(symbol.name, positive=True) ** 2 for symbol in _under_root(left - right)}
    return sympy.cancel((left - right).xreplace(squares)) == 0


def _under_root(expression: sympy.Expr) -> set[sympy.Symbol]:
    roots = (power for power in expression.atoms(sympy.Pow) if not power.exp.is_Integer)
    return {root.base for root in roots if root.base.is_Symbol}
