"""The check of an amplifier's file finds what is wrong with one: numbers, sides, units, and dead zones of another."""

from dataclasses import replace
from fractions import Fraction

import pytest

from dzdesign import api
from dzdesign.codegen.amplifier.device import device_named
from dzdesign.codegen.amplifier.files import amplifier_file, notes_of
from dzdesign.codegen.amplifier.setting import amplifier_setting
from dzdesign.core.errors import RequirementError
from dzdesign.design.fixed_offset import dead_zones, fixed_offset
from dzdesign.design.lot_valves import LotSide, LotValve
from dzdesign.verify.outputs.amplifier import file_checks
from dzdesign.verify.requirements import DEAD_ZONES, READ_BACK, SAFE
from tests.support.golden_firmware import FULL, golden_compensator, golden_valve

DIGEST = "0" * 64


@pytest.fixture(scope="module")
def designs():
    return {"one": golden_compensator(), "two": golden_compensator(root=FULL)}


def exported(compensator, device):
    """Return the file for a device, and what is stated of it."""
    setting = amplifier_setting(compensator, device_named(device))
    stated = {
        sign: [(row.dp_MPa, row.fixed) for row in dead_zones(compensator, drives, sign)]
        for sign, drives in setting.characteristics.items()
    }
    return amplifier_file(setting, compensator, DIGEST), stated


def failed(device, content, compensator, stated):
    return {check.id for check in file_checks(device, content, compensator, stated) if not check.holds}


@pytest.mark.parametrize(
    ("name", "device", "old", "new", "wrong"),
    [
        ("one", "west", "MIN:A 4956", "MIN:A 4957", SAFE),
        ("one", "west", "MIN:A 4956", "MIN:A 4856", DEAD_ZONES),
        ("one", "west", "MAX:A 9999", "MAX:A 999", DEAD_ZONES),
        ("one", "west", "TRIGGER 47", "TRIGGER 4", DEAD_ZONES),
        ("one", "west", "TRIGGER", "TRIGER", READ_BACK),
        ("one", "west", "TRIGGER 47", "TRIGGER 47\r\nMAX 5", READ_BACK),
        ("one", "west", ":A", ":B", READ_BACK),
        # What reads as the certified law, and is another one in a device that reads otherwise or takes more of it.
        ("one", "west", "MIN:A 4956", "MIN:A 9000\r\nMIN:A 4956", READ_BACK),
        ("one", "west", "MIN:A 4956", "MIN:A 4_956", READ_BACK),
        ("one", "west", "MIN:A 4956\r", "MIN:A 4956\x0b", READ_BACK),
        ("one", "cia408", "ParameterValue=8120", "ParameterValue=0x1FB8", READ_BACK),
        ("one", "cia408", "[6345sub1]", "[6346sub1]\r\nParameterValue=9000\r\n\r\n[6345sub1]", READ_BACK),
        ("one", "cia408", "[FileInfo]", "[DEFAULT]\r\nParameterValue=9000\r\n\r\n[FileInfo]", READ_BACK),
        ("one", "beckhoff", "END_VAR", "END_VAR\r\nValveCharacteristicTable[2,2] := 0.9;", READ_BACK),
        ("one", "beckhoff", "END_VAR", "    x : INT := 1;\r\nEND_VAR", READ_BACK),
        ("one", "csv", "0.4640,", "58/125,", READ_BACK),
        ("one", "cia408", "ParameterValue=8120", "ParameterValue=8121", SAFE),
        ("one", "cia408", "ParameterValue=1\r", "ParameterValue=2\r", READ_BACK),
        ("one", "cia408", "[6345sub1]", "[6345]", READ_BACK),
        ("one", "rmc75", "4.956 V", "4.957 V", SAFE),
        ("one", "rmc75", "4.956 V", "4.956 mV", DEAD_ZONES),
        ("one", "rmc75", "4.956 V", "4.956 kV", READ_BACK),
        ("one", "beckhoff", "0.004640, 0.495", "0.004640, 0.496", SAFE),
        ("one", "beckhoff", "0.004640, 0.495", "0.004640, 0.395", DEAD_ZONES),
        ("one", "beckhoff", "190(0.0)", "188(0.0)", READ_BACK),
        ("one", "beckhoff", "1.000000, 0.9", "0.900000, 0.9", READ_BACK),
        ("one", "csv", "0.4640,49.5", "0.4640,49.7", SAFE),
        ("one", "csv", "command_percent", "drive", READ_BACK),
        ("one", "csv", "0.0000,0.0000", "0.0000,1.0000", READ_BACK),
        ("one", "csv", "100.0000,9", "100.0000,109", READ_BACK),
        # Drive for a side that the design has not.
        ("one", "west", "TRIGGER 47", "TRIGGER 47\r\nMIN:B 9000\r\nMAX:B 9999", READ_BACK),
        ("one", "cia408", "ParameterValue=0\r", "ParameterValue=9000\r", READ_BACK),
        ("one", "csv", "0.0000,0.0000", "-100.0000,-99.0000\r\n-0.0100,-98.0000\r\n0.0000,0.0000", READ_BACK),
        ("two", "west", "MIN:B 27", "MIN:B 28", SAFE),
        ("two", "csv", "-", "", READ_BACK),
    ],
)
def test_a_seeded_fault_is_found(designs, name, device, old, new, wrong):
    content, stated = exported(designs[name], device)
    assert old.encode() in content
    assert wrong.id in failed(device, content.replace(old.encode(), new.encode()), designs[name], stated)


