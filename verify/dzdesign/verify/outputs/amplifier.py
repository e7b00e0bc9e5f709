"""What is checked of an amplifier's file, as it is read back, and of the table of dead zones beside it in a folder."""

import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path

from dzdesign.core.documents import read_bytes
from dzdesign.core.errors import InputError, quoted
from dzdesign.core.option_readers import percent
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import OutputManifest
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.verify.evidence import OutputChecks
from dzdesign.verify.outputs.amplifier_files import FileLaw, read_file
from dzdesign.verify.requirements import DEAD_ZONES, READ_BACK, SAFE, Check

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
#: Of the folder; no command opens the valve where a share in it is infinite.
TABLE = "dead_zones.csv"
#: Of one side: pressure drop, MPa, and share of command to the knee by branch.
Stated = tuple[float, Mapping[str, float]]


def file_checks(
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
    side = compensator.valve.side(sign)
    curve = side.certified[compensator.side(sign).certificate.guard]
    found = [curve.bound()]
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
    apart: list[float] = []
    for sign in compensator.signals.signs:
        tests = compensator.valve.side(sign).tests
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
                apart.append(abs(min(found, 2.0) - min(shares[branch], 2.0)))
    text = f"{len(apart)} values compared, at most {max(apart, default=0.0):.4%} of command apart"
    return DEAD_ZONES.check(holds=all(each <= ALLOWED for each in apart), text=text)


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


def checks(
    folder: Path, manifest: OutputManifest, compensator: Compensator, say: Callable[[str], None]
) -> OutputChecks:
    """Check a folder for an amplifier: read its file and its table back, and compare them with the valve."""
    say("reading the file and the table back")
    try:
        device = manifest.settings.get("device", "")
        content = _file_for(folder, manifest, device)
        threshold = manifest.settings.get("threshold", "")
        zero = Fraction(repr(percent("0.5 %")(threshold, "threshold in the manifest"))) if threshold else None
    except InputError as error:
        return OutputChecks(checks=(READ_BACK.check(holds=False, text=str(error)),))
    try:
        stated = _table_of(read_bytes(folder / TABLE, "table of dead zones"))
    except InputError as error:
        found = [each for each in file_checks(device, content, compensator, {}, zero) if each.id != DEAD_ZONES.id]
        return OutputChecks(checks=(*found, DEAD_ZONES.check(holds=False, text=str(error))))
    return OutputChecks(checks=file_checks(device, content, compensator, stated, zero))


def _file_for(folder: Path, manifest: OutputManifest, device: str) -> bytes:
    """Return the one file beside the table, the compensator and git's; it is named after its device."""
    names = sorted(manifest.files.keys() - {Compensator.FILE_NAME, TABLE, ".gitattributes"})
    if len(names) != 1 or names[0].partition(".")[0] != device:
        raise InputError(f"the manifest names {len(names)} files for {quoted(device)}, expected one of its name")
    return read_bytes(folder / names[0], f"file for {device}")


def _table_of(content: bytes) -> dict[int, list[Stated]]:
    """Return what a table of dead zones states of the file, by the sign of command; the design's stands beside it."""
    signs: dict[str, int] = {name: sign for sign, name in SIDE_NAMES.items()}
    tests: dict[tuple[int, float], dict[str, float]] = {}
    try:
        for row in csv.DictReader(content.decode("ascii").splitlines()):
            place = signs[row["side"]], float(row["dp_MPa"])
            tests.setdefault(place, {})[row["branch"]] = float(row["dead_zone_fixed"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{TABLE} can't be read: {type(error).__name__}, {error}") from error
    return {sign: [(dp_MPa, shares) for (at, dp_MPa), shares in tests.items() if at == sign] for sign in signs.values()}
