"""Exchanges that go wrong: what may happen between a PC and a drive, and what must hold after each of them."""

import random
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from dzdesign.codegen.calibration.layout import members
from dzdesign.codegen.loading.protocol import MOST_PAYLOAD, SYNC, Frame, Request
from dzdesign.codegen.loading.session import LoadSession, NoReplyError, RefusedError
from tests.support.loading.bench import Drive, Faults, VirtualLine

#: Octets before `compensator_sha256` in a block.
SHA_AT = 2 * next(member.at for member in members() if member.path == "compensator_sha256")


def crc_of_block(block: bytes) -> int:
    return int.from_bytes(block[-4:], "little")


def origin_of_block(block: bytes) -> int:
    return int.from_bytes(block[SHA_AT : SHA_AT + 4], "big")


def load(session: LoadSession, block: bytes, **announced: int) -> str:
    """Load a block, and return how it ended: done, refused or no reply."""
    crc, origin = announced.get("crc", crc_of_block(block)), announced.get("origin", origin_of_block(block))
    try:
        list(session.loading(block, crc, origin))
    except RefusedError as error:
        return f"refused {error.reason}"
    except NoReplyError:
        return "no reply"
    return "done"


@dataclass
class Bench:
    """A drive, the blocks that may lie in it, and the count of what must not happen."""

    drive: Drive
    good: Sequence[bytes]
    old: bytes
    ends: Counter = field(default_factory=Counter)
    invalid_accepted: int = 0
    old_lost: int = 0
    wrongly_done: int = 0
    stuck: int = 0
    used_unheld: int = 0

    @property
    def words_of_a_load(self) -> int:
        """Words that are erased, cleared and then set, and written, with the mark."""
        return self.drive.slot_octets + len(self.old) // 2 + 1

    def exchange(self, kind: Callable[["Bench", random.Random, bytes], str], rng: random.Random) -> None:
        """Have one kind of exchange go on with a new block, and look at what the drive has after it."""
        new = rng.choice([block for block in self.good if block != self.old])
        drive = self.drive
        drive.power_on(rng.randrange(1 << 30), busy=rng.choice((0, 0, 3, 500)))
        ended = kind(self, rng, new)
        self.ends[kind.__name__, ended] += 1
        allowed = (new,) if ended == "done" else (self.old, new)
        dead = drive.get("dead")
        in_use, loaded = drive.block(), drive.get("uses")
        self.used_unheld += drive.get("wrong_uses")
        if not dead:
            self._look(in_use, allowed)
        after = drive.power_on()
        self._look(after, allowed)
        if not dead and after != in_use:
            self.wrongly_done += 1
        if not dead and loaded == 0 and after != self.old:
            self.wrongly_done += 1
        self.old = after if after in self.good else self.old
        newer = rng.choice([block for block in self.good if block != self.old])
        if load(LoadSession(VirtualLine(drive), rng.randrange(256)), newer) != "done" or drive.power_on() != newer:
            self.stuck += 1
        else:
            self.old = newer

    def _look(self, block: bytes | None, allowed: tuple[bytes, ...]) -> None:
        if block is None:
            self.old_lost += 1
        elif block not in self.good:
            self.invalid_accepted += 1
        elif block not in allowed:
            self.wrongly_done += 1


class DyingLine(VirtualLine):
    """A line whose sender dies after so many octets."""

    def __init__(self, drive: Drive, left: int) -> None:
        super().__init__(drive)
        self.left = left

    def write(self, octets: bytes) -> None:
        super().write(octets[: self.left])
        self.left -= len(octets)
        if self.left <= 0:
            raise BrokenPipeError


def _session(bench: Bench, rng: random.Random, there: Faults | None = None, back: Faults | None = None) -> LoadSession:
    return LoadSession(VirtualLine(bench.drive, there, back), rng.randrange(256))


def noisy_line(bench: Bench, rng: random.Random, new: bytes) -> str:
    """Octets are lost, doubled and changed, both ways."""

    def faults() -> Faults:
        rate = rng.choice((1e-4, 1e-3, 2e-3))  # of 3e-3 a frame in some hundreds would be lost in every try
        return Faults(rng, lost=rate * rng.random(), doubled=rate * rng.random(), changed=rate * rng.random())

    return load(_session(bench, rng, faults(), faults()), new)


