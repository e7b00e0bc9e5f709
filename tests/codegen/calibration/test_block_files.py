"""Files of a block, Intel HEX and octets alone: where each octet lies, what is read back, and what is refused."""

import pytest

from dzdesign.codegen.calibration.packing import FORMATS, MOST_OCTETS, Place, image_of, read_block_file
from dzdesign.codegen.project import target_named
from dzdesign.core.errors import InputError
from tests.support.block_reader import hex_memory, hex_text

OCTETS = bytes(range(256)) * 10 + b"last"
PLACES = {
    "f28335": target_named("f28335").block_place,
    "f280049c": target_named("f280049c").block_place,
    "octets from 0": target_named("host").block_place,
    "words over a segment's end": Place(address=0x31_FFFE, unit_octets=2),
    "octets over a segment's end": Place(address=0x0800_FFF4),
    "last words": Place(address=2**31 - len(OCTETS) // 2, unit_octets=2),
}


@pytest.mark.parametrize("place", PLACES.values(), ids=PLACES)
@pytest.mark.parametrize("name", FORMATS)
def test_a_file_gives_the_octets_back(name, place, tmp_path):
    for file in (tmp_path / f"block.{name}", tmp_path / "block.other"):
        file.write_bytes(image_of(OCTETS, name, place))
        assert read_block_file(file, None if file.suffix == f".{name}" else name)[0] == OCTETS


@pytest.mark.parametrize("place", PLACES.values(), ids=PLACES)
def test_each_octet_lies_at_its_address(place):
    expected = {place.address * place.unit_octets + at: octet for at, octet in enumerate(OCTETS)}
    assert hex_memory(image_of(OCTETS, "hex", place).decode(), of_words=place.unit_octets == 2) == expected


def test_a_c28x_has_words_of_which_the_high_octet_comes_first():
    """As `hex2000 --romwidth=16 --intel` writes 0x2211, 0x4433 at word 0x330000."""
    place = PLACES["f28335"]
    assert image_of(bytes.fromhex("11223344"), "hex", place).decode().split() == [
        ":020000040033C7", ":040000002211443352", ":00000001FF",
    ]  # fmt: skip
    second = image_of(bytes(64), "hex", place).decode().split()[2]
    assert second.startswith(":20001000"), "the second row of 32 octets is 16 words further"


@pytest.mark.parametrize(
    "change",
    [
        lambda rows: [*rows[:3], rows[3][:-1] + ("1" if rows[3][-1] == "0" else "0"), *rows[4:]],
        lambda rows: [*rows[:3], *rows[4:]],
        lambda rows: [*rows[:3], rows[2], *rows[3:]],
        lambda rows: [*rows[:3], ":00000001FF", *rows[3:]],
        lambda rows: [*rows[:3], rows[3][:20], *rows[4:]],
        lambda rows: rows[:-1],
    ],
)
def test_a_hex_file_of_words_with_an_error_is_refused(change, tmp_path):
    rows = image_of(OCTETS, "hex", PLACES["f28335"]).decode().split()
    (tmp_path / "a.hex").write_text("\n".join(change(rows)) + "\n")
    with pytest.raises(InputError, match=r"a\.hex"):
        read_block_file(tmp_path / "a.hex")


def test_rows_may_come_in_any_order_and_lie_anywhere(tmp_path):
    (tmp_path / "b.HEX").write_bytes(hex_text((0x33_0000, OCTETS)).replace("\n", "\r\n").encode())
    assert read_block_file(tmp_path / "b.HEX")[0] == OCTETS
    first, *rows, end = image_of(OCTETS, "hex", PLACES["f28335"]).decode().split()
    (tmp_path / "a.hex").write_text("\n".join([first, *reversed(rows), end]) + "\n")
    assert read_block_file(tmp_path / "a.hex")[0] == OCTETS


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
        read_block_file(tmp_path / name)


@pytest.mark.parametrize(
    ("place", "address", "right"),
    [
        (Place(unit_octets=2), 2**31 - 4, False),
        (Place(unit_octets=2), 0x33_0001, False),
        (Place(unit_octets=2), 2**31 - 6, True),
        (Place(), 0x0800_0002, False),
        (Place(), -4, False),
        (Place(), 2**32 - 12, True),
        (Place(), 2**32 - 8, False),
    ],
)
def test_an_address_has_room_behind_it(place, address, right):
    if right:
        assert place.at(address, 12) == Place(address=address, unit_octets=place.unit_octets)
        return
    with pytest.raises(InputError, match="--address is"):
        place.at(address, 12)
