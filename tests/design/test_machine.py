"""A declared machine: the offset under the band less the budget, at every corner, and what says so can't be edited."""

from dataclasses import replace
from fractions import Fraction

import pytest

from dzdesign.codegen.project import target_named
from dzdesign.core.artefact_types import RuleError
from dzdesign.core.dither import Dither
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.recorded_units import CommandUnit, RecordedUnits
from dzdesign.design import ceiling
from dzdesign.design.ceiling import offset_ceiling
from dzdesign.design.certificate import guarded_curve, with_certificates
from dzdesign.design.costs import colder_coil
from dzdesign.design.designing import design
from dzdesign.design.drive_functions import DrivenDither
from dzdesign.design.lot_setting import lot_margins, lot_setting, prove_lot
from dzdesign.design.machine import check_bench_current, dither_reserve, recorded_full_A
from dzdesign.design.redesign import prove_derived
from tests.design.machine_oracle import worst_margin_mV
from tests.support import designs
from tests.support.designs import CURRENT, MACHINES

CONVERTER = target_named("f28335").converter
OF_ALL = (
    "pressure_error_a_MPa", "pressure_error_b_MPa", "bench_pressure_error_MPa", "pressure_offset_codes",
    "pressure_gain_codes", "pressure_noise_codes", "oil_error", "ageing_error",
)  # fmt: skip
#: Ranges ten times too small.
SMALLER = {"coil_temperature_C": (16.0, 26.0), "supply_V": (23.4, 24.8)}
#: The sensors ten times as bad as the paper's, so that none hides in the rounding.
COARSE = {"pressure_error": "1 %", "bench_pressure_error": "0.2 MPa"}


def options(texts):
    return designs.options(**texts)


def made_for(valve, texts):
    return designs.designed(valve, **texts)


@pytest.fixture(scope="module", params=MACHINES)
def designed(request, example_valve):
    return made_for(example_valve, MACHINES[request.param] | COARSE)


def test_the_offset_is_under_the_bound_at_every_corner(designed):
    margin = worst_margin_mV(designed, designed.machine, CONVERTER)
    assert 0 <= margin < 6


