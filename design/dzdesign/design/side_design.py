"""One side of the valve in; its law out, in the finest units of the firmware's arithmetic, with its certificate."""

from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import gcd

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import worded
from dzdesign.design.beta_table import STEP_CODES, choose_beta_table, released_from
from dzdesign.design.ceiling import OffsetCeiling, OffsetCurve, offset_row
from dzdesign.design.certificate import GuardedSide, hold_below
from dzdesign.design.design_choices import Above
from dzdesign.design.exact_row import ExactRow
from dzdesign.design.machine import Allowance
from dzdesign.design.options import DesignOptions
from dzdesign.design.side_law import SideLaw
from dzdesign.design.signals import Signals
from dzdesign.identify.valve.guard_curve import GUARDS
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.side_model import SideModel

#: Finest and coarsest, as powers of two. Beta stays below 2, so a node fits 16 bits; a coefficient over 2^16 is finer
#: than half a count of a PWM of 60 000.
BETA_BITS = (15, 11)
COEFFICIENT_BITS = (16, 12)
#: Share of each test's largest flow that full command has to reach.
FULL_FLOW = 0.98
#: What either factor of the firmware's product may take: 31 bits.
FACTOR_LIMIT = 2**31


@dataclass(frozen=True, slots=True, kw_only=True)
class Units:
    """Denominators, powers of two: of beta's nodes, and of k x_max/u_max and u_min0/u_max."""

    beta: int
    coefficient: int


def finest_units(signals: Signals, transition_codes: int) -> Units:
    """Return the finest units with which the law in counts fits the firmware's arithmetic; refuse where none do.

    In counts the law is ``B (p c + o) / (D S K C E) * M``, with C codes of command, E of the transition (0 without one)
    and M counts of the PWM. What M has in common with the denominator cancels, and what remains of M goes with the
    table B or with the factor in c, each of which has 31 bits.
    """
    units = finest_that_fit(signals, transition_codes)
    if units is not None:
        return units
    spans = " and ".join(str(signals.command.span(sign)) for sign in signals.signs)
    what = f"a full command of {spans} codes over {signals.compare_max} counts"
    shorter = transition_codes
    while shorter and finest_that_fit(signals, shorter) is None:
        shorter //= 2
    if shorter:
        share = shorter / min(signals.command.span(sign) for sign in signals.signs)
        raise InputError(
            f"a transition of {transition_codes} codes of command, with {what}, needs more than 64-bit arithmetic; "
            f"choose one of {100 * share + 0.01:.2f} % ({shorter} codes) at most"
        )
    raise InputError(
        f"{what} needs more than 64-bit arithmetic; choose an attenuator whose full command has more factors in common "
        "with the counts" + (", or give --transition off" if transition_codes else "")
    )


def finest_that_fit(signals: Signals, transition_codes: int) -> Units | None:
    """Return the finest units with which the law fits the firmware's arithmetic; None where none do."""
    spans = [signals.command.span(sign) for sign in signals.signs]
    finest, coarsest = sum((BETA_BITS[0], COEFFICIENT_BITS[0])), sum((BETA_BITS[1], COEFFICIENT_BITS[1]))
    for total in range(finest, coarsest - 1, -1):
        for coefficient in range(COEFFICIENT_BITS[0], COEFFICIENT_BITS[1] - 1, -1):
            beta = total - coefficient
            if BETA_BITS[1] <= beta <= BETA_BITS[0] and all(
                _fits(span, signals.compare_max, transition_codes, beta, coefficient) for span in spans
            ):
                return Units(beta=1 << beta, coefficient=1 << coefficient)
    return None


