"""Design again: does a compensator follow from its valve and options, and what would other choices leave?

An edited file would otherwise change the firmware. The other choices are the treatments of the valve's hysteresis: the
table and advice of `dzdesign design`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from msgspec import UnsetType

from dzdesign.core.artefact_reading import differences
from dzdesign.core.errors import InputError, RequirementError, quoted
from dzdesign.core.recorded_units import shown_in
from dzdesign.design.certificate import with_certificates
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs_at_tests import (
    between_tests,
    branch_commands,
    corners_of,
    read_dead_zone,
    remaining_dead_zone,
)
from dzdesign.design.designing import design
from dzdesign.design.fixed_offset import fixed_offset, jump, zero_band
from dzdesign.design.lot_setting import prove_lot
from dzdesign.design.lot_valves import LotSide
from dzdesign.design.options import options_of
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.ramp_result import TestResult

#: Coarsest unit of the law's coefficients, see `dzdesign.design.side_design`.
COARSEST = Fraction(1, 2**12)
#: The choices, simplest first: what is given to `design` beside the options that were.
WAYS: Mapping[str, Mapping[str, str]] = {
    "--transition off": {"transition": "off", "hysteresis": "keep"},
    "--transition auto": {"transition": "auto", "hysteresis": "keep"},
    "--hysteresis play": {"transition": "auto", "hysteresis": "play"},
}
#: What an amplifier without pressure sensors does: the price of having none.
FIXED = "fixed offset, no pressure sensors"
#: Share of command by which a less simple choice must leave less to be recommended. A play must be right to it.
WORTH = 0.002
#: Standard errors by which the change of the hysteresis with the rate may be larger.
RATE_ERRORS = 2.0


def refuse_without_options(compensator: Compensator, source: str) -> None:
    """Refuse a file that does not say what it was designed with: nothing in it could be derived again."""
    if compensator.target is None:
        raise InputError(
            f"'{source}' does not say for which target and with which options it was designed ('target' and 'options' "
            f"are null), so no number in it can be derived again; {Compensator.REMEDY}"
        )


def prove_derived(compensator: Compensator) -> None:
    """Design the compensator again from the valve and the options in it; refuse the first key that does not follow.

    Of a lot's setting the sides are not those of the one valve in the file: only their certificates and budgets follow
    from it, and it is proved that the setting over-compensates no valve. Of a file that does not say what was asked for
    nothing can be told.
    """
    if compensator.target is None or compensator.options is None:
        return
    try:
        redesigned = design(compensator.valve, options_of(compensator.options, compensator.target))
    except InputError as error:
        raise InputError(f"its valve can't be designed with its options: {error}; {Compensator.REMEDY}") from error
    if compensator.lot:
        try:
            with shown_in(compensator.valve.recorded_units):
                sides = with_certificates(compensator).sides
                prove_lot(compensator)
        except RequirementError as error:
            raise InputError(f"{error}; make it again with `dzdesign batch`") from error
        _prove_lot_setting(compensator, redesigned)
        redesigned = replace(redesigned, sides=sides, lot=compensator.lot, costs=compensator.costs)
    # The position loop is said beside the law, which does not rest on it.
    redesigned = replace(redesigned, tool=compensator.tool, position_loop=compensator.position_loop)
    for found in differences(compensator, redesigned):
        raise InputError(
            f"'{found.place}' is {_words(found.stated)}, but {_words(found.follows)} follows from its valve and its "
            f"options; {Compensator.REMEDY}"
        )


def _prove_lot_setting(compensator: Compensator, redesigned: Compensator) -> None:
    """Bound what follows from all valves by what follows from the one in the file: no larger offset, all of its travel.

    Full command must not ask for more than full drive either. That valve is one of the lot, with the bounds it has.
    """
    of_carrier = [each for each in compensator.lot if each.valve_sha256 == compensator.valve_json_sha256]
    for sign in compensator.signals.signs:
        common, single, name = compensator.side(sign), redesigned.side(sign), compensator.valve.side_name(sign)
        drive_range, offset = common.drive_range_over_u_max, common.u_min0_over_u_max
        for place, value, low, high in (
            ("u_min0_over_u_max", offset, Fraction(0), single.u_min0_over_u_max),
            ("drive_range_over_u_max", drive_range, single.drive_range_over_u_max - COARSEST, 1 - offset + COARSEST),
        ):
            if not low <= value <= high:
                raise InputError(
                    f"'sides.{name}.{place}' is {float(value):.6f}, expected {float(low):.6f} to {float(high):.6f} of "
                    f"a setting for this valve among others; {Compensator.REMEDY}"
                )
        bounds = LotSide.of(compensator.valve.sides[name], common.certificate.guard)
        if bounds not in [each.side(sign) for each in of_carrier]:
            raise InputError(
                f"the lot has no valve with the hash and the {name} bounds of the valve in the file; make it again "
                "with `dzdesign batch`"
            )


def _words(value: object) -> str:
    if isinstance(value, Fraction):
        return f"{float(value):.6f}"
    return "nothing" if value is None else quoted(value)


@dataclass(frozen=True, slots=True, kw_only=True)
class HysteresisChoice:
    """One choice, the worst of all tests and both sides, and at the onset between the tests too; shares of command."""

    given: str
    #: None where no test has what it needs, or the design is refused: then `refused` says why.
    onset: float | None = None
    reading: float | None = None
    #: Of the compensated branches over the command, from 5 % of the largest flow on: on average, and at most.
    hysteresis: float | None = None
    largest: float | None = None
    refused: str = ""
    recommended: bool = False
    #: Why the recordings do not show that it works; empty where they do.
    possible: str = ""

    @property
    def judged(self) -> str:
        """Return whether it is recommended, or possible; nothing of another."""
        return "recommended" if self.recommended else "possible" if self.possible else ""

    @property
    def left(self) -> float:
        """Return what it leaves in all: dead zone on opening and hysteresis, the mean of which counts.

        Its largest is where a ramp stuck, or where the flow hardly grows any more.
        """
        return 1.0 if self.onset is None else self.onset + (self.hysteresis or 0.0)


def hysteresis_choices(compensator: Compensator) -> tuple[HysteresisChoice, ...]:
    """Return the choices for a compensator's valve with its other options; none where they are not known.

    One with a dither has its thresholds moved by it, of which ramps without a dither say nothing: there is no table.
    Of ramps that were recorded with it there is: a play takes out what hysteresis is left under the dither.
    """
    if compensator.target is None or compensator.options is None or compensator.lot:
        return ()
    dithered = compensator.drive_functions.dither_counts > 0
    if dithered and compensator.valve.dither is None:
        return ()
    found = []
    for given, texts in WAYS.items():
        given = f'--dither "{compensator.options["dither"]}" {given}' if dithered else given
        try:
            made = design(compensator.valve, options_of({**compensator.options, **texts}, compensator.target))
        except (InputError, RequirementError) as error:
            found.append(HysteresisChoice(given=given, refused=str(error)))
            continue
        if texts["transition"] == "auto" and not made.transition_codes:
            found.append(HysteresisChoice(given=given, refused="the opening branch was not recorded"))
        else:
            found.append(_judged(given, made))
    if not found[-1].refused:
        found[-1] = replace(found[-1], possible=widths_unknown(compensator.valve))
    best = found[0]
    for other in found[1:]:
        if not other.possible and other.left < best.left - WORTH:
            best = other
    return tuple(replace(each, recommended=each is best and each.onset is not None) for each in found)


def widths_unknown(valve: ValveModel) -> str:
    """Say why the hysteresis of slower ramps is not known to be the recorded one; nothing where two rates show it.

    A play inverts the recorded width. A valve whose hysteresis grows with the rate has less of it on a machine that
    moves more slowly than the bench: the play then takes out more than there is.
    """
    left, error, units = valve.meter.left_by_rates_s, valve.meter.left_by_rates_se_s, valve.recorded_units
    if isinstance(left, UnsetType) or isinstance(error, UnsetType):
        if valve.meter.lag_is == "identified":
            return "the ramps of two rates already serve to find the meter's lag; declare it with identify --meter-lag"
        return "ramps of a second rate, half as fast or slower, would show whether the hysteresis depends on the rate"
    tests = [test for side in valve.sides.values() for test in side.tests]
    rate = max((test.conditions.rate_V_s or 0.0 for test in tests if test.conditions), default=0.0)
    # At half the rate the width, which changes by twice the lag that is left, is narrower by the rate times that lag.
    change_V, error_V = abs(left) * rate, RATE_ERRORS * error * rate
    if change_V + error_V <= WORTH * valve.u_max_V:
        return ""
    found, uncertain = (units.text(1e3 * value, ".2g mV") for value in (change_V, error_V))
    way = "narrower" if left > 0 else "wider"
    return f"at half the ramps' rate the hysteresis is {way} by {found} ± {uncertain}, and a play has one width"


def without_sensors(compensator: Compensator) -> HysteresisChoice:
    """Return what the largest certified offset leaves that is the same at every pressure drop: that of an amplifier."""
    onsets: list[float] = []
    read: list[float] = []
    try:
        for sign in compensator.signals.signs:
            offset = fixed_offset(compensator, sign).share
            drives = jump(offset, Fraction(1), zero_band(compensator, sign))
            for test in compensator.valve.side(sign).tests:
                rising = test.recorded.rising
                at_reading = rising.command_at(compensator.reading_flow_L_min) if rising else None
                for threshold_V, left in ((test.u_knee_rising_V, onsets), (at_reading, read)):
                    if threshold_V is not None:
                        at = drives.command_at(Fraction(repr(float(threshold_V))) / compensator.u_max_V)
                        left.append(1.0 if at is None else float(at))
    except InputError as error:
        return HysteresisChoice(given=FIXED, refused=str(error))
    reading = max(read) if read and len(read) == len(onsets) else None
    return HysteresisChoice(given=FIXED, onset=max(onsets, default=None), reading=reading)


def _judged(given: str, made: Compensator) -> HysteresisChoice:
    tests = [(test, sign) for sign in made.signals.signs for test in made.valve.side(sign).tests]
    between = [between_tests(made, sign) for sign in made.signals.signs]
    onsets = [left["opening"] for test, sign in tests if "opening" in (left := remaining_dead_zone(made, test, sign))]
    read = [left["opening"] for test, sign in tests if "opening" in (left := read_dead_zone(made, test, sign))]
    widths = [np.abs(found) for test, sign in tests if (found := hysteresis_left(made, test, sign)).size]
    travel = max((_travel(made, sign) for sign in made.signals.signs), default=0.0)
    return HysteresisChoice(
        given=given,
        onset=max(*onsets, *between) if onsets else None,
        # A test that never comes to that flow is no better than the others.
        reading=max(read, default=None) if len(read) == len(onsets) else None,
        hysteresis=max(float(np.concatenate(widths).mean()), travel) if widths else None,
        largest=max(*(float(found.max()) for found in widths), travel) if widths else None,
    )


def _travel(made: Compensator, sign: int) -> float:
    """Return the share of command that a play needs to turn: noise to both sides, and the way from branch to branch."""
    functions = made.drive_functions
    if not functions.has_play:
        return 0.0
    return (2 * functions.play_noise_codes + functions.play_codes) / made.signals.command.span(sign)


def hysteresis_left(made: Compensator, test: TestResult, sign: int = 1) -> np.ndarray:
    """Return how far the compensated branches lie apart over the command, shares, from 5 to 99 % of the largest flow.

    They are the recorded branches, each driven as its direction is. Above zero the falling one lies lower. Where the
    flow hardly grows any more a small difference of it is a large one of command. Nothing of a test of one branch.
    """
    if test.recorded.rising is None or test.recorded.falling is None or test.dp_MPa is None:
        return np.zeros(0)
    corners = corners_of(made, made.signals.pair(sign).code_at(test.dp_MPa), sign)
    functions, span = made.drive_functions, made.signals.command.span(sign)
    share = np.arange(span + 1) / span
    ends = ([0.0, corners.zero_band, corners.end, 1.0], [corners.offset, corners.offset, corners.at_end, corners.full])
    rising = np.interp(share, *ends)
    falling = rising
    if nodes := functions.play_counts[0 if sign > 0 else 1]:
        at = np.arange(len(nodes)) * functions.play_step_codes / span
        begun = np.clip((share - corners.zero_band) / (corners.end - corners.zero_band), 0, 1)
        falling = rising - np.interp(share, at, np.array(nodes) / made.signals.compare_max) * begun
    found, u_max = [], float(made.u_max_V)
    for up, down in branch_commands(test):
        if up / u_max < rising[-1]:
            opened, closed = np.interp(up / u_max, rising, share), np.interp(down / u_max, falling, share)
            found.append(float(opened - closed))
    return np.array(found)