@pytest.mark.parametrize(
    ("drive", "key"),
    [
        *(("amplifier", key) for key in ["amplifier_error", *OF_ALL]),
        *(("duty", key) for key in ("coil_temperature_C", "supply_V")),
        *(("current", key) for key in ("current_error", "current_rest_error", "bench_current_error")),
    ],
)
def test_a_component_ten_times_too_small_is_seen(example_valve, drive, key):
    chosen = options(MACHINES[drive] | COARSE)
    truth, value = chosen.machine, getattr(chosen.machine, key)
    smaller = SMALLER.get(key) or (value // 10 if isinstance(value, int) else value / 10)
    wrong = replace(chosen, machine=replace(truth, **{key: smaller}))
    assert worst_margin_mV(design(example_valve, wrong), truth, CONVERTER) < 0


def test_the_factors_of_the_budget_are_those_of_copper_and_voltage():
    machine = options(MACHINES["duty"]).machine
    assert machine.least_factor == Fraction("0.8428") * 24 / 32 * Fraction("0.998") * Fraction("0.995")
    assert machine.largest_factor == Fraction("1.2358") * 24 / 18 * Fraction("1.002") * Fraction("1.005")
    assert replace(machine, bench_coil_C=40.0).least_factor < machine.least_factor


def test_the_bench_is_a_machine_too():
    """A coil that is always hotter than on the bench raises no offset: the valve may be driven there as well."""
    machine = options(MACHINES["duty"] | {"coil_temperature": "40..80 degC"}).machine
    assert machine.least_factors["coil temperature"] == 1


def test_the_budget_adds_up_to_the_ceiling(designed):
    """It ends where the table's own ceiling is; no component alone takes more than all of them."""
    budget, signals = designed.positive.budget, designed.signals
    assert [budget.line(name) is not None for name in ("oil", "ageing", "recording")] == [True] * 3
    curve = guarded_curve(designed.valve.positive, "closing", designed.below_dp0, designed.above, designed.machine)
    limit = offset_ceiling(curve, designed.u_max_V, designed.allowance(1)).limit
    curve_V = designed.valve.positive.certified["closing"].u_threshold_V
    for at, dp in enumerate(budget.dp_MPa):
        last = int(signals.pair(1).dp_code(Fraction(repr(budget.dp_MPa[-1]))))
        code = min(round(signals.pair(1).dp_code(Fraction(repr(dp)))), last)
        assert budget.threshold_V[at] <= curve_V[at] + 2e-3
        assert budget.ceiling_V[at] == pytest.approx(float(limit[code] * designed.u_max_V), abs=1e-6)
        assert designed.beta(code) * designed.positive.u_min0_over_u_max <= limit[code]
        assert budget.threshold_V[-1] == pytest.approx(curve_V[-1], abs=2e-3)
        assert budget.combined_mV[at] >= max(line.contribution_mV[at] for line in budget.lines)
    assert all(line.price >= 0 and line.source for line in budget.lines)
    kinds = {line.component: line.origin for line in budget.lines}
    assert kinds["recording"] == "measured" and kinds["oil"] == "default" and kinds["pressure sensor A"] == "declared"


def test_a_price_is_what_a_design_without_the_component_gains(example_valve):
    """The price of the oil, by a design in which it is zero: at dP0, where both touch their ceilings."""
    texts = MACHINES["amplifier"]
    with_oil, without = (made_for(example_valve, texts | {"oil": oil}) for oil in ("1 %", "0 %"))
    line = with_oil.positive.budget.line("oil")
    gained = [
        high - low
        for high, low in zip(without.positive.budget.ceiling_V, with_oil.positive.budget.ceiling_V, strict=True)
    ]
    assert line.price == pytest.approx(max(gained) / 10, rel=1e-5)
    assert line.contribution_mV[0] == pytest.approx(line.sensitivity_mV[0] * line.half_width, rel=1e-4)


def test_without_a_machine_the_certificate_is_of_the_recording(example_compensator):
    assert example_compensator.machine is None and example_compensator.certified_of == "the valve as recorded"
    assert {line.component for line in example_compensator.positive.budget.lines} == {
        "recording",
        "rounding of pressures",
        "rounding of the drive",
    }
    found = colder_coil(example_compensator, 1)
    assert found.seen and found.lowered_V == pytest.approx(40 * 0.00393 * 5.0, rel=0.03) and found.flow_L_min > 1
    assert any("a coil at -20 degC" in line for line in example_compensator.costs)


def test_an_edited_machine_or_budget_is_refused(example_valve):
    made = made_for(example_valve, MACHINES["amplifier"])
    prove_derived(made)
    machine = replace(made, machine=replace(made.machine, ageing_error=0.0001))
    lines = made.positive.budget.lines
    cheap = replace(made.positive.budget, lines=(replace(lines[0], price=0.0), *lines[1:]))
    budget = replace(made, sides=replace(made.sides, positive=replace(made.positive, budget=cheap)))
    none = replace(made, sides=replace(made.sides, positive=replace(made.positive, budget=None)))
    for wrong in (machine, budget, none, replace(made, machine=None)):
        with pytest.raises(InputError):
            prove_derived(wrong)
    # Designed for other words than it states: every number agrees with the machine, and the machine with no option.
    other = replace(options(MACHINES["amplifier"]), machine=machine.machine)
    with pytest.raises(InputError):
        prove_derived(design(example_valve, other))


def test_a_table_edited_beyond_the_tests_is_refused(example_valve):
    """Sensors that read 5 MPa as 5.2 take the law there: its table is part of the certificate too."""
    made = made_for(example_valve, MACHINES["amplifier"] | {"transition": "off"})
    node = int(made.signals.pair(1).dp_code(Fraction(5))) // made.beta_step_codes + 2
    table = tuple(made.positive.beta[0] if place == node else each for place, each in enumerate(made.positive.beta))
    with pytest.raises(RequirementError):
        with_certificates(replace(made, sides=replace(made.sides, positive=replace(made.positive, beta=table))))


def test_a_recorded_dither_is_stronger_where_a_drive_gives_more_current():
    machine, recorded = options(MACHINES["duty"]).machine, Dither(frequency_Hz=125.0, peak=0.01)
    driven = DrivenDither(counts=600, compare_max=60000, frequency_Hz=Fraction(125))
    assert dither_reserve(driven, recorded) == 0 and dither_reserve(driven, None, machine) == 600
    assert dither_reserve(driven, recorded, machine) == pytest.approx(600 * (1 - machine.least_factor), abs=1)


def test_the_rated_current_must_be_that_of_full_command(example_valve):
    by_current = replace(
        example_valve, recorded_units=RecordedUnits(command=CommandUnit(unit="mA", factor=80.0, declared="0..800 mA"))
    )
    signal = replace(example_valve, recorded_units=RecordedUnits(command=CommandUnit(unit="mA", factor=2.0)))
    assert recorded_full_A(by_current) == pytest.approx(0.8)
    assert recorded_full_A(signal) is None and recorded_full_A(example_valve) is None
    check_bench_current(by_current, 0.8, 0.8)
    check_bench_current(example_valve, 1.0, None)
    for valve, declared in ((by_current, None), (example_valve, 1.2), (example_valve, 0.999)):
        with pytest.raises(InputError, match="--rated-current"):
            check_bench_current(valve, 1.0, declared)


def test_a_bench_current_beside_the_rated_one_is_not_hidden_in_its_error(example_valve):
    """0.96 A +- 5 % may be 0.912 A, but the budget's factor is 0.95: the threshold over 1 A would be 4 % lower."""
    with pytest.raises(InputError, match="--rated-current"):
        made_for(example_valve, CURRENT | {"bench_current": "0.96 A +- 5 %"})
    exact = made_for(example_valve, CURRENT | {"rated_current": "0.96 A", "bench_current": "0.96 A +- 5 %"})
    assert exact.machine.least_factors["bench current"] == Fraction("0.95")


def test_a_machine_of_another_drive_is_no_machine_of_the_compensator(example_compensator):
    with pytest.raises(RuleError):
        replace(example_compensator, machine=options(CURRENT).machine)


@pytest.mark.slow
def test_a_lot_setting_is_under_every_bound_less_the_same_machine(example_valve):
    valves = {"one": example_valve, "two": replace(example_valve, record={"serial": "2"})}
    machine, recording = (
        lot_setting({name: made_for(valve, texts) for name, valve in valves.items()}).compensator
        for texts in (MACHINES["amplifier"], {})
    )
    assert machine.machine.drive == "amplifier"
    assert worst_margin_mV(machine, machine.machine, CONVERTER) >= 0
    assert all(each.margin_V >= 0 for each in lot_margins(machine))
    prove_derived(machine)
    with pytest.raises(RequirementError):
        prove_lot(replace(recording, machine=machine.machine))


class TestTheBenchsGaugeAboveTheTests:
    """Its gain is wrong by as much above the tests as at the last one: further from it, the drop is further off."""

    def margin_mV(self, designed):
        """Return the least margin above the tests, mV, of a gauge whose gain was wrong by all its error at the last."""
        bound, machine = designed.valve.positive.certified["closing"].above.bound(), designed.machine
        last = bound.dp_MPa[0]
        gain, factor = 1 + Fraction(repr(machine.bench_pressure_error_MPa)) / last, machine.least_factor
        worst = []
        pair = designed.signals.pair(1)
        for code in range(int(pair.dp_code(last)) + 1, int(pair.dp_code(Fraction(10)))):
            drive = Fraction(designed.compare(designed.signals.command.zero_code, code), designed.signals.compare_max)
            at_MPa = pair.dp_MPa(code) * gain
            known = bound.at(at_MPa)
            if known is None or known <= 0:  # nothing is known there, and one unit of the table is left
                break
            worst.append(known * factor - drive * designed.u_max_V)
        return float(1000 * min(worst))

    def test_it_is_counted(self, designed):
        assert self.margin_mV(designed) >= 0

    def test_without_it_the_bound_is_passed(self, example_valve, monkeypatch):
        bare = MACHINES["amplifier"] | {"amplifier": "0 %", "oil": "0 %", "ageing": "0 %", "pressure_error": "0 %"}
        chosen = options(bare | {"bench_pressure_error": "0.4 MPa", "pressure_converter": "0 + 0 + 0 codes"})
        assert self.margin_mV(design(example_valve, chosen)) >= 0
        monkeypatch.setattr(ceiling, "_drawn_together", lambda bound, _: bound)
        assert self.margin_mV(design(example_valve, chosen)) < 0
