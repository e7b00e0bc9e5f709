"""What a compensation law is, and the one of a name; each is stated once, in a file of `laws/`."""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import sympy
from sympy.core.relational import Relational
from sympy.logic.boolalg import BooleanTrue

from dzdesign.core.errors import InputError, nearest
from dzdesign.derivation import symbols as s
from dzdesign.derivation.account.scope import under_law
from dzdesign.derivation.account.statement import Kind, Statement
from dzdesign.derivation.laws import LAW_NAMES
from dzdesign.derivation.lowering import lower

_LAW_SYMBOLS = {s.u_i, s.beta, s.k, s.x_max, s.u_max, s.u_min0}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)  # compared and hashed as the one object that it is
class Law:
    """A compensation law ``u_O = gain * u_i + offset`` for positive commands.

    Raises
    ------
    ValueError
        If `output` is not affine in `u_i` and in `beta`, is not beta u_min0 at zero command, which the certificate and
        the firmware's zero band rest on, or names another symbol; if `rises_if` is not the sign of the gain.
    """

    #: What `law` and the command line call it: the name of its file in `laws/`.
    name: str
    #: The equation that states it.
    equation: str
    #: The compensator's output u_O [V] in `u_i`, `beta`, `k`, `x_max`, `u_max` and `u_min0`.
    output: sympy.Expr
    #: What more command gives more drive on; always, unless given.
    rises_if: Relational | BooleanTrue = sympy.true
    #: What the law does and does not achieve.
    note: str
    #: What it is in the account of the paper; our choice, unless given.
    statements: tuple[Statement, ...] = ()
    #: Number of the statement that ends its derivation in a report; the last of `statements`, unless given.
    stated_as: str = ""

    def __post_init__(self) -> None:
        for complaint in self._complaints():
            raise ValueError(f"law {self.name}: {complaint}")
        if not self.statements:
            stated = Kind.CHOICE(self.name, f"the law `{self.name}`").says(s.u_O, self.output)
            stated = stated.within(under_law(self.name), sympy.Eq(s.dP, s.dP1)).remark(self.note)
            object.__setattr__(self, "statements", (stated,))
        object.__setattr__(self, "stated_as", self.stated_as or self.statements[-1].number)

    def _complaints(self) -> Iterator[str]:
        foreign = self.output.free_symbols - _LAW_SYMBOLS
        if foreign:
            yield f"the output may not name {sorted(map(str, foreign))}"
        if self.gain.has(s.u_i) or sympy.diff(self.gain, s.beta, 2) != 0:
            yield f"the output is not affine in u_i and beta: {self.output}"
        if sympy.expand(self.offset - s.beta * s.u_min0) != 0:
            yield f"at zero command the output is {self.offset}, expected beta*u_min0"
        margin = sympy.S.One if self.rises_if == sympy.true else self.rises_if.gts - self.rises_if.lts
        if not sympy.cancel(self.gain / margin).is_positive:
            yield f"the gain {self.gain} is not positive exactly if {self.rises_if}"

    @property
    def gain(self) -> sympy.Expr:
        """Coefficient of u_i in the output, dimensionless."""
        return sympy.diff(self.output, s.u_i)

    @property
    def offset(self) -> sympy.Expr:
        """Output at zero command [V]."""
        return self.output.subs(s.u_i, 0)

    def gain_by_beta(self, power: int) -> sympy.Expr:
        """Return the part of the gain that beta does not touch (0), or what beta multiplies in it (1)."""
        return sympy.expand(self.gain).coeff(s.beta, power)

    def evaluate_gain(self, beta: Any, kappa: Any) -> Any:
        """Return the gain for numbers of any kind: fractions stay exact, arrays and CasADi expressions what they are.

        `beta` is Eq. (5) at the present pressure drop; `kappa` is k x_max / u_max, dimensionless.

        Examples
        --------
        >>> from fractions import Fraction
        >>> law("paper").evaluate_gain(Fraction(9, 10), Fraction(1, 2))
        Fraction(11, 20)
        """
        return lower(self.gain.subs(s.k, s.kappa * s.u_max / s.x_max), (s.beta, s.kappa))(beta, kappa)

    def evaluate_offset(self, beta: Any, u_min0: Any) -> Any:
        """Return the output at zero command for numbers of any kind, in the unit of `u_min0`, V or any unit of command.

        `beta` is Eq. (5) at the present pressure drop; `u_min0` is the dead-zone threshold at the reference one.

        Examples
        --------
        >>> from fractions import Fraction
        >>> law("paper").evaluate_offset(Fraction(9, 10), 5)
        Fraction(9, 2)
        """
        return lower(self.offset, (s.beta, s.u_min0))(beta, u_min0)


def law(name: str) -> Law:
    """Return the law of that name, one of `LAW_NAMES`.

    Examples
    --------
    >>> law("paper").offset
    beta*u_min0
    """
    if name not in LAW_NAMES:
        raise InputError(f"unknown law {name!r}{nearest(name, LAW_NAMES)}: choose one of {', '.join(LAW_NAMES)}")
    found: Law = import_module(f"dzdesign.derivation.laws.{name}").LAW
    if found.name != name:
        raise ValueError(f"laws/{name}.py states the law '{found.name}', expected the file's name")
    return found
