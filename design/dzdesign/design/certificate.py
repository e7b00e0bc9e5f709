"""The certificate: proof that the offset lies below the lower bound of the guarded threshold at every pressure code.

`design` proves it for the table that it chooses, and so it is proved again where a compensator from a file is designed
again: a file can be edited, and the firmware's header would go on promising what no longer holds.
"""

from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil

import numpy as np

from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.beta_table import STEP_CODES, TableMargins
from dzdesign.design.budget import budget_of
from dzdesign.design.ceiling import OffsetCeiling, OffsetCurve, offset_above, offset_ceiling, offset_row
from dzdesign.design.compensator import Compensator
from dzdesign.design.design_choices import Above
from dzdesign.design.machine import Allowance, Machine
from dzdesign.design.options import DesignOptions
from dzdesign.design.side_law import Budget, Certificate, Sides
from dzdesign.design.signals import Signals
from dzdesign.identify.valve.guard_curve import CertifiedCurve, Guard
from dzdesign.identify.valve.side_model import SideModel

#: Of a loss in V: tenths of a microvolt.
LOSS_DIGITS = 7


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardedSide:
    """One side of a valve, the threshold of it that is guarded, and what rounding, dither and the machine leave."""

    side: SideModel
    guard: Guard
    #: Certified offset of the guarded threshold.
    curve: OffsetCurve
    #: What rounding, dither and the machine leave of it.
    ceiling: OffsetCeiling
    allowance: Allowance
    u_max_V: Fraction
    machine: Machine | None

    @classmethod
    def of(
        cls, side: SideModel, guard: Guard, chosen: DesignOptions | Compensator, u_max_V: Fraction, allowance: Allowance
    ) -> "GuardedSide":
        """Return it with its curve and its ceiling."""
        curve = guarded_curve(side, guard, chosen.below_dp0, chosen.above, chosen.machine)
        return cls(
            side=side, guard=guard, curve=curve, ceiling=offset_ceiling(curve, u_max_V, allowance),
            allowance=allowance, u_max_V=u_max_V, machine=chosen.machine,
        )  # fmt: skip

    def certify(self, u_min0: Fraction, table: tuple[int, ...], denominator: int) -> tuple[Certificate, Budget]:
        """Prove the certificate, in exact arithmetic, at every pressure code; return it with the budget.

        The table is of nodes of beta over `denominator`, `u_min0` is the law's over u_max. An offset above the ceiling
        is refused.
        """
        curve, tested = self.curve, self.ceiling.certified
        margins = TableMargins(limit=self.ceiling.limit, nodes=table, unit=u_min0 / (denominator * STEP_CODES))
        margin = _smallest_margin(margins, tested, lets_go=curve.above is not None)
        losses = _losses_V(curve, tested, self.allowance, margins, self.u_max_V)
        holds_to, released_from = _above(curve, tested, self.allowance, margins)
        certificate = Certificate(
            confidence=self.side.certificate.confidence,
            guard=self.guard,
            level_L_min=self.side.unseen_below_L_min(self.guard),
            zero_flow_L_min=self.side.zero_flow_L_min,
            dp_MPa=(curve.dp_MPa[0], curve.dp_MPa[-1]),
            holds_to_MPa=holds_to,
            released_from_MPa=released_from,
            smallest_margin_V=margin * self.u_max_V,
            mean_loss_V=round(sum(losses) / len(losses), LOSS_DIGITS),
            largest_loss_V=round(max(losses), LOSS_DIGITS),
        )
        return certificate, budget_of(self.side, curve, self.u_max_V, self.allowance, self.guard, self.machine)


def with_certificates(compensator: Compensator) -> Compensator:
    """Return a compensator whose certificates and budgets are those that follow from the valve in it."""
    laws = {}
    for sign in compensator.signals.signs:
        law, side = compensator.side(sign), compensator.valve.side(sign)
        guarded = GuardedSide.of(
            side, law.certificate.guard, compensator, compensator.u_max_V, compensator.allowance(sign)
        )
        certificate, budget = guarded.certify(law.u_min0_over_u_max, law.beta, compensator.beta_denominator)
        laws[sign] = replace(law, certificate=certificate, budget=budget)
    return replace(compensator, sides=Sides.of(compensator.valve, laws))


