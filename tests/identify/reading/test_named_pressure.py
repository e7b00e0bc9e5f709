"""Which pressure a file's name states, which it may state, and when it contradicts a column."""

import pytest

from dzdesign.identify.reading.series import contradicts, pressures_in_name


@pytest.mark.parametrize(
    ("name", "readings"),
    [
        ("Rampe_0_5MPa.txt", ["0.5 MPa", "5 MPa"]),
        ("V0_1MPa.csv", ["0.1 MPa", "1 MPa"]),
        ("ramp_0p5MPa.txt", ["0.5 MPa"]),
        ("ramp_0-5MPa.txt", ["0.5 MPa", "5 MPa"]),
        ("ramp_0,5 MPa.txt", ["0.5 MPa"]),
        ("run_10_0_5_MPa.txt", ["0.5 MPa", "5 MPa"]),
        ("ramp2P5MPa.txt", ["2.5 MPa"]),
        ("ramp 12,5 Bar up.csv", ["12.5 bar"]),
        ("ramp_2_1.5MPa.csv", ["1.5 MPa"]),
        ("ramp_5MPa_2.csv", ["5 MPa"]),
        ("dp5MPa.csv", ["5 MPa"]),
        ("ramp_2_5MPa.txt", ["2.5 MPa", "5 MPa"]),
        ("ramp_2-5MPa.txt", ["2.5 MPa", "5 MPa"]),
        ("V8_2MPa.csv.gz", ["8.2 MPa", "2 MPa"]),
        ("2026-11-22_5MPa.csv", ["22.5 MPa", "5 MPa"]),
        ("2.000 kPa.csv", ["2.000 kPa", "2000 kPa"]),
        ("20261122_50bar.csv", ["50 bar"]),  # no valve's at 2 million MPa
        ("run_0_500kPa.csv", ["500 kPa"]),  # nor at half a kPa
        ("1.250MPa.csv", ["1.250 MPa"]),  # nor at 1250 MPa
        ("2026.11.22.5MPa.csv", []),
        ("a_1.5MPa_40bar.csv", []),
        ("ramp_2.csv", []),
    ],
)
def test_what_can_be_read_in_two_ways_is_not_guessed(name, readings):
    assert list(pressures_in_name(name)) == readings


def test_a_column_that_agrees_with_either_reading_is_no_contradiction():
    assert not contradicts("ramp_2_5MPa.csv", 2.4e6) and not contradicts("ramp_2_5MPa.csv", 4.9e6)
    assert contradicts("ramp_2_5MPa.csv", 1e6) == "2.5 MPa or 5 MPa"
    assert contradicts("ramp_0p5MPa.csv", 5e6) == "0.5 MPa" and not contradicts("ramp_0p5MPa.csv", 0.495e6)
    assert not contradicts("V0_5MPa.csv", 5e6) and not contradicts("ramp_0_5MPa.csv", 0.495e6)
