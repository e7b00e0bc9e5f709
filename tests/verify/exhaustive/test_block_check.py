"""One firmware with the blocks of other valves: what is right holds on every input, any other number or law is seen."""

from dataclasses import replace

import pytest

from dzdesign.block_checks import given_blocks
from dzdesign.codegen.calibration.packing import pack, unpack
from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_types import SourceFile
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.verify.exhaustive.block_check import BlockFirmware
from dzdesign.verify.toolchain import host_compiler
from tests.support.block_cores import block_folder
from tests.support.core_variants import variant
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
SOURCE = SourceFile(source="compensator.json", sha256="0" * 64)
FORMAT_AND_CRC, FIRMWARE = 0b10, 0b100


@pytest.fixture(scope="module")
def lot(tmp_path_factory):
    """A firmware folder in block form, and folders with block and compensator.json of two valves of its kind."""
    folder = tmp_path_factory.mktemp("lot")
    first = variant("default")
    other = variant("no transition")
    for name, compensator in {"one": first, "other": other}.items():
        block_folder(compensator, folder / name)
    firmware = generate(first, "f28335", "block")
    write_folder(folder / "fw", firmware.contents, firmware.manifest)
    return folder, {"one": first, "other": other}


def block_in(folder, name):
    return (folder / name / "calibration.bin").read_bytes()


def changed(octets, **numbers):
    return pack(replace(unpack(octets), **numbers))


@pytest.mark.slow
def test_each_block_is_tried_on_every_input_and_the_core_is_compiled_once(lot, monkeypatch):
    folder, compensators = lot
    commands, run = [], host_compiler.run_compiler
    monkeypatch.setattr(host_compiler, "run_compiler", lambda *given: commands.append(given[0]) or run(*given))
    earlier = set(host_compiler.build_folder().glob("*.bin"))
    firmware = BlockFirmware(folder / "fw")
    found = {"one": firmware.check(block_in(folder, "one"), compensators["one"], SOURCE)}
    first = len(commands)
    found["other"] = firmware.check(block_in(folder, "other"), compensators["other"], SOURCE)
    assert all(each.holds and each.inputs[0].inputs > 20_000_000 for each in found.values())
    assert len({each.inputs[0].outputs_hash for each in found.values()}) == 2
    assert len({each.inputs[0].object_sha256 for each in found.values()}) == 1
    assert sum("dz_comp.c" in command for command in commands) <= 1
    assert not any(each in command for command in commands[first:] for each in ("every_input.c", "other_codes.c"))
    assert set(host_compiler.build_folder().glob("*.bin")) <= earlier  # others may take theirs away meanwhile


def test_the_block_of_another_valve_is_seen(lot):
    folder, compensators = lot
    found = BlockFirmware(folder / "fw").check(block_in(folder, "one"), compensators["other"], SOURCE)
    check = found.requirement("one", compensators["other"])
    assert not found.holds and found.inputs[0].wrong and check.holds is False and "one" in check.name


def test_what_the_firmware_refuses_is_not_tried(lot):
    folder, compensators = lot
    firmware, octets = BlockFirmware(folder / "fw"), block_in(folder, "one")
    damaged = firmware.check(octets[:99] + bytes([octets[99] ^ 1]) + octets[100:], compensators["one"], SOURCE)
    other_rate = firmware.check(changed(octets, tick_Hz=unpack(octets).tick_Hz // 2), compensators["one"], SOURCE)
    assert damaged.refused & FORMAT_AND_CRC and other_rate.refused == FIRMWARE
    assert not damaged.holds and not other_rate.holds and not damaged.inputs + other_rate.inputs
    with pytest.raises(RequirementError, match="octets"):
        firmware.check(octets[:-2], compensators["one"], SOURCE)


def test_what_can_not_be_tried_is_refused_before_anything_runs(lot, tmp_path):
    folder, compensators = lot
    lonely = tmp_path / "valve.bin"
    lonely.write_bytes(block_in(folder, "one"))
    with pytest.raises(InputError, match="beside"):
        given_blocks(folder / "fw", [lonely])
    fixed = generate(compensators["one"], "f28335")
    write_folder(tmp_path / "fixed", fixed.contents, fixed.manifest)
    with pytest.raises(InputError, match="block form"):
        given_blocks(tmp_path / "fixed", [folder / "one" / "calibration.bin"])
