"""Files of amplifiers, read back from their text by readers that share no code with the writers: their law is safe."""

import json
from dataclasses import replace
from fractions import Fraction

import pytest

from dzdesign import api
from dzdesign.codegen.amplifier.device import DEVICE_NAMES, device_named
from dzdesign.codegen.amplifier.files import amplifier_file, is_file_of, notes_of
from dzdesign.codegen.amplifier.setting import amplifier_setting
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.fixed_offset import dead_zones
from tests.support.amplifier_readers import StatedBound, dead_zone, over_compensated, read_file
from tests.support.paths import GOLDENS, GOLDENS_FULL

DIGEST = "0123456789abcdef" * 4
#: The RMC100 takes no 5 V.
OF_ONE = tuple(name for name in DEVICE_NAMES if name != "rmc")
#: By how much an amplifier may be off, and the oil may move the threshold, in the third design.
BUDGET = {"amplifier": "5 %", "oil": "2 %", "ageing": "0 %"}
LEAST_FACTOR = 1 / Fraction(105, 100) * Fraction(98, 100)
CASES = (
    [("one solenoid", name) for name in OF_ONE]
    + [("two solenoids", name) for name in ("west", "cia408", "csv", "rmc75")]
    + [("a budget", name) for name in ("west", "csv")]
)


def unlimited(compensator):
    """Return a compensator that allows full drive."""
    functions = replace(compensator.drive_functions, compare_limit=compensator.signals.compare_max)
    return replace(compensator, drive_functions=functions)


@pytest.fixture(scope="session")
def designs():
    """The designs, by name."""
    one, two = (
        read_artefact((root / "compensator.json").read_bytes(), Compensator, "compensator.json")
        for root in (GOLDENS, GOLDENS_FULL)
    )
    return {
        "one solenoid": one,
        "two solenoids": unlimited(two),
        "two, limited": two,
        "a budget": api.design(GOLDENS / "valve.json", bench_pressure_error="0 MPa", **BUDGET),
    }


@pytest.fixture
def case(designs, tmp_path):
    """Return the file of a design for a device, its law, the document, and the share that a dither keeps."""

    def made(name, device, text=None):
        compensator, path = designs[name], tmp_path / f"{device}{device_named(device).ending}"
        content = amplifier_file(amplifier_setting(compensator, device_named(device)), compensator, DIGEST)
        path.write_bytes(content if text is None else text(content.decode()).encode())
        functions, signals = compensator.drive_functions, compensator.signals
        kept = Fraction(functions.dither_counts, signals.compare_max)
        return read_file(device, path), json.loads(to_json_bytes(compensator)), kept

    return made


def zero_of(compensator):
    """Return the largest command that may be zero, a share of full."""
    codes = compensator.command_error.offset_codes + compensator.command_error.noise_codes
    return Fraction(codes, compensator.signals.command.span(1))


def violations(case, designs, name, device, text=None):
    """Return how many pressure drops are over-compensated by a file, and by how much its dead zones are off at most."""
    law, document, kept = case(name, device, text)
    factor = LEAST_FACTOR if name == "a budget" else Fraction(1)
    # A controller that adds an offset to its own output reads no command, so its zero is exact.
    zero = Fraction(0) if device.startswith("rmc") else zero_of(designs[name])
    over = over_compensated(law, document, zero, factor=factor, kept=kept)
    setting = amplifier_setting(designs[name], device_named(device))
    off, full_V = 0.0, Fraction(*document["u_max_V"])
    for sign, side in ((1, "positive"), (-1, "negative")):
        if sign not in setting.characteristics:
            continue
        stated = dead_zones(designs[name], setting.characteristics[sign], sign)
        tests = document["valve"]["sides"][side]["tests"]
        assert len(stated) == len(tests)
        for row, test in zip(stated, tests, strict=True):
            for branch, key in (("opening", "u_knee_rising_V"), ("closing", "u_knee_falling_V")):
                found = dead_zone(law, sign, Fraction(repr(test[key])) / full_V)
                off = max(off, abs(row.fixed[branch] - (2 if found is None else found)))
    return over, off


@pytest.mark.parametrize(("name", "device"), CASES)
def test_a_file_read_back_over_compensates_nowhere_and_its_dead_zones_are_those_stated(case, designs, name, device):
    over, off = violations(case, designs, name, device)
    assert over == 0
    assert off <= 1e-4


