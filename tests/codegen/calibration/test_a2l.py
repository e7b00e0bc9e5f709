"""The layout as A2L: strict by a2ltool, which shares no code with dzdesign, and each number where the block has it."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from dzdesign.codegen.calibration.a2l import a2l_text
from dzdesign.codegen.calibration.block import block_of
from dzdesign.codegen.calibration.layout import members
from dzdesign.codegen.calibration.packing import OCTETS, pack
from dzdesign.codegen.project import target_named
from tests.support.core_variants import variant

#: Of the extra `test`, where it has a wheel.
CHECKER = shutil.which("a2ltool", path=Path(sys.executable).parent)
WIDTHS = {"U8": 1, "U16": 2, "U32": 4, "U64": 8, "S32": 4}


def check(text: str, folder: Path) -> tuple[int, str]:
    """Return what a2ltool says of a file, strictly."""
    (folder / "block.a2l").write_text(text)
    command = [CHECKER, "--strict", "--check", "-v", str(folder / "block.a2l")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.skipif(CHECKER is None, reason="a2ltool has no wheel for this system")
def test_a_strict_parser_finds_nothing_wrong(tmp_path):
    text = a2l_text(target_named("f28335").block_place)
    status, said = check(text, tmp_path)
    assert status == 0 and "No problems found" in said
    faults = {"U32 0 ": "U33 0 ", "VAL_BLK": "VALBLK", "/end MODULE\n": "", " unit_3 0": " unit_99 0"}
    for right, wrong in faults.items():
        assert right in text
        status, said = check(text.replace(right, wrong, 1), tmp_path)
        assert status or "No problems found" not in said, wrong


@pytest.mark.parametrize("target", ["f28335", "host"])
def test_every_number_of_the_block_is_at_its_address(target):
    place = target_named(target).block_place
    block = block_of(variant("bipolar, all options", "wide"), "ab" * 32, serial="V-7 №3", record="lot 12")
    octets, begin = pack(block), place.address * place.unit_octets
    found = re.findall(
        r"/begin CHARACTERISTIC (\S+) \"[^\"]+\"\n(VALUE|VAL_BLK|ASCII) (0x[0-9a-f]+) ([US]\d+) 0 \S+ (-?\d+) (\d+)\n"
        r"(?:(?:NUMBER|MATRIX_DIM) ([\d ]+)\n)?READ_ONLY\n/end CHARACTERISTIC\n",
        a2l_text(place),
    )
    assert [name for name, *_ in found] == [member.path for member in members()]
    end = begin
    for name, kind, at, layout, least, most, dimensions in found:
        width, count = WIDTHS[layout], 1
        for dimension in dimensions.split():
            count *= int(dimension)
        assert int(at, 16) == end and (count > 1) == (kind != "VALUE")
        # A slope below zero is one for an XCP tool too.
        signed = name.endswith(".slope")
        assert (layout[0] == "S") is signed and int(most) - int(least) == 256**width - 1
        assert int(least) == (-(256**width) // 2 if signed else 0)
        piece = octets[end - begin : end - begin + width * count]
        end += width * count
        if kind == "ASCII":
            assert piece.rstrip(b"\0").decode() == {"serial": "V-7 №3", "record": "lot 12"}[name]
        elif name == "compensator_sha256":
            assert piece.hex() == "ab" * 32
        elif name != "crc32":
            side = re.match(r"sides\[(\d)\]", name)
            of = block.sides[int(side[1])] if side else block.current if name.startswith("current.") else block
            value = getattr(of, name.rpartition(".")[2])
            numbers = [int.from_bytes(piece[each : each + width], "little") for each in range(0, len(piece), width)]
            assert numbers == list(value if isinstance(value, tuple) else (value,)), name
    assert end - begin == OCTETS
