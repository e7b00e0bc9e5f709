"""The current loop of the example's coil: margins, steps, steady error and limit cycles at every corner; its states.

The coil is exact between two edges of the PWM, and the controller is the C.
"""

from time import perf_counter

from scoreboard import Row, print_rows, say

from dzdesign.design.current.circuit import CoilCircuit, CurrentSampling, CurrentSensor
from dzdesign.design.current.drive import LEAST_PHASE_DEG, choose_loop, gains_of, worst_step
from dzdesign.design.current.responses import CurrentRequest, step_responses, worst_margins
from dzdesign.design.target_inputs import Converter
from dzdesign.verify.current.coil import CoilLoop, CoilSimulation
from dzdesign.verify.current.controller_states import check_states, hashes_on
from dzdesign.verify.current.corner_runs import HELD_S, fault_runs, run_corner, solenoid_changes
from dzdesign.verify.toolchain.machines import CORTEX_M4
from tests.support.current_loops import current_texts

COIL = CoilCircuit(resistance_ohm=3.5, inductance_H=0.04, rated_A=1.0, supply_V=(18.0, 32.0))
CONVERTER, SAMPLING = Converter(), CurrentSampling()
PLAIN = CurrentSensor(V_per_A=2.0, offset_V=0.15)
MEASURED = CurrentSensor(V_per_A=2.0, offset_V=0.15, supply_divider=0.075)
#: Sensor, limit of the rise, solenoids, shunts.
FORMS = {
    "supply unknown": (PLAIN, 10.0, 1, 1),
    "supply measured": (MEASURED, 5.0, 1, 1),
    "two solenoids, one shunt": (PLAIN, 10.0, 2, 1),
    "two solenoids, two shunts": (MEASURED, 5.0, 2, 2),
}
STATES, QUICK_STATES = 10_000_000, 500_000


def print_current_loop(quick: bool = False, seed: int = 0) -> list[Row]:
    """Judge both forms of the loop, print and return the rows."""
    rows = []
    for name, (sensor, limit_ms, solenoids, shunts) in FORMS.items():
        say(f"current loop, {name} ...")
        asked = CurrentRequest(
            circuit=COIL, sensor=sensor, sampling=SAMPLING, converter=CONVERTER, solenoids=solenoids, shunts=shunts
        )
        loop = choose_loop(asked, 60000)
        core = current_texts(loop)
        around = CoilLoop(loop=loop, circuit=COIL, sensor=sensor, converter=CONVERTER, sampling=SAMPLING)
        phase, gain = worst_margins(COIL, SAMPLING, gains_of(loop, COIL))
        steps = step_responses(loop, asked)
        slowest, largest = worst_step(steps)
        missing = LEAST_PHASE_DEG - phase.phase_deg
        rows += [
            Row(what=f"{name}: phase margin below {LEAST_PHASE_DEG:g} degrees, worst corner and current", value=missing,
                limit=0, unit="deg", note=f"{phase.phase_deg:.1f} degrees at {phase.crossover_rad_s:.0f} rad/s"),
            Row(what=f"{name}: gain margin, worst corner and current", value=gain.gain),
            Row(what=f"{name}: 10-90 % of rated current, slowest corner", value=1e3 * slowest.rise_s, limit=limit_ms,
                unit="ms", note=f"{1e3 * slowest.least_s:.1f} ms at full duty; {slowest.corner}"),
            Row(what=f"{name}: overshoot of that step, worst corner", value=100 * largest.overshoot, limit=10, unit="%",
                note=f"{largest.corner}"),
            *_settled(name, around, core, quick),
            *_states(name, loop, core, QUICK_STATES if quick else STATES),
        ]  # fmt: skip
    print_rows("Current loop: coil of 3.5 + 0.5 ohm and 40 mH, R x 0.75-1.35, L x 0.5-1.5, 18-32 V", rows)
    return rows


def _settled(name: str, around: CoilLoop, core: dict[str, str], quick: bool) -> list[Row]:
    """Return the rows of set points held for ten seconds, and of the faults of the circuit, at every corner."""
    simulation = CoilSimulation(around, core)
    corners = around.corners()
    found = [run_corner(simulation, corner) for corner in (corners[::13] if quick else corners)]
    if faults := [each for each in found if each.faults]:
        return [Row(what=f"{name}: faults at {faults[0]}", value=faults[0].faults, limit=0)]
    missed, changes = [fault for fault in fault_runs(simulation) if not fault.holds], solenoid_changes(simulation)
    allowed_A = (around.loop.open_sum / around.loop.samples + 1) / around.codes_per_A
    of_two = [] if changes is None else [
        Row(what=f"{name}: current in both at once, side changed back after 1 to {changes.phases} periods",
            value=1e3 * changes.both_A, limit=1e3 * allowed_A, unit="mA", note=f"{changes.corners} corners"),
        Row(what=f"{name}: from a change of side to the other solenoid's current", value=1e3 * changes.slowest_s,
            unit="ms"),
        Row(what=f"{name}: faults of circuits without one", value=changes.faults, limit=0),
    ]  # fmt: skip
    return [
        *of_two,
        Row(what=f"{name}: limit cycle in {HELD_S:g} s, of mean current and reading, {len(found)} corners",
            value=max(each.limit_cycle_codes for each in found), limit=2, unit="codes"),
        Row(what=f"{name}: steady error of the reading", value=max(each.steady_error_codes for each in found), limit=1,
            unit="codes"),
        Row(what=f"{name}: steady error of the current itself",
            value=max(each.current_error_codes for each in found), unit="codes",
            note="with rounding of the offset and of codes without noise, and the ripple between two samples"),
        Row(what=f"{name}: phase margin missing by the eigenvalues of the declared circuit",
            value=LEAST_PHASE_DEG - min(each.phase_margin_deg for each in found), limit=0, unit="deg"),
        Row(what=f"{name}: faults of the circuit that the C does not see or latch", value=len(missed), limit=0),
    ]  # fmt: skip


def _states(name: str, loop, core, states: int) -> list[Row]:
    """Return the rows of the comparison state by state."""
    start = perf_counter()
    found, hashes = check_states(loop, core, states)
    rows = [
        Row(what=f"{name}: of {found.states} states other than the exact controller's, host", value=found.wrong,
            limit=0, note=found.first_wrong or f"{perf_counter() - start:.0f} s")
    ]  # fmt: skip
    if missing := CORTEX_M4.missing():
        return [*rows, Row(what=f"{name}: the same on a Cortex-M4", value=1, limit=0, note=missing)]
    start = perf_counter()
    other = hashes_on(CORTEX_M4, loop, core, states)
    wrong = sum(one != two for one, two in zip(other, hashes, strict=True))
    note = f"a hash for each 10000 states, {len(other)}; {perf_counter() - start:.0f} s"
    return [
        *rows,
        Row(what=f"{name}: hashes of states on a Cortex-M4 other than the host's", value=wrong, limit=0, note=note),
    ]
