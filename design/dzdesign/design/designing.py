"""`design`: a `ValveModel` and an engineer's choices in, a proved `Compensator` out."""

from dataclasses import replace
from fractions import Fraction

from dzdesign.core.artefact_types import THIS_TOOL, SourceFile
from dzdesign.core.errors import InputError
from dzdesign.core.worded import errors_in
from dzdesign.derivation.law import Law, law
from dzdesign.derivation.laws import LAW_NAMES
from dzdesign.derivation.presentation.formulas import to_text
from dzdesign.design.compensator import Compensator, sha256_of_valve
from dzdesign.design.costs import costs_of
from dzdesign.design.machine.allowance import allowance_of, check_bench_current, dither_reserve
from dzdesign.design.offset.beta_table import STEP_CODES
from dzdesign.design.options import DesignOptions
from dzdesign.design.play import with_play
from dzdesign.design.pressure_inputs import ACCEPTED, refuse_hidden_failures, with_negative_drop
from dzdesign.design.side_design import (
    finest_units,
    fits,
    refuse_two_signs,
    side_law,
)
from dzdesign.design.side_law import Sides
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.reading_flow import default_reading_flow

#: Share of the sensor's span by which the difference may read negative before it counts as a failed sensor.
REVERSE_SHARE = Fraction(1, 100)


def design(valve: ValveModel, options: DesignOptions | None = None) -> Compensator:
    """Design the compensator of a valve with rational coefficients, and prove the certificate on them.

    Parameters
    ----------
    valve : ValveModel
        From `dzdesign.identify.identify` or valve.json.
    options : DesignOptions, optional
        Choices of the engineer.

    Raises
    ------
    InputError
        If the law can't be used for this valve.
    RequirementError
        If a proof fails.
    """
    with errors_in(valve.recorded_units):
        return _designed(valve, options or DesignOptions())


def _designed(valve: ValveModel, options: DesignOptions) -> Compensator:
    law(options.law)
    if len(options.signals.signs) == 2:
        refuse_two_signs(valve, options.guard)
        options = with_negative_drop(valve, options)
    signals = options.signals
    u_max = _full_command(valve, options)
    if options.current is not None and (machine := options.machine) is not None:
        check_bench_current(valve, options.current.circuit.rated_A, machine.bench_full_A)
    transition_codes = _transition_codes(valve, options)
    units = finest_units(signals, transition_codes)
    functions = options.drive_functions(transition_codes)
    dither = functions.dither(signals)
    dither.check(valve.dither)
    current_drive = options.current_drive()
    reserve, laws = dither_reserve(dither, valve.dither, options.machine, current_drive), {}
    for sign in signals.signs:
        side = valve.positive if sign > 0 else valve.sides["negative"]
        allowance = allowance_of(signals, options.machine, sign=sign, dither_counts=reserve)
        laws[sign] = side_law(side, options, u_max, units, transition_codes, allowance)
    request = options.request
    compensator = Compensator(
        tool=THIS_TOOL,
        made_from=(SourceFile(source=ValveModel.FILE_NAME, sha256=sha256_of_valve(valve)),),
        target=request.target if request else None,
        options=request.options if request else None,
        law=options.law,
        below_dp0=options.below_dp0,
        above=options.above,
        signals=signals,
        u_max_V=u_max,
        sides=Sides(positive=laws[1], negative=laws.get(-1)),
        beta_denominator=units.beta,
        beta_step_codes=STEP_CODES,
        reverse_codes=int(REVERSE_SHARE * (signals.pressure_a.full_code - signals.pressure_a.zero_code)),
        transition_codes=transition_codes,
        reading_flow_L_min=options.reading_flow_L_min or default_reading_flow(valve),
        zero_band_codes=options.error.zero_band_codes if transition_codes else 0,
        command_error=options.error,
        drive_functions=functions,
        current_drive=current_drive,
        machine=options.machine,
        costs=(),
        valve=valve,
    )
    for sign in signals.signs:
        prove_monotone(compensator, sign)
    if ACCEPTED not in options.accept:
        refuse_hidden_failures(compensator)
    compensator = _with_play(compensator, options)
    return replace(compensator, costs=costs_of(compensator))


def _with_play(compensator: Compensator, options: DesignOptions) -> Compensator:
    """Add the inverse play if it is asked for; not where a dither takes the same hysteresis out."""
    if not options.play:
        return compensator
    if compensator.drive_functions.dither_counts and compensator.valve.dither is None:
        raise InputError(
            "--hysteresis play takes out the recorded hysteresis, and --dither most of the same once more; give one of "
            f'them, or record ramps with that dither: identify --dithered "{options.dither_text}"'
        )
    return with_play(compensator)


def _full_command(valve: ValveModel, options: DesignOptions) -> Fraction:
    """Return the full command that the valve was identified with, V, which a signal that states one must end at."""
    u_max = Fraction(repr(valve.u_max_V))
    if options.full_command_V not in (None, u_max):
        raise InputError(
            f"the command signal's upper end stands for {float(options.full_command_V or 0):g} V, but the valve was "
            f"identified with a full command of {valve.u_max_V:g} V; write the signal's range up to that"
        )
    return u_max


def _transition_codes(valve: ValveModel, options: DesignOptions) -> int:
    """Return the codes of the transition; where nothing is said, none for a valve whose opening was not recorded."""
    sides = [valve.sides[SIDE_NAMES[sign]] for sign in options.signals.signs if SIDE_NAMES[sign] in valve.sides]
    if options.transition is None and not options.play and any(side.opening_curve is None for side in sides):
        return 0
    codes = options.transition_codes()
    while options.transition is None and codes > options.error.least_transition and not fits(options.signals, codes):
        codes //= 2
    return codes


def prove_monotone(compensator: Compensator, sign: int) -> None:
    """Prove that more command gives more drive, at every pressure: the gain is affine in beta, so its ends decide.

    Inside the transition the drive rises faster still: the law is given a command that runs ahead there, and what the
    transition takes away falls. In the zero band it stands still.
    """
    chosen, side = law(compensator.law), compensator.side(sign)
    numerators = side.law_beta
    betas = [Fraction(end, compensator.beta_denominator) for end in (min(numerators), max(numerators))]

    def rises(candidate: Law) -> bool:
        return all(candidate.evaluate_gain(beta, side.drive_range_over_u_max) > 0 for beta in betas)

    if not rises(chosen):
        others = [name for name in LAW_NAMES if rises(law(name))]
        raise InputError(
            f"law '{chosen.name}' would fall with rising command: it rises if {to_text(chosen.rises_if)}, but k x_max/"
            f"u_max = {float(side.drive_range_over_u_max):.3f} at beta = {float(max(betas)):.3f}"
            + (f"; use --law {' or '.join(others)}" if others else "")
        )
