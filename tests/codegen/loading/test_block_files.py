"""Files of a calibration block: what is read from each format, and what is refused."""

import pytest
from intelhex import IntelHex

from dzdesign.codegen.calibration.block_files import MOST_OCTETS, octets_in_file
from dzdesign.core.errors import InputError

OCTETS = bytes(range(256)) * 6 + b"end"


def hex_text(*runs: tuple[int, bytes]) -> str:
    image = IntelHex()
    for at, octets in runs:
        image.frombytes(octets, offset=at)
    lines = []
    image.write_hex_file(type("Lines", (), {"write": lambda self, text: lines.append(text)})())
    return "".join(lines)


def ti_text(*runs: tuple[int, bytes], width: int = 16, end: str = "q\n") -> str:
    text = ""
    for at, octets in runs:
        rows = (octets[first : first + width].hex(" ").upper() for first in range(0, len(octets), width))
        text += f"@{at:04X}\n" + "\n".join(rows) + "\n"
    return text + end


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.bin", OCTETS),
        ("a.HEX", hex_text((0, OCTETS)).encode()),
        ("a.hex", hex_text((0x33_0000, OCTETS)).replace("\n", "\r\n").encode()),
        ("a.txt", ti_text((0x8000, OCTETS)).encode()),
        ("a.txt", ti_text((0, OCTETS), width=7, end="\r\nQ").lower().encode()),
    ],
)
def test_each_format_gives_the_octets_wherever_they_lie(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    assert octets_in_file(tmp_path / name) == OCTETS


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.s19", b"", "expected a calibration file, .bin, .hex, .txt"),
        ("a.bin", bytes(MOST_OCTETS + 1), "a few KiB"),
        ("a.hex", b":0100000001FF", "does not end with the record"),
        ("a.hex", hex_text((0, OCTETS)).replace(":10001000", ":10001001").encode(), "not Intel HEX"),
        ("a.hex", b"S1\n:00000001FF\n", "not Intel HEX"),
        ("a.hex", b"\xff\n:00000001FF\n", "no ASCII"),
        ("a.hex", b":00000001FF\n", "octets in none of its rows"),
        ("a.hex", hex_text((0, OCTETS), (5000, OCTETS)).encode(), "parts that do not follow each other"),
        ("a.txt", ti_text((0, OCTETS), (5000, OCTETS)).encode(), "parts that do not follow each other"),
        ("a.txt", ti_text((0, OCTETS), end="").encode(), "does not end with 'q'"),
        ("a.txt", ti_text((0, OCTETS), end="q\n00\n").encode(), "follows the 'q'"),
        ("a.txt", b"00 01\nq\n", "row 1"),
        ("a.txt", b"@0000\n00 1\nq\n", "row 2"),
        ("a.txt", b"@0000 00\nq\n", "row 1"),
        ("a.txt", b"q\n", "octets in none of its rows"),
    ],
)
def test_a_file_with_an_error_is_refused(tmp_path, name, content, said):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=said):
        octets_in_file(tmp_path / name)
