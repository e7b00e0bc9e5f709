"""The printed limit of a position loop's gain against a simulation in small steps, over draws of valve and loop."""

import numpy as np
from scoreboard import Row, print_rows, say

from dzdesign.design.position_loop import GAINS, largest_gain
from tests.support.hunting import drawn, hunts, swinging

DRAWS, FEW = 200, 12
BELOW, ABOVE = 0.95, 1.15


def print_hunting(*, quick: bool, seed: int) -> list[Row]:
    """Print how many loops cycle just below the limit, and how many do not just above."""
    rng, draws = np.random.default_rng(seed), FEW if quick else DRAWS
    below = quiet = limited = 0
    ratios = []
    for draw in range(draws):
        of = drawn(rng)
        loop = swinging(of)
        gain = largest_gain(loop)
        ratios.append(gain / loop.linear_gain)
        if not 0 < gain < GAINS[-1] * loop.linear_gain:
            continue
        limited += 1
        seconds = 40 * 2 * np.pi / loop.swing_rad_s
        below += hunts(of, BELOW * gain, seconds)
        quiet += not hunts(of, ABOVE * gain, seconds)
        if not (draw + 1) % 20:
            say(f"position loops: {draw + 1} of {draws}")
    note = f"of {limited}"
    rows = [
        Row(what="loops that cycle at 95 % of the printed limit", value=below, limit=0, note=note),
        Row(what="loops that do not cycle at 115 % of it", value=quiet, limit=0.2 * limited, note=note),
        Row(what="draws without a limit within what is tried", value=draws - limited),
        Row(what="printed limit over that of an ideal line, median", value=float(np.median(ratios))),
        Row(what="the same, smallest", value=float(np.min(ratios))),
    ]
    print_rows(f"Hunting, {draws} draws, seed {seed}", rows)
    return rows
