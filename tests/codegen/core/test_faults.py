"""Debounce, latch and interlock of the drive: what an engineer asks, and seeded faults that verify must find."""

from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import pairwise

import pytest

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions
from dzdesign.verify.exhaustive.drive_check import (
    CompiledDrive,
    PreparedDrive,
)
from tests.codegen.core.test_drive import Firmware, compensator_named
from tests.support.core_variants import variant
from tests.support.golden_firmware import GOLDENS, golden_compensator
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
#: Bits of the status word.
COMMAND, PRESSURE_A, WAITING, HELD, LATCHED = 1, 2, 32, 64, 128
SOUND, BROKEN_A, REVERSED = (1500, 1000), (0, 1000), (1000, 1500)
FULL, INVALID = 4095, 65535


@cache
def compensator_of(samples: int = 5, latch: bool = False, interlock: bool = True):
    valve = golden_compensator("f28335", GOLDENS).valve
    return design(valve, DesignOptions(fault_samples=samples, fault_latch=latch, interlock=interlock))


def started(*options) -> Firmware:
    """The drive after zero command has been seen."""
    firmware = Firmware(compensator_of(*options))
    give(firmware, 0, SOUND, compensator_of(*options).drive_functions.fault_samples)
    assert firmware.state.status == 0
    return firmware


def give(firmware: Firmware, command: int, pressures: tuple[int, ...], count: int = 1) -> list[tuple[int, int]]:
    """Give so many samples; the compare value and the status after each."""
    found = []
    for _ in range(count):
        firmware.sample(command, *pressures)
        firmware.tick()
        found.append((firmware.state.compare_a, firmware.state.status))
    return found


@pytest.mark.parametrize("samples", [1, 5, 40])
def test_after_a_reset_full_command_does_nothing_until_zero_command_was_seen(samples):
    compensator = compensator_of(samples)
    band, firmware = compensator.drive_functions.interlock_codes, Firmware(compensator)
    assert band == compensator.zero_band_codes == 19
    assert set(give(firmware, FULL, SOUND, 3000)) == {(0, WAITING)}
    assert set(give(firmware, band + 1, SOUND, 3000)) == {(0, WAITING)}
    *waits, last = give(firmware, band, SOUND, samples)
    assert set(waits) <= {(0, WAITING)} and last == (compensator.compare(0, 500), 0)
    assert give(firmware, FULL, SOUND)[0] == (compensator.compare(FULL, 500), 0)


@pytest.mark.parametrize("samples", [2, 5])
def test_zero_command_must_be_seen_in_a_row(samples):
    firmware = Firmware(compensator_of(samples))
    for _ in range(50):
        assert set(give(firmware, 0, SOUND, samples - 1) + give(firmware, FULL, SOUND)) == {(0, WAITING)}


@pytest.mark.parametrize("interlock", [True, False])
def test_one_invalid_command_lets_go_at_once_and_full_command_alone_does_not_come_back_by_itself(interlock):
    compensator = compensator_of(5, False, interlock)
    firmware = started(5, False, interlock)
    full = compensator.compare(FULL, 500)
    assert give(firmware, FULL, SOUND, 9)[-1] == (full, 0)
    assert give(firmware, INVALID, SOUND) == [(0, COMMAND | WAITING)]
    if interlock:
        assert set(give(firmware, FULL, SOUND, 2000)) == {(0, WAITING)}
        assert give(firmware, 0, SOUND, 5)[-1] == (compensator.compare(0, 500), 0)
        assert give(firmware, FULL, SOUND) == [(full, 0)]
    else:
        assert give(firmware, FULL, SOUND, 5) == [(0, WAITING)] * 4 + [(full, 0)]


@pytest.mark.parametrize("sign", [1, -1])
def test_the_interlock_of_two_solenoids_waits_for_zero_from_either_side(sign):
    compensator = compensator_named("two solenoids, interlock and latch")
    zero, band = compensator.signals.command.zero_code, compensator.drive_functions.interlock_codes
    firmware = Firmware(compensator)
    pressures = (2400, 1500)
    for away, follows in ((band + 1, False), (-band - 1, False), (band, True)):
        for _ in range(10):
            firmware.sample(zero + sign * away, *pressures)
        assert (firmware.state.status & WAITING == 0) == follows
    firmware.sample(zero + sign * 500, *pressures)
    firmware.tick()
    assert firmware.outputs[0 if sign > 0 else 1] > 0


