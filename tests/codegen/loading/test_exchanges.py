"""A block goes to a drive: request by request, and over a line, from senders, with a supply and a store that fail."""

import random
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from dzdesign.codegen.loading.protocol import ERASE_S, Frame, Reason, Request
from dzdesign.codegen.loading.session import LoadSession
from tests.support.loading import request_checks as checks
from tests.support.loading.bench import HERE, TICK_HZ, VirtualLine, session
from tests.support.loading.exchanges import KINDS, any_frame, load
from tests.support.loading.files import COMPILER, blocks, drive_files, new_bench

#: An exchange has some 3000 octets, and erases and writes some 4000 words.
OCTETS_APART, WORDS_APART = 37, 29


def check(bench) -> None:
    assert bench.invalid_accepted == bench.old_lost == bench.wrongly_done == bench.stuck == bench.used_unheld == 0


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_after_a_faulty_exchange_the_old_or_the_new_block_is_whole_and_the_next_load_works(bench, kind):
    rng = random.Random(kind.__name__)
    for _ in range(30):
        bench.exchange(kind, rng)
    check(bench)
    ends = {end for _, end in bench.ends}
    if kind.__name__ in ("noisy_line", "hostile_frames"):
        assert ends == {"done"}, "the sender sends again what was not answered"
    elif kind.__name__ == "drive_in_use":
        assert {f"refused {Reason.COMMAND}", f"refused {Reason.DRIVING}", f"refused {Reason.STORE}"} <= ends


def start(bench) -> None:
    """Have the old block in a slot, and nothing of a load before."""
    bench.drive.erase()
    bench.drive.power_on()
    assert load(session(bench.drive), blocks()[1]) == "done"


