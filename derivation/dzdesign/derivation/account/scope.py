"""Where a statement is meant to hold: what is set up, and comparisons of its symbols; no free text."""

from dataclasses import dataclass
from functools import reduce
from typing import NamedTuple

import sympy
from sympy.core.relational import Relational

from dzdesign.derivation.symbols import dP, dP0, dP1, k, u_i, u_max, u_min, u_min0, u_min1, u_O, x_max


class Setting(NamedTuple):
    """One of the ways in which something can be set up; of one aspect just one of them is at a time."""

    aspect: str
    #: As a report says it, behind "proved for".
    words: str

    def __str__(self) -> str:
        return self.words.replace("$", "")


BARE = Setting("drive", "the valve without compensator")
FREE_BETA = Setting("drive", "the paper's law with any $beta$")
#: The simulation model, Eqs. (19)-(24), which has no overlap.
PLANT = Setting("drive", "the simulation model")
#: What the firmware runs unless it is told otherwise (`scaling.py`).
WITH_TRANSITION = Setting("drive", "the law `paper` with zero band and transition")
FIXED_OPENING = Setting("spool", "a stop that fixes $x_max$ at every pressure drop (Assumption 3)")
FREE_OPENING = Setting("spool", "a spool that does not meet its stop")
CODES_AT_PIN = Setting("codes", "codes at $n_V$ counts per volt")
CODES_OF_COMMAND = Setting("codes", "codes in the counts of the command")


def under_law(name: str) -> Setting:
    """Return the setting in which a law drives the valve, with commands from zero to full: a law is for one side."""
    return Setting("drive", f"the law `{name}`")


@dataclass(frozen=True, slots=True)
class Scope:
    """Where a statement is meant to hold: in one of the settings of each aspect named, and where all comparisons do."""

    settings: tuple[Setting, ...] = ()
    comparisons: tuple[Relational, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.settings or self.comparisons)

    def __str__(self) -> str:
        return "; ".join([*(str(setting) for setting in self.settings), *map(sympy.sstr, self.comparisons)])

    def __and__(self, other: "Scope") -> "Scope":
        comparisons = sorted({*self.comparisons, *other.comparisons}, key=sympy.default_sort_key)
        return Scope(tuple(dict.fromkeys((*self.settings, *other.settings))), tuple(comparisons))

    def admits(self, settings: frozenset[Setting]) -> bool:
        """Whether what is set up is one of the settings named, of each aspect; one with a beta of its own if named."""
        if settings & {FREE_BETA, WITH_TRANSITION} - set(self.settings):
            return False
        return {one.aspect for one in self.settings} == {one.aspect for one in self.settings if one in settings}


EVERYWHERE = Scope()


def scope(*limits: Setting | Relational) -> Scope:
    """Return a scope from settings and comparisons in any order.

    Examples
    --------
    >>> from dzdesign.derivation.symbols import dP, dP0
    >>> str(scope(BARE, sympy.Eq(dP, dP0)))
    'the valve without compensator; Eq(dP, dP0)'
    """
    # Of comparisons joined by "or" one could be true at general values, the other of those that matter.
    if any(not isinstance(limit, Setting | Relational) for limit in limits):
        raise ValueError(f"a scope is made of settings and single comparisons, got {limits}")
    parts = [Scope((limit,)) if isinstance(limit, Setting) else Scope((), (limit,)) for limit in limits]
    return reduce(Scope.__and__, parts, EVERYWHERE)


_BEFORE_STOP = u_O <= u_min + k * x_max
AT_FULL_COMMAND = scope(sympy.Eq(u_i, u_max))
AT_ZERO_COMMAND = scope(sympy.Eq(u_i, 0))
LAW_AT_REFERENCE = scope(under_law("paper"), sympy.Eq(dP, dP0))
UP_TO_REFERENCE = scope(under_law("paper"), dP <= dP0)
LAW_OFF_REFERENCE = scope(under_law("paper"), sympy.Eq(dP, dP1), dP0 < dP1)
TARGET_OFF_REFERENCE = scope(under_law("target"), sympy.Eq(dP, dP1))
#: Up to where the edge is shut on the other side.
_POSITIVE = -u_min < u_O
BEYOND_THRESHOLD = scope(u_min <= u_O, _BEFORE_STOP)
BEFORE_STOP = scope(_BEFORE_STOP)
EDGE = scope(_POSITIVE, _BEFORE_STOP)
FULL_STROKE = scope(FIXED_OPENING, _POSITIVE)
CONSTANT_THRESHOLD = scope(sympy.Eq(u_min0, u_min1))