@pytest.mark.parametrize("fault", [BROKEN_A, (1500, 4095), REVERSED], ids=["A broken", "B above", "reversed"])
def test_a_failed_pressure_has_the_smallest_beta_at_once_and_until_it_was_sound_for_the_debounce(fault):
    compensator = compensator_of()
    smallest, normal = compensator.compare(700, -compensator.reverse_codes - 1), compensator.compare(700, 500)
    assert smallest < normal
    firmware = started()
    assert give(firmware, 700, SOUND, 3)[-1] == (normal, 0)
    first, *rest = give(firmware, 700, fault, 20)
    assert first[0] == smallest and {value for value, _ in rest} == {smallest} and first[1] & HELD
    assert give(firmware, 700, SOUND, 6) == [(smallest, HELD)] * 4 + [(normal, 0)] * 2


def test_at_the_limit_of_plausible_pressures_the_offset_no_longer_chatters():
    """Every sample another side of the limit: without a debounce each change is hundreds of millivolts."""
    on_edge = (1000, 1000 + compensator_of().reverse_codes)
    beyond = (1000, 1001 + compensator_of().reverse_codes)

    def steps(*options) -> tuple[int, int]:
        firmware = started(*options)
        give(firmware, 700, beyond)
        values = [give(firmware, 700, on_edge if sample % 2 else beyond)[0][0] for sample in range(500)]
        return sum(left != right for left, right in pairwise(values)), max(values) - min(values)

    debounced, alone = steps(), steps(1)
    assert debounced == (0, 0)
    assert alone[0] == 499 and alone[1] > 60000 // 100, "more than 100 mV of 10 V"


def test_a_latched_fault_stays_whatever_comes_until_the_drive_is_initialised():
    compensator = compensator_of(3, True)
    smallest = compensator.compare(700, -compensator.reverse_codes - 1)
    firmware = started(3, True)
    assert give(firmware, 700, BROKEN_A, 2)[-1] == (smallest, PRESSURE_A | HELD)
    assert give(firmware, 700, SOUND, 3)[-1] == (compensator.compare(700, 500), 0), "two samples do not latch"
    # Three do, though sound ones come between, as long as there are fewer in a row than are needed.
    assert give(firmware, 700, BROKEN_A, 1) + give(firmware, 700, SOUND, 2) + give(firmware, 700, BROKEN_A, 1)
    assert give(firmware, 700, SOUND, 2)[-1] == (smallest, HELD)
    assert give(firmware, 700, BROKEN_A, 1) == [(smallest, PRESSURE_A | HELD | LATCHED)]
    assert set(give(firmware, 700, SOUND, 5000)) == {(smallest, HELD | LATCHED)}
    assert set(give(firmware, INVALID, SOUND, 3)[-1:]) == {(0, COMMAND | WAITING | HELD | LATCHED)}
    assert set(give(firmware, 0, SOUND, 5000)) == {(0, WAITING | HELD | LATCHED)}


#: What is put for what in dz_drive.c, and the options that show it.
SEEDED = {
    "the interlock is forgotten after an invalid command": (
        "too_few(block, drive->valid_commands) &",
        "too_few(block, drive->valid_commands) & all_ones((drive->status & 1u) ^ 1u) &"),
    "no interlock after a reset": (
        "? block->fault_samples : 0u;", "? block->fault_samples : block->fault_samples;"),
    "an invalid command does not wait": (
        " = valid_samples(block, drive->valid_commands, invalid |", " = valid_samples(block, drive->valid_commands,"),
    "zero one code too wide": (
        "is_negative(block->interlock - codes)", "is_negative(block->interlock + 1u - codes)"),
    "zero one code too narrow": (
        "is_negative(block->interlock - codes)", "is_negative(block->interlock - 1u - codes)"),
    "back one sample early": (
        "return is_negative(valid - block->fault_samples);", "return is_negative(valid + 1u - block->fault_samples);"),
    "back one sample late": (
        "(valid + ((valid - block->fault_samples) >> 31))", "(valid + ((valid - block->fault_samples - 1u) >> 31))"),
    "valid samples need not be in a row": (
        " >> 31)) & ~fault;", " >> 31)) & (~fault | valid);"),
    "latched one sample early": (
        "(block->fault_samples - (uint32_t)1u)", "(block->fault_samples - (uint32_t)2u)"),
    "a single sound command clears the latch": (
        "(uint16_t)(faulty & gone)", "(uint16_t)(faulty & invalid)"),
    "a single sound pressure clears the latch": (
        "(uint16_t)(faulty & held)", "(uint16_t)(faulty & fault)"),
    "the latch of the command is not asked": (
        "invalid | early | latched(block, faulty)", "invalid | early"),
    "pressure B's bit is no fault": (
        "DZ_STATUS_PRESSURE_B | ", ""),
    "an implausible difference is no fault": (
        " | DZ_STATUS_DIFFERENCE));", "));"),
    "the law takes the pressures again": (
        "p_b_adc), held)", "p_b_adc), all_ones(status & 14u))"),
    "the status is silent": (
        "(gone & DZ_STATUS_WAITING) | ", ""),
}  # fmt: skip


