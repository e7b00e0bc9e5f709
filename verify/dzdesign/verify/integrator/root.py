"""Where a function changes its sign; SciPy's own takes longer to be imported than CVODES to move through a window."""

from collections.abc import Callable

#: Of a root, in the unit of the argument: of a time in ms, 1e-7 ns.
EXACT = 1e-13
#: Two steps out of three halve the bracket at worst: by so many it is shorter than any number tells.
MOST_STEPS = 400


def root(value: Callable[[float], float], low: float, high: float, within: float = EXACT) -> float:
    """Return where a function of unlike signs at both ends is zero, to `within`: Illinois' regula falsi, safeguarded.

    A `RuntimeError` where the signs are alike.
    """
    at_low, at_high = value(low), value(high)
    if at_low * at_high > 0.0:
        raise RuntimeError(f"no change of sign between {low:g} and {high:g} ms")
    kept, before = 0, (4 * (high - low), 2 * (high - low))
    for _ in range(MOST_STEPS):
        if at_low == 0.0 or high - low <= within:
            return low
        if at_high == 0.0:
            return high
        at = (low + high) / 2
        if high - low <= before[0] / 2:
            straight = (low * at_high - high * at_low) / (at_high - at_low)
            # Off both ends, so that a root beside one is soon between two near numbers.
            at = min(max(straight, low + within / 2), high - within / 2)
        before = before[1], high - low
        found = value(at)
        if found * at_high > 0.0:
            high, at_high = at, found
            # An end that stays twice would stay for long: its value counts half.
            at_low, kept = (at_low / 2 if kept < 0 else at_low), -1
        else:
            low, at_low = at, found
            at_high, kept = (at_high / 2 if kept > 0 else at_high), 1
    return (low + high) / 2
