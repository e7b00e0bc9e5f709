"""Two copies of a block in a drive's memory: which of them counts, whatever a lost supply left there."""

import random

from tests.support.loading.files import blocks

LINKED, NONE = 2, 0xFFFF


def mark(count: int) -> bytes:
    return bytes((count & 0xFF, ~count & 0xFF))


def used(bench, first: bytes, second: bytes) -> int:
    """Start a drive with these slots, and say which one it uses."""
    bench.drive.erase()
    bench.drive.write_slot(0, first)
    bench.drive.write_slot(1, second)
    bench.drive.power_on()
    return bench.drive.code.drive_used()


def test_the_newer_of_two_valid_blocks_counts_also_where_the_count_goes_round(bench):
    first, second = blocks()[1:3]
    for count in range(256):
        assert used(bench, first + mark(count), second + mark(count + 1)) == 1
        assert used(bench, first + mark(count + 1), second + mark(count)) == 0


def test_a_mark_that_was_cut_short_is_none(bench):
    """Of the bits that become 0 only some have: all 256 ways to have one or more left."""
    old, new = blocks()[1:3]
    for count in (0x00, 0x05, 0xFF):
        whole = int.from_bytes(mark(count), "little")
        falling = [1 << bit for bit in range(16) if not whole >> bit & 1]
        assert len(falling) == 8
        for left in range(256):
            word = whole | sum(bit for place, bit in enumerate(falling) if left >> place & 1)
            found = used(bench, old + mark(count - 1), new + word.to_bytes(2, "little"))
            assert found == (1 if left == 0 else 0), f"{word:04x}"


def test_without_a_loaded_block_the_linked_one_counts(bench):
    erased = b"\xff" * bench.drive.slot_octets
    assert used(bench, erased, erased) == LINKED
    assert used(bench, blocks()[1], erased) == LINKED, "a block without its mark does not count"


def test_a_loaded_block_that_went_bad_is_not_replaced_by_the_linked_one(bench):
    """The linked one may be another valve's."""
    sound, erased = blocks()[1], b"\xff" * bench.drive.slot_octets
    for at in range(0, len(sound), 97):
        bad = bytearray(sound + mark(7))
        bad[at] ^= 1
        assert used(bench, bytes(bad), erased) == NONE
        assert bench.drive.block() is None
        assert used(bench, bytes(bad), blocks()[2] + mark(6)) == 1, "the older one is valid"


def test_a_linked_block_that_is_not_valid_leaves_the_drive_without_one(bench):
    bench.drive.erase()
    bench.drive.link(b"\0" * len(blocks()[0]))
    try:
        assert bench.drive.power_on() is None
    finally:
        bench.drive.link(blocks()[0])


def test_what_memory_holds_by_chance_is_no_block(bench):
    rng = random.Random(11)
    for _ in range(300):
        content = [rng.randbytes(bench.drive.slot_octets) for _ in range(2)]
        assert used(bench, *content) in (LINKED, NONE)
