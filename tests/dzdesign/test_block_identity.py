"""Whose a calibration block is: blocks that are right by themselves, and would drive another valve than their own."""

from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import pytest

from dzdesign.block_checks import GivenBlock, beside_another, blocks_checked, of_another_valve
from dzdesign.codegen.calibration.block import block_of
from dzdesign.codegen.calibration.packing import pack, text_of, unpack
from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_types import THIS_TOOL, to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.design.compensator import Compensator
from dzdesign.report.lot.summary import OK, ValveManifest
from dzdesign.verify.requirements import EXACT_LAW, Check
from tests.support.core_variants import variant


def of_valve(serial: str) -> Compensator:
    compensator = variant("default")
    return replace(compensator, valve=replace(compensator.valve, record={"Serial": serial} if serial else {}))


@dataclass
class Accepted:
    """In place of trying every input: a firmware that finds nothing wrong with any block."""

    folder: Path

    def check(self, block: bytes, compensator: Compensator, source: object) -> "Accepted":
        return self

    def requirement(self, name: str, compensator: Compensator) -> Check:
        return EXACT_LAW.check(holds=True, text="every input is right", name=name)


@pytest.fixture
def tried(monkeypatch, tmp_path):
    """Return what blocks_checked() says of the blocks at these places, of compensators and with serial numbers."""
    monkeypatch.setattr("dzdesign.verify.exhaustive.block_check.BlockFirmware", Accepted)
    monkeypatch.setattr("dzdesign.block_checks.drives_checked", lambda folder, blocks: [])
    monkeypatch.setattr("dzdesign.block_checks.refuse_underived", lambda *_, **__: None)
    firmware = generate(of_valve(""), "f28335", calibration="block").manifest
    monkeypatch.setattr("dzdesign.verify.folder.read_firmware_manifest", lambda folder: firmware)

    def check(blocks: dict[str, tuple[Compensator, str | None]]) -> list[Check]:
        given = []
        for name, (compensator, serial) in blocks.items():
            path = tmp_path / name
            path.parent.mkdir(exist_ok=True)
            document = path.parent / "compensator.json"
            document.write_bytes(to_json_bytes(compensator))
            octets = pack(block_of(compensator, sha256_of(document.read_bytes()), serial=serial))
            given.append(GivenBlock(path=path, octets=octets, compensator_json=document))
        return blocks_checked(tmp_path, given)

    return check


def test_the_block_of_a_firmware_names_its_valve():
    assert text_of(unpack(generate(of_valve("47"), "host", calibration="block").block).serial) == "47"


def test_a_serial_number_that_the_test_record_contradicts(tried):
    assert of_another_valve("48", of_valve("47"))
    long = "a number of more octets than a block has room for"
    for serial, recorded in (("47", "47"), ("", "47"), ("48", ""), ("a number", long)):
        assert of_another_valve(serial, of_valve(recorded)) == ""
    (check,) = tried({"a/valve.bin": (of_valve("47"), "48")})
    assert check.holds is False and "'48'" in check.text and "'47'" in check.text


def test_each_block_says_whose_it_is(tried):
    first, second = tried({"a/valve.bin": (of_valve("47"), None), "b/valve.bin": (of_valve("48"), None)})
    assert first.holds and second.holds
    assert "'47'" in first.text and "'48'" in second.text and "CRC-32 " in first.text


def test_one_valves_block_in_two_folders(tried):
    alike = of_valve("")
    *each, repeated = tried({"a/valve.bin": (alike, None), "b/valve.bin": (alike, None)})
    assert all(check.holds for check in each) and repeated.holds is False
    assert all(name in repeated.name for name in ("a/valve.bin", "b/valve.bin"))
    *_, repeated = tried({"a/valve.bin": (of_valve("47"), None), "b/valve.bin": (of_valve(""), "47")})
    assert repeated.holds is False and "'47'" in repeated.text
    assert all(check.holds for check in tried({"a/valve.bin": (alike, None), "a/valve.hex": (alike, None)}))


def test_a_design_for_a_converter_of_another_range(tried):
    """Codes of 3.3 V at a converter of 3 V: no number of the block tells."""
    target = target_named("f28335").inputs()
    for full_V, holds in ((target.converter.full_V, True), (Fraction(33, 10), False)):
        designed_for = replace(target, converter=replace(target.converter, full_V=full_V))
        (check,) = tried({"a/valve.bin": (replace(of_valve("47"), target=designed_for, options={}), None)})
        assert check.holds is holds and ("converter's range" in check.text) is not holds


def test_a_folder_of_a_batch_whose_block_is_another(tmp_path):
    octets = b"the block that the batch wrote"
    files = {"calibration.bin": sha256_of(octets)}
    manifest = ValveManifest(tool=THIS_TOOL, made_from=(), name="V1", status=OK, files=files)
    block = tmp_path / "calibration.hex"
    assert beside_another(block, octets) == ""
    (tmp_path / "manifest.json").write_bytes(to_json_bytes(manifest))
    assert beside_another(block, octets) == ""
    assert "'V1'" in beside_another(block, b"another")
    (tmp_path / "manifest.json").write_bytes(to_json_bytes(replace(manifest, files={})))
    assert beside_another(block, b"another") == ""
