"""Recovered valves, both readings of Fig. 6, section 4.3, and a deliberate error in derivation's law."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.artefact_files import write_folder
from dzdesign.core.errors import RequirementError
from dzdesign.derivation import law as laws
from dzdesign.derivation import symbols as s
from dzdesign.derivation.account.published import FIRST, SIMULATION
from dzdesign.reproduce import displacement_readings, paper_numbers, recovered_valves
from dzdesign.reproduce.assumptions import LOADS_MPA, OILS
from dzdesign.reproduce.chain import run_chain
from dzdesign.reproduce.displacement_readings import DISPLACEMENT, DISPLACEMENT_DEAD_ZONE, half_digits_off
from dzdesign.reproduce.first_valve_numbers import duty_cycles
from dzdesign.reproduce.load_and_oil import run_load_and_oil
from dzdesign.reproduce.offset_reading import of_the_offset
from dzdesign.reproduce.recovered_valves import at_rest, recover_simulated, recover_stopped, recover_valves
from dzdesign.reproduce.rows import Subject
from dzdesign.reproduce.valve_runs import DIRECT, PAPER, PRODUCT, Drive, ValveRuns, run_valve
from dzdesign.verify.closed_loop.loop import ClosedLoop
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs
from tests.support.synthetic import needs_compiler

pytestmark = [pytest.mark.slow, needs_compiler]
PAPER_LAW = laws.law("paper")


@pytest.fixture(scope="module")
def bare_runs():
    """The simulated and the first valve, and the first with a stop, bare and under the paper's law."""
    return [run_valve(valve, ClosedLoop(valve.plant)) for valve in (*recover_valves()[:2], recover_stopped())]


def test_the_plant_at_rest_is_the_compiled_plant(bare_runs):
    """The fit's closed form against the compiled motion with its PWM: another way to the same flow."""
    for runs in bare_runs:
        for dp_MPa in (1.0, 5.0):
            rest, run = at_rest(runs.valve.plant, dp_MPa), runs.ramps[Drive(DIRECT), dp_MPa]
            at = [4000, 7000, 9500]  # 100 records a second
            opened = [min(10 * run.command[k], float(rest.stops_V)) - float(rest.opens_V) for k in at]
            assert run.q_mean_L_min[at] == pytest.approx(
                [max(float(rest.flow_per_volt) * one, 0) for one in opened], abs=0.01
            )


def test_figures_that_no_valve_can_have_are_refused():
    impossible = replace(FIRST, flow1="60")  # more than the orifice passes at five times the pressure drop
    base = recover_simulated("preload").plant
    with pytest.raises(RequirementError, match="first valve can't be recovered"):
        recovered_valves._recover(impossible, base, recovered_valves.OF_TESTED, 0.6)


def test_the_rounding_of_the_print_moves_a_parameter_as_far_as_is_said():
    first, base = recover_valves()[1], recover_simulated("preload").plant
    moved = recovered_valves._recover(replace(FIRST, dead_zone1_percent="51.74"), base, tuple(first.rounding), 0.6)
    change = moved.plant.pressure_force_N_MPa - first.plant.pressure_force_N_MPa
    assert 0 < abs(change) <= first.rounding["pressure_force_N_MPa"]


def test_the_stop_saturates_the_papers_law_where_it_is_printed(bare_runs):
    stopped = bare_runs[2]
    assert 8 <= stopped.flat_from_V(Drive(PAPER), 1.0) <= 8.5
    assert stopped.flat_from_V(Drive(PAPER), 5.0) > 9.9  # the flows ask for a flow force, which keeps the spool off it
    assert bare_runs[1].flat_from_V(Drive(PAPER), 1.0) > 9.9


# --- Fig. 6 --------------------------------------------------------------------------------------------------


def test_the_paper_contradicts_itself_only_where_both_readings_fail():
    numbers = list(paper_numbers._of_the_displacement())
    told = {
        (number.quantity.split(" (")[0], number.dp_MPa)
        for number in numbers
        for one in number.outcomes
        if "contradicts itself" in one.reason
    }
    assert told == {(DISPLACEMENT_DEAD_ZONE, 5.0)}
    for quantity in (DISPLACEMENT, DISPLACEMENT_DEAD_ZONE):
        for dp_MPa in (1.0, 5.0):
            both = all(half_digits_off(reading, quantity, dp_MPa) > 1 for reading in ("overlap", "preload"))
            assert both == ((quantity, dp_MPa) in told)