@pytest.mark.parametrize(("share", "said"), [("0", True), ("0.001", True), ("0.3", False), (None, False)])
def test_a_threshold_below_the_designs_reading_of_zero_is_said(designs, share, said):
    """Of a command at the design's 0.46 % a table with a threshold of 0.1 % opens the valve: its check must say so."""
    threshold = None if share is None else Fraction(share)
    setting = amplifier_setting(designs["one"], device_named("csv"), threshold=threshold)
    content = amplifier_file(setting, designs["one"], DIGEST)
    _, safe, _ = file_checks("csv", content, designs["one"], {}, threshold)
    assert safe.id == SAFE.id and safe.holds
    assert ("the design declares 0.46%" in safe.text) is said
    assert any("flow at zero command is possible" in note and "--threshold" in note
               for note in notes_of(setting, designs["one"])) is said  # fmt: skip


def test_dead_zones_of_something_else_are_found(designs):
    content, stated = exported(designs["one"], "west")
    [(dp_MPa, shares), *rest] = stated[1]
    for other in (
        {1: rest},
        {1: [(dp_MPa + 1, shares), *rest]},
        {1: [(dp_MPa, shares | {"opening": shares["opening"] + 2e-4}), *rest]},
        {1: [(dp_MPa, {"opening": shares["opening"]}), *rest]},
        {},
    ):
        assert failed("west", content, designs["one"], other) == {DEAD_ZONES.id}


def test_a_file_that_does_not_hold_is_not_written(tmp_path, monkeypatch):
    """One count too many, by a fault in the rounding, reaches no file."""
    compensator = api.design(golden_valve())
    assert api.export(compensator, to="west").setting.parameters["MIN:A"] == 4956
    monkeypatch.setattr("dzdesign.codegen.amplifier.setting.floor", lambda value: value.__floor__() + 1)
    with pytest.raises(RequirementError, match="over-compensated"):
        api.export(compensator, to="west", output=tmp_path / "valve.txt")
    assert not any(tmp_path.iterdir())


def test_a_lot_is_safe_for_its_lowest_valve(designs):
    compensator = designs["one"]
    own = LotSide.of(compensator.valve.sides["positive"], compensator.positive.certificate.guard)
    lower = replace(own, u_lower_V=tuple(value - 0.05 for value in own.u_lower_V))
    digests = compensator.valve_json_sha256, "0" * 64
    lot = tuple(
        LotValve(name=f"V{n}", valve_sha256=digest, positive=side)
        for n, (digest, side) in enumerate(zip(digests, (own, lower), strict=True))
    )
    both = replace(compensator, lot=lot)
    assert fixed_offset(compensator).share - fixed_offset(both).share == Fraction(5, 1000)
    content, stated = exported(both, "west")
    assert failed("west", content, both, stated) == set()
    assert SAFE.id in failed("west", exported(compensator, "west")[0], both, stated)


def test_a_bound_that_sags_between_two_tests_counts_where_it_is_deepest(designs):
    """Of equal bounds at 1 and 5 MPa, with M = 0.1 V/MPa2, it is M h2 / 8 = 0.2 V lower at 3 MPa."""
    compensator = designs["one"]
    own = LotSide.of(compensator.valve.sides["positive"], compensator.positive.certificate.guard)
    sags = replace(own, trend="flat", dp_MPa=(1.0, 5.0), u_lower_V=(4.9, 4.9), curvature_V_MPa2=(0.1,))
    digests = compensator.valve_json_sha256, "0" * 64
    lot = tuple(
        LotValve(name=f"V{n}", valve_sha256=digest, positive=side)
        for n, (digest, side) in enumerate(zip(digests, (own, sags), strict=True))
    )
    both = replace(compensator, lot=lot)
    found = fixed_offset(both)
    assert (found.share, found.lowest_at_MPa) == (Fraction(47, 100), Fraction(3))
    content, stated = exported(both, "cia408")
    assert failed("cia408", content, both, stated) == set()


def test_a_gauge_that_read_too_little_counts_as_a_higher_pressure_drop():
    valve, budget = golden_valve(), {"amplifier": "1 %"}
    exact, wrong = (
        api.design(valve, bench_pressure_error=error, **budget) for error in ("0 MPa", "0.3 MPa")
    )
    assert fixed_offset(exact).lowest_at_MPa == 5 and fixed_offset(wrong).lowest_at_MPa == Fraction(53, 10)
    assert fixed_offset(wrong).share < fixed_offset(exact).share
    content, stated = exported(wrong, "west")
    assert failed("west", content, wrong, stated) == set()
    content, stated = exported(exact, "west")
    assert failed("west", content, wrong, stated) == {SAFE.id}
