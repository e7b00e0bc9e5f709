"""A threshold that grows with the pressure drop: what a failed sensor then does, and which signals show the failure."""

from fractions import Fraction

import pytest

from dzdesign.core.artefact_files import write_folder
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.design.costs import hidden_failures
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions
from dzdesign.design.signal_text import parse_signal, pressure_signal
from dzdesign.design.signals import Signals
from dzdesign.design.target_inputs import Converter
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.verify.closed_loop.firmware_loop import scenes_of
from dzdesign.verify.closed_loop.loop_checks import shut_after_scenarios
from dzdesign.verify.closed_loop.scenarios import EXCESS, run_scenarios
from dzdesign.verify.requirements import ZERO_FLOW
from tests.support.synthetic import Truth, needs_compiler, synthetic_ramp

pytestmark = needs_compiler
#: Two signals that hide a failure each, and one that shows both: 21 mA is 2.94 V of 3.
NO_LIVE_ZERO, NO_ROOM, BOTH = "0..10 V x 0.28 = 20 MPa", "4..20 mA on 150 ohm = 20 MPa", "4..20 mA on 140 ohm = 20 MPa"


@pytest.fixture(scope="module", params=[0.1, -0.1], ids=["rising", "falling"])
def valve(request):
    ramps = [
        synthetic_ramp(dp, Truth(knee_rising=5.0 + request.param * dp), seed=seed)
        for seed, dp in enumerate((1.0, 3.0, 5.0))
    ]
    found = identify(ramps, IdentifyOptions(meter_lag=0.0))
    assert found.positive.trend == ("increasing" if request.param > 0 else "decreasing")
    return found


@pytest.mark.parametrize("signal", [NO_LIVE_ZERO, NO_ROOM, BOTH])
def test_a_failure_is_required_to_be_harmless_where_the_core_can_know_of_it(valve, signal, tmp_path):
    from dzdesign.codegen.project import generate

    sensor = pressure_signal(parse_signal(signal, "--pressure-a"), Converter(), Fraction(20))
    compensator = design(
        valve, DesignOptions(signals=Signals(pressure_a=sensor, pressure_b=sensor), accept=("broken-sensor",))
    )
    made = generate(compensator, "host")
    write_folder(tmp_path / "fw", made.files, made.manifest)
    scene = scenes_of(tmp_path / "fw", compensator, None)[0]
    results = [result for result in run_scenarios(scene) if result.name.startswith("sensor ")]
    (excess,) = [result for result in results if result.name == EXCESS]
    rising = valve.positive.trend == "increasing"
    assert excess.must_shut == (signal == BOTH or not rising)
    # A reading at the converter's end is one of 20 MPa, where the signal has no room above.
    assert (excess.q_zero_L_min > 0.5) == (rising and signal == NO_ROOM)
    assert all(result.must_shut for result in results if result is not excess)
    check = shut_after_scenarios(results, ZERO_FLOW.check(holds=True, text=""), AS_COMPUTED, plant_given=False)
    assert check.holds is True, check.text
    told = [line.partition(",")[0] for line in hidden_failures(compensator) if "pressure signal" in line or "," in line]
    hides = signal != BOTH if rising else signal == NO_LIVE_ZERO
    assert ("accepted" in told) == hides
    assert ("live zero" in check.text) == (rising and hides)