@pytest.mark.parametrize(
    ("name", "device"),
    # Of two solenoids the RMC75 has one value, which is far from the other side's bound.
    [case for case in CASES if case[1] not in ("csv", "beckhoff") and case != ("two solenoids", "rmc75")],
)
def test_one_count_more_over_compensates(case, designs, name, device):
    """The setting is the largest one, and the check sees a single count."""
    offset = device_named(device).offset
    counts = amplifier_setting(designs[name], device_named(device)).parameters[offset.positive]

    def one_more(text):
        if device == "rmc75":
            assert f"{counts / 1000:.3f}" in text
            return text.replace(f"{counts / 1000:.3f}", f"{(counts + 1) / 1000:.3f}")
        separator = "=" if device == "cia408" else " "
        assert f"{separator}{counts}" in text
        return text.replace(f"{separator}{counts}", f"{separator}{counts + 1}")

    over, _ = violations(case, designs, name, device, one_more)
    assert over > 0


@pytest.mark.parametrize(
    ("name", "device", "change"),
    [
        ("two solenoids", "west", lambda text: exchanged(text, ":A", ":B")),
        ("two solenoids", "cia408", lambda text: exchanged(text, "6343", "6344")),
        ("two solenoids", "csv", lambda text: "\n".join(swapped(line) for line in text.splitlines())),
        ("one solenoid", "rmc75", lambda text: text.replace(" V\r", " mV\r")),
        ("one solenoid", "west", lambda text: text.replace("MIN:A 4", "MIN:A ")),
        ("one solenoid", "west", lambda text: text.replace("TRIGGER 47", "TRIGGER 470")),
        ("one solenoid", "beckhoff", lambda text: text.replace("0.4956", "0.4957")),
    ],
    ids=["sides of west", "sides of cia408", "sides of csv", "unit of rmc75", "a digit of west", "trigger", "a table"],
)
def test_a_wrong_file_is_seen(case, designs, name, device, change):
    over, off = violations(case, designs, name, device, change)
    assert over > 0 or off > 1e-3


def exchanged(text, one, other):
    """Return a text in which two words have changed places."""
    return text.replace(one, "\0").replace(other, one).replace("\0", other)


def swapped(line):
    """Return a line of a table with the command's sign turned round, the drive's too."""
    if not line[:1].isdigit() and not line.startswith("-"):
        return line
    command, drive = line.split(",")
    return f"{command},{-float(drive):.4f}"


def test_the_largest_safe_offset_lies_on_the_bound(designs):
    """It is the lowest place of the stated bound, between the tests too, and no further from it than its decimals."""
    for name in ("one solenoid", "two solenoids"):
        compensator = designs[name]
        document = json.loads(to_json_bytes(compensator))
        offsets = amplifier_setting(compensator, device_named("csv")).offsets
        kept = Fraction(compensator.drive_functions.dither_counts, compensator.signals.compare_max)
        for sign, offset in offsets.items():
            bound = StatedBound.of(document, "positive" if sign > 0 else "negative")
            least = min(bound.at(place) for place in bound.places(4000))
            share = least / Fraction(*document["u_max_V"]) - kept
            assert share - Fraction(1, 10**5) < offset.share <= share + Fraction(1, 10**6)


def test_a_table_is_the_law_beyond_the_transition_and_rises(designs, case):
    for name, device in (("one solenoid", "beckhoff"), ("two solenoids", "csv"), ("two, limited", "beckhoff")):
        compensator, (law, _, _) = designs[name], case(name, device)
        commands, drives = zip(*law.points, strict=True)
        assert list(commands) == sorted(set(commands)) and list(drives) == sorted(set(drives))
        at = compensator.valve.sides["positive"].reference.dp_MPa
        dp_code = round(compensator.signals.dp_code(Fraction(repr(at))))
        command = compensator.signals.command
        for sign in compensator.signals.signs:
            for code in range(compensator.transition_end, command.span(sign), 97):
                exact = compensator.drive(command.zero_code + command.direction(sign) * code, dp_code, sign)
                read = sign * law.drive(sign * Fraction(code, command.span(sign)))
                limit = Fraction(compensator.drive_functions.compare_limit, compensator.signals.compare_max)
                assert abs(read - min(exact, limit)) < 1e-4


