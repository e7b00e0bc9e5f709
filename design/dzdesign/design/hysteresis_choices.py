"""What each way with the valve's hysteresis leaves: the table that `dzdesign design` prints, and what it recommends."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction

from dzdesign.core.errors import InputError, RequirementError
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs_at_tests import read_dead_zone, remaining_dead_zone
from dzdesign.design.designing import design
from dzdesign.design.law_corners import corners_of
from dzdesign.design.option_texts import options_of
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.identify.valve.ramp_result import TestResult

#: The choices, simplest first: what is given to `design` beside the options that were.
WAYS: Mapping[str, Mapping[str, str]] = {
    "--transition off": {"transition": "off", "hysteresis": "keep"},
    "--transition auto": {"transition": "auto", "hysteresis": "keep"},
    "--hysteresis play": {"transition": "auto", "hysteresis": "play"},
}
#: Share of command by which a less simple choice must leave less to be recommended.
WORTH = 0.002


@dataclass(frozen=True, slots=True, kw_only=True)
class HysteresisChoice:
    """One choice, the worst of all tests and both sides; shares of full command."""

    given: str
    #: None where no test has what it needs, or the design is refused: then `refused` says why.
    onset: float | None = None
    reading: float | None = None
    hysteresis: float | None = None
    refused: str = ""
    recommended: bool = False

    @property
    def left(self) -> float:
        """Return what it leaves in all: dead zone on opening and hysteresis."""
        return 1.0 if self.onset is None else self.onset + (self.hysteresis or 0.0)


def hysteresis_choices(compensator: Compensator) -> tuple[HysteresisChoice, ...]:
    """Return the choices for a compensator's valve with its other options; none where they are not known.

    One with a dither has its thresholds moved by it, of which ramps without a dither say nothing: there is no table.
    """
    if compensator.target is None or compensator.options is None or compensator.lot:
        return ()
    if compensator.drive_functions.dither_counts:
        return ()
    found = []
    for given, texts in WAYS.items():
        try:
            made = design(compensator.valve, options_of({**compensator.options, **texts}, compensator.target))
        except (InputError, RequirementError) as error:
            found.append(HysteresisChoice(given=given, refused=str(error)))
            continue
        if texts["transition"] == "auto" and not made.transition_codes:
            found.append(HysteresisChoice(given=given, refused="the opening branch was not recorded"))
        else:
            found.append(_judged(given, made))
    best = found[0]
    for other in found[1:]:
        if other.left < best.left - WORTH:
            best = other
    return tuple(
        HysteresisChoice(
            given=each.given,
            onset=each.onset,
            reading=each.reading,
            hysteresis=each.hysteresis,
            refused=each.refused,
            recommended=each is best and each.onset is not None,
        )
        for each in found
    )


def _judged(given: str, made: Compensator) -> HysteresisChoice:
    tests = [(test, sign) for sign in made.signals.signs for test in made.valve.sides[SIDE_NAMES[sign]].tests]
    onsets = [left["opening"] for test, sign in tests if "opening" in (left := remaining_dead_zone(made, test, sign))]
    read = [left["opening"] for test, sign in tests if "opening" in (left := read_dead_zone(made, test, sign))]
    return HysteresisChoice(
        given=given,
        onset=max(onsets, default=None),
        reading=max(read, default=None),
        hysteresis=max((width for test, sign in tests for width in _hysteresis(made, test, sign)), default=None),
    )


def _hysteresis(made: Compensator, test: TestResult, sign: int) -> Iterator[float]:
    """Yield the hysteresis that a test's knees leave over the command, a share; with a play its travel beside it."""
    if test.u_knee_rising_V is None or test.u_knee_falling_V is None or test.dp_MPa is None:
        return
    functions, span = made.drive_functions, made.signals.command.span(sign)
    corners = corners_of(made, round(made.signals.dp_code(Fraction(repr(test.dp_MPa)))), sign)
    gain = (corners.full - corners.at_end) / (1 - corners.end)
    width = (test.u_knee_rising_V - test.u_knee_falling_V) / float(made.u_max_V)
    nodes = functions.play_counts[0 if sign > 0 else 1]
    taken = nodes[len(nodes) // 2] / made.signals.compare_max if nodes else 0.0
    travel = (2 * functions.play_noise_codes + functions.play_codes) / span if nodes else 0.0
    yield max(abs(width - taken) / gain, travel)
