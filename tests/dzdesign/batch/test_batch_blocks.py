"""`batch --calibration block`: one firmware and a block a valve; a valve that needs another firmware fails alone."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from dzdesign.batch.summary import anomalies_of, firmware_left
from dzdesign.batch.valve_folders import read_valve_folder
from dzdesign.block_checks import blocks_checked, given_blocks
from dzdesign.codegen.calibration.block import built_for
from dzdesign.codegen.calibration.packing import pack, read_block_file, text_of, unpack
from dzdesign.codegen.project import block_core, generate
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import SourceFile, to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.design.compensator import Compensator
from dzdesign.report.lot.summary import LOT_SETTING
from dzdesign.verify.exhaustive.block_check import BlockFirmware
from dzdesign.verify.toolchain import host_compiler
from tests.dzdesign.batch.test_batch import rows, tree
from tests.support.many_valves import LOT_TOML, write_lot
from tests.support.synthetic import needs_compiler

pytestmark = [pytest.mark.slow, needs_compiler]

SEED = 7
#: The last one needs another firmware: of a converter and rates of its own.
TARGETS = {"V0000": "host", "V0001": "host", "V0002": "cortex-m4"}


def batch(folder, output, *more):
    options = ["--config", str(LOT_TOML), "--jobs", "1", "--calibration", "block", *more]
    return main(["batch", str(folder / "lot.csv"), "-o", str(output), *options])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The lot's list, what the batch made of it, and the compiler's commands."""
    folder = tmp_path_factory.mktemp("lot")
    write_lot(folder, len(TARGETS), 0, SEED)
    lines = [f"{name},{name}/*.csv,{target},{name}-S" for name, target in TARGETS.items()]
    (folder / "lot.csv").write_text("\n".join(["name,files,target,record.serial", *lines]), encoding="utf-8")
    commands, run = [], host_compiler.run_compiler
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(host_compiler, "run_compiler", lambda *given: commands.append(given[0]) or run(*given))
        assert batch(folder, folder / "out") == 1
    return folder, folder / "out", commands


def test_two_valves_of_one_serial_number_are_named(made):
    first, second, failed = (read_valve_folder(valve(made[1], name)) for name in TARGETS)
    assert anomalies_of([first, second, failed], made[1], []) == []
    (line,) = anomalies_of([first, replace(second, compensator=first.compensator), failed], made[1], [])
    assert "V0000, V0001" in line and "'V0000-S'" in line


def test_a_lots_firmware_of_an_earlier_run_is_named(made, tmp_path):
    summary = json.loads((made[1] / "batch.json").read_text("utf-8"))
    assert summary["firmware"] and not any("lot/firmware" in line for line in summary["anomalies"])
    (line,) = firmware_left(made[1], None)
    assert "lot/firmware" in line and firmware_left(tmp_path, None) == []


def valve(output, name):
    return output / "valves" / name


def compensator_of(folder):
    return read_artefact((folder / "compensator.json").read_bytes(), Compensator, str(folder))


def test_one_firmware_and_a_block_a_valve(made):
    _, output, commands = made
    projects = [path.parent for path in output.rglob("manifest.json") if (path.parent / "core").is_dir()]
    assert projects == [output / "lot" / "firmware"]
    core = block_core(built_for(compensator_of(valve(output, "V0000"))))
    assert len(core) == 6
    assert all((projects[0] / name).read_text(encoding="utf-8") == text for name, text in core.items())
    for name in ("V0000", "V0001"):
        folder, octets = valve(output, name), read_block_file(valve(output, name) / "calibration.bin")[0]
        block = unpack(octets)
        assert octets == read_block_file(folder / "calibration.hex")[0] and text_of(block.serial) == f"{name}-S"
        content = (folder / "compensator.json").read_bytes()
        alone = generate(compensator_of(folder), "host", "block")
        assert replace(unpack(alone.block), serial=block.serial, crc32=block.crc32) == block
        found = json.loads((folder / "calibration_check.json").read_bytes())
        assert found["holds"] and found["made_from"][0]["sha256"] == sha256_of(content)
        assert found["block_sha256"] == sha256_of(octets)
    stated = json.loads((output / "batch.json").read_bytes())["firmware"]
    assert stated["block_of"] == LOT_SETTING and stated["folder"] == "lot/firmware"
    assert stated["manifest_sha256"] == sha256_of((projects[0] / "manifest.json").read_bytes())
    # Two different cores, as one valve needs another firmware: each compiled once for checking, whatever the valves.
    cores = [command for command in commands if "-c" in command and "dz_comp.c" in command]
    assert len(cores) <= 2


