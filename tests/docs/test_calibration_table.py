"""The table of the calibration block's layout in the docs: a block can be read by it alone."""

import importlib.util
import re

from dzdesign.codegen.calibration.block import block_of
from dzdesign.codegen.calibration.layout import members
from dzdesign.codegen.calibration.packing import FORMATS, OCTETS, pack
from tests.support.core_variants import variant
from tests.support.paths import ROOT

PAGE = ROOT / "docs" / "reference" / "calibration.md"


def table() -> str:
    place = importlib.util.spec_from_file_location("docs_generated", ROOT / "docs" / "generated.py")
    module = importlib.util.module_from_spec(place)
    place.loader.exec_module(module)
    return module.MADE["calibration"]()


def test_a_block_is_read_by_the_table_alone():
    block = block_of(variant("bipolar, all options"), "ab" * 32, serial="V-7")
    octets = pack(block)
    rows = [[cell.strip(" `") for cell in row.strip("|").split("|")] for row in table().splitlines()[2:]]
    rows = [row for row in rows if len(row) == 7]
    second = int(next(at for at, _, name, *_ in rows if name == "sides[1]"))
    first = int(next(at for at, _, name, *_ in rows if name == "sides[0].offset"))
    assert {name for _, _, name, *_ in rows} == {
        each.path for each in members() if not each.path.startswith("sides[1]")
    } | {"sides[1]"}
    covered = 0
    for word, octet, name, size, *_ in (row for row in rows if row[2] != "sides[1]"):
        bits, count = (int(number) for number in re.fullmatch(r"(\d+) bits(?: × (\d+))?", size).groups("1"))
        assert int(octet) == 2 * int(word)
        of_side = name.startswith("sides[0].")
        for side in range(1 + of_side):
            begin = int(octet) + side * 2 * (second - first)
            found = [
                int.from_bytes(octets[at : at + bits // 8], "little")
                for at in range(begin, begin + bits // 8 * count, bits // 8)
            ]
            of = block.sides[side] if of_side else block.current if name.startswith("current.") else block
            if sensor := re.match(r"sensors\[(\d)\]\.", name):
                of = block.sensors[int(sensor[1])]
            value = getattr(of, name.rpartition(".")[2])
            assert name == "crc32" or found == list(value if isinstance(value, tuple) else (value,)), name
            covered += bits // 8 * count
    assert covered == OCTETS


def test_the_page_states_size_and_formats():
    page = PAGE.read_text(encoding="utf-8")
    assert f"a block of {OCTETS} octets" in page and "<!-- made: calibration -->" in page
    assert all(f"| `.{name}` |" in page for name in FORMATS)
