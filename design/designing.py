"""`design`: a `ValveModel` and an engineer's choices in, a proved `Compensator` out."""

from dataclasses import dataclass, field
from fractions import Fraction

from dzdesign.core.artefacts import sha256_of, to_json
from dzdesign.core.errors import InputError, RequirementError, nearest
from dzdesign.derivation.law import law
from dzdesign.design.beta_table import (
    DENOMINATOR,
    STEP_CODES,
    OffsetCeiling,
    choose_beta_table,
    offset_ceiling,
)
from dzdesign.design.compensator import Certificate, Compensator
from dzdesign.design.signals import Signals
from dzdesign.identify.guard_curve import GUARDS, GuardCurve
from dzdesign.identify.model import SideModel, ValveModel
from dzdesign.identify.valve_file import valve_from_document

#: k x_max/u_max and u_min0/u_max are integers over this: finer than half a PWM count of 60 000.
COEFFICIENT_DENOMINATOR = 1 << 16
#: Share of the sensor's span by which the difference may read negative before it counts as a failed sensor.
REVERSE_SHARE = Fraction(1, 100)


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignOptions:
    """Choices of the engineer.

    Attributes
    ----------
    law_name : str
        ``paper`` (Eq. 18) or ``target`` (meets Eq. 16).
    signals : Signals
        Scalings of the converter and the PWM.
    guard : {"closing", "mean", "opening"}
        The threshold that the certificate must protect. Zero command comes after closing, so a valve of which no
        falling branch was recorded is refused unless "opening" is asked for; under "mean" and "opening" the valve may
        pass flow at zero command after closing, and what remains of the dead zone on opening is smaller.
    """

    law_name: str = "paper"
    signals: Signals = field(default_factory=Signals)
    guard: str = "closing"

    def __post_init__(self) -> None:
        if self.guard not in GUARDS:
            raise InputError(
                f"the guard is '{self.guard}'{nearest(self.guard, GUARDS)}, "
                f"expected {', '.join(GUARDS[:-1])} or {GUARDS[-1]}"
            )


def design(valve: ValveModel, options: DesignOptions | None = None, valve_bytes: bytes | None = None) -> Compensator:
    """Design the compensator of a valve, every coefficient rational and the certificate proved on them.

    Parameters
    ----------
    valve : ValveModel
        From `dzdesign.identify.identify` or valve.json.
    options : DesignOptions, optional
        Choices of the engineer.
    valve_bytes : bytes, optional
        The file the valve was read from, for its hash; without it the hash is of the document as it would be written.

    Raises
    ------
    InputError
        If the law can't be used for this valve.
    RequirementError
        If a proof fails.
    """
    options = options or DesignOptions()
    document = valve_bytes.decode() if valve_bytes is not None else to_json(valve.to_document())
    # The file's rounded numbers, so that the same valve gives the same firmware by whichever way it comes here.
    valve = valve_from_document(document.encode(), "valve.json")
    signals, side = options.signals, valve.positive
    chosen = law(options.law_name)
    if not side.beta_dp_MPa:
        raise InputError(
            "the valve was identified without a pressure drop, so no offset can be certified at any pressure; "
            "record the ramp test again with a column of dP (or pA and pB)"
        )
    curve = _curve_of(side, options.guard)
    u_max = Fraction(repr(valve.u_max_V))
    kappa = _over(_travel(side, curve, u_max), "nearest")
    # Half a count less, because the compare value of the offset may be rounded up.
    u_min0 = _over(Fraction(repr(curve.u_min0_V)) / u_max - Fraction(1, 2 * signals.compare_max), "down")
    if u_min0 <= 0:
        raise InputError(f"u_min0 is {curve.u_min0_V:.4f} V, less than one count of the PWM: no dead zone")
    ceiling = offset_ceiling(side, options.guard, signals, u_max)
    table = choose_beta_table(ceiling, u_min0, side.trend, signals.pressure_code_max)
    compensator = Compensator(
        law_name=chosen.name,
        signals=signals,
        u_max_V=u_max,
        k_x_max_over_u_max=kappa,
        u_min0_over_u_max=u_min0,
        beta_numerators=table,
        beta_denominator=DENOMINATOR,
        beta_step_codes=STEP_CODES,
        reverse_codes=int(REVERSE_SHARE * signals.pressure_code_max),
        certificate=Certificate(
            confidence=side.confidence,
            guard=options.guard,
            level_L_min=side.level_L_min,
            dp_MPa=(Fraction(repr(side.beta_dp_MPa[0])), Fraction(repr(side.beta_dp_MPa[-1]))),
            smallest_margin_V=_smallest_margin(ceiling, table, u_min0) * u_max,
        ),
        costs=(),
        valve_document=document,
        valve_sha256=sha256_of(document.encode()),
    )
    _prove_monotone(compensator)
    return _with_costs(compensator, side)