def frames_out_of_order(bench: Bench, rng: random.Random, new: bytes) -> str:
    """Whole frames are lost, doubled, and come late, behind others."""

    def faults() -> Faults:
        return Faults(
            rng, piece_lost=0.2 * rng.random(), piece_doubled=0.2 * rng.random(), piece_late=0.2 * rng.random()
        )

    return load(_session(bench, rng, faults(), faults()), new)


def supply_lost_in_a_second_load(bench: Bench, rng: random.Random, new: bytes) -> str:
    """After a load without a restart: the block of the first one is the old one now."""
    first = rng.choice([block for block in bench.good if block not in (bench.old, new)])
    if load(_session(bench, rng), first) == "done":
        bench.old = first
    bench.drive.set(words_left=rng.randrange(bench.words_of_a_load + 1))
    return load(_session(bench, rng), new)


def sender_lost(bench: Bench, rng: random.Random, new: bytes) -> str:
    """The PC's program dies; what it sent last may be cut."""

    try:
        return load(LoadSession(DyingLine(bench.drive, rng.randrange(2 * len(new))), rng.randrange(256)), new)
    except BrokenPipeError:
        VirtualLine(bench.drive).read(1.0)
        return "sender lost"


def drive_in_use(bench: Bench, rng: random.Random, new: bytes) -> str:
    """The output is in use, the command leaves zero on the way, the interrupt stands still, or a word is broken."""

    class MovingLine(VirtualLine):
        left = rng.choice((0, rng.randrange(len(new) // 32)))
        what = rng.choice(("driving", "command", "never_holds", "bad_word"))

        def write(self, octets: bytes) -> None:
            if self.left <= 0:
                self.drive.set(**{self.what: rng.randrange(len(new) // 2) if self.what == "bad_word" else 1})
            self.left -= 1
            super().write(octets)

    return load(LoadSession(MovingLine(bench.drive), rng.randrange(256)), new)


def hostile_frames(bench: Bench, rng: random.Random, new: bytes) -> str:
    """Garbage, cut frames, and frames with a right CRC of any type, number, length and content."""
    line = VirtualLine(bench.drive)
    session = LoadSession(line, rng.randrange(256))
    words = len(new) // 2
    for _ in range(rng.randrange(1, 60)):
        kind = rng.randrange(6)
        if kind == 0:
            line.write(rng.randbytes(rng.randrange(1, 100)))
        elif kind == 1:
            octets = bytearray(any_frame(rng, words).octets())
            octets[4] = rng.choice((0, 255, MOST_PAYLOAD, MOST_PAYLOAD + 1, rng.randrange(256)))
            line.write(bytes(octets))
        elif kind == 2:
            line.write(any_frame(rng, words).octets()[: rng.randrange(1, 70)])
        elif kind == 3:
            line.write(SYNC.to_bytes(2, "big") * rng.randrange(1, 40))
        else:
            line.write(any_frame(rng, words).octets())
        if rng.random() < 0.1:
            line.read(1.0)
    for _ in range(100):
        line.read(0.05)
    return load(session, new)


def any_frame(rng: random.Random, words: int) -> Frame:
    kind = rng.choice((*Request, rng.randrange(256)))
    sizes = (0, 1, 2, 3, 4, 10, MOST_PAYLOAD, rng.randrange(MOST_PAYLOAD + 1))
    payload = rng.randbytes(rng.choice(sizes))
    if kind == Request.BEGIN and rng.random() < 0.7:
        length = rng.choice((words, words, words, 0, words - 1, words + 1, 0xFFFF, 0x8000))
        payload = length.to_bytes(2, "big") + rng.randbytes(8)
    if kind == Request.DATA and rng.random() < 0.7:
        at = rng.choice((0, 1, words - 1, words, 0xFFFF, rng.randrange(words)))
        payload = at.to_bytes(2, "big") + rng.randbytes(rng.choice((0, 1, 2, 2, 63, 64)))
    return Frame(type=kind, sequence=rng.choice((0, 1, 2, 3, rng.randrange(256))), payload=payload)


KINDS = (
    noisy_line,
    frames_out_of_order,
    supply_lost_in_a_second_load,
    sender_lost,
    drive_in_use,
    hostile_frames,
)
