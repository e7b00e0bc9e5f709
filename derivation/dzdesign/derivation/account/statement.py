"""What a statement is: published or ours, with the grounds, cases and conditions that it is judged by."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, replace
from enum import StrEnum
from typing import Any, NamedTuple

import sympy
from sympy.core.function import AppliedUndef
from sympy.core.relational import Relational

from dzdesign.derivation.account.scope import EVERYWHERE, Scope, Setting, scope
from dzdesign.derivation.symbols import AT_PRESSURE_DROPS, Name, dP, f, headroom, print_unit, rescaled

Replacements = tuple[tuple[Name, sympy.Expr], ...]


class Kind(StrEnum):
    """Origin of a statement; statements of the first four kinds are taken as given."""

    PREMISE = "premise"  # an equation that the paper starts from
    ASSUMPTION = "assumption"  # a reading of a figure, or an approximation that the paper makes
    DEFINITION = "definition"  # the meaning of a new name
    CHOICE = "choice"  # ours, not the paper's
    PAPER = "paper"  # an equation that the paper derives
    LAW = "law"  # ties the law of `law.py` and the scaling of `scaling.py` to the paper's equations
    CORRECTED = "corrected"  # what a published equation should read
    THEOREM = "theorem"  # what the paper does not say

    @property
    def is_given(self) -> bool:
        return self in (Kind.PREMISE, Kind.ASSUMPTION, Kind.DEFINITION, Kind.CHOICE)

    def __call__(self, number: str, title: str) -> "Heading":
        """Begin a statement of this kind: its number in the paper, or a name for what has none, and its title."""
        return Heading(self, number, title)


class Heading(NamedTuple):
    """The beginning of a statement."""

    kind: Kind
    number: str
    title: str

    def says(self, symbol: Name, *members: sympy.Expr) -> "Statement":
        """State ``symbol = member = ... = member``."""
        return Statement(number=self.number, title=self.title, kind=self.kind, symbol=symbol, members=members)


class Outcome(StrEnum):
    """What can be found about a statement."""

    GIVEN = "given"
    FOLLOWS = "follows"
    FOLLOWS_IF = "follows if"
    DOES_NOT_FOLLOW = "does not follow"


@dataclass(frozen=True, slots=True)
class Ground:
    """A statement used as a premise of another one, at certain values of its symbols."""

    #: Number of the statement used.
    number: str
    #: What replaces its symbols, all at once: ``((dP, dP0),)`` takes it at the reference pressure drop. Values whose
    #: signs SymPy knows also decide between the cases of a piecewise statement.
    at: Replacements = ()
    _: KW_ONLY
    #: Which of its right-hand sides is used: the last, unless said otherwise.
    member: int = -1
    #: ``(by, name)``: the statement is first differentiated by the symbol `by`, and the derivative of its left-hand
    #: side is called `name`.
    derivative: tuple[sympy.Symbol, Name] | None = None

    def __str__(self) -> str:
        words = (part if isinstance(part, str) else sympy.sstr(part) for part in self.qualified())
        return " ".join([self.number, *words])

    def qualified(self) -> tuple[str | sympy.Basic, ...]:
        """Say at which values it is used, from the values themselves: words and formulas in a row."""
        parts: list[str | sympy.Basic] = []
        if self.member >= 0:
            parts.append(f"right-hand side {self.member + 1}")
        if self.derivative is not None:
            parts += ["differentiated by", self.derivative[0]]
        if any(value.has(AppliedUndef) and not value.has(f) for _, value in self.at):
            return (*parts, "under the Laplace transform")
        at_drops = [(name, AT_PRESSURE_DROPS[name].index(value)) for name, value in self.at if _is_at_drop(name, value)]
        if len({index for _, index in at_drops}) == 1:
            parts += ["at", sympy.Eq(dP, AT_PRESSURE_DROPS[dP][at_drops[0][1]])]
        else:
            at_drops = []
        for name, value in self.at:
            if name == value or name in dict(at_drops):
                continue
            # A distance of its own only says which case it is.
            limit = sympy.Le(value - headroom, name) if value.has(headroom) else None
            parts += ["for", limit] if limit is not None else ["with", value, "for", name]
        return tuple(parts)


def _is_at_drop(name: Name, value: sympy.Expr) -> bool:
    return value in AT_PRESSURE_DROPS.get(name, ())


class Case(NamedTuple):
    """One of the cases by which a piecewise statement is proved; the referee tries what they may leave out."""

    #: Replacements that make the case, such as ``((dP1, dP0 + above),)`` with a positive `above`.
    at: Replacements
    where: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """What has to hold for a statement to follow; whether it is also necessary is for the proof to find."""

    #: The statement follows if all equations of one of these hold.
    any_of: tuple[tuple[sympy.Eq, ...], ...]
    #: The statement is to hold for every value of these, so each power of them counts by itself.
    for_all: tuple[sympy.Symbol, ...] = ()
    #: To hold for every function, the statement must hold for this one; necessity is proved on it.
    witness: tuple[tuple[sympy.Expr, sympy.Expr], ...] = ()
    #: Published values at which none of the alternatives holds: the statement does not follow then.
    ruled_out_by: Replacements = ()
    #: Derived minus published, as a correct account finds it, of the first case and member in which they differ.
    discrepancy: sympy.Expr = sympy.S.Zero
    #: What the paper calls the condition, in brackets.
    words: str = ""


@dataclass(frozen=True, slots=True)
class Value:
    """A number that a statement gives with published figures put in, beside the number that the paper prints."""

    #: Whose number it is.
    label: str
    #: The published figures.
    at: Replacements
    #: Unit of the result, which `at` must be consistent with; for ``%`` the expression is multiplied by 100.
    unit: str
    _: KW_ONLY
    #: The expression; the statement's last member if none is given.
    of: sympy.Expr | None = None
    #: The paper's number as printed, or empty where it has none.
    published: str = ""
    #: What could explain a difference, or what the number means.
    remark: str = ""

    def exact(self, statement: "Statement") -> sympy.Expr:
        """Return the number exactly, in `unit`."""
        expression = statement.members[-1] if self.of is None else self.of
        number = sympy.simplify(expression.subs(dict(self.at)))
        if not number.is_number:
            raise ValueError(f"{statement.number}, {self.label}: {number} is not a number")
        return 100 * number if self.unit == "%" else number

    def agrees(self, statement: "Statement") -> bool:
        """Return whether the number, rounded to the digits that the paper prints, is the paper's."""
        decimals = len(self.published.partition(".")[2])
        difference = abs(self.exact(statement) - sympy.Rational(self.published))
        return bool(difference <= sympy.Rational(1, 2 * 10**decimals))


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement:
    """``symbol = member = ... = member``, with the grounds from which it is to follow.

    It is declared in one chain: ``Kind.PAPER(number, title).says(...).by(...).within(...)``, and so on.
    """

    number: str
    title: str
    kind: Kind
    symbol: Name
    #: Right-hand sides, as published. A statement that rests on this one uses the last.
    members: tuple[sympy.Expr, ...]
    grounds: tuple[Ground, ...] = ()
    #: Symbols of the grounds that are solved for along with `symbol`; None for those that the grounds are about.
    eliminate: tuple[Name, ...] | None = None
    cases: tuple[Case, ...] = ()
    condition: Condition | None = None
    positive_if: Relational | None = None
    scope: Scope = EVERYWHERE
    #: What must differ for the derivation, which divides by the difference.
    provided: tuple[sympy.Ne, ...] = ()
    #: What a correct account finds; what is usual of its kind and condition, unless given.
    expected: Outcome = None  # type: ignore[assignment]  # by __post_init__
    rearranges: bool = False
    corrected_by: str = ""
    corrected_for: str = ""
    see: tuple[str, ...] = ()
    values: tuple[Value, ...] = ()
    note: str = ""
    #: Heading that it stands under.
    section: str = ""

    def __post_init__(self) -> None:
        if not self.members or any(member.has(self.symbol) for member in self.members):
            raise ValueError(f"{self.number}: needs right-hand sides that are free of {self.symbol}")
        if not self.expected:
            object.__setattr__(self, "expected", Outcome.GIVEN if self.kind.is_given else Outcome.FOLLOWS)

    def by(
        self, *grounds: str | Ground, eliminate: Sequence[Name] | None = None, provided: Sequence[sympy.Ne] = ()
    ) -> "Statement":
        """Derive it from grounds; one that is used as it stands is given by its number."""
        used = tuple(Ground(one) if isinstance(one, str) else one for one in grounds)
        unknowns = None if eliminate is None else tuple(eliminate)
        return replace(self, grounds=used, eliminate=unknowns, provided=tuple(provided))

    def rearranging(self, *grounds: str | Ground, **how: Any) -> "Statement":
        """Derive it from grounds that it only rearranges: it says nothing new."""
        return replace(self.by(*grounds, **how), rearranges=True)

    def within(self, *limits: Scope | Setting | Relational) -> "Statement":
        """Say where it is meant to hold; everywhere unless said."""
        narrowed = self.scope
        for limit in limits:
            narrowed &= limit if isinstance(limit, Scope) else scope(limit)
        return replace(self, scope=narrowed)

    def in_cases(self, *cases: Case) -> "Statement":
        """Prove it in cases."""
        return replace(self, cases=cases)

    def if_(self, *any_of: sympy.Eq | tuple[sympy.Eq, ...], **more: Any) -> "Statement":
        """Say on which condition it follows, an equation or a set of them; `more` is what `Condition` takes."""
        alternatives = tuple(one if isinstance(one, tuple) else (one,) for one in any_of)
        condition = Condition(any_of=alternatives, **more)
        expected = Outcome.DOES_NOT_FOLLOW if condition.ruled_out_by else Outcome.FOLLOWS_IF
        return replace(self, condition=condition, expected=expected)

    def positive_exactly_if(self, claim: Relational) -> "Statement":
        """Claim when the left-hand side is positive."""
        return replace(self, positive_if=claim)

    def on_their_condition(self) -> "Statement":
        """Expect that it follows only on the condition of a ground."""
        return replace(self, expected=Outcome.FOLLOWS_IF)

    def corrected(self, by: str, only_for: str = "") -> "Statement":
        """Name the statement that says what this one should read."""
        return replace(self, corrected_by=by, corrected_for=only_for)

    def qualified_by(self, *numbers: str) -> "Statement":
        """Name the statements that qualify this one."""
        return replace(self, see=numbers)

    def numbers(self, *values: Value) -> "Statement":
        """Put its numbers beside the paper's."""
        return replace(self, values=values)

    def remark(self, note: str) -> "Statement":
        """Say what a reader should know beyond the verdict."""
        return replace(self, note=note)

    def unit_error(self) -> str:
        """Say what is wrong with its units: nothing if it is one equation in other units too."""
        try:
            for member in self.members:
                for relation in member.atoms(Relational):
                    if not _are_in_one_unit(relation.lhs, relation.rhs):
                        return f"{sympy.sstr(relation)} compares two units"
                for branch in [value for value, _ in member.args] if isinstance(member, sympy.Piecewise) else [member]:
                    if branch != 0 and not _are_in_one_unit(branch, self.symbol):  # zero is of every unit
                        return f"the right-hand side is not in {print_unit(self.symbol)}"
        except KeyError as error:
            return f"the unit of {error.args[0]} is not known"
        return ""

    @property
    def published(self) -> sympy.Eq:
        """The statement in its last form, the one that other statements use."""
        return sympy.Eq(self.symbol, self.members[-1], evaluate=False)


def _are_in_one_unit(left: sympy.Expr, right: sympy.Expr) -> bool:
    """Whether two sides grow by one factor if every symbol is counted in other units; zero grows by any."""
    names = {name for side in (left, right) for name in side.atoms(AppliedUndef)}
    names |= {name for side in (left, right) for name in side.xreplace(dict.fromkeys(names, sympy.S.One)).free_symbols}
    values = {name: sympy.sqrt(2 + n) for n, name in enumerate(sorted(names, key=str))}
    grown = {name: value * rescaled(name) for name, value in values.items()}
    ratios = [sympy.N(side.xreplace(grown)) / sympy.N(side.xreplace(values)) for side in (left, right) if side != 0]
    return len(ratios) < 2 or bool(abs(ratios[0] / ratios[1] - 1) < 1e-9)
