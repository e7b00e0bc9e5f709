"""The requirements on a firmware's current loop: the C against its exact model, and with the coil at every corner."""

from collections.abc import Callable
from dataclasses import dataclass
from math import log
from pathlib import Path

from dzdesign.core.errors import RequirementError
from dzdesign.design.compensator import Compensator
from dzdesign.design.current.drive import CurrentDrive
from dzdesign.verify.current import corner_runs
from dzdesign.verify.current.coil import CoilLoop, CoilSimulation
from dzdesign.verify.current.controller_states import BLOCK, SEED, check_states, hashes_on
from dzdesign.verify.current.results import (
    ControllerStates,
    CurrentCorner,
    CurrentLoopResult,
    FaultRun,
    SolenoidChanges,
)
from dzdesign.verify.requirements import (
    CURRENT_FAULTS,
    CURRENT_MARGINS,
    CURRENT_SETTLES,
    CURRENT_SOLENOIDS,
    CURRENT_STATES,
    CURRENT_STEP,
    MACHINE_CODE,
    Check,
)
from dzdesign.verify.toolchain.machines import BLOCK_HEADER, VALVE_HEADER, Machine, block_of, bound_files

#: States that every verification compares: a second's work.
STATES = 10_000_000
#: On a small machine.
FEW_STATES = BLOCK
#: Least phase margin; largest limit cycle and steady error, codes of the converter; largest overshoot.
LEAST_PHASE_DEG, MOST_SWING_CODES, MOST_ERROR_CODES, MOST_OVERSHOOT = 45.0, 2.0, 1.0, 0.10
#: Largest current beyond a set point that comes from zero, codes: the valve stays shut as the drive is released.
MOST_RELEASE_CODES = 1.0
#: How far what is found may lie from what compensator.json says of the same.
SAME_DEG, SAME_GAIN, SAME_OVERSHOOT = 0.1, 0.02, 0.002
#: Chance of which a wrong state among those that are drawn would be missed.
MISSED = 1e-3
CORE = ("dz_current.c", "dz_current.h")


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentChecks:
    """What was found of the current loop; nothing of a drive by duty."""

    checks: tuple[Check, ...] = ()
    result: CurrentLoopResult | None = None


def read_controller(folder: Path) -> dict[str, str]:
    """Return the C code of a firmware's current controller, by file; one that is not there is a `RequirementError`."""
    try:
        core = {name: (folder / "core" / name).read_text(encoding="utf-8") for name in CORE}
        bound = bound_files(block_of(folder))
        headers = [BLOCK_HEADER, *([] if bound else [VALVE_HEADER])]
        return core | {name: (folder / "core" / name).read_text(encoding="utf-8") for name in headers} | bound
    except (OSError, UnicodeDecodeError) as error:
        raise RequirementError(f"the current controller's C can't be read: {error}; run codegen again") from error


def current_checks(
    folder: Path, compensator: Compensator, say: Callable[[str], None], states: int = STATES
) -> CurrentChecks:
    """Check the current loop of a firmware; one whose drive is by duty has none."""
    drive, around = compensator.current_drive, CoilLoop.of(compensator)
    if drive is None or around is None:
        return CurrentChecks()
    say("comparing the current controller with its exact model, state by state")
    try:
        core = read_controller(folder)
        found, _ = check_states(drive.loop, core, states)
        say("running the current controller with the coil at every corner")
        result = _result(CoilSimulation(around, core), found, compensator)
    except RequirementError as error:
        return CurrentChecks(checks=(CURRENT_STATES.check(holds=False, text=str(error)),))
    checks = (
        _states_check(result.states),
        _margins_check(result, drive),
        _settles_check(result, drive, around),
        _step_check(result, drive, around),
        _faults_check(result.faults),
        *([_changes_check(result.changes, drive, around)] if result.changes else []),
    )
    return CurrentChecks(checks=checks, result=result)


def controller_on_machine(folder: Path, compensator: Compensator, machine: Machine, states: int = STATES) -> Check:
    """Compare a machine's controller with the host's over the states that there are those of the exact model."""
    name = f"current controller's machine code of the {machine.name}"
    drive = compensator.current_drive
    if drive is None:
        raise ValueError("the drive is by duty")
    if missing := machine.missing():
        return MACHINE_CODE.check(name=name, holds=None, text=f"not run: {missing}")
    count = FEW_STATES if machine.small else states
    try:
        core = read_controller(folder)
        (host, hashes), found = check_states(drive.loop, core, count), hashes_on(machine, drive.loop, core, count)
    except RequirementError as error:
        return MACHINE_CODE.check(name=name, holds=False, text=str(error))
    wrong = sum(one != other for one, other in zip(found, hashes, strict=True))
    text = (
        f"{host.states} states and calibrations (seed {SEED}) in {len(found)} hashes: {wrong} other than the host's, "
        f"whose states are those of the exact model but for {host.wrong}; {machine.runner[0]}, {machine.compiler} "
        f"{' '.join(machine.core_flags)}"
    )
    return MACHINE_CODE.check(name=name, holds=wrong + host.wrong == 0, text=text)