@cache
def prepared_and_folder(samples: int, folder) -> tuple[PreparedDrive, CompiledDrive]:
    compensator = compensator_of(samples, True)
    made = generate(compensator, "host")
    write_folder(folder, made.files, made.manifest)
    return PreparedDrive(compensator, count=300), CompiledDrive(folder)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("faults") / "fw"


def test_without_a_seeded_fault_nothing_is_found(folder):
    prepared, drive = prepared_and_folder(3, folder)
    found = drive.check(prepared)
    assert found.faults == 0 and prepared.memories > 1500


@pytest.mark.parametrize("name", SEEDED)
def test_a_seeded_fault_is_found(name, folder):
    prepared, drive = prepared_and_folder(3, folder)
    old, new = SEEDED[name]
    text = drive.sources["dz_drive.c"].decode()
    assert text.count(old) == 1, old
    assert drive.edited("dz_drive.c", text.replace(old, new).encode()).check(prepared).faults > 0


#: Of three pressures: what is remembered of the other side's.
SEEDED_OF_THREE = {
    "one memory for both sides": ("        own = 1u;\n        idle = 0u;\n", ""),
    "the other side forgets its pressures": ("faulty_pressures[idle], others)", "faulty_pressures[idle], 0u)"),
    "the other side's pressures count at once": ("(void)held_pressures(", "held |= held_pressures("),
    "the latch of the other side is asked": (
        "latched(block, drive->faulty_pressures[own])", "latched(block, drive->faulty_pressures[0])"),
    "the drop of the side at rest is a fault": (
        "    others &= DZ_STATUS_PRESSURE_A", "    others &= DZ_STATUS_DIFFERENCE | DZ_STATUS_PRESSURE_A"),
    "C's bit is no fault": (" | DZ_STATUS_PRESSURE_C |\n", " |\n"),
}  # fmt: skip


@pytest.fixture(scope="module")
def of_three(tmp_path_factory):
    compensator = replace_faults(variant("three pressures"))
    made = generate(compensator, "host")
    folder = tmp_path_factory.mktemp("three") / "fw"
    write_folder(folder, made.files, made.manifest)
    return PreparedDrive(compensator, count=300), CompiledDrive(folder)


def replace_faults(compensator):
    """The same with a short debounce."""
    return replace(compensator, drive_functions=replace(compensator.drive_functions, fault_samples=3))


def test_of_three_pressures_nothing_is_found_without_a_seeded_fault(of_three):
    prepared, drive = of_three
    found = drive.check(prepared)
    assert found.faults == 0, found.first_wrong


@pytest.mark.parametrize("name", SEEDED_OF_THREE)
def test_a_seeded_fault_of_the_third_pressure_is_found(name, of_three):
    prepared, drive = of_three
    old, new = SEEDED_OF_THREE[name]
    text = drive.sources["dz_drive.c"].decode()
    assert text.count(old) == 1, old
    assert drive.edited("dz_drive.c", text.replace(old, new).encode()).check(prepared).faults > 0


#: Sound pressures of `three`, and a C that no sensor gives.
THREE, BROKEN_C = (2400, 1500, 1500), (2400, 1500, 0)
PRESSURE_C = 512


def test_a_failed_pressure_of_the_other_side_is_said_and_changes_no_output():
    made = variant("three pressures")
    functions = replace(made.drive_functions, ramp_up=(0, 0), fault_latch=False)
    compensator = replace(made, drive_functions=functions)
    zero, full = compensator.signals.command.zero_code, compensator.signals.command.full_code
    sound, broken = Firmware(compensator), Firmware(compensator)
    for firmware in (sound, broken):
        give(firmware, zero, THREE, 5)
    for command in (zero, full, (zero + full) // 2):
        of_sound, of_broken = give(sound, command, THREE, 300), give(broken, command, BROKEN_C, 300)
        assert [compare for compare, _ in of_sound] == [compare for compare, _ in of_broken]
        assert {status for _, status in of_broken} == {PRESSURE_C | status for _, status in of_sound}
    # Back again, it must have been valid for the debounce before the side that reads it uses it.
    negative = compensator.signals.command.negative_full_code
    give(broken, zero, BROKEN_C, 300)
    statuses = []
    for _ in range(10):
        broken.sample(negative, *THREE)
        statuses.append(broken.state.status & HELD)
    assert statuses == [HELD] * 4 + [0] * 6


def test_without_a_transition_the_declared_error_of_the_command_counts_as_zero():
    valve = golden_compensator("f28335", GOLDENS).valve
    compensator = design(valve, DesignOptions(transition=Fraction(0)))
    functions = compensator.drive_functions
    assert compensator.zero_band_codes == 0
    assert functions.interlock_codes == compensator.command_error.zero_band_codes == 19
    assert replace(functions, interlock_codes=None).interlock_codes is None
