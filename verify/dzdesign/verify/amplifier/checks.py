"""What is checked of an amplifier's file as it is read back: its law at zero command, the dead zones stated of it."""

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.verify.amplifier.readers import FileLaw, read_file
from dzdesign.verify.requirements import Check, Requirement

#: `export` checks a file before it writes it, `verify` that of a folder.
HOW = "`export`, `verify`"
READ_BACK = Requirement(id="amplifier-read-back", title="the file is read back", how=HOW)
SAFE = Requirement(
    id="amplifier-over-compensation", title="no over-compensation at zero command in the tested pressure range",
    how=HOW,
)  # fmt: skip
DEAD_ZONES = Requirement(
    id="amplifier-dead-zones", title="the stated dead zones are those of the file's law", how=HOW
)
#: Pressure drops between the tests of each side, beside the tests themselves.
PLACES = 1000
#: Of command; a threshold is looked for in steps of a quarter of it.
ALLOWED = Fraction(1, 10_000)
STEPS = 40_000
#: Half of the sixth decimal of what was stated, MPa or a share, and what a float adds.
ROUNDED = 0.51e-6
#: Devices that read no command, so that a zero command is exactly that.
EXACT_ZERO = ("rmc", "rmc75")
#: Devices with one offset, which acts on commands of both signs whatever the design has.
BOTH_SIGNS = EXACT_ZERO
#: Of one side: pressure drop, MPa, and share of command to the knee by branch.
Stated = tuple[float, Mapping[str, float]]


def checks(
    device: str,
    content: bytes,
    compensator: Compensator,
    stated: Mapping[int, Sequence[Stated]],
    zero: Fraction | None = None,
) -> tuple[Check, ...]:
    """Check the file for a device against the valve; `stated` has what was printed of it, by the sign of command.

    Commands up to `zero`, a share of full, may be a zero command; without one, up to the error declared for the design.
    """
    try:
        laws = read_file(device, content)
    except InputError as error:
        return (READ_BACK.check(holds=False, text=str(error)),)
    signs = compensator.signals.signs
    if missing := [SIDE_NAMES[sign] for sign in signs if sign not in laws]:
        return (READ_BACK.check(holds=False, text=f"it contains nothing for {' and '.join(missing)} commands"),)
    others = [SIDE_NAMES[sign] for sign in laws.keys() - set(signs) if _adds(laws[sign])]
    if others and device not in BOTH_SIGNS:
        text = f"it compensates {others[0]} commands, which the design does not drive: nothing is certified for them"
        return (READ_BACK.check(holds=False, text=text),)
    read = f"{len(content.splitlines())} lines, {len(laws)} direction{'s' * (len(laws) > 1)} of command"
    return (
        READ_BACK.check(holds=True, text=read),
        _safe(device, laws, compensator, zero),
        _dead_zones(laws, compensator, stated),
    )


def _adds(law: FileLaw) -> bool:
    """Return whether a law drives more than its command anywhere: then it compensates a dead zone."""
    return any(drive > command for command, drive in law.points)


def _safe(device: str, laws: Mapping[int, FileLaw], compensator: Compensator, declared: Fraction | None) -> Check:
    """Compare the largest drive of a command that may be zero with the bound at many pressure drops, exactly."""
    tried, over, margins, of_design = 0, 0, [], Fraction(0)
    for sign in compensator.signals.signs:
        error = compensator.command_error
        of_side = Fraction(error.offset_codes + error.noise_codes, compensator.signals.command.span(sign))
        of_design, zero = max(of_design, of_side), of_side if declared is None else declared
        zero, law = Fraction(0) if device in EXACT_ZERO else zero, laws[sign]
        drive = max(law.just_behind(law.rest), law.drive(zero), *(y for x, y in law.points if x <= zero))
        for bound_V in _bounds_V(compensator, sign):
            tried += 1
            margins.append(bound_V - drive * compensator.u_max_V)
            over += margins[-1] < 0
    smallest = compensator.valve.recorded_units.text(1e3 * float(min(margins)), ".3f mV")
    text = f"{tried} pressure drops, {over} over-compensated, smallest margin {smallest}"
    if declared is not None and declared < of_design:
        counted = f"only commands up to {float(declared):.2%} count as zero"
        text += f"; {counted}, and the design declares {float(of_design):.2%}"
    return SAFE.check(holds=not over, text=text)