def zero_command_points(compensator: Compensator) -> tuple[int, ...]:
    """Return the set points at zero command at the ends of the tested interval, counts."""
    signals, ends = compensator.signals, compensator.side().certificate.dp_MPa
    zero = signals.command.zero_code
    return tuple(sorted({compensator.compare(zero, round(signals.pair(1).dp_code(dp))) for dp in ends}))


def _result(simulation: CoilSimulation, found: ControllerStates, compensator: Compensator) -> CurrentLoopResult:
    around, corners, functions = simulation.around, simulation.around.corners(), compensator.drive_functions
    above, below = corner_runs.dithered_current(simulation, functions, zero_command_points(compensator))
    offsets = corner_runs.offset_errors(around)
    shifted = [corner_runs.held_current(simulation, around.at(), 0.5, codes).reading_error for codes in offsets]
    return CurrentLoopResult(
        states=found,
        seconds=corner_runs.HELD_S,
        shares=corner_runs.SHARES,
        not_carried=sum(not around.carries(corner, share) for corner in corners for share in corner_runs.SHARES),
        corners=tuple(corner_runs.run_corner(simulation, corner) for corner in corners),
        offset_codes=offsets,
        offset_error_codes=max(shifted, default=0.0),
        dither_above_counts=above,
        dither_below_counts=below,
        faults=tuple(corner_runs.fault_runs(simulation)),
        changes=corner_runs.solenoid_changes(simulation),
    )


def _states_check(states: ControllerStates) -> Check:
    # A share p of wrong states among those drawn is missed with (1 - p)^N.
    one_of = states.states / -log(MISSED)
    text = (
        f"{states.states} states and calibrations, random and at the ends that matter (seed {states.seed}): "
        f"{states.wrong} differ; a controller that is wrong in one of {one_of:.2g} of them would be missed once in "
        f"{1 / MISSED:g}"
    )
    first = f"; first: {states.first_wrong}" if states.first_wrong else ""
    return CURRENT_STATES.check(holds=states.wrong == 0, text=text + first)


def _at(corner: CurrentCorner) -> str:
    return f"{corner.resistance_ohm:.3g} ohm, {1e3 * corner.inductance_H:.3g} mH, {corner.supply_V:.3g} V"


def _margins_check(result: CurrentLoopResult, drive: CurrentDrive) -> Check:
    phase = min(result.corners, key=lambda corner: corner.phase_margin_deg)
    gain = min(result.corners, key=lambda corner: corner.gain_margin)
    same = (
        abs(phase.phase_margin_deg - drive.phase_margin_deg) <= SAME_DEG
        and abs(gain.gain_margin / drive.gain_margin - 1) <= SAME_GAIN
    )
    text = (
        f"{len(result.corners)} corners of resistance, inductance and supply, every delay counted: phase margin at "
        f"least {phase.phase_margin_deg:.1f} degrees (at {_at(phase)}; required: {LEAST_PHASE_DEG:g}), gain margin "
        f"{gain.gain_margin:.2f} (at {_at(gain)}); compensator.json says {drive.phase_margin_deg:.1f} degrees and "
        f"{drive.gain_margin:.2f}"
    )
    return CURRENT_MARGINS.check(holds=same and phase.phase_margin_deg >= LEAST_PHASE_DEG, text=text)


