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
from dzdesign.verify.closed_loop.scenarios import sensor_failures
from dzdesign.verify.closed_loop.scene import NO_CORE_CAN_KNOW
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


def designed(valve, signal, folder, above):
    from dzdesign.codegen.project import generate

    sensor = pressure_signal(parse_signal(signal, "--pressure-a"), Converter(), Fraction(20))
    signals = Signals(pressure_a=sensor, pressure_b=sensor)
    compensator = design(valve, DesignOptions(signals=signals, accept=("broken-sensor",), above=above))
    made = generate(compensator, "host")
    write_folder(folder, made.files, made.manifest)
    return compensator


@pytest.mark.parametrize("signal", [NO_LIVE_ZERO, NO_ROOM, BOTH])
def test_a_failure_is_required_to_be_harmless_where_the_core_can_know_of_it(valve, signal, tmp_path):
    compensator = designed(valve, signal, tmp_path / "fw", "hold")
    rising = valve.positive.trend == "increasing"
    everything = []
    for scene in scenes_of(tmp_path / "fw", compensator, None):
        results = list(sensor_failures(scene))
        everything += results
        for result in results:
            assert result.q_zero_L_min == 0 or not result.must_shut, result
        unknown = {each.name.partition(":")[0] for each in results if not each.must_shut}
        assert all(each.not_required == NO_CORE_CAN_KNOW for each in results if not each.must_shut)
        # Each sensor by itself. With the port open to the tank B breaks and reads what it reads.
        opens = {"sensor B breaks"} if rising and signal == NO_LIVE_ZERO else set()
        opens |= {"sensor A is shorted"} if rising and signal == NO_ROOM else set()
        opens |= {"sensor A breaks"} if not rising and signal == NO_LIVE_ZERO else set()
        assert {name for name in unknown if "stuck" not in name} == opens
    # A reading at the converter's end is one of 20 MPa, where the signal has no room above.
    most = max(each.q_zero_L_min for each in everything if "A is shorted" in each.name)
    assert (most > 0.5) == (rising and signal == NO_ROOM)
    check = shut_after_scenarios(results, ZERO_FLOW.check(holds=True, text=""), AS_COMPUTED, plant_given=False)
    assert check.holds is True, check.text
    told = [line.partition(",")[0] for line in hidden_failures(compensator) if "pressure signal" in line or "," in line]
    hides = signal != BOTH if rising else signal == NO_LIVE_ZERO
    assert hides == bool(opens) == ("accepted" in told) == ("live zero" in "".join(check.not_required))


def test_an_offset_that_is_lowered_above_the_tests_shuts_at_a_reading_of_the_converters_end(valve, tmp_path):
    """20 MPa is four times the highest test: of a threshold that grows nothing is left of the offset there."""
    compensator = designed(valve, NO_ROOM, tmp_path / "fw", "lower")
    for scene in scenes_of(tmp_path / "fw", compensator, None):
        shorted = [each for each in sensor_failures(scene) if "A is shorted" in each.name]
        assert len(shorted) == len(scene.backs_MPa)
        assert all(each.must_shut and each.q_zero_L_min == 0 for each in shorted)
