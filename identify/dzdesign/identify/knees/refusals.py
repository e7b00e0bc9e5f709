"""Recordings that show no threshold, refused with the reason: a shut valve, a flow that jumps, a wrong pressure."""

from collections.abc import Sequence

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import worded
from dzdesign.identify.constants import L_MIN, LARGEST_DP, MPA, SMALLEST_DP, Shown
from dzdesign.identify.knees.described_tests import DescribedTest
from dzdesign.identify.knees.gated_line import PreparedBranch
from dzdesign.identify.knees.noise import robust_sigma
from dzdesign.identify.knees.profile import crossing, largest_flow
from dzdesign.identify.ramps.branches import Branch, median
from dzdesign.identify.ramps.pooling import name_of_ramp
from dzdesign.identify.ramps.splitting import Ramp
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.reading.scaling import turned
from dzdesign.identify.valve.recorded_drop import DropSign

#: A flow that rises with the command has readings between these shares of the largest where its mean is between them.
MIDDLE = (0.15, 0.45)
#: A meter's floor up to this share of the largest flow leaves a straight part to be seen.
LARGEST_FLOOR = 0.55
#: Fewest of the readings there, as a share, and width over u_max above which few readings are a coarse staircase's.
FEWEST_IN_THE_MIDDLE, WIDEST_JUMP = 0.25, 0.05
#: Shares of a ramp's largest command up to which it rests, and from which on its flow is compared; and share of the
#: largest flow that has a sign.
AT_REST, AT_TOP, SMALL_FLOW = 0.05, 0.9, 0.1
#: A flow at zero command of this share of its change is no zero error of a meter; one at full command of less than the
#: other is that of a shut valve.
OPEN_AT_REST, SHUT = 0.5, 0.2
#: A command that goes back to this share of the largest lets the flow fall; what then falls by no more than this share
#: of its span, and has one of so many times the noise, is a total; rows for which the command is back.
BACK, NEVER, TOTAL_NOISES, ROWS_BACK = 0.1, 0.02, 20.0, 10
#: So far below the lowest command of a ramp, over u_max, a knee may lie: it is extrapolated, and a warning says so.
EXTRAPOLATED = 0.1


def refuse_two_directions(tests: Sequence[RampTest]) -> None:
    """Refuse recordings of one side of which some have a pressure drop above zero and others one below it."""
    found = {test.dp_sign: test.source for test in tests if test.dp is not None and not test.dp_is_declared}
    if len(found) > 1:
        raise InputError(
            f"the pressure drop was recorded above zero in '{found[1]}' and below it in '{found[-1]}', expected one "
            "direction at all commands of one sign; correct the sign of dP, or swap pA and pB in one of them"
        )


def refuse_two_signs_of_flow(ramps: Sequence[Ramp]) -> None:
    """Refuse ramps of one side of which some have a flow above zero and others below: two sides under one command."""
    flows: dict[bool, tuple[float, Ramp]] = {}
    for ramp in ramps:
        u, q = ramp.test.u, ramp.test.q
        rest, top = q[u <= AT_REST * u.max()], q[u >= AT_TOP * u.max()]
        flow, noise = (median(top) - median(rest), robust_sigma(rest)) if rest.size and top.size else (0.0, 0.0)
        if abs(flow) > max(6 * noise, abs(flows.get(flow > 0, (0.0, ramp))[0])):
            flows[flow > 0] = flow, ramp
    if len(flows) < 2 or min(abs(flow) for flow, _ in flows.values()) < SMALL_FLOW * max(
        abs(flow) for flow, _ in flows.values()
    ):
        return
    (above, one), (below, other) = flows[True], flows[False]
    raise InputError(
        worded(
            "the flow reaches {above:+.3g L/min} in '{one}' and {below:+.3g L/min} in '{other}', at commands of one "
            "sign. These are two sides of the valve, or a meter turned round. Give the command its sign, or each side "
            "a file of its own",
            above=above / L_MIN,
            one=name_of_ramp(one),
            below=below / L_MIN,
            other=name_of_ramp(other),
        )
    )