def _bounds_V(compensator: Compensator, sign: int) -> Iterator[Fraction]:
    """Yield the lower bound of the guarded threshold, as the worst machine has it, from the first test to the last."""
    side = compensator.valve.sides[SIDE_NAMES[sign]]
    curve = side.certified[compensator.side(sign).certificate.guard]
    found = [curve.bound(side.trend or "flat")]
    found += [each.bound() for valve in compensator.lot if (each := valve.side(sign)) is not None]
    machine = compensator.machine
    factor = machine.least_factor if machine else Fraction(1)
    kept = Fraction(compensator.dither_reserve_counts, compensator.signals.compare_max)
    kept += Fraction(repr(machine.current_rest_error)) if machine and machine.current_rest_error else 0
    for bound in found:
        first, last = bound.dp_MPa
        tests = [end for piece in bound.pieces for end in (piece.from_MPa, piece.to_MPa)]
        for place in (*tests, *(first + (last - first) * Fraction(n, PLACES) for n in range(PLACES + 1))):
            value = bound.at(place)
            if value is not None:
                yield value * factor - kept * compensator.u_max_V
    error_MPa = Fraction(repr(machine.bench_pressure_error_MPa)) if machine else Fraction(0)
    if error_MPa and curve.above is not None:
        last = found[0].dp_MPa[1]
        value = curve.above.bound().at(last + error_MPa * (1 + error_MPa / last))
        yield (value or Fraction(0)) * factor - kept * compensator.u_max_V


def _dead_zones(
    laws: Mapping[int, FileLaw], compensator: Compensator, stated: Mapping[int, Sequence[Stated]]
) -> Check:
    """Look for the command at which the drive reaches each knee, and compare it with what was stated."""
    compared, largest = 0, 0.0
    for sign in compensator.signals.signs:
        tests = compensator.valve.sides[SIDE_NAMES[sign]].tests
        if len(stated.get(sign, ())) != len(tests):
            text = f"{len(tests)} tests of the {SIDE_NAMES[sign]} side, {len(stated.get(sign, ()))} stated"
            return DEAD_ZONES.check(holds=False, text=text)
        for (dp_MPa, shares), test in zip(stated[sign], tests, strict=True):
            knees = {"opening": test.u_knee_rising_V, "closing": test.u_knee_falling_V}
            recorded = {branch: knee for branch, knee in knees.items() if knee is not None}
            if abs(dp_MPa - (test.dp_MPa or 0.0)) > ROUNDED or set(shares) != set(recorded):
                return DEAD_ZONES.check(holds=False, text=f"no test has the values stated at {dp_MPa:g} MPa")
            for branch, knee in recorded.items():
                found = _dead_zone(laws[sign], Fraction(repr(knee)) / compensator.u_max_V)
                compared, largest = compared + 1, max(largest, abs(min(found, 2.0) - min(shares[branch], 2.0)))
    text = f"{compared} values compared, at most {largest:.4%} of command apart"
    return DEAD_ZONES.check(holds=largest <= float(ALLOWED), text=text)


def _dead_zone(law: FileLaw, threshold: Fraction) -> float:
    """Return the least command on a grid at which the drive has come to a threshold; infinite where none does."""
    if law.drive(Fraction(1)) < threshold:
        return float("inf")
    low, high = 0, STEPS
    while high - low > 1:
        middle = (low + high) // 2
        reached = law.drive(Fraction(middle, STEPS)) >= threshold
        low, high = (low, middle) if reached else (middle, high)
    return high / STEPS