def test_a_valve_that_needs_another_firmware_fails_alone_with_the_reason(made):
    _, output, _ = made
    table = {row["name"]: row for row in rows(output)}
    assert [table[name]["status"] for name in TARGETS] == ["ok", "ok", "failed"]
    reason = table["V0002"]["reason"]
    assert "another firmware" in reason and "target cortex-m4 instead of host" in reason
    left = {path.name for path in valve(output, "V0002").iterdir()}  # nothing that was found of a block it has not
    assert left == {"manifest.json", "valve.json", "compensator.json", "reason.txt"}
    octets = (valve(output, "V0001") / "calibration.bin").read_bytes()
    assert table["V0001"]["calibration_bin_sha256"] == sha256_of(octets)


def test_what_is_done_is_taken_up(made, capsys):
    folder, output, _ = made
    before = tree(output)
    assert batch(folder, output) == 1
    assert "2 of them done before" in capsys.readouterr().err
    assert tree(output) == before


def test_verify_tries_each_block_with_the_lots_firmware(made):
    _, output, _ = made
    firmware = output / "lot" / "firmware"
    blocks = given_blocks(firmware, [valve(output, "V0001") / "calibration.bin"] * 2)
    inputs, drive = blocks_checked(firmware, blocks)
    assert inputs.holds and drive.holds, (inputs.text, drive.text)
    assert "'V0001-S'" in inputs.text and drive.name.startswith("the drive functions")


@pytest.mark.parametrize("holds", [True, False])
def test_what_is_verified_is_the_valves_block_and_no_firmware_stays(made, holds, tmp_path, monkeypatch):
    """The verification itself has tests of its own; here it only looks at what it is given."""
    folder, _, _ = made
    (tmp_path / "lot.csv").write_text(f"name,files,target,record.serial\nV0001,{folder}/V0001/*.csv,host,S1\n", "utf-8")
    given = []

    def look(arguments, identified):
        given.append((unpack((arguments.firmware / "calibration.bin").read_bytes()), identified))
        (arguments.output / "verification.json").parent.mkdir()
        (arguments.output / "verification.json").write_text("{}", encoding="utf-8")
        fault = SimpleNamespace(holds=holds, name="drive", text="one code off")
        return SimpleNamespace(holds=holds, evidence=SimpleNamespace(all_checks=[fault]))

    monkeypatch.setattr("dzdesign.stages.verify.verify_firmware", look)
    assert batch(tmp_path, tmp_path / "out", "--verify") == (0 if holds else 1)
    alone, ((verified, identified),) = valve(tmp_path / "out", "V0001"), given
    block = unpack((alone / "calibration.bin").read_bytes())
    assert text_of(block.serial) == "S1" and verified == block
    assert to_json_bytes(identified) == (alone / "valve.json").read_bytes()
    assert (alone / "evidence" / "verification.json").is_file() and not (alone / "firmware").exists()
    (row,) = rows(tmp_path / "out")
    assert (row["status"], row["reason"]) == (("ok", "") if holds else ("does not hold", "drive: one code off"))


def test_a_number_that_no_input_shows_is_seen(made, tmp_path):
    """The drive's debouncing is no part of dz_comp(): the block is accepted, and every input is right."""
    _, output, _ = made
    firmware, folder = output / "lot" / "firmware", valve(output, "V0001")
    octets = (folder / "calibration.bin").read_bytes()
    edited = pack(replace(unpack(octets), fault_samples=unpack(octets).fault_samples + 1))
    source = SourceFile(source="compensator.json", sha256="0" * 64)
    assert BlockFirmware(firmware).check(edited, compensator_of(folder), source).holds
    (tmp_path / "valve.bin").write_bytes(edited)
    shutil.copy(folder / "compensator.json", Path(tmp_path) / "any_name.json")
    (check,) = blocks_checked(firmware, given_blocks(firmware, [tmp_path / "valve.bin"]))
    assert check.holds is False and "fault_samples" in check.text
