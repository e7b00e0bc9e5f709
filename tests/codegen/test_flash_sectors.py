"""The flash sectors of the calibration blocks, stated once more from TI's linker files.

Oracle: C2000Ware 26.01.00.00, device_support/f2833x/common/cmd/F28335.cmd and
device_support/f28004x/common/cmd/28004x_generic_flash_lnk.cmd; `make bench-c2000ware` reads a user's own copy of them.
"""

import re
from dataclasses import dataclass

import pytest

from dzdesign.codegen.calibration.layout import LENGTH_WORDS
from dzdesign.codegen.calibration.packing import Place
from dzdesign.codegen.project import generate, target_named, targets
from tests.support.golden_firmware import golden_compensator
from tests.support.paths import ROOT


@dataclass(frozen=True, kw_only=True)
class Stated:
    """What TI's linker file says of the range, and the flash ranges that it places sections in."""

    file: str
    region: str
    page: int
    origin: int
    length: int
    used: frozenset[str]


STATED = {
    "f28335": Stated(
        file="F28335.cmd", region="FLASHB", page=1, origin=0x330000, length=0x8000,
        used=frozenset({"FLASHA", "FLASHC", "FLASHD", "BEGIN", "CSM_PWL", "CSM_RSVD"}),
    ),
    "f280049c": Stated(
        file="28004x_generic_flash_lnk.cmd", region="FLASH_BANK1_SEC8", page=0, origin=0x098000, length=0x1000,
        used=frozenset({"BEGIN", *(f"FLASH_BANK0_SEC{number}" for number in (1, 2, 3, 4, 5))}),
    ),
}  # fmt: skip


def test_every_sector_is_stated_and_no_other():
    assert {target.name for target in targets() if target.sector} == STATED.keys()
    assert target_named("host").block_place == Place()


@pytest.mark.parametrize("name", STATED)
def test_the_sector_is_that_of_the_linker_file(name):
    stated, target = STATED[name], target_named(name)
    sector = target.sector
    assert (sector.file, sector.region, sector.page) == (stated.file, stated.region, stated.page)
    assert (sector.address, sector.words) == (stated.origin, stated.length)
    assert target.block_place == Place(address=stated.origin, unit_octets=2)
    assert sector.words >= LENGTH_WORDS


@pytest.mark.parametrize("name", STATED)
def test_a_block_alone_is_linked_into_the_sector(name):
    stated = STATED[name]
    assert stated.region not in stated.used, "TI's file places nothing there"
    files = generate(golden_compensator(name), name, calibration="block").files
    fragment = re.sub(r"/\*.*?\*/", "", files[f"{name}/dz_calibration.cmd"], flags=re.DOTALL)
    placed = re.findall(r"(\S+)\s*:\s*>+\s*(\w+),\s*PAGE\s*=\s*(\d)", fragment)
    assert placed == [("dz_calibration", stated.region, str(stated.page))]
    sections = {path: re.findall(r'#pragma \w+_SECTION\((\w+), "(\S+)"\)', text) for path, text in files.items()}
    in_it = [(path, what) for path, found in sections.items() for what, section in found if section == "dz_calibration"]
    assert in_it == [(f"{name}/dz_block.c", "dz_block")]
    assert {section for found in sections.values() for _, section in found} <= {"dz_calibration", ".TI.ramfunc"}


@pytest.mark.parametrize("name", STATED)
def test_the_pages_state_the_same_address(name):
    page = (ROOT / "docs" / "reference" / "calibration.md").read_text(encoding="utf-8")
    (row,) = (line for line in page.splitlines() if line.startswith(f"| {name} |"))
    assert f"word `{STATED[name].origin:#x}`" in row
    assert f"`{STATED[name].region}` of TI's `{STATED[name].file}`" in row