def refuse_a_wrong_pressure(source: str, dp: float | None, sign: DropSign = 1) -> None:
    """Refuse a pressure drop (Pa; None if it is unknown) that is not a valve's: a wrong unit, or swapped ports.

    `sign` is that of the side's recorded pressure drop.
    """
    if dp is None:
        return
    if 0 < dp < SMALLEST_DP or dp > LARGEST_DP:
        raise InputError(
            f"'{source}': the pressure drop is {Shown(dp / MPA):.3g MPa}, expected {Shown(SMALLEST_DP / MPA):g #MPa} "
            f"to {Shown(LARGEST_DP / MPA):g MPa}; correct the unit in the header (mPa is a thousandth of a pascal)"
        )
    if dp <= 0 and sign < 0:
        raise InputError(
            f"'{source}': the pressure drop is {Shown(-dp / MPA):.3f MPa} as recorded, expected below zero as "
            "elsewhere in the recording at commands of that sign; correct the sign of dP, or leave out that part"
        )
    if dp <= 0:
        raise InputError(
            f"'{source}': the pressure drop is {Shown(dp / MPA):.3f MPa}, expected a positive one; swap pA and pB, or "
            "correct the sign of dP"
        )


def refuse_an_open_valve(test: RampTest, u_max: float) -> None:
    """Refuse a valve that is open at zero command and shut at full command: a reversed signal, or normally open."""
    top = float(test.u.max())
    low, high = test.q[test.u <= 0.05 * u_max], test.q[test.u >= 0.95 * top]
    if not low.size or top < 0.5 * u_max:
        return
    rest, full = median(low), median(high)
    change = abs(full - rest)
    if change <= TOTAL_NOISES * robust_sigma(np.diff(test.q)) or abs(rest) < OPEN_AT_REST * change or (
        abs(full) > SHUT * change
    ):  # fmt: skip
        return
    raise InputError(
        worded(
            "'{source}': the flow is {rest:.3f L/min} at zero command and {full:.3f L/min} at {top:.2f V}, expected it "
            "to rise from zero; if the valve is normally open or its command reversed, turn the command round{option}",
            source=test.source,
            rest=rest / L_MIN,
            full=full / L_MIN,
            top=top,
            option=_by_columns(test, ["u"] if rest > 0 else ["u", "Q"], u_max),
        )
    )


def refuse_a_total(test: RampTest) -> None:
    """Refuse what rises as long as oil flows and never falls: a volume, pulses, or the position of a cylinder.

    Only a command that rises and goes back, and stays there for some rows, tells it from the flow of a single branch.
    """
    top = int(np.argmax(test.u))
    low = test.u <= BACK * test.u[top]
    if min(np.count_nonzero(low[:top]), np.count_nonzero(low[top:])) < ROWS_BACK:
        return
    least = max(TOTAL_NOISES * robust_sigma(np.diff(test.q)), 0.01 * L_MIN)
    for q in (test.q, -test.q):
        span = q[-1] - q[0]
        if span > least and np.max(np.maximum.accumulate(q) - q) < NEVER * span:
            label = f" '{test.columns['Q'].label}'" if "Q" in test.columns else ""
            raise InputError(
                f"'{test.source}': the column of Q{label} never goes back, though the command does: a volume, a count "
                "of pulses or a position is no flow; differentiate it over time (of a cylinder: area x speed)"
            )


def refuse_a_shut_valve(test: RampTest, branches: Sequence[Branch | None], u_max: float) -> None:
    """Refuse a test whose flow at full command does not stand out of the meter's noise, or has the wrong sign."""
    source = test.source
    for branch in filter(None, branches):
        bottom = branch.q[branch.u <= branch.u.min() + 0.05 * np.ptp(branch.u)]
        noise = robust_sigma(bottom)
        rise = largest_flow([branch], u_max) - median(bottom)
        least = max(6 * noise, 0.01 * L_MIN)
        if rise > least:
            continue
        if rise < -least:
            raise InputError(
                worded(
                    "'{source}': the flow falls with the command, by {fall:.3f L/min} from zero to {top:.2f V}, "
                    "expected one that rises; reverse the sign of Q{option}, or leave cells blank where the logger "
                    "wrote a number for a missing sample",
                    source=source,
                    fall=-rise / L_MIN,
                    top=branch.u.max(),
                    option=_by_columns(test, ["Q"], u_max),
                )
            )
        raise InputError(
            f"'{source}': the flow does not show the valve opening. From zero command to "
            f"{Shown(branch.u.max()):.2f V} the flow rises by {Shown(rise / L_MIN):.3f L/min}, expected more than "
            f"{Shown(least / L_MIN):.3f #L/min} (6 times the meter's noise of {Shown(noise / L_MIN):.3f L/min}); "
            "check the solenoid, the supply and the column of Q, or average the readings"
        )


