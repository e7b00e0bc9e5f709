"""The order of warnings: the most serious first."""

from collections.abc import Sequence

from dzdesign.identify.valve.model import Warning_

#: Codes of warnings, the most serious first: what stops `design`, what makes the numbers worthless, what may let flow
#: pass at zero command, what can't be said, what costs performance, and what is only to be known.
MOST_SERIOUS_FIRST = (
    "branch-order", "one-branch",
    "simulated", "flow-contradicts-dp", "pressure-stuck", "time-unit", "missing-samples", "side-refused", "two-sides",
    "no-repeats", "few-repeats", "repeatability", "order", "drift",
    "coarse-flow", "meter-clipped", "edge-not-swept", "gap", "not-monotone", "leak", "meter-zero", "onset-hidden",
    "lag-large", "lag-unknown", "clock",
    "no-pressure", "one-pressure", "declared-pressure",
    "flow-falls", "not-full-command", "curved", "bend", "noise", "coarse-levels", "soft-edge", "outliers",
    "pressure-sag", "no-saturation", "flat-trend", "thinned",
)  # fmt: skip


def most_serious_first(warnings: Sequence[Warning_]) -> tuple[Warning_, ...]:
    """Return warnings by `MOST_SERIOUS_FIRST`; those of one code stay as they stand.

    Parameters
    ----------
    warnings : sequence of Warning_
        In any order.
    """
    rank = {code: place for place, code in enumerate(MOST_SERIOUS_FIRST)}
    return tuple(sorted(warnings, key=lambda warning: rank.get(warning.code, len(rank))))
