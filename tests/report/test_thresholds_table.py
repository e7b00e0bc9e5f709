"""The report's first table: what counts as no flow at each pressure drop, and a leak where there is one."""

from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.report.sections.valve import thresholds_table
from tests.identify.knees.test_readings_at_rest import recordings


def columns(per_MPa):
    side = identify(recordings(per_MPa), IdentifyOptions(meter_lag=0.0)).positive
    table = thresholds_table(side, "closing", "Thresholds", AS_COMPUTED)
    return {label: [row[at].text for row in table.rows] for at, label in enumerate(table.columns)}, side


def test_the_noise_level_stands_beside_each_pressure_drop():
    found, side = columns(0.0)
    assert found["noise level (L/min)"] == [f"{test.noise_level_L_min:.2f}" for test in side.tests]
    assert "leak (L/min)" not in found


def test_so_does_a_leak():
    found, _ = columns(0.2)
    assert found["leak (L/min)"] == ["0.20", "0.60", "1.00"]