def _by_columns(test: RampTest, quantities: Sequence[str], u_max: float) -> str:
    """Return the option that turns columns round; nothing where they are not known."""
    columns = [turned(name, test.columns[name], u_max) for name in quantities if name in test.columns]
    return f' by --columns "{", ".join(columns)}"' if columns else ""


def refuse_a_jump(read: PreparedBranch, u_max: float) -> None:
    """Refuse a flow that jumps past its straight part: the line would be laid through the jump, volts too high.

    A meter whose floor lies above half of the largest flow makes such a jump wherever the flow happens to reach it, and
    so does a valve that only switches. The mean of readings on either side of a jump looks like a steep ramp; the
    readings themselves are on either side.
    """
    low, high = (crossing(*read.profile, share * read.y_max) for share in MIDDLE)
    inside = (read.branch.u >= low) & (read.branch.u <= high)
    # A floor inside the straight part is dealt with: what it hides is censored.
    if not inside.any() or high - low > WIDEST_JUMP * u_max or MIDDLE[0] < read.floor / read.y_max < LARGEST_FLOOR:
        return
    share = read.y[inside] / read.y_max
    if np.mean((share > MIDDLE[0]) & (share < MIDDLE[1])) >= FEWEST_IN_THE_MIDDLE:
        return
    raise InputError(
        f"'{read.source}': the flow jumps at {Shown(0.5 * (low + high)):.2f V}, expected a straight rise. Of "
        f"{inside.sum()} readings there, almost none lies between {MIDDLE[0]:.0%} and {MIDDLE[1]:.0%} of the largest "
        f"flow of {Shown(read.y_max / L_MIN):.3g L/min}. Either the valve only switches, or the meter starts above "
        "that flow; use a meter of a smaller range, or leave out this pressure drop"
    )


def refuse_an_impossible_knee(branch: Branch, knee: float, source: str, u_max: float) -> None:
    """Refuse a knee (V) outside the command that a test's branch has swept, as a line through a bent part gives it."""
    lowest, highest = float(branch.u.min()), float(branch.u.max())
    if max(lowest - EXTRAPOLATED * u_max, 0.0) <= knee <= highest:
        return
    raise InputError(
        worded(
            "'{source}': the knee on {way} comes out at {knee:.2f V}, expected it within the command that was swept, "
            "{lowest:.2f #V} to {highest:.2f V}; look at the flow below it for a leak or a pump that came up late, and "
            "choose a --knee-window in which the flow is straight",
            source=source,
            way="opening" if branch.rising else "closing",
            knee=knee,
            lowest=lowest,
            highest=highest,
        )
    )


def refuse_mixed_branches(described: Sequence[DescribedTest]) -> None:
    """Refuse tests of which some have a branch that others lack: they can't be compared.

    A test's branch may be a test of its own, at the pressure drop that the pump had come up to by then.
    """
    for column, name in ((0, "rising"), (1, "falling")):
        lacking = [item for item in described if item.shapes[column] is None]
        if not lacking or len(lacking) == len(described):
            continue
        at = "" if lacking[0].dp is None else f" at {Shown(lacking[0].dp / MPA):.3g MPa}"
        raise InputError(
            f"'{lacking[0].test.source}' has no {name} branch{at} while other ramp tests have one; record every "
            "pressure drop up and down, each ramp after the pressure has settled, or leave that file out"
        )