def test_the_same_design_gives_the_same_bytes_with_its_hash_and_is_known_again(designs):
    compensator = designs["one solenoid"]
    for name in OF_ONE:
        device = device_named(name)
        first, second = (amplifier_file(amplifier_setting(compensator, device), compensator, DIGEST) for _ in range(2))
        assert first == second and first.isascii() and is_file_of(device, first)
        naming = [line for line in first.decode().splitlines() if DIGEST in line]
        assert ["compensator.json" in line for line in naming] == [True] * (device.format != "commands")
        for other in (b"time,u_V\n0,1\n", (GOLDENS / "host" / "core" / "dz_comp.h").read_bytes()):
            assert not is_file_of(device, other)


def test_every_device_states_its_source_its_range_and_a_law_that_is_drawn_up():
    for name in DEVICE_NAMES:
        device = device_named(name)
        assert device.sources and all(len(source) > 20 for source in device.sources)
        assert (device.offset is None) == (device.law == "table")
        for parameter in (device.offset, device.full, device.threshold):
            assert parameter is None or 0 <= parameter.least < parameter.most <= device.counts_of_full
        texts = (device.title, device.description, device.unconfirmed, device.hint, device.instead)
        text = "".join((*texts, *device.sources))
        assert text.isascii() and "*)" not in text and "\n" not in text and "http" not in text


@pytest.mark.parametrize(
    ("name", "device", "options"),
    [
        ("one solenoid", "rmc", {}),
        ("two solenoids", "west-pam190", {}),
        ("one solenoid", "west", {"dp_MPa": Fraction(2)}),
        ("one solenoid", "csv", {"dp_MPa": Fraction(8)}),
        ("one solenoid", "rmc75", {"threshold": Fraction(1, 100)}),
        ("limited", "cia408", {}),
        ("limited low", "west", {}),
        ("one solenoid", "none", {}),
    ],
)
def test_what_a_device_does_not_hold_is_refused(designs, name, device, options, wording):
    compensator = designs["one solenoid"]
    if name.startswith("limited"):
        limit = 45_000 if name == "limited" else 29_000
        functions = replace(compensator.drive_functions, compare_limit=limit)
        compensator = replace(compensator, drive_functions=functions)
    if name == "two solenoids":
        compensator = designs[name]
    with wording.refusal(InputError, f"amplifier files: {device}, {name}, {' '.join(options) or 'as it is'}"):
        amplifier_setting(compensator, device_named(device), **options)


def test_a_threshold_is_rounded_up_and_an_offset_down(designs):
    setting = amplifier_setting(designs["one solenoid"], device_named("west"), threshold=Fraction(1, 3000))
    assert setting.parameters["TRIGGER"] == 4
    drives = setting.characteristics[1]
    assert drives.drive(Fraction(1, 3000)) == drives.drive(Fraction(4, 10_000)) == 0
    assert drives.drive(Fraction(4, 10_000) + Fraction(1, 10**9)) >= Fraction(setting.parameters["MIN:A"], 10_000)
    offset, counts = setting.offsets[1].share, setting.parameters["MIN:A"]
    assert counts <= offset * 10_000 < counts + 1


def test_full_command_is_the_drive_that_opens_the_valve_fully_at_every_test(designs, monkeypatch):
    drives = iter([Fraction(70, 100), Fraction(85, 100), Fraction(60, 100)])
    monkeypatch.setattr("dzdesign.codegen.amplifier.setting.full_drive", lambda *_: next(drives))
    assert amplifier_setting(designs["one solenoid"], device_named("west")).parameters["MAX:A"] == 8500


def test_notes_say_what_is_not_certified(designs):
    notes = {
        name: " ".join(notes_of(amplifier_setting(compensator, device_named("west")), compensator))
        for name, compensator in designs.items()
    }
    assert "above 5.00 MPa" in notes["one solenoid"] and "only the valve as recorded" in notes["one solenoid"]
    assert "below 1.00 MPa" in notes["two solenoids"] and "dither" in notes["two solenoids"]
    assert "only the valve as recorded" not in notes["a budget"]
