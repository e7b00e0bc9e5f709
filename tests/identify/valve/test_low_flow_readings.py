"""`--low-flow`: a reading by hand as it is typed, and what is refused."""

import pytest

from dzdesign.core.errors import InputError
from dzdesign.identify.valve.low_flow import EXAMPLE, read_low_flow, readings_of_side


@pytest.mark.parametrize(
    "text",
    [
        "12 +- 3 mL/min at 5.1 V, 3 MPa, closing",
        "12 mL/min ± 0.003 L/min at 51 %, 30 bar, CLOSING",
        "0.012+/-0.003 L/min  at  5100 mV,3000 kPa,closing",
        " 200 +- 50 mm³/s at 5.1 V, 3 MPa, closing ",
    ],
)
def test_it_may_be_written_in_many_ways(text):
    (row,) = read_low_flow(text, 10.0)
    assert row.u_V == pytest.approx(5.1) and row.dp_MPa == pytest.approx(3.0) and row.branch == "falling"
    assert row.q_L_min == pytest.approx(0.012) and row.q_error_L_min == pytest.approx(0.003)
    assert row.source == "low-flow reading 1"


def test_the_example_of_the_help_is_one():
    (row,) = read_low_flow([EXAMPLE], 10.0)
    assert (row.u_V, row.dp_MPa, row.branch) == (5.16, 5.0, "falling")


@pytest.mark.parametrize("sign", ["-", ""], ids=["as the command", "as an amount"])
def test_negative_commands_are_of_the_negative_side_whichever_sign_their_flows_have(sign):
    rows = read_low_flow(
        ["12 +- 3 mL/min at 5.1 V, 3 MPa, closing", f"{sign}14 +- 3 mL/min at -5.2 V, 3 MPa, closing"], 10.0
    )
    (positive,), (negative,) = readings_of_side(rows, 1), readings_of_side(rows, -1)
    assert (positive.u_V, negative.u_V) == (5.1, 5.2) and negative.q_L_min == pytest.approx(0.014)


def test_a_flow_against_the_command_within_its_error_is_none():
    (row,) = read_low_flow("-2 +- 3 mL/min at 5.1 V, 3 MPa, opening", 10.0)
    assert row.q_L_min == 0 and row.branch == "rising"


@pytest.mark.parametrize(
    "given",
    [
        "low.csv",
        "5 mL/min at 5.16 V, 5 MPa, closing",
        "5 +- 1 mL/min at 5.16 V, 5 MPa, shut",
        "5 +- 1 mL/min at 51.6 V, 5 MPa, closing",
        "5 +- 1 mL/min at 5.16 V, 0 MPa, closing",
        "5 +- 0 mL/min at 5.16 V, 5 MPa, closing",
        "-5 +- 1 mL/min at 5.16 V, 5 MPa, closing",
        "5 +- 1 at 5.16 V, 5 MPa, closing",
        "5 +- 1 mL/min at 5.16, 5 MPa, closing",
        [EXAMPLE, EXAMPLE],
        [5.0],
    ],
)
def test_what_no_valve_gives_is_refused(given, wording):
    with wording.refusal(InputError, f"low flow readings: {given}"):
        read_low_flow(given, 10.0)
