"""Files of a calibration block: what is read from each format, and what is refused."""

import pytest

from dzdesign.codegen.calibration.packing import MOST_OCTETS, read_block_file
from dzdesign.core.errors import InputError
from tests.support.block_reader import hex_text

OCTETS = bytes(range(256)) * 6 + b"end"


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.bin", OCTETS),
        ("a.HEX", hex_text((0, OCTETS)).encode()),
        ("a.hex", hex_text((0x33_0000, OCTETS)).replace("\n", "\r\n").encode()),
    ],
)
def test_each_format_gives_the_octets_wherever_they_lie(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    assert read_block_file(tmp_path / name)[0] == OCTETS


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.s19", b"", "expected a calibration file, .hex, .bin"),
        ("a.bin", bytes(MOST_OCTETS + 1), "a few KiB"),
        ("a.hex", b":0100000001FF", "does not end with the record"),
        ("a.hex", hex_text((0, OCTETS)).replace(":10001000", ":10001001").encode(), "not Intel HEX"),
        ("a.hex", b"S1\n:00000001FF\n", "not Intel HEX"),
        ("a.hex", b"\xff\n:00000001FF\n", "no ASCII"),
        ("a.hex", b":00000001FF\n", "octets in none of its rows"),
        ("a.hex", hex_text((0, OCTETS), (5000, OCTETS)).encode(), "parts that do not follow each other"),
    ],
)
def test_a_file_with_an_error_is_refused(tmp_path, name, content, said):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=said):
        read_block_file(tmp_path / name)[0]