def test_the_supply_may_go_at_any_octet(bench):
    old, new = blocks()[1:3]
    start(bench)
    for octets in range(0, 3 * len(new) // 2, OCTETS_APART):
        bench.drive.power_on(seed=octets)
        bench.drive.set(octets_left=octets)
        ended = load(session(bench.drive), new)
        dead = bench.drive.get("dead")
        assert (ended == "done") == (not dead)
        assert bench.drive.power_on() == (old if dead else new)
    assert not dead, "the last one came through"


def test_the_supply_may_go_at_any_word_that_is_erased_or_written(bench):
    old, new = blocks()[1:3]
    start(bench)
    words = bench.words_of_a_load
    for cut in (*range(0, words, WORDS_APART), *range(words - 4, words)):
        bench.drive.power_on(seed=cut)
        bench.drive.set(words_left=cut)
        assert load(session(bench.drive), new) == "no reply" and bench.drive.get("dead")
        assert bench.drive.power_on(seed=cut) == old or cut == words - 1
        start(bench)
    bench.drive.power_on()
    assert load(session(bench.drive), new) == "done"
    assert bench.drive.words == words, "the count of the test is the drive's"


SMALL = HERE / "small"


@pytest.mark.parametrize("check", checks.CHECKS, ids=lambda check: check.__name__)
def test_rule(bench, check):
    check(bench.drive)


def stream() -> bytes:
    """Two loads of a small block with cut and doubled frames, and hostile ones around them: what a drive gets."""
    rng, words = random.Random(24), 80

    def hostile() -> bytes:
        return b"".join(any_frame(rng, words).octets() + rng.randbytes(rng.randrange(4)) for _ in range(4))

    def frame(request: int, number: int, payload: bytes) -> bytes:
        return Frame(type=request, sequence=number, payload=payload).octets()

    sent = hostile()
    for number in (1, 2):
        block = bytearray(rng.randbytes(2 * words))
        block[6:8], block[40:42] = words.to_bytes(2, "little"), number.to_bytes(2, "little")
        crc, origin = block[:-5:-1], block[8:12]
        sent += frame(Request.BEGIN, 7, words.to_bytes(2, "big") + crc + origin)
        for at, sequence in ((0, 8), (32, 9), (64, 10)):
            piece = frame(Request.DATA, sequence, at.to_bytes(2, "big") + block[2 * at : 2 * at + 64])
            sent += piece[:20] + piece + piece + piece  # the cut one takes the next one's octets
        sent += frame(Request.COMMIT, 11, bytes(crc)) + frame(Request.QUERY, 12, b"") + hostile()
    return sent


@pytest.mark.skipif(not (shutil.which("avr-gcc") and shutil.which("simavr")), reason="no avr-gcc or no simavr")
def test_it_does_the_same_where_int_has_16_bits(tmp_path):
    ours = {name: text for name, text in drive_files().items() if not name.startswith("dz_calibration")}
    ours["stream.h"] = f"""#include <stdint.h>
#ifdef __AVR__
#include <avr/pgmspace.h>
#else
#define PROGMEM
#endif
static const uint8_t stream[] PROGMEM = {{{", ".join(map(str, stream()))}}};
"""
    for name, text in ours.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    sources = [*sorted(map(str, tmp_path.glob("*.c"))), str(SMALL / "exchange.c")]
    found = {}
    for compiler, options in (
        (COMPILER, ["-Wno-unused-variable"]),
        ("avr-gcc", ["-mmcu=atmega1280", "-DF_CPU=16000000UL", "-Wno-format"]),
    ):
        program = tmp_path / f"{Path(compiler).name}.elf"
        command = [compiler, "-std=gnu99", "-Os", "-Wall", "-Wextra", "-Werror", *options]
        command += [f"-I{tmp_path}", f"-I{SMALL}", *sources, "-o", str(program)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        run = ["simavr", "-m", "atmega1280", "-f", "16000000", program] if compiler == "avr-gcc" else [program]
        done = subprocess.run(run, capture_output=True, text=True, check=True, timeout=60)
        printed = re.sub(r"\x1b\[\d+m", "", done.stdout + done.stderr)  # simavr colours what it echoes
        found[compiler] = re.findall(r"^(?:[0-9A-F]{8,}|use \d+|used .* end)", printed, re.MULTILINE)
    assert found["avr-gcc"] == found[COMPILER]
    assert [line for line in found[COMPILER] if line.startswith("use")] == ["use 1", "use 2", found[COMPILER][-1]]
    assert found[COMPILER][-1].startswith("used 1 ")


FIFO_OCTETS = 16


class DeafLine(VirtualLine):
    """While the drive erases, time goes by and the PC goes on; of what it sends the receiver's FIFO is kept."""

    def __init__(self, drive) -> None:
        super().__init__(drive)
        self.until_s, self.held = 0.0, b""

    def write(self, octets: bytes) -> None:
        if self.time_s < self.until_s:
            self.held = (self.held + octets)[:FIFO_OCTETS]
            self.time_s += 0.002
        else:
            super().write(octets)

    def read(self, limit_s: float) -> bytes:
        if self.time_s < self.until_s:
            self.time_s += min(limit_s, 0.05, self.until_s - self.time_s + 1e-9)
            return b""
        if self.held:
            held, self.held = self.held, b""
            self.drive.code.drive_feed(held, len(held))
        return super().read(limit_s)

    def _pass(self, time_s: float, passes: int) -> None:
        super()._pass(time_s, passes)
        if late := self.drive.get("late_ticks"):
            self.drive.set(late_ticks=0)
            self.until_s = self.time_s + late / TICK_HZ


def loaded(bench, erase_s: float) -> str:
    drive = bench.drive
    drive.erase()
    drive.power_on()
    drive.set(erase_ticks=round(erase_s * TICK_HZ))
    return load(LoadSession(DeafLine(drive)), blocks()[1])


@pytest.mark.parametrize("erase_s", [0.0, 0.25, 1.9, 2.1, 3.5, 10.0, ERASE_S - 1])
def test_a_load_waits_for_a_slow_erase_and_erases_once(bench, erase_s):
    assert loaded(bench, erase_s) == "done"
    assert bench.drive.get("erases") == 1 and bench.drive.block() == blocks()[1] == bench.drive.power_on()


def test_an_erase_that_never_ends_is_given_up(bench):
    assert loaded(bench, 2 * ERASE_S) == "no reply"


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


#: What stands in a generated file, what stands there instead, and the test or rule that must see it.
FAULTS = [
    ("dz_load.c", "else if (wrong != 0u)", "else if (wrong == 0xFFFFu)", checks.announcements_that_are_not_kept),
    ("dz_load.c", "load->used = load->slot;", "", checks.the_used_slot_is_never_written),
    ("dz_load.c", "load->words = (uint16_t)(load->words + load->count);", "load->words = load->count;",
     checks.repeated_requests_are_done_once),
    ("dz_load.c", "else if (is_repeated(load) != 0u)", "else if (is_repeated(load) > 1u)",
     checks.repeated_requests_are_done_once),
    ("dz_load.c", "!= COMMIT_OCTETS)", "> 0xFFu)", checks.lengths_that_are_not_right),
    ("dz_slots.c", "&& (dz_calibration_check(&dz_store_slot(slot)->block) == 0u)", "",
     test_a_loaded_block_that_went_bad_is_not_replaced_by_the_linked_one),
    ("dz_load.c", "load->since = ticks;\n        load->anew", "load->anew",
     test_a_load_waits_for_a_slow_erase_and_erases_once),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("file", "old", "new", "check"), FAULTS)
def test_a_seeded_fault_is_found(bench, file, old, new, check, tmp_path):
    """`bench` skips without a compiler."""
    text = drive_files()[file]
    assert text.count(old) == 1
    faulty = new_bench(tmp_path, {file: text.replace(old, new)}, "-Wno-error", "-w")
    with pytest.raises((AssertionError, ValueError)):  # the latter: no reply, or two
        if check is test_a_load_waits_for_a_slow_erase_and_erases_once:
            check(faulty, 3.5)
        else:
            check(faulty if check.__name__.startswith("test") else faulty.drive)
