"""The transition: over the first codes of command the drive runs from the closing threshold to the opening one.

Hysteresis parts the two: a single offset at the opening threshold leaks at zero command, one at the closing threshold
leaves a dead zone on opening. With a transition the law is that of the opening threshold, u_O(beta_o), and below the
transition's end u_t it is lowered in proportion to what is missing to it::

    u_O = u_O(beta_o) - (beta_o - beta) u_min0 (1 - u_i/u_t)        for u_i < u_t

so that zero command gives beta u_min0, the certified closing offset, and u_i = u_t the opening law, without a step.
"""

from functools import cache
from typing import Any

import sympy

from dzdesign.derivation.lowering import lower
from dzdesign.derivation.scaling import COMPARE_VALUE, mu
from dzdesign.derivation.symbols import beta, n_full, u_max, u_min0, u_O

beta_o = sympy.Symbol("beta_o", positive=True)  # beta of the opening threshold
share = sympy.Symbol("share", nonnegative=True)  # u_i/u_t
#: What the transition takes from the opening law below its end, V.
LOWERED_BY = (beta_o - beta) * u_min0 * (1 - share)


def evaluate_transition(
    *, beta_opening: Any, beta_closing: Any, u_min0_over_u_max: Any, share_of_transition: Any, n_full: Any
) -> Any:
    """Return by how many counts the transition lowers the opening law, for numbers of any kind.

    The betas are the offsets of the two thresholds over the law's u_min0; `share_of_transition` is u_i/u_t, from 0 to
    1: beyond the transition there is nothing to lower. Full drive is `n_full` counts.

    Examples
    --------
    >>> evaluate_transition(beta_opening=1, beta_closing=0, u_min0_over_u_max=1, share_of_transition=0, n_full=600)
    Fraction(600, 1)
    """
    return _lowered()(beta_opening, beta_closing, u_min0_over_u_max, share_of_transition, n_full)


@cache
def _lowered() -> Any:
    counts = COMPARE_VALUE.subs(u_O, LOWERED_BY).subs(u_min0, mu * u_max)
    return lower(sympy.cancel(counts), (beta_o, beta, mu, share, n_full))
