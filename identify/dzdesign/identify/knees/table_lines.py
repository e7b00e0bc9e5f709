"""A line through the levels of a table of few commands, as a hand-written recording or a staircase gives it."""

import math

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import worded
from dzdesign.identify.knees.gated_line import GatedLine, PreparedBranch, fit_line
from dzdesign.identify.knees.noise import Roughness
from dzdesign.identify.knees.profile import crossing

#: A table's flow that leaves less than `SHUT` of the largest, for more than `JUMPED`, between two levels of the
#: command jumps if it rises so many times faster there than over the next two levels.
SHUT, JUMPED, JUMP = 0.05, 0.15, 3.0


def line_through_levels(read: PreparedBranch, window: tuple[float, float]) -> GatedLine | None:
    """Return the line from the last level below a window to the first above it: all that a table of few levels tells.

    The zero is known to one level of the command, and its error is said to be that.
    """
    _refuse_a_jump_between_levels(read)
    u, y = read.profile
    order = np.argsort(u)
    u, y = u[order], y[order]
    above = int(np.searchsorted(u, crossing(u, y, window[0] * read.y_max)))
    beyond = int(np.searchsorted(u, crossing(u, y, window[1] * read.y_max)))
    if not 0 < above <= beyond < u.size:
        return None
    levels = slice(above - 1, beyond + 1)
    slope, knee = fit_line(u[levels], y[levels])
    step = float(np.diff(u[levels]).max())
    if slope <= 0 or not u[above - 1] - step <= knee <= u[beyond]:
        return None
    kept = (read.branch.u >= u[above - 1]) & (read.branch.u <= u[beyond])
    censored = kept & (read.branch.q < 0.5 * read.floor)
    seen = kept & ~censored
    u_seen = read.branch.u[seen]
    if u_seen.size < 2 or np.ptp(u_seen) == 0:
        return None
    lever = 1 / u_seen.size + (u_seen.mean() - knee) ** 2 / np.sum((u_seen - u_seen.mean()) ** 2)
    return GatedLine(
        window=window,
        slope=slope,
        knee=knee,
        lever=lever,
        sigma=slope * step / math.sqrt(lever),
        block_inflation=1.0,
        variance_inflation=1.0,
        inside=kept,
        kept=kept,
        censored=censored,
        roughness=Roughness(0, 0.0, 0.0),
        outliers=0,
    )


def _refuse_a_jump_between_levels(read: PreparedBranch) -> None:
    """Refuse a table whose flow jumps from one level of the command to the next.

    A valve that opens into a straight part rises from its last shut level by less than one level's worth; what rises
    by several comes from a meter that wakes up late, and the line down to the shut level would end volts too high.
    """
    u, share = read.profile[0], read.profile[1] / read.y_max
    opened = int(np.argmax(share > SHUT))
    if opened == 0 or opened + 2 >= u.size or share[opened] < JUMPED:
        return
    before = (share[opened] - share[opened - 1]) / (u[opened] - u[opened - 1])
    after = (share[opened + 2] - share[opened]) / (u[opened + 2] - u[opened])
    if before <= JUMP * max(after, 0.0):
        return
    raise InputError(
        worded(
            "'{source}': the flow jumps between {shut:.2f #V} and {open:.2f V}, from {least:.0%} to {most:.0%} of the "
            "largest flow of {flow:.3g L/min}, {steeper:.3g} times as steep as above it, expected a straight rise; "
            "record levels in between, or, if the meter shows nothing below some flow, take one of a smaller range",
            source=read.source,
            shut=u[opened - 1],
            open=u[opened],
            least=max(share[opened - 1], 0.0),
            most=share[opened],
            flow=read.y_max * 6e4,
            steeper=before / after if after > 0 else np.inf,
        )
    )
