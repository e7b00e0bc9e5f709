"""The calibration blocks' flash sectors against TI's own linker files: range, page, and nothing placed there."""

import os
import re
from pathlib import Path

import pytest

from dzdesign.codegen.project import targets
from dzdesign.codegen.target import FlashSector

WARE = Path(os.environ.get("DZDESIGN_C2000WARE", ""))
SECTORS = {target.name: target.sector for target in targets() if target.sector}


def text_of(file: str) -> str:
    """Return a linker file of the C2000Ware folder, without its comments."""
    (path,) = (WARE / "device_support").glob(f"*/common/cmd/{file}")
    text = re.sub(r"/\*.*?\*/", "", path.read_text(encoding="utf-8", errors="replace"), flags=re.DOTALL)
    return re.sub(r"//.*", "", text)


def ranges_of(text: str) -> dict[str, tuple[int, int, int]]:
    """Return page, origin and length of every memory range, by its name."""
    memory, found, page = re.search(r"MEMORY\s*\{(.*?)\}", text, re.DOTALL)[1], {}, 0
    words = re.compile(r"PAGE\s*(\d)\s*:|(\w+)\s*:\s*origin\s*=\s*(\w+)\s*,\s*length\s*=\s*(\w+)")
    for number, name, origin, length in words.findall(memory):
        page = int(number) if number else page
        if name:
            found[name] = (page, int(origin, 16), int(length, 16))
    return found


@pytest.mark.parametrize("name", SECTORS)
def test_the_sector_is_that_of_the_linker_file(name):
    sector: FlashSector = SECTORS[name]
    ranges = ranges_of(text_of(sector.file))
    assert ranges[sector.region] == (sector.page, sector.address, sector.words)
    end = sector.address + sector.words
    shared = {
        other
        for other, (_, origin, length) in ranges.items()
        if other != sector.region and origin < end and origin + length > sector.address
    }
    assert not shared, "no other range has words of this sector, on whatever page"


@pytest.mark.parametrize("name", SECTORS)
def test_the_linker_file_places_nothing_there(name):
    sector: FlashSector = SECTORS[name]
    sections = text_of(sector.file).partition("SECTIONS")[2]
    assert sections.count(">") > 10 and not re.search(rf"\b{sector.region}\b", sections)
