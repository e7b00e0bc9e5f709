"""What the zero-command drive does above the tested pressure drops, against what the certificate says of it there.

Argued from valve.json again: the nodes of the continued bound, linear between them but for the first interval, where a
threshold that bends by at most M may sag below their chord. Nothing is taken of how the table was made.
"""

from dataclasses import replace
from fractions import Fraction
from math import ceil, floor

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.lot_valves import LotSide
from dzdesign.identify.valve.above_tests import AboveTests
from dzdesign.verify.evidence import AboveCheck, InputCheck
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.sagging_bound import SaggingBound
from dzdesign.verify.exhaustive.test_vectors import Differences
from dzdesign.verify.exhaustive.zero_command import counted_dither, margin_of_sagging, pressure_drops
from dzdesign.verify.requirements import ABOVE_TESTS, Check


def check_above(exact: ExactLaw, found: Differences, at_zero: np.ndarray) -> AboveCheck:
    """Compare the drive at zero command above the tests with its bound, with the last test's offset, and with none."""
    compensator, certificate = exact.compensator, exact.compensator.side(exact.sign).certificate
    last, unit_V = certificate.dp_MPa[1], exact.compensator.u_max_V / exact.compare_max
    continued = _continued(compensator, exact)
    ends = {last, certificate.holds_to_MPa} | {Fraction(repr(dp)) for dp in (continued.dp_MPa if continued else ())}
    drops = pressure_drops(exact, found, ends)
    # A code's middle is a whole number of steps: what it is compared with is brought to codes, exactly.
    codes, step_MPa = found.values, exact.a.per_code_MPa
    above = drops.made & (codes > floor(last / step_MPa))
    curve = compensator.valve.sides[exact.side].certified[certificate.guard]
    most = floor(Fraction(repr(curve.offset_V[-1])) / unit_V)
    margin, exceeded = None, 0
    if continued is not None and certificate.holds_to_MPa > last:
        bound = SaggingBound(_as_tests(continued))
        held = above & (codes <= floor(certificate.holds_to_MPa / step_MPa)) & (at_zero > 0)
        known = margin_of_sagging(
            bound, replace(drops, made=held), at_zero + counted_dither(compensator), unit_V
        )
        margin, exceeded = (None, 0) if known is None else (float(known.margin_V), known.exceeded)
        # What lies behind the last node is under no bound, so only no drive at all holds there.
        exceeded += int(np.sum(held & (codes > floor(Fraction(repr(continued.dp_MPa[-1])) / step_MPa))))
    side = compensator.side(exact.sign)
    let_go = floor(side.u_min0_over_u_max * exact.compare_max / compensator.beta_denominator + Fraction(1, 2))
    released = certificate.released_from_MPa
    not_released = 0
    if released is not None:
        not_released = int(np.sum(above & (codes >= ceil(released / step_MPa)) & (at_zero > let_go)))
    return AboveCheck(
        choice=compensator.above,
        certified_to_MPa=float(certificate.holds_to_MPa) if certificate.holds_to_MPa > last else None,
        released_from_MPa=None if released is None else float(released),
        codes=int(above.sum()),
        over_compensated=exceeded,
        smallest_margin_V=margin,
        rising=int(np.sum(above & (at_zero > most))),
        not_released=not_released,
    )


def _continued(compensator: Compensator, exact: ExactLaw) -> AboveTests | None:
    """Return the certified bound above the tests; None where there is none, and where the offset is held."""
    guard = compensator.side(exact.sign).certificate.guard
    continued = compensator.valve.sides[exact.side].certified[guard].above
    return continued if continued is not None and continued.certified and compensator.above != "hold" else None


def _as_tests(continued: AboveTests) -> LotSide:
    """Return the nodes of a continued bound as bounds at tests."""
    bends = (continued.curvature_V_MPa2, *(0.0 for _ in continued.dp_MPa[2:]))
    return LotSide(
        trend=None, confidence=1.0, premise="smooth", curvature_V_MPa2=bends, dp_MPa=continued.dp_MPa,
        u_lower_V=continued.u_lower_V,
    )  # fmt: skip


def above_checked(inputs: InputCheck, units: RecordedUnits, sign: str) -> Check:
    """Tell whether the drive above the tests is what the certificate says; `sign` says whose where there are two."""
    above = inputs.above
    faults = above.over_compensated + above.rising + above.not_released
    parts = [f"--above {above.choice}: {above.codes} pressure codes lie above the tests"]
    if above.certified_to_MPa is None:
        parts.append("nothing is certified there")
    else:
        margin = "" if above.smallest_margin_V is None else (
            f" (smallest margin of the C code's compare values {units.text(1e3 * above.smallest_margin_V, '.3f mV')})"
        )
        parts.append(
            f"up to {units.text(above.certified_to_MPa, '.3g MPa')}, {above.over_compensated} exceed the bound that "
            f"the curve's premise continues{margin}"
        )
    parts.append(f"{above.rising} exceed the certified offset of the last test")
    if above.released_from_MPa is not None:
        at = units.text(above.released_from_MPa, ".3g MPa")
        parts.append(f"the offset is released from {at}, with {above.not_released} exceptions")
    return ABOVE_TESTS.check(name=sign + ABOVE_TESTS.title, holds=faults == 0, text="; ".join(parts))
