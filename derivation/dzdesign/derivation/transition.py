"""The zero band and the transition: from the closing threshold, held about zero command, to the opening one.

Hysteresis parts the two thresholds: a single offset at the opening threshold leaks at zero command, one at the closing
threshold leaves a dead zone on opening. So commands up to u_z, the zero band, count as zero; and from u_z to u_t, the
transition, the drive runs straight from the certified closing offset to the law of the opening threshold::

    share = (u_i - u_z)/(u_t - u_z), held between 0 and 1
    u_O = u_O(beta_o; u) - (beta_o - beta) u_min0 (1 - share),  u = share u_t for u_i < u_t, u_i beyond

u_O(beta_o; u) being the law of the opening threshold. In the zero band that is beta u_min0, the certified offset, at
u_t the opening law, and beyond it the law as if there were no band: full command stays full command.
"""

from functools import cache
from typing import Any

import sympy

from dzdesign.derivation.lowering import lower
from dzdesign.derivation.scaling import COMPARE_VALUE, mu
from dzdesign.derivation.symbols import beta, beta_o, n_full, share, u_i, u_max, u_min0, u_O, u_t, u_z

#: What the transition takes from the opening law, V.
LOWERED_BY = (beta_o - beta) * u_min0 * (1 - share)
#: Share of the transition that a command within it has passed.
SHARE = (u_i - u_z) / (u_t - u_z)
#: The command that the opening law is given within the transition.
LAW_COMMAND = share * u_t


def evaluate_share(command: Any, *, zero_band: Any, end: Any) -> Any:
    """Return the share of the transition that a command has passed, 0 to 1, for numbers of one unit.

    `zero_band` is where the transition begins, `end` where it ends.

    Examples
    --------
    >>> evaluate_share(21, zero_band=19, end=51)
    Fraction(1, 16)
    """
    return min(max(_lowered_share()(command, zero_band, end), 0), 1)


def evaluate_law_command(command: Any, *, zero_band: Any, end: Any) -> Any:
    """Return the command that the opening law is given: 0 in the zero band, the command itself beyond the transition.

    Examples
    --------
    >>> evaluate_law_command(21, zero_band=19, end=51)
    Fraction(51, 16)
    """
    passed = evaluate_share(command, zero_band=zero_band, end=end)
    return command if passed == 1 else _lowered_command()(passed, end)


def evaluate_transition(
    *, beta_opening: Any, beta_closing: Any, u_min0_over_u_max: Any, share_of_transition: Any, n_full: Any
) -> Any:
    """Return by how many counts the transition lowers the opening law, for numbers of any kind.

    The betas are the offsets of the two thresholds over the law's u_min0; `share_of_transition` is what
    `evaluate_share` gives. Full drive is `n_full` counts.

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


@cache
def _lowered_share() -> Any:
    return lower(SHARE, (u_i, u_z, u_t))


@cache
def _lowered_command() -> Any:
    return lower(LAW_COMMAND, (share, u_t))