def test_the_misfit_of_fig_6_is_what_can_be_worked_out_by_hand():
    # Preload: no flow before the spool moves, 51.7 + 0.05 t >= 55 - 0.5 t, and at 1 MPa 53.5 + 0.05 t >= 54 - 0.5 t.
    assert half_digits_off("preload", DISPLACEMENT_DEAD_ZONE, 5.0) == pytest.approx(3.3 / 0.55, abs=1e-6)
    assert half_digits_off("preload", DISPLACEMENT_DEAD_ZONE, 1.0) == pytest.approx(0.5 / 0.55, abs=1e-6)

    # Overlap: of dead travel d the opening is (1/d - 1) overlaps, and Eq. (24) gives its ratio from the flows.
    def is_short_of_it(t):
        least = (1 / (0.55 + 0.005 * t) - 1) / (1 / (0.54 - 0.005 * t) - 1)
        return least > (25.2 + 0.05 * t) / (15 - 0.5 * t) / np.sqrt(5)

    low, high = 0.0, 10.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if is_short_of_it(middle) else (low, middle)
    assert half_digits_off("overlap", DISPLACEMENT_DEAD_ZONE, 5.0) == pytest.approx(low, abs=1e-6)


def test_a_dead_zone_that_overlap_can_have_is_no_contradiction(monkeypatch):
    """Seeded: 61 % of travel at 5 MPa, which Eq. (24) makes of the printed flows."""
    displacement_readings.least_misfit.cache_clear()
    with monkeypatch.context() as patch:
        wrong = replace(SIMULATION, displacement_dead_zone_rises_percent="7")
        patch.setattr(displacement_readings, "SIMULATION", wrong)
        assert (
            half_digits_off("overlap", DISPLACEMENT_DEAD_ZONE, 5.0)
            < 1
            < half_digits_off("preload", DISPLACEMENT_DEAD_ZONE, 5.0)
        )
    displacement_readings.least_misfit.cache_clear()


# --- the offset that the printed dead zones ask for ----------------------------------------------------------


def rows_of_the_offset(recovered):
    subject = Subject(runs=ValveRuns(valve=recovered, ramps={}, steps={}))
    return {(row.quantity.split(",")[0], row.dp_MPa): row for row in of_the_offset(subject)}


def test_one_offset_has_both_dead_zones_with_compensator():
    """By hand: 5.39 V less 3.5 % of what Eq. (14) leaves above it, and beta 51.7/53.9 of that at 5 MPa."""
    simulated, first, second = map(rows_of_the_offset, recover_valves())
    offset = (5.39 - 0.35) / 0.965
    by_hand = 100 * (5.17 - 51.7 / 53.9 * offset) / (10 - 51.7 / 53.9 * offset)
    key = ("dead zone with", 5.0)
    assert [rows[key].outcomes[0].value for rows in (simulated, first, second)] == pytest.approx(
        [1.86, by_hand, 0.96], abs=0.005
    )
    assert [rows[key].agrees for rows in (simulated, first, second)] == [True, False, True]
    assert all(rows[key].holds for rows in (simulated, first, second))
    assert all(rows["dead zone with", 1.0].outcomes[0].agrees for rows in (simulated, first, second))


def test_no_offset_has_the_simulations_dead_zone_and_its_flow_without_beta():
    key = ("zero without beta", 5.0)
    row, metered = rows_of_the_offset(recover_valves()[0])[key], rows_of_the_offset(recover_valves()[1])[key]
    (ours,) = row.outcomes
    assert ours.reason.startswith("the paper contradicts itself") and ours.explained[1] < 0.945
    assert row.holds and metered.agrees  # the tested valve's meter is off by more
    # Seeded: with no dead zone left there is no contradiction.
    plain = recover_valves()[0]
    none_left = replace(plain, published=replace(plain.published, residual_percent="0"))
    (ours,) = rows_of_the_offset(none_left)[key].outcomes
    assert ours.reason.startswith("within the rounding") or ours.agrees


# --- section 4.3 ---------------------------------------------------------------------------------------------