def _curve_of(side: SideModel, guard: str) -> GuardCurve:
    """Return the curve that certifies a threshold; refuse one that valve.json does not have, and say why."""
    if guard in side.guards:
        return side.guards[guard]
    has_rising, has_falling = side.tests[0].rising is not None, side.tests[0].falling is not None
    if guard != "opening" and not has_falling:
        remedy = "record the falling branch too, or accept flow at zero command after closing with --guard opening"
    elif guard != "closing" and not has_rising:
        remedy = "record the rising branch too, or take --guard closing, the safer one"
    else:
        remedy = (
            "make valve.json again with `dzdesign identify`; if it is still missing, no offset lies under that "
            "threshold's bounds: take one that is there"
        )
    raise InputError(
        f"the ramp tests bound the {' and the '.join(side.guards)} threshold, but the {guard} one is to be guarded; "
        + remedy
    )


def _travel(side: SideModel, curve: GuardCurve, u_max: Fraction) -> Fraction:
    """Return k x_max/u_max for a law whose offset is u_min0: from there to the command of full flow on opening.

    Identification gives k x_max from the knee on. The law starts lower, at the guarded offset; without the difference
    full command would not reach full flow (u_O(u_max) = u_max exactly if k x_max = u_max - u_min0).
    """
    reference = min(side.tests, key=lambda test: abs(test.dp_MPa - side.reference_dp_MPa))
    knee = reference.u_knee_rising_V if reference.u_knee_rising_V is not None else reference.u_knee_falling_V
    below_knee = max(Fraction(repr(knee)) - Fraction(repr(curve.u_min0_V)), Fraction(0))
    travel = Fraction(repr(side.k_x_max_over_u_max)) + below_knee / u_max
    return min(travel, 1 - Fraction(repr(curve.u_min0_V)) / u_max)  # beyond full drive there is nothing


def _over(value: Fraction, rounding: str) -> Fraction:
    """Return `value` as an integer over `COEFFICIENT_DENOMINATOR`, rounded to nearest or down."""
    scaled = value * COEFFICIENT_DENOMINATOR
    numerator = scaled.numerator // scaled.denominator if rounding == "down" else round(scaled)
    return Fraction(numerator, COEFFICIENT_DENOMINATOR)


def _smallest_margin(ceiling: OffsetCeiling, table: tuple[int, ...], u_min0: Fraction) -> Fraction:
    """Return the least distance over u_max between ceiling and offset on the certified codes; never negative."""
    scale = DENOMINATOR * STEP_CODES
    margins = []
    for code in ceiling.certified or range(len(ceiling.limit)):
        index, share = divmod(code, STEP_CODES)
        beta = Fraction(table[index] * (STEP_CODES - share) + table[index + 1] * share, scale)
        margins.append(ceiling.limit[code] - beta * u_min0)
    smallest = min(margins)
    if smallest < 0:
        raise RequirementError(f"the offset exceeds the certified one by {float(-smallest):.2e} of u_max")
    return smallest


def _prove_monotone(compensator: Compensator) -> None:
    """Prove that more command gives more drive, at every pressure: the gain is affine in beta, so its ends decide."""
    chosen = law(compensator.law_name)
    betas = (
        Fraction(min(compensator.beta_numerators), DENOMINATOR),
        Fraction(max(compensator.beta_numerators), DENOMINATOR),
    )
    if min(chosen.evaluate_gain(beta, compensator.k_x_max_over_u_max) for beta in betas) <= 0:
        raise InputError(
            f"law '{chosen.name}' would fall with rising command: beta (1 - k x_max/u_max) must stay below 1, but "
            f"k x_max/u_max = {float(compensator.k_x_max_over_u_max):.3f}; use --law target"
        )


def _with_costs(compensator: Compensator, side: SideModel) -> Compensator:
    """Add what the choices cost: the residual dead zone per test and the drive at full command."""
    from dataclasses import replace

    signals, u_max = compensator.signals, float(compensator.u_max_V)
    lines = []
    for test in side.tests:
        code = round(signals.dp_code(Fraction(repr(test.dp_MPa))))
        offset = float(compensator.drive(0, code))
        gain = float(compensator.drive(signals.command_code_max, code)) - offset
        parts = [f"{test.dp_MPa:.2f} MPa: offset {offset * u_max:.3f} V"]
        for name, knee in (("opening", test.u_knee_rising_V), ("closing", test.u_knee_falling_V)):
            if knee is not None and knee >= offset * u_max:
                parts.append(f"dead zone that remains on {name} {(knee / u_max - offset) / gain:.2%} of command (knee)")
            elif knee is not None:
                above = offset * u_max - knee
                parts.append(f"flow at zero command on {name}: the offset lies {above:.3f} V above the knee")
        parts.append(f"drive at full command {offset + gain:.2%}")
        lines.append(", ".join(parts))
    low, high = (float(end) for end in compensator.certificate.dp_MPa)
    if side.trend == "increasing":
        lines.append(
            "the threshold grows with the pressure drop, so a pressure signal that reads too high raises the offset: a "
            "broken wire of sensor B is not recognised; monitor the sensors outside the compensator"
        )
    lines.append(
        f"outside {low:.2f} to {high:.2f} MPa the nearest tested beta is held and nothing is certified; "
        f"a pressure difference below -{compensator.reverse_codes} codes is taken as a failed sensor: smallest beta"
    )
    return replace(compensator, costs=tuple(lines))