def guarded_curve(
    side: SideModel, guard: str, below_dp0: str, above: Above = "hold", machine: Machine | None = None
) -> OffsetCurve:
    """Return the certified offset of the threshold that is to be guarded, or say what to do if there is none.

    What it does above the tests is chosen, and there an error of the machine's bench counts more.
    """
    if not side.curve.dp_MPa:
        raise InputError(
            "the valve was identified without a pressure drop, so no offset can be certified at any pressure; "
            'record the ramp test again with a column of dP (or pA and pB), or declare it: identify --dp "1 MPa"'
        )
    curve = _curve_of(side, guard)
    if curve.premise == "none" and len(curve.dp_MPa) > 1:
        raise InputError(_nothing_between(side, curve))
    return OffsetCurve(
        dp_MPa=tuple(Fraction(repr(value)) for value in curve.offset_dp_MPa),
        offset_V=tuple(Fraction(repr(value)) for value in curve.offset_V),
        certified=curve.bound(),
        hold_below_MPa=hold_below(side, below_dp0),
        above=offset_above(curve, above, machine),
    )


def _nothing_between(side: SideModel, curve: CertifiedCurve) -> str:
    """Say that a premise between two tests must be declared, and which dead zone each would leave."""
    leaves = [
        f"{check.premise} leaves a dead zone of {100 * check.dead_zone_over_u_max:.1f} %"
        for check in side.curve.premises
        if check.dead_zone_over_u_max is not None
    ]
    left = f" ({', '.join(leaves)})" if leaves else ""
    return (
        f"between {len(curve.dp_MPa)} tested pressure drops nothing is known of the threshold; declare what it is "
        f"there, identify --curve line or --curve monotone{left}, or a --curvature, or record a third pressure drop"
    )


def hold_below(side: SideModel, below_dp0: str) -> Fraction | None:
    """Return the pressure drop below which beta is held at 1, MPa; None where the tests are followed there."""
    return Fraction(repr(side.reference.dp_MPa)) if below_dp0 == "hold" else None


def _curve_of(side: SideModel, guard: str) -> CertifiedCurve:
    """Return the curve that certifies a threshold; refuse one that valve.json does not have, and say why."""
    if guard in side.certified:
        return side.certified[guard]
    raise InputError(
        f"--guard {guard} needs a bound of the {guard} threshold, but the ramp tests bound only the "
        f"{' and the '.join(side.certified)} threshold; " + _remedy(side, guard)
    )


def _remedy(side: SideModel, guard: str) -> str:
    has_rising, has_falling = side.tests[0].u_knee_rising_V is not None, side.tests[0].u_knee_falling_V is not None
    if guard != "opening" and not has_falling:
        return "record the falling branch too, or accept flow at zero command after closing with --guard opening"
    if guard != "closing" and not has_rising:
        return "record the rising branch too, or take --guard closing, the safer one"
    return (
        "make valve.json again with `dzdesign identify`; if the bound is still missing, no offset lies below it, so "
        "choose another --guard"
    )


def _smallest_margin(margins: TableMargins, tested: range, *, lets_go: bool) -> Fraction:
    """Return the least distance over u_max between ceiling and offset on the certified codes.

    On no code it is negative: those outside the tests may be read at a tested pressure drop. But for an offset that is
    let go above them, which is the least that the table has.
    """
    codes = np.arange(len(margins.limit))
    let_go = (codes >= tested.stop) & (margins.numerators <= STEP_CODES) & lets_go
    held = codes[~let_go]
    if held.size and (least := margins.least(held)) < 0:
        raise RequirementError(f"the offset exceeds the certified one by {float(-least):.2e} of u_max")
    if tested:
        return margins.least(codes[tested.start : tested.stop])
    least = margins.least(codes)
    return max(least, Fraction(0)) if let_go.any() else least


def _above(
    curve: OffsetCurve, tested: range, allowance: Allowance, margins: TableMargins
) -> tuple[Fraction, Fraction | None]:
    """Return up to which pressure drop the certificate holds, and from which the offset is released, MPa.

    Above the tests it holds as far as the continued bound does, code by code, and where the drive is zero whatever the
    threshold. An offset that is released is one unit of beta.
    """
    tests_end, count, pair = curve.dp_MPa[-1], len(margins.limit), allowance.pair
    if curve.above is None or tested.stop >= count:
        return tests_end, None
    last = _holds_to(tested.stop, allowance.signals, margins) if curve.above.certified else None
    holds_to = tests_end if last is None else max(pair.dp_MPa(last), tests_end)
    driven = np.flatnonzero(margins.numerators[tested.stop :] > STEP_CODES)
    released_from = tested.stop + (int(driven[-1]) + 1 if driven.size else 0)
    return holds_to, max(pair.dp_MPa(released_from), tests_end) if released_from < count else None


def _holds_to(first: int, signals: Signals, margins: TableMargins) -> int | None:
    """Return the last of the codes, from the first on, up to which every offset is certified or rounds to no drive."""
    half = 1 / (2 * signals.compare_max * margins.unit)
    unseen = margins.numerators < ceil(half)  # whole numbers below a half of a count
    for code in margins.exceeded():
        if code >= first and not unseen[code]:
            return code - 1 if code > first else None
    return len(margins.limit) - 1


