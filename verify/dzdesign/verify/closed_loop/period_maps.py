"""The exact maps of a linear plant over a period of the PWM, as numbers, and tables of what the pulse adds."""

import numpy as np

from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S

#: Half counts of the compare value in a step of the coarse table of responses.
FINE = 512
#: Terms of the series by which the voltage moves the middle value's position.
BALANCE_TERMS = 16
#: Entries of the exact maps over a period, row by column of (current, position, speed, charge); of the position of its
#: middle value; what the acceleration adds: to the middle and, foreseen, to the end from its value at the start, and to
#: position and speed from its values at start, middle and end.
MAP = (
    "i_i", "q_i", "x_i", "x_x", "x_v", "v_i", "v_x", "v_v", "mid_i", "mid_x", "mid_v",
    "mid_start", "ahead_start", "ahead_slope", "x_start", "x_mid", "x_end", "v_start", "v_mid", "v_end",
)  # fmt: skip


def period_map(rates: np.ndarray) -> list[float]:
    """Return the entries of `MAP`: exponentials of the linear part, and integrals of them against polynomials."""
    from scipy.linalg import expm

    def over(seconds: float) -> tuple[np.ndarray, np.ndarray]:
        # Powers of time s^j/j! drive the speed: an exponential of a larger matrix holds their responses, j = 0, 1, 2.
        larger = np.zeros((7, 7))
        larger[:4, :4], larger[2, 4], larger[4, 5], larger[5, 6] = rates, 1.0, 1.0, 1.0
        found = expm(larger * seconds)
        return found[:4, :4], found[:4, 4:]

    end, by_power = over(PWM_PERIOD_S)
    middle, by_power_middle = over(PWM_PERIOD_S / 2)
    share = 1 / PWM_PERIOD_S
    # Values at 0, T/2, T -> coefficients of s^j/j!.
    quadratic = np.array([[1, 0, 0], [-3 * share, 4 * share, -share], [4 * share**2, -8 * share**2, 4 * share**2]])
    return [
        end[0, 0], end[3, 0], *end[1, :3], *end[2, :3], *middle[1, :3],
        by_power_middle[1, 0], by_power[1, 0], 2 * share * by_power[1, 1],
        *(by_power[1] @ quadratic), *(by_power[2] @ quadratic),
    ]  # fmt: skip


def balanced(rates: np.ndarray, drive: np.ndarray, entries: list[float]) -> tuple[list[float], np.ndarray]:
    """Return `MAP` with another middle value, and what the voltage adds to its position by powers of the share of time.

    Of an acceleration that is x itself the speed at the end is that of a second spool driven by the first one's
    position. The middle value stands where the step gives just that.
    """
    from scipy.linalg import expm

    of = dict(zip(MAP, entries, strict=True))
    # Current, position and speed; position and speed of the second spool; a constant acceleration of the first.
    both = np.zeros((6, 6))
    both[:3, :3], both[3, 4], both[4, 1], both[4, 3:5], both[2, 5] = rates[:3, :3], 1.0, 1.0, rates[2, 1:3], 1.0
    second = expm(both * PWM_PERIOD_S)[4]
    of |= {
        name: float(whole - of["v_end"] * end - of["v_start"] * start) / of["v_mid"]
        for name, whole, end, start in (
            ("mid_i", second[0], of["x_i"], 0.0),
            ("mid_x", second[1], of["x_x"], 1.0),
            ("mid_v", second[2], of["x_v"], 0.0),
            ("mid_start", second[5], of["ahead_start"], 0.0),
        )
    }
    term, series = np.zeros(6), np.zeros(BALANCE_TERMS)
    term[:3] = drive[:3] * PWM_PERIOD_S
    for order in range(1, BALANCE_TERMS):
        series[order] = (term[4] - of["v_end"] * term[1]) / of["v_mid"]
        term = both @ term * (PWM_PERIOD_S / (order + 1))
    return list(of.values()), series


def response_tables(rates: np.ndarray, drive: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return `Numbers.coarse` and `Numbers.fine` for `count` parts of a period."""
    from scipy.linalg import expm

    driven = np.zeros((5, 5))
    driven[:4, :4], driven[:4, 4] = rates, drive
    part = driven * (PWM_PERIOD_S / count)
    fine, coarse = _powers(expm(part), FINE), _powers(expm(part * FINE), count // FINE + 1)
    (i, x, v, charge), push = range(4), slice(0, 4)
    entries = [(i, i), (charge, i), (x, i), (x, x), (x, v), (v, i), (v, x), (v, v)]
    free = np.stack([fine[:, row, column] for row, column in entries], axis=1)
    return np.ascontiguousarray(coarse[:, push, 4]), np.hstack([free, fine[:, push, 4]])


def _powers(matrix: np.ndarray, count: int) -> np.ndarray:
    """Return the powers 0 to count - 1 of a matrix, (count, n, n)."""
    powers = np.eye(len(matrix))[None]
    while len(powers) < count:
        powers = np.concatenate([powers, powers @ (powers[-1] @ matrix)])
    return powers[:count]
