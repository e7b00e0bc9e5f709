"""What the recordings leave open from ramp to ramp: no repeats, unlike ones, an order that hides a drift, a drift."""

import math
from collections.abc import Iterator, Sequence

from dzdesign.identify.constants import MPA
from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.fit.scatter import Scatter
from dzdesign.identify.knees.between_ramps import ScatterChecks
from dzdesign.identify.knees.described_tests import DescribedTest
from dzdesign.identify.options import ASSUMED_REPEATABILITY, IdentifyOptions
from dzdesign.identify.valve.bound_proof import BoundProof
from dzdesign.identify.valve.model import Warning_
from dzdesign.identify.valve.repeatability import Repeatability
from dzdesign.identify.valve.side_model import SideModel

#: With fewer degrees of freedom the scatter is known so badly that repeats pay twice.
FEW_DEGREES = 4
#: Standard errors from which a drift is said, and share of u_max from which it matters.
DRIFT_SIGNIFICANCE, SMALLEST_DRIFT = 3.0, 1e-3
#: Shares of u_max from which an outlying ramp's distance, and the scatter of ramps like their neighbours, matter.
SMALLEST_DISTANCE, SMALLEST_SCATTER = 1e-3, 5e-4


def about_ramps(
    side: SideModel,
    scatter: Scatter,
    checks: ScatterChecks,
    tests: Sequence[DescribedTest],
    options: IdentifyOptions,
) -> Iterator[Warning_]:
    """Yield the warnings about what differs from ramp to ramp, on the guarded branch."""
    found, proof = side.certificate.repeatability, side.curve.proof
    count = len(tests)
    sd_mV, degrees = 1e3 * found.sd_V, found.degrees_of_freedom
    if found.origin == "assumed":
        repeats = sum(len(test.ramps) for test in tests) - count
        drift = " once the drift has taken one" if found.drift_V is not None else ""
        said = {"percent": 100 * ASSUMED_REPEATABILITY, "sd_mV": sd_mV, "drift": drift}
        yield warn("assumed-scatter", None, "few-repeats" if repeats else "no-repeats", **said)
    elif degrees is not None and options.repeatability is not None:
        percent = 100 * found.sd_V / options.u_max
        yield warn("repeatability", sd_mV=sd_mV, percent=percent, declared=100 * options.repeatability)
    elif degrees is not None and degrees < FEW_DEGREES and not scatter.unlike:
        yield warn("few-repeats", sd_mV=sd_mV, differences=degrees)
    yield from _about_premises(found, scatter, checks, tests, proof, options.u_max)
    if found.no_drift == "order of pressure" or (found.no_drift == "order unknown" and count > 1):
        yield warn("order", None, "unknown" if found.no_drift == "order unknown" else "of-pressure")
    if found.drift_V is not None and found.drift_se_V is not None:
        least = max(DRIFT_SIGNIFICANCE * found.drift_se_V, SMALLEST_DRIFT * options.u_max)
        if abs(found.drift_V) > least:
            yield warn("drift", drift_mV=1e3 * found.drift_V, se_mV=1e3 * found.drift_se_V)


def _about_premises(
    found: Repeatability,
    scatter: Scatter,
    checks: ScatterChecks,
    tests: Sequence[DescribedTest],
    proof: BoundProof,
    u_max: float,
) -> Iterator[Warning_]:
    """Yield what the repeats say against a scatter that is normal, alike at all pressure drops, and independent."""
    alike, groups, unlike = checks.alike, checks.groups, scatter.unlike
    if groups and groups.apart > SMALLEST_DISTANCE * u_max:
        low, high = (tests[test].ramps[number] for test, number in groups.ramps)
        yield warn(
            "two-groups",
            tests[groups.ramps[0][0]].test.source,
            "column" if groups.column else "ramps",
            apart_mV=1e3 * groups.apart,
            column=groups.column,
            low=groups.values[0] or low,
            high=groups.values[1] or high,
        )
    if alike:
        where = "at all pressure drops together, and most of all here," if alike.everywhere else "here"
        yield warn(
            "alike-repeats",
            tests[alike.test].test.source,
            where=where,
            sd_mV=1e3 * alike.sd,
            noise_mV=1e3 * alike.of_noise,
        )
    if unlike:
        knot_MPa = scatter.model.knots_MPa[unlike.knot]
        nearest = min(tests, key=lambda test: abs((test.dp or 0.0) / MPA - knot_MPa))
        yield warn(
            "unequal-scatter",
            nearest.test.source,
            sd_mV=1e3 * math.sqrt(unlike.variance),
            others_mV=1e3 * found.sd_V,
            differences=unlike.degrees,
        )
    for ramp in proof.set_aside:
        if abs(ramp.distance_V) > SMALLEST_DISTANCE * u_max:
            yield warn("outlying-ramp", ramp.source, distance_mV=1e3 * ramp.distance_V, ratio=ramp.deviations)
    if checks.serial is not None and found.sd_V > SMALLEST_SCATTER * u_max:
        yield warn("serial-scatter", correlation=checks.serial)
