"""`design`: a `ValveModel` and an engineer's choices in, a proved `Compensator` out.

Where it is asked for, the drive has an inverse play operator. A valve with hysteresis is a play in its input: on the
way back it waits until the drive has fallen by the play's width. So on a falling command the drive goes ahead by that
width, and the spool follows at once. What is taken begins with the transition and is whole at its end: zero command has
the certified offset, whatever the width. Over the command the width is the recorded one: towards full command, where
every ramp turns, the branches of real valves come together.
"""

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np

from dzdesign.core.artefact_types import THIS_TOOL, SourceFile, to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import shown_in
from dzdesign.derivation.law import Law, law
from dzdesign.derivation.laws import LAW_NAMES
from dzdesign.derivation.presentation.formulas import to_text
from dzdesign.design.beta_table import STEP_CODES
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs import costs_of
from dzdesign.design.costs_at_tests import branch_commands, corners_of
from dzdesign.design.machine import allowance_of, check_bench_current, dither_reserve
from dzdesign.design.options import DesignOptions
from dzdesign.design.pressure_inputs import ACCEPTED, refuse_hidden_failures, with_pressure_inputs
from dzdesign.design.side_design import finest_that_fit, finest_units, refuse_two_signs, side_law
from dzdesign.design.side_law import Sides
from dzdesign.design.signals import Signals
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.reading_flow import default_reading_flow

#: Share of the sensor's span by which the difference may read negative before it counts as a failed sensor.
REVERSE_SHARE = Fraction(1, 100)
#: Codes of travel over which the drive goes over to the other branch, behind those that noise may make.
PLAY_CODES = 8
#: Most segments of the width over the command.
SEGMENTS = 16
#: Share of command over whose end the width is carried on to full command.
LAST = 0.05


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
    with shown_in(valve.recorded_units):
        return _designed(valve, options or DesignOptions())


def _designed(valve: ValveModel, options: DesignOptions) -> Compensator:
    law(options.law)
    if len(options.signals.signs) == 2:
        refuse_two_signs(valve, options.guard)
    options = with_pressure_inputs(valve, options)
    options.check_channels()
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
        side = valve.side(sign)
        allowance = allowance_of(signals, options.machine, sign=sign, dither_counts=reserve)
        laws[sign] = side_law(side, options, u_max, units, transition_codes, allowance)
    compensator = Compensator(
        tool=THIS_TOOL,
        made_from=(SourceFile(source=ValveModel.FILE_NAME, sha256=sha256_of(to_json_bytes(valve))),),
        target=options.target,
        options=options.texts,
        law=options.law,
        below_dp0=options.below_dp0,
        above=options.above,
        signals=signals,
        u_max_V=u_max,
        sides=Sides.of(valve, laws),
        beta_denominator=units.beta,
        beta_step_codes=STEP_CODES,
        reverse_codes=_reverse_codes(signals),
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
    if options.play:
        compensator = with_play(compensator, options.dither_text)
    return replace(compensator, costs=costs_of(compensator))


def _reverse_codes(signals: Signals) -> int:
    """Return a share of the fewest codes that the sensor ahead of a side has for its span."""
    ahead = (signals.pair(sign).ahead for sign in signals.signs)
    return int(REVERSE_SHARE * min(sensor.full_code - sensor.zero_code for sensor in ahead))


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
    sides = [valve.side(sign) for sign in options.signals.signs]
    if options.transition is None and not options.play and any(side.opening_curve is None for side in sides):
        return 0
    codes = options.transition_codes()
    if options.transition is None:
        while codes > options.error.least_transition and not finest_that_fit(options.signals, codes):
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


def with_play(compensator: Compensator, dither: str) -> Compensator:
    """Return a compensator with a transition whose drive takes out the recorded hysteresis of its valve.

    A dither, in words, that was not there as the ramps were recorded takes out the same hysteresis: it is refused.
    """
    signals = compensator.signals
    if compensator.drive_functions.dither_counts and compensator.valve.dither is None:
        raise InputError(
            "--hysteresis play takes out the recorded hysteresis, and --dither most of the same once more; give one of "
            f'them, or record ramps with that dither: identify --dithered "{dither}"'
        )
    longest = max(signals.command.span(sign) for sign in signals.signs)
    step = 1 << (-(-(longest + 1) // SEGMENTS) - 1).bit_length()
    nodes = [play_nodes(compensator, sign, step) if sign in signals.signs else () for sign in (1, -1)]
    if not all(any(nodes[0 if sign > 0 else 1]) for sign in signals.signs):
        raise InputError(
            "the opening threshold does not lie above the certified offset at every pressure, so no hysteresis can be "
            "taken out; leave out --hysteresis play"
        )
    functions = replace(
        compensator.drive_functions,
        play_counts=(nodes[0], nodes[1]),
        play_step_codes=step,
        play_codes=PLAY_CODES,
        play_noise_codes=compensator.command_error.noise_codes,
    )
    return replace(compensator, drive_functions=functions)


def play_nodes(compensator: Compensator, sign: int, step: int) -> tuple[int, ...]:
    """Return the hysteresis, the median a side's tests, at commands `step` codes apart, counts.

    It is never wider than what the transition spans: that would drive a falling command below the certified offset.
    """
    curves = [curve for curve in _recorded_widths(compensator, sign) if len(curve) > 1]
    if not curves:
        raise InputError(
            "--hysteresis play needs the valve's hysteresis, of which no test has both branches; record the falling "
            "branch too, or leave it out"
        )
    span = compensator.signals.command.span(sign)
    at = np.arange(span // step + 2) * step / span
    widths = np.median([_width_at(at, np.array(curve)) for curve in curves], axis=0)
    counts = np.round(widths / float(compensator.u_max_V) * compensator.signals.compare_max)
    return tuple(int(value) for value in np.clip(counts, 0, narrowest_transition(compensator, sign)))


def _recorded_widths(compensator: Compensator, sign: int) -> Iterator[list[tuple[float, float]]]:
    """Yield for each test the command of the law, a share, and how far the recorded branches lie apart there, V."""
    for test in compensator.valve.side(sign).tests:
        if test.u_knee_rising_V is None or test.u_knee_falling_V is None:
            continue
        corners = corners_of(compensator, compensator.signals.pair(sign).code_at(test.dp_MPa), sign)
        u_max = float(compensator.u_max_V)
        found = [(corners.command_at(up / u_max), up - down) for up, down in branch_commands(test)]
        rising = [place for place, (left, right) in enumerate(pairwise(found)) if left[0] < right[0] < 1]
        yield [found[place] for place in rising]


def _width_at(share: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Return the width at commands from its (share, V): held below them, and carried on above as over their end."""
    known, width = curve.T
    near = known >= known[-1] - LAST
    slope = np.polyfit(known[near], width[near], 1)[0] if near.sum() > 1 else 0.0
    beyond = np.maximum(width[-1] + slope * (share - known[-1]), 0.0)
    widths: np.ndarray = np.where(share > known[-1], beyond, np.interp(share, known, width))
    return widths


def narrowest_transition(compensator: Compensator, sign: int) -> int:
    """Return the least distance of the opening law from the certified offset, counts: all pressures, rounded down."""
    law = compensator.side(sign)
    gap = min(upper - lower for upper, lower in zip(law.law_beta, law.beta, strict=True))
    return int(Fraction(gap, compensator.beta_denominator) * law.u_min0_over_u_max * compensator.signals.compare_max)
