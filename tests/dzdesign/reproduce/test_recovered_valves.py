"""Recovered valves, and a deliberate error in derivation's law."""

from dataclasses import replace

import pytest

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.derivation import law as laws
from dzdesign.derivation import symbols as s
from dzdesign.derivation.account.published import FIRST
from dzdesign.design.designing import design
from dzdesign.identify.valve.model import ValveModel
from dzdesign.reproduce.law_numbers import half_digit
from dzdesign.reproduce.product_results import product_results
from dzdesign.reproduce.recovered_valves import METER_START_L_MIN, AtRest, printed_at, recover, recover_valves
from dzdesign.reproduce.runs import run_chain, run_valve
from dzdesign.verify.closed_loop.loop import ClosedLoop, RampSequence
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs
from tests.support.synthetic import needs_compiler

pytestmark = [pytest.mark.slow, needs_compiler]
PAPER_LAW = laws.law("paper")


@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_recovered_valve_has_its_printed_figures_at_rest(place):
    """By the figures themselves, another way than the equations solved for them."""
    valve = recover_valves()[place]
    for dp_MPa in (1.0, 5.0):
        rest, printed = AtRest(valve.plant, dp_MPa), printed_at(valve.published, dp_MPa)
        seen = rest.opens_V + METER_START_L_MIN / rest.flow_per_volt
        for ours, text in ((10 * seen, printed.dead_zone_percent), (float(rest.flow_L_min(10.0)), printed.flow)):
            assert abs(ours - float(text)) < 1e-3 * half_digit(text)
    if place == 0:
        assert AtRest(valve.plant, 1.0).position_mm(10.0) == pytest.approx(1.8, abs=1e-5)


def test_the_plant_at_rest_is_the_compiled_plant():
    """The closed form against the compiled motion with its PWM: another way to the same flow."""
    command = RampSequence(ramp=100.0).command()
    for valve in recover_valves()[:2]:
        loop = ClosedLoop(valve.plant)
        for dp_MPa in (1.0, 5.0):
            run, at = loop.run(command, dp_MPa), [4000, 7000, 9500]  # 100 records a second
            expected = AtRest(valve.plant, dp_MPa).flow_L_min(10 * run.command[at])
            assert run.q_mean_L_min[at] == pytest.approx(expected, abs=0.01)


def test_figures_that_no_valve_can_have_are_refused():
    impossible = replace(FIRST, flow1="60")  # more than the orifice passes at five times the pressure drop
    with pytest.raises(RequirementError, match="first valve can't be recovered"):
        recover(impossible, recover_valves()[0].plant)


def test_the_rounding_of_the_print_moves_a_parameter_as_far_as_is_said():
    simulated, first, _ = recover_valves()
    moved = recover(replace(FIRST, dead_zone1_percent="51.74"), simulated.plant)
    change = moved.plant.pressure_force_N_MPa - first.plant.pressure_force_N_MPa
    assert 0 < abs(change) <= first.rounding["pressure_force_N_MPa"]


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


#: Of these comes a firmware of a tested valve that follows them faithfully at every input; the others are refused.
IN_THE_C = {"beta on all of Eq. (14)": 2, "gain of the bare valve": 1}


@pytest.fixture(scope="module")
def identified():
    """The valves as the product identifies them."""
    chains = [run_chain(valve) for valve in recover_valves()]
    contents = [each.files[f"{each.valve.valve.replace(' ', '_')}/valve.json"] for each in chains]
    return [read_artefact(content.encode(), ValveModel, "valve.json") for content in contents]


@pytest.mark.parametrize("error", [name for name in WRONG if name not in IN_THE_C])
def test_no_firmware_comes_of_a_wrong_law(identified, monkeypatch, error):
    seed(monkeypatch, WRONG[error])
    with pytest.raises((InputError, RequirementError, ArithmeticError)):
        generate(design(identified[2]), "host")


@pytest.mark.parametrize(("place", "error"), [(1, "none"), (2, "none"), *((IN_THE_C[name], name) for name in IN_THE_C)])
def test_the_papers_numbers_catch_a_wrong_law_in_the_c(identified, monkeypatch, tmp_path, place, error):
    """Only the plant behind the C shows that flow is missing."""
    if error != "none":
        seed(monkeypatch, WRONG[error])
    valve, compensator = recover_valves()[place], design(identified[place])
    firmware = generate(compensator, "host")
    write_folder(tmp_path / "firmware", firmware.files, firmware.manifest)
    assert check_all_inputs(tmp_path / "firmware").holds
    runs = run_valve(valve, ClosedLoop(valve.plant, tmp_path / "firmware", compensator))
    faults = [fault for result in product_results([runs]) for fault in result.faults]
    assert bool(faults) == (error != "none"), faults