def _fits(span: int, compare_max: int, transition_codes: int, beta_bits: int, coefficient_bits: int) -> bool:
    """Tell whether table and factor fit with some divisor of what remains of the PWM's range moved to the table."""
    transition = max(transition_codes, 1)
    powers = STEP_CODES << (beta_bits + coefficient_bits)
    shared = gcd(compare_max, powers * span * transition)
    remains = compare_max // shared
    table = STEP_CODES << (beta_bits + 1)
    factor = span * transition << coefficient_bits
    return any(
        table * moved < FACTOR_LIMIT and factor * (remains // moved) < FACTOR_LIMIT
        for moved in range(1, remains + 1)
        if remains % moved == 0
    )


def refuse_crossed_branches(side: SideModel) -> None:
    """Refuse knees in an order that no valve has: the guarded one is not where the valve closes."""
    for test in side.tests:
        if test.closes_above_opening:
            raise InputError(
                worded(
                    "'{source}': the valve closes ({closes:.3f V}) above where it opens ({opens:.3f V}), as no valve "
                    "does, so flow at zero command is possible; run `identify` again with the meter's true "
                    "--meter-lag or a right column of time, or take it as it is by --accept branch-order",
                    source=test.source,
                    closes=test.u_knee_falling_V,
                    opens=test.u_knee_rising_V,
                )
            )


def refuse_two_signs(valve: ValveModel, guard: str) -> None:
    """Refuse a command of both signs where a side was not tested, or does not bound the guarded threshold."""
    for untested in valve.untested_sides:
        raise InputError(
            f"the command has both signs, but the valve's {untested} side was not tested; record its ramps, or give a "
            "command of one sign"
        )
    guards = {name: valve.sides[name].certified for name in ("positive", "negative")}
    lacking = [name for name, found in guards.items() if guard not in found]
    if not lacking:
        return
    common = [name for name in GUARDS if all(name in found for found in guards.values())]
    raise InputError(
        f"the {' and the '.join(lacking)} side's ramp tests do not bound the {guard} threshold, which is to be "
        "guarded; "
        + (f"take --guard {common[0]}, or " if common else "no guard serves both sides: ")
        + "record both branches of both sides"
    )


#: Standard errors by which the transition's end stands above the opening threshold.
OPENING_ERRORS = 3


def opening_offset(side: SideModel, options: DesignOptions) -> OffsetCurve:
    """Return where the transition ends and the law goes on: the opening threshold, and its error on top.

    A law that starts above the threshold only shortens the dead zone that is left; one that starts below lengthens it.
    """
    opening = side.opening_curve
    if opening is None:
        raise InputError(
            "a transition ends at the opening threshold, of which valve.json has no curve; record the rising branch "
            "with a column of dP, make valve.json again, or give --transition off"
        )
    error = max(opening.u_se_V)
    offset = [Fraction(repr(value)) + OPENING_ERRORS * Fraction(repr(error)) for value in opening.u_V]
    return OffsetCurve(
        dp_MPa=tuple(Fraction(repr(value)) for value in opening.dp_MPa),
        offset_V=tuple(offset),
        certified=None,
        hold_below_MPa=hold_below(side, options.below_dp0),
    )


def opening_ceiling(
    opening: OffsetCurve, guarded: OffsetCurve, tested: range, above: Above, allowance: Allowance, u_max: Fraction
) -> OffsetCeiling:
    """Return the opening threshold at every pressure code: no bound, so rounding to codes does not count.

    Above the tests it comes down by as much as the guarded offset: a transition, and the hysteresis that a play takes
    out of it, stay as they are at the last test. Where the offset is released, only that height is left of it.
    """
    pair = allowance.pair
    last = pair.largest_difference
    limit = offset_row(opening, pair, 0, last)
    if guarded.above is not None and tested.stop <= last:
        let_go = min(released_from(above, tested) or last + 1, last + 1)
        height = opening.offset_V[-1] - guarded.offset_V[-1]
        held = offset_row(guarded, pair, tested.stop, let_go - 1).line(Fraction(1), -height)
        left = ExactRow.joined([([height.numerator] * (last + 1 - let_go), height.denominator)])
        limit = limit[: tested.stop].followed_by(held).followed_by(left)
    return OffsetCeiling(limit=limit.line(1 / u_max), certified=tested)


def side_law(
    side: SideModel,
    options: DesignOptions,
    u_max: Fraction,
    units: Units,
    transition_codes: int,
    allowance: Allowance,
) -> SideLaw:
    """Choose the coefficients and tables of one side, and prove its certificate."""
    signals = options.signals
    if "branch-order" not in options.accept:
        refuse_crossed_branches(side)
    guarded = GuardedSide.of(side, options.guard, options, u_max, allowance)
    certified, ceiling = guarded.curve, guarded.ceiling
    opening = opening_offset(side, options) if transition_codes else None
    reference = Fraction(repr(side.reference.dp_MPa))
    tested, goes_on = ceiling.certified, certified.above is not None
    _refuse_no_offset(ceiling.limit[: tested.stop] if goes_on else ceiling.limit, options)
    top = (opening or certified).at(reference)
    if opening is None and options.machine:
        top = left_by_machine(top, ceiling, allowance, reference, u_max)
    u_min0 = offset_at_reference(top / u_max, signals, units.coefficient)
    above_one = side.trend == "increasing" or options.below_dp0 == "extend"
    table = partial(choose_beta_table, u_min0=u_min0, trend=side.trend, denominator=units.beta, above_one=above_one)
    beta = table(ceiling, above=options.above if goes_on else None)
    transition_beta = None
    if opening is not None:
        under = opening_ceiling(opening, certified, tested, options.above, allowance, u_max)
        upper = table(under, above="lower" if goes_on else None)
        transition_beta = tuple(map(max, upper, beta))
    certificate, budget = guarded.certify(u_min0, beta, units.beta)
    return SideLaw(
        drive_range_over_u_max=over(travel(side, u_max, top), "nearest", units.coefficient),
        u_min0_over_u_max=u_min0,
        beta=beta,
        transition_beta=transition_beta,
        certificate=certificate,
        budget=budget,
    )


def _refuse_no_offset(limits: ExactRow, options: DesignOptions) -> None:
    """Refuse limits of the offset, over u_max, that leave none at some pressure drop."""
    if limits.least() > 0:
        return
    raise InputError(
        "dither and declared machine leave no offset under the certified one; make the dither smaller, declare "
        "narrower ranges, or control the current"
        if options.machine
        else "the dither's peak leaves no offset under the certified one; make it smaller"
    )


def offset_at_reference(top: Fraction, signals: Signals, coefficient: int) -> Fraction:
    """Return u_min0 over u_max: half a count below, for the offset's compare value may be rounded up."""
    u_min0 = over(top - Fraction(1, 2 * signals.compare_max), "down", coefficient)
    if u_min0 <= 0:
        raise InputError(f"u_min0 is {float(top):.2%} of full command, less than one count of the PWM: no dead zone")
    return u_min0


def travel(side: SideModel, u_max: Fraction, offset_V: Fraction) -> Fraction:
    """Return k x_max/u_max for a law whose offset is u_min0: from there to the command of full flow on opening.

    Identification gives k x_max from the knee on. The law starts lower, at the guarded offset; without the difference
    full command would not reach full flow (u_O(u_max) = u_max exactly if k x_max = u_max - u_min0). Nor would it where
    the flow bends before its end, or the stop is met at some pressure drops only: the recorded flow says how far to go.
    """
    reference = min(side.tests, key=lambda test: abs((test.dp_MPa or 0.0) - (side.reference.dp_MPa or 0.0)))
    knee = reference.u_knee_rising_V if reference.u_knee_rising_V is not None else reference.u_knee_falling_V
    below_knee = max(Fraction(repr(knee)) - offset_V, Fraction(0))
    travel = Fraction(repr(side.k_x_max_over_u_max)) + below_knee / u_max
    recorded = (test.recorded.opening for test in side.tests)
    flows_V = max(branch.command_at(FULL_FLOW * max(branch.q_L_min)) or 0.0 for branch in recorded)
    travel = max(travel, (Fraction(repr(round(flows_V, 7))) - offset_V) / u_max)
    return min(travel, 1 - offset_V / u_max)  # beyond full drive there is nothing


def left_by_machine(
    top_V: Fraction, ceiling: OffsetCeiling, allowance: Allowance, dp0_MPa: Fraction, u_max_V: Fraction
) -> Fraction:
    """Return the offset at dP0 that a declared machine leaves, V: a beta of 1 without a transition."""
    limit = ceiling.limit[round(allowance.pair.dp_code(dp0_MPa))]
    return min(top_V, (limit + Fraction(1, 2 * allowance.signals.compare_max)) * u_max_V)


def over(value: Fraction, rounding: str, unit: int) -> Fraction:
    """Return `value` as an integer over `unit`, rounded to nearest or down."""
    scaled = value * unit
    numerator = scaled.numerator // scaled.denominator if rounding == "down" else round(scaled)
    return Fraction(numerator, unit)