def test_load_and_oil_do_what_the_equations_say():
    """By the density alone: the flow goes with its root; the load changes nothing at a constant pressure drop."""
    first = recover_valves()[1]
    under = run_load_and_oil(first, ClosedLoop(first.plant), product=False)
    assert (under.load_MPa[0], under.load_MPa[-1]) == LOADS_MPA
    for command in ("1.5", "3.5"):
        assert under.spread_L_min(PAPER, command) < 1e-9 and under.over_load[PAPER, command].min() > 1
    expected = 100 * ((OILS[0].density / OILS[-1].density) ** 0.5 - 1)
    assert under.largest_flow_change_percent(PAPER) == pytest.approx(expected, rel=0.02)
    assert under.dead_zone_change_per_mille(DIRECT) < 0.2
    thick = replace(first, plant=replace(first.plant, rho_kg_m3=2 * first.plant.rho_kg_m3))
    assert run_load_and_oil(thick, ClosedLoop(thick.plant), product=False).over_load[PAPER, "3.5"][-1] < (
        0.75 * under.over_load[PAPER, "3.5"][-1]
    )


# --- a deliberate error in derivation's law ------------------------------------------------------------------

WRONG = {
    "beta inverted": PAPER_LAW.output.subs(s.beta, 1 / s.beta),
    "beta turned about 1": PAPER_LAW.output.subs(s.beta, 2 - s.beta),
    "sign of k x_max": PAPER_LAW.output.subs(s.k, -s.k),
    "offset without beta": PAPER_LAW.output.subs(s.beta, 1),
    "offset subtracted": PAPER_LAW.output - 2 * s.beta * s.u_min0,
    "beta on all of Eq. (14)": s.beta * PAPER_LAW.output.subs(s.beta, 1),
    "gain of the bare valve": s.u_i + s.beta * s.u_min0,
}


def seed(monkeypatch, output) -> None:
    """Put a wrong law in the place of the paper's, past the checks that a law makes of itself."""
    with monkeypatch.context() as unchecked:
        unchecked.setattr(laws.Law, "_complaints", lambda law: ())
        wrong = replace(PAPER_LAW, output=output)
    monkeypatch.setattr("dzdesign.derivation.laws.paper.LAW", wrong)


def quick_numbers():
    """Every number of the simulated and the first valve under the paper's law, and the duty cycles."""
    runs = [run_valve(valve, ClosedLoop(valve.plant)) for valve in recover_valves()[:2]]
    simulated, first = (Subject(runs=each) for each in runs)
    second = Subject(runs=ValveRuns(valve=recover_valves()[2], ramps={}, steps={}))
    valves = (simulated, first)
    return [*(row for each in valves for row in paper_numbers.numbers_of_valve(each)), *duty_cycles(first, second)]


@pytest.mark.parametrize("error", ["none", *WRONG])
def test_the_papers_numbers_catch_a_wrong_law(monkeypatch, error):
    if error != "none":
        seed(monkeypatch, WRONG[error])
    unexplained = [number.quantity for number in quick_numbers() if number.holds is False]
    assert bool(unexplained) == (error != "none"), unexplained


def test_the_closed_loop_catches_a_wrong_law_in_the_c(monkeypatch, tmp_path):
    """The C follows the wrong law faithfully at every input; only the plant behind it shows that flow is missing."""
    from dzdesign.codegen.project import generate
    from dzdesign.core.artefact_reading import read_artefact
    from dzdesign.design.designing import design
    from dzdesign.identify.valve.model import ValveModel

    second = recover_valves()[2]
    content = run_chain(second).files["second_valve/valve.json"].encode()
    valve = read_artefact(content, ValveModel, "valve.json")
    seed(monkeypatch, WRONG["beta on all of Eq. (14)"])
    compensator = design(valve)
    firmware = generate(compensator, "host")
    write_folder(tmp_path / "firmware", firmware.files, firmware.manifest)
    assert check_all_inputs(tmp_path / "firmware").holds
    runs = run_valve(second, ClosedLoop(second.plant, tmp_path / "firmware", compensator), compensator)
    unexplained = {
        (number.quantity, number.dp_MPa, outcome.by)
        for number in paper_numbers.numbers_of_valve(Subject(runs=runs))
        for outcome in number.outcomes
        if not outcome.accounted
    }
    assert ("largest flow with", 5.0, PRODUCT) in unexplained
