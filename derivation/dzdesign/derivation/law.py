"""The compensation law, stated once. Design, code generation and verification take it from here."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import sympy

from dzdesign.core.errors import InputError, nearest
from dzdesign.derivation.lowering import lower
from dzdesign.derivation.symbols import beta, k, kappa, u_i, u_max, u_min0, x_max

_LAW_SYMBOLS = {u_i, beta, k, x_max, u_max, u_min0}


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """A compensation law ``u_O = gain * u_i + offset`` for positive commands.

    Parameters
    ----------
    name : str
        What `law` and the command line call it.
    equation : str
        The equation that states it.
    output : sympy.Expr
        The compensator's output u_O [V] in `u_i`, `beta`, `k`, `x_max`, `u_max` and `u_min0`.
    note : str
        What the law does and does not achieve.

    Raises
    ------
    ValueError
        If `output` is not affine in `u_i`, or names another symbol.
    """

    name: str
    equation: str
    output: sympy.Expr
    note: str

    def __post_init__(self) -> None:
        foreign = self.output.free_symbols - _LAW_SYMBOLS
        if foreign:
            raise ValueError(f"law {self.name}: the output may not name {sorted(map(str, foreign))}")
        if self.gain.has(u_i):
            raise ValueError(f"law {self.name}: the output is not affine in u_i: {self.output}")

    @property
    def gain(self) -> sympy.Expr:
        """Coefficient of u_i in the output, dimensionless."""
        return sympy.diff(self.output, u_i)

    @property
    def offset(self) -> sympy.Expr:
        """Output at zero command [V]."""
        return self.output.subs(u_i, 0)

    def evaluate_gain(self, beta: Any, kappa: Any) -> Any:
        """Return the gain for numbers of any kind.

        Parameters
        ----------
        beta : number or array
            Correction coefficient at the present pressure drop, Eq. (5).
        kappa : number or array
            k x_max / u_max, dimensionless.

        Returns
        -------
        number or array
            Of the kind that came in: fractions stay exact, arrays and CasADi expressions stay what they are.

        Examples
        --------
        >>> from fractions import Fraction
        >>> law("paper").evaluate_gain(Fraction(9, 10), Fraction(1, 2))
        Fraction(11, 20)
        """
        return _compiled_gain(self)(beta, kappa)

    def evaluate_offset(self, beta: Any, u_min0: Any) -> Any:
        """Return the output at zero command for numbers of any kind.

        Parameters
        ----------
        beta : number or array
            Correction coefficient at the present pressure drop, Eq. (5).
        u_min0 : number or array
            Dead-zone threshold at the reference pressure drop, in V or in any unit of command.

        Returns
        -------
        number or array
            In the unit of `u_min0` and of the kind that came in.

        Examples
        --------
        >>> from fractions import Fraction
        >>> law("paper").evaluate_offset(Fraction(9, 10), 5)
        Fraction(9, 2)
        """
        return _compiled_offset(self)(beta, u_min0)


@cache
def _compiled_gain(law: Law) -> Callable[..., Any]:
    return lower(law.gain.subs(k, kappa * u_max / x_max), (beta, kappa))


@cache
def _compiled_offset(law: Law) -> Callable[..., Any]:
    return lower(law.offset, (beta, u_min0))


_LAWS = (
    Law(
        name="paper",
        equation="(18)",
        output=(beta * (k * x_max / u_max - 1) + 1) * u_i + beta * u_min0,
        note="Eq. (18); Eq. (14) is its case beta = 1, which the selector (7) holds for dP <= dP0. "
        "Off the reference its flow is not the target (16), unless beta = 1 or k x_max = u_max: "
        "it exceeds the target by gamma_1 (1 - beta) (1 - k x_max/u_max) u_i / k.",
    ),
    Law(
        name="target",
        equation="from (16)",
        output=k * x_max / u_max * u_i + beta * u_min0,
        note="Gain of Eq. (14), offset of Eq. (18): its flow is the target (16) exactly wherever "
        "beta u_min0 is the threshold. For beta < 1 and k x_max < u_max it gives less flow at full command "
        "than Eq. (18), as long as the spool can open further than x_max.",
    ),
)

LAW_NAMES = tuple(law.name for law in _LAWS)


def law(name: str) -> Law:
    """Return the law of that name.

    Parameters
    ----------
    name : str
        One of `LAW_NAMES`.

    Returns
    -------
    Law

    Raises
    ------
    InputError
        If there is no law of that name; the message gives the nearest one.

    Examples
    --------
    >>> law("paper").offset
    beta*u_min0
    """
    for candidate in _LAWS:
        if candidate.name == name:
            return candidate
    raise InputError(f"unknown law {name!r}{nearest(name, LAW_NAMES)}: choose one of {', '.join(LAW_NAMES)}")