def _settles_check(result: CurrentLoopResult, drive: CurrentDrive, around: CoilLoop) -> Check:
    swing = max(result.corners, key=lambda corner: corner.limit_cycle_codes)
    error = max(result.corners, key=lambda corner: corner.steady_error_codes)
    current = max(corner.current_error_codes for corner in result.corners)
    released = max(result.corners, key=lambda corner: corner.release_overshoot_codes)
    tried = len(result.corners) * len(result.shares) - result.not_carried
    text = (
        f"{tried} set points of {result.seconds:g} s each, without dither: limit cycle up to "
        f"{swing.limit_cycle_codes:.2f} codes (at {_at(swing)}; allowed: {MOST_SWING_CODES:g}), steady error up to "
        f"{error.steady_error_codes:.2f} codes (at {_at(error)}; allowed: {MOST_ERROR_CODES:g}), of the current itself "
        f"{current:.2f}; on its way there from zero the current is up to {released.release_overshoot_codes:.2f} codes "
        f"beyond (at {_at(released)}; allowed: {MOST_RELEASE_CODES:g})"
    )
    if result.not_carried:
        text += f"; {result.not_carried} set points lie beyond what the supply can drive, and were not tried"
    if result.offset_codes:
        shifts = ", ".join(f"{offset:+.0f}" for offset in result.offset_codes)
        text += f"; with a sensor's zero off by {shifts} codes {result.offset_error_codes:.2f} codes, once calibrated"
    kept = max(
        result.dither_above_counts - drive.dither_above_counts,
        result.dither_below_counts - drive.dither_below_counts,
    )
    if drive.dither_above_counts or drive.dither_below_counts:
        text += (
            f"; in the dither the current's peak lies up to {result.dither_above_counts:.0f} counts above the set "
            f"point's and {result.dither_below_counts:.0f} below it, for which compensator.json keeps "
            f"{drive.dither_above_counts} and {drive.dither_below_counts}"
        )
    faults = [corner for corner in result.corners if corner.faults]
    if faults:
        text += f"; faults {faults[0].faults:#x} of a circuit without a fault at {_at(faults[0])}"
    settles = not faults and max(error.steady_error_codes, result.offset_error_codes) <= MOST_ERROR_CODES
    settles &= kept * around.codes_per_A * around.circuit.rated_A / around.loop.full_counts <= MOST_ERROR_CODES
    settles = settles and released.release_overshoot_codes <= MOST_RELEASE_CODES
    return CURRENT_SETTLES.check(holds=settles and swing.limit_cycle_codes <= MOST_SWING_CODES and tried > 0, text=text)


def _step_check(result: CurrentLoopResult, drive: CurrentDrive, around: CoilLoop) -> Check:
    stepped = [corner for corner in result.corners if corner.overshoot is not None]
    late = [corner for corner in stepped if corner.rise_s is None]
    if not stepped or late:
        text = f"at {_at(late[0])} the step does not arrive" if late else "no corner can carry the rated current"
        return CURRENT_STEP.check(holds=False, text=text)
    slowest = max(stepped, key=lambda corner: corner.rise_s or 0.0)
    largest = max(stepped, key=lambda corner: corner.overshoot or 0.0)
    rise_s, least_s, overshoot = slowest.rise_s or 0.0, slowest.least_rise_s or 0.0, largest.overshoot or 0.0
    as_printed = rise_s <= drive.rise_s + around.sampling.period_s and overshoot <= drive.overshoot + SAME_OVERSHOOT
    text = (
        f"10 to 90 % of the rated current in {1e3 * rise_s:.1f} ms at the slowest corner ({_at(slowest)}; "
        f"{rise_s / least_s:.1f} times what the switch on all the time would take), overshoot up to {overshoot:.1%} "
        f"(at {_at(largest)}; allowed: {MOST_OVERSHOOT:.0%}); compensator.json says {1e3 * drive.rise_s:.1f} ms and "
        f"{drive.overshoot:.1%}"
    )
    if len(stepped) < len(result.corners):
        text += f"; {len(result.corners) - len(stepped)} corners can't carry the rated current"
    return CURRENT_STEP.check(holds=as_printed and overshoot <= MOST_OVERSHOOT, text=text)


def _changes_check(changes: SolenoidChanges, drive: CurrentDrive, around: CoilLoop) -> Check:
    # A sum of codes that are rounded down, as the offset is, shows up to a code less.
    allowed_A = (drive.loop.open_sum / drive.loop.samples + 1) / around.codes_per_A
    text = (
        f"{changes.corners} corners, the side changed back after 1 to {changes.phases} PWM periods: both solenoids at "
        f"once have up to {changes.both_A:.4g} A (allowed: {allowed_A:.4g}), and the other one its first current "
        f"{1e3 * changes.slowest_s:.1f} ms after a change (at most {1e3 * drive.change_s:.1f})"
    )
    if changes.faults:
        text += f"; faults {changes.faults:#x} of circuits without a fault"
    holds = changes.both_A <= allowed_A and changes.slowest_s <= drive.change_s and not changes.faults
    return CURRENT_SOLENOIDS.check(holds=holds, text=text)


def _faults_check(faults: tuple[FaultRun, ...]) -> Check:
    parts = []
    for fault in faults:
        seen = "not seen" if fault.seen_after_s is None else f"seen after {1e3 * fault.seen_after_s:.1f} ms"
        stays = "the output stays off" if fault.latched else "the output does not stay off"
        parts.append(f"{fault.name}: {seen} (at most {1e3 * fault.limit_s:.0f}), {stays}")
    return CURRENT_FAULTS.check(holds=all(fault.holds for fault in faults), text="; ".join(parts))
