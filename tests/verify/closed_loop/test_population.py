"""Machines drawn from the budget: none flows under the right budget, and every one that is too small is caught."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom
from small_budgets import (
    DUTY,
    IN_TURN,
    LARGEST,
    LITTLE,
    called_ten_times_better,
    designed,
    drawn_alone,
    right_and_wrong,
    worst_ends,
)

from dzdesign.core.errors import InputError
from dzdesign.verify.closed_loop import population as population_module
from dzdesign.verify.closed_loop.drawn_machine import COMPONENTS, drawn_machine
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.closed_loop.loop_checks import of_population
from dzdesign.verify.closed_loop.population import (
    NODES,
    Tolerances,
    draw,
    read_tolerances,
    run_population,
    threshold_band,
    upper_limit,
)
from dzdesign.verify.closed_loop.scene import PERIODS, ramp, scenes_of
from dzdesign.verify.requirements import ZERO_FLOW
from tests.support.evidence import verify
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler


@pytest.fixture(scope="module")
def duty(example_valve, tmp_path_factory):
    folder = tmp_path_factory.mktemp("population") / "fw"
    return scenes_of(folder, designed(example_valve, folder, **DUTY), None)


# --- what is drawn --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("flowing", "machines"), [(0, 10_000), (1, 200), (17, 500)])
def test_the_upper_limit_is_where_so_few_or_fewer_have_a_chance_of_5_percent(flowing, machines):
    assert binom.cdf(flowing, machines, upper_limit(flowing, machines)) == pytest.approx(0.05, rel=1e-6)


def seeded(seed):
    return np.random.default_rng(seed)


def test_components_are_drawn_evenly_and_the_first_of_more_are_the_same():
    many = draw(20_000, seeded(3))
    assert np.array_equal(many[:7], draw(7, seeded(3)))
    assert not np.array_equal(many[:7], draw(7, seeded(4)))
    assert np.abs(many).max() <= 1 and np.abs(many.mean(axis=0)).max() < 0.02
    assert many.std(axis=0) == pytest.approx(np.full(len(COMPONENTS), 3**-0.5), rel=0.02)


def test_a_drive_is_that_of_a_plant_with_another_voltage(scenes, plant_scenes, plant):
    """The numbers of a plant multiplied, against those made of another plant."""
    command = RampSequence(rest=0.2, ramp=3.0, top=0.3).command()
    for loop in (plant_scenes[0].loop, scenes[0].loop):
        scaled = loop.with_drive(1.21).run(command, 2.0)
        if not loop.stand_in:
            made = loop.with_plant(replace(plant, u_max_V=12.1)).run(command, 2.0)
            assert np.abs(scaled.q_L_min - made.q_L_min).max() < 1e-9
        usual = loop.run(np.minimum(1.21 * command, 1.0), 2.0)
        assert np.abs(scaled.q_mean_L_min - usual.q_mean_L_min)[command < 0.8].max() < 0.05


def test_the_corner_that_is_called_worst_is(duty):
    """Turning any component round from there never brings the valve nearer to flow."""
    scene = duty[2]
    machine, worst = scene.compensator.machine, worst_ends(scene)
    command = np.concatenate([ramp(0, 1, 0.5), ramp(1, 0, 0.5), np.zeros(1000)])

    def flow(shares):
        loop, errors = drawn_machine(scene, machine, shares, 0)
        added = loop.added_V - shares[COMPONENTS.index("recording")] * 0.02 + 0.3
        run = loop.run(
            command, scene.dp_MPa, "compensated", back_MPa=1.0, added_V=added, errors=errors, periods_per_record=PERIODS
        )
        return run.q_mean_L_min[-200:].mean()

    most = flow(worst)
    assert most > 0.1
    for place, name in enumerate(COMPONENTS):
        turned = worst.copy()
        turned[place] *= -1
        assert flow(turned) <= most + 1e-3, name


# --- the right budget -----------------------------------------------------------------------------------------------


def test_no_machine_of_the_right_budget_flows_not_even_where_all_is_at_its_worst(duty, wording):
    found = run_population(duty, 150, 1)
    assert (found.flowing, found.flowing_in_loop, found.never_open, found.pressures) == (0, 0, 0, 11)
    assert found.upper_limit == pytest.approx(1 - 0.05 ** (1 / 150), rel=1e-9)
    check = of_population(found, ZERO_FLOW.check(holds=True, text=""), duty[0].units)
    assert check.holds
    wording.of_test(check.text)
    with drawn_alone(duty):
        cornered = run_population(duty, 4, 1)
    assert (cornered.flowing, cornered.flowing_in_loop, cornered.never_open) == (0, 0, 0)


def test_the_worst_corner_is_near_the_edge(duty, monkeypatch):
    """25 mV of the valve more than the budget has, and every machine of the corner flows."""


    def opened(*given):
        loop, errors = drawn_machine(*given)
        return loop.with_added_drive(0.025), errors

    monkeypatch.setattr(population_module, "drawn_machine", opened)
    with drawn_alone(duty):
        found = run_population(duty, 4, 1)
    assert (found.flowing, found.flowing_in_loop) == (0, 4) and found.least_margin_V < 0.025


def test_the_threshold_may_come_down_to_its_certified_bound(duty):
    band = threshold_band(duty[0], [scene.dp_MPa for scene in duty])
    bounds = duty[0].compensator.valve.positive.certified["closing"]
    closing = band.closing_V[::NODES]
    assert band.dp_MPa[::NODES] == pytest.approx([scene.dp_MPa for scene in duty])
    assert closing - band.half_V[::NODES] == pytest.approx(np.array(bounds.u_lower_V), abs=1e-6)
    begins = [test.recorded.falling.u_V[1] for test in duty[0].compensator.valve.positive.tests]
    assert closing == pytest.approx(np.array(begins), abs=2e-3)


def test_a_quick_closing_ends_where_a_slow_one_does(duty):
    """A sample of machines that flow, closed in 100 s: the same flow at zero command.

    A tenth of a code of the pressure drop decides between two drives, hence the hundredth of a litre.
    """
    scene = duty[-1]
    machine, shares = scene.compensator.machine, draw(12, seeded(5))
    openings = population_module.Openings.of(1)
    slow = RampSequence(rest=0.5, top=0.5).command()
    flowing = 0
    for index, each_shares in enumerate(shares):
        loop, errors = drawn_machine(scene, machine, each_shares, index)
        quiet = replace(errors, noise_codes=(0, 0, 0))
        flows = [
            loop.run(command, scene.dp_MPa, "compensated", added_V=2.4, errors=quiet).q_mean_L_min[-1]
            for command in (openings.command, slow)
        ]
        assert flows[0] == pytest.approx(flows[1], abs=0.01)
        flowing += flows[1] > 0.1
    assert flowing >= 3


def test_a_plant_of_equations_is_drawn_too(example_valve, plant, tmp_path):
    true, wrong = LITTLE | {"amplifier": "2 %"}, LITTLE | {"amplifier": "0.2 %"}
    scenes = scenes_of(tmp_path / "fw", designed(example_valve, tmp_path / "fw", **true), plant)
    assert run_population(scenes, 20, 1).flowing == 0
    short = scenes_of(tmp_path / "short", designed(example_valve, tmp_path / "short", **wrong), plant)
    machine = scenes[0].compensator.machine
    caught_out = [replace(each, compensator=replace(each.compensator, machine=machine)) for each in short]
    found = run_population(caught_out, 40, 1)
    assert 0 < found.flowing_in_loop <= found.flowing


# --- a budget that is too small -------------------------------------------------------------------------------------


@pytest.fixture
def few_in_loop(monkeypatch):
    """Run the ten nearest machines in the loop, not the two hundred."""
    monkeypatch.setattr(population_module, "IN_LOOP", 10)


def caught(valve, folder, true, wrong, *drawn, **more):
    """The machines of the true budget with a firmware that was designed for a wrong one; with its own none flows."""
    right, short = right_and_wrong(valve, folder, true, wrong, *drawn, **more)
    assert (right.flowing, right.flowing_in_loop, right.never_open) == (0, 0, 0)
    assert 0 < short.flowing_in_loop <= short.flowing  # the noise at its peak may let one more flow
    return short


def test_the_largest_component_ten_times_too_small_fails_the_population(example_valve, tmp_path, wording):
    found = caught(example_valve, tmp_path, *LARGEST, machines=60)
    assert found.flowing > 5 and found.largest_L_min > 1
    check = of_population(found, ZERO_FLOW.check(holds=True, text=""), example_valve.recorded_units)
    assert check.holds is False
    wording.of_test(check.text)


@pytest.mark.slow
@pytest.mark.usefixtures("few_in_loop")
@pytest.mark.parametrize("component", IN_TURN)
def test_each_component_ten_times_too_small_fails_with_the_others_at_their_worst(example_valve, tmp_path, component):
    true, wrong = IN_TURN[component]
    found = caught(example_valve, tmp_path, true, wrong, component, machines=40)
    assert 0 < found.flowing < 40


@pytest.mark.usefixtures("few_in_loop")
def test_a_recording_that_is_called_ten_times_too_good_fails(example_valve, tmp_path):
    found = caught(example_valve, tmp_path, LITTLE, {}, "recording", machines=40, change=called_ten_times_better)
    assert found.flowing > 0


# --- how it is asked for --------------------------------------------------------------------------------------------


def test_the_example_file_is_read(example_folder):
    assert read_tolerances(example_folder / "machines.toml") == Tolerances(machines=1_000_000, seed=1)


@pytest.mark.parametrize(
    "text", ["machine = 3", "machines = 0", "machines = true", 'machines = "3"', "seed = 3", "machines = "]
)
def test_what_does_not_fit_is_refused(tmp_path, text, wording):
    (tmp_path / "t.toml").write_text(text)
    with wording.refusal(InputError):
        read_tolerances(tmp_path / "t.toml")


def test_machines_of_an_undeclared_machine_are_refused(firmware, wording):
    with wording.refusal(InputError):
        verify(firmware, tolerances=Tolerances(machines=10))


@pytest.mark.slow
def test_the_evidence_has_the_population(example_valve, tmp_path):
    designed(example_valve, tmp_path / "fw", **DUTY)
    quick = RampSequence(rest=0.5, ramp=4.0, top=0.5)
    found = verify(tmp_path / "fw", sequence=quick, tolerances=Tolerances(machines=20)).evidence
    assert found.population.machines == 20 and found.population.flowing == 0
    checks = {check.id: check for check in found.checks}
    assert checks["population"].holds and checks["zero-flow-after-scenarios"].holds
