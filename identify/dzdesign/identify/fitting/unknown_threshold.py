"""Why a threshold that lies well above zero has no lower bound there: the readings tell it too badly."""

from dzdesign.core.recorded_units import worded
from dzdesign.identify.constants import MPA
from dzdesign.identify.fitting.guarded_thresholds import Guarding
from dzdesign.identify.knees.described_tests import DescribedTests

#: Standard errors of the knee by which a threshold below it shows a soft edge.
SOFT = 3.0


def unknown_threshold(group: DescribedTests, guarding: Guarding) -> str | None:
    """Return which test's threshold is known too badly, by its noise more than by the ramps' scatter; None: of none.

    The first flows of a soft edge, few above a meter's floor, may leave their zero open by volts. Then neither the
    meter's zero nor the valve is at fault, and the knee is known well all the same.
    """
    threshold = next(iter(guarding.thresholds.values())).threshold
    worst = int(threshold.bound.argmin())
    value, se, bound = (float(each[worst]) for each in (threshold.value, threshold.se, threshold.bound))
    if bound > 0 or value <= 0 or se < group.between(guarding.column).sd:
        return None
    knee, knee_se = (float(each[worst, guarding.column]) for each in (guarding.knees.knee, guarding.knees.knee_se))
    dp, source = group.tests[worst].dp, group.tests[worst].test.source
    return worded(
        "the threshold's lower bound is {bound:.3f V}, not above zero. {at} {known} {se:.2g dV}; "
        "record that pressure drop more often or on slower ramps, or leave it out",
        bound=bound,
        at=worded("In {source}", source=source) if dp is None else worded("At {dp:.3g MPa}", dp=dp / MPA),
        known=worded(
            "the edge is soft: flow continues below the knee of {knee:.4g V}, and ends at about {value:.4g V} with a "
            "standard error of",
            knee=knee, value=value,
        )
        if knee - value > SOFT * knee_se
        else worded("the threshold of {value:.4g V} has a standard error of", value=value),
        se=se,
    )  # fmt: skip
