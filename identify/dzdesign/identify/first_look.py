"""A first look at recordings: which sides, ramps and pressures there are, what the meter shows.

For a person who has yet to declare anything: what the recordings tell is kept apart from what they can't.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.constants import L_MIN, MPA
from dzdesign.identify.knees.described_tests import DescribedTests
from dzdesign.identify.knees.prepared_tests import describe_tests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.sides import tests_of_side
from dzdesign.identify.ramps.splitting import despiked
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import SIDES

#: Full commands that amplifiers have, V: the smallest that the recordings do not exceed by 5 % is proposed.
USUAL_U_MAX = (1.0, 2.5, 3.3, 5.0, 10.0, 12.0, 15.0, 20.0, 24.0, 48.0)

@dataclass(frozen=True, slots=True, kw_only=True)
class SideOverview:
    """What the recordings of one side show."""

    #: Nominal pressure drops; None: not known.
    dp_MPa: tuple[float | None, ...]
    #: Ramps of the command.
    ramps: int
    #: Fastest pace of the command; None if it is not known.
    rate_V_s: float | None
    #: Largest flow, and the flow at which the meter starts.
    q_max_L_min: float
    floor_L_min: float
    #: Of the meter, as `MeterLag` says it.
    lag_s: float
    lag_is: str
    #: Recording -> reading at zero command, where it is not zero.
    zero_L_min: dict[str, float]


def proposed_u_max(tests: Sequence[RampTest]) -> tuple[float, float]:
    """Return the full command to declare, and the largest command seen in all recordings, both in V."""
    seen = max(float(np.abs(despiked(test.u)).max()) for test in tests)
    return next((usual for usual in USUAL_U_MAX if seen <= 1.02 * usual), math.ceil(seen)), seen


def look_at_sides(tests: Sequence[RampTest], u_max: float) -> tuple[dict[str, SideOverview], dict[str, str]]:
    """Return what each side shows in all recordings, and for a side that `identify` would refuse the reason."""
    sides, refused = {}, {}
    options = IdentifyOptions(u_max=u_max)
    for name, sign in SIDES.items():
        of_side = tests_of_side(tests, sign, u_max)
        if not of_side:
            continue
        try:
            sides[name] = _overview(describe_tests(of_side, options))
        except InputError as error:
            refused[name] = str(error)
    return sides, refused


def _overview(group: DescribedTests) -> SideOverview:
    rates = [shape.prepared.branch.rate for item in group.tests for shape in item.branches]
    rates = [rate for rate in rates if math.isfinite(rate)]
    return SideOverview(
        dp_MPa=tuple(None if item.dp is None else item.dp / MPA for item in group.tests),
        ramps=sum(len(item.ramps) for item in group.tests),
        rate_V_s=max(rates, default=None),
        q_max_L_min=max(item.q_max for item in group.tests) / L_MIN,
        floor_L_min=group.floor / L_MIN,
        lag_s=group.lag.seconds,
        lag_is=group.lag.origin,
        zero_L_min=group.zero_L_min,
    )