def _losses_V(
    curve: OffsetCurve, tested: range, allowance: Allowance, margins: TableMargins, u_max_V: Fraction
) -> list[float]:
    """Return by how much the table's offset lies under the certified curve at each certified code, V."""
    codes, unit_V = tested or range(1), margins.unit * u_max_V
    offset = offset_row(curve, allowance.pair, codes.start, codes.stop - 1)
    table = margins.numerators[codes.start : codes.stop].tolist()
    up, unit = unit_V.numerator, unit_V.denominator
    triples = zip(offset.numerators, offset.denominators, table, strict=True)
    return [(value * unit - beta * up * by) / (by * unit) for value, by, beta in triples]


def reach_of_certificate(compensator: Compensator) -> str:
    """Return a sentence on what the certificate counts of a machine, or that it counts nothing of one."""
    if compensator.machine is None:
        return (
            "The certificate covers the valve as recorded: no machine was declared, so coil temperature, "
            "supply voltage, pressure sensors, oil and ageing are not counted."
        )
    sides: dict[str, list[str]] = {}
    for sign in compensator.signals.signs:
        budget, name = compensator.side(sign).budget, compensator.valve.side_name(sign)
        if budget is not None:
            sides.setdefault(taken_off(budget, compensator.valve.recorded_units.of_side(name)), []).append(name)
    parts = [f"{names[0]} commands: {text}" if len(sides) > 1 else text for text, names in sides.items()]
    return f"The certificate covers the valve as recorded and the declared machine: {'; '.join(parts)}."


def taken_off(budget: Budget, units: RecordedUnits) -> str:
    """Return by how much the offset's ceiling lies under the recorded threshold at most, and for what mostly."""
    place = max(range(len(budget.dp_MPa)), key=lambda at: budget.combined_mV[at])
    largest = budget.largest
    return (
        f"its budget takes {units.text(budget.combined_mV[place], '.0f mV')} from the recorded threshold at "
        f"{units.text(budget.dp_MPa[place], '.2f MPa')}; its largest component is {largest.component} "
        f"({largest.origin}), {units.text(largest.contribution_mV[place], '.0f mV')}"
    )


def not_counted(compensator: Compensator | None) -> tuple[str, ...]:
    """Return lines on what of a machine the certificate leaves out."""
    if compensator is None or compensator.machine is None:
        return (
            "The machine: another coil temperature or supply than on the bench, errors of its pressure sensors and of "
            "their converters beyond rounding, the oil and ageing. `dzdesign design` counts them where they are "
            "declared.",
            "Failures that the signals hide, and the spread between valves of a type.",
        )
    return (
        "A machine outside what was declared: the budget counts that, and nothing beyond it.",
        "Defaults of the budget that nobody measured on this machine; each is named in its table.",
        "Failures that the signals hide, and the spread between valves of a type.",
    )


def above_in_words(choice: Above, certificate: Certificate, side: SideModel, units: RecordedUnits) -> str:
    """Return what the law does above the tests, up to where that is certified, and on what premise."""
    curve, last = side.certified[certificate.guard], units.text(float(certificate.dp_MPa[1]), ".2f MPa")
    if choice == "hold" or (choice == "lower" and curve.above is None):
        why = "" if choice == "hold" else " (a single test gives no slope for lowering it)"
        return (
            f"above {last} the offset of the highest test is held{why} and nothing is certified: where the threshold "
            "falls, flow at zero command is possible"
        )
    released = certificate.released_from_MPa
    text = f"above {last} the offset falls with the continued bound"
    if choice == "release":
        text = f"above {last} the offset is released"
    if released is not None:
        at = units.text(float(released), ".3g MPa")
        text += f" and is zero from {at} on. There the full dead zone is back"
    holds_to = certificate.holds_to_MPa
    if curve.above is None:
        return f"{text}. Not certified: a single test gives no slope"
    rests = curve.above.in_words(curve.premise)
    if released is not None and holds_to >= released > certificate.dp_MPa[1]:  # no offset is left beyond
        return f"{text}. Up to there this offset is {rests}"
    if holds_to > certificate.dp_MPa[1]:
        return f"{text}. Up to {units.text(float(holds_to), '.3g MPa')} this offset is {rests}"
    return f"{text}. {rests[0].upper()}{rests[1:]}"


def below_in_words(certificate: Certificate, side: SideModel, units: RecordedUnits) -> str:
    """Return what the law does below the lowest test, and what is known of the threshold there."""
    first = units.text(float(certificate.dp_MPa[0]), ".2f MPa")
    text = f"below {first} the offset of the lowest test is held and nothing is certified"
    if side.trend == "increasing":
        return f"{text}: the threshold grows with the pressure drop, so flow at zero command is possible there"
    if side.trend == "decreasing":
        return f"{text}. A threshold that keeps rising towards zero pressure drop stays above this offset"
    return text
