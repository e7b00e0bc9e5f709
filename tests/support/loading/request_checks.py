"""What a drive answers to single requests, one rule a check: each is a test, and finds seeded faults."""

from collections.abc import Callable
from dataclasses import dataclass

from dzdesign.codegen.loading.protocol import (
    LOAD_S,
    MOST_PAYLOAD,
    MOST_WORDS,
    OCTET_S,
    REPLY,
    Frame,
    FrameReader,
    Reason,
    Reply,
    Request,
)
from tests.support.loading.bench import TICK_HZ, Drive, session
from tests.support.loading.exchanges import crc_of_block, load, origin_of_block
from tests.support.loading.files import BLOCK_OCTETS, blocks, refused_blocks

WORDS = BLOCK_OCTETS // 2
OLD, NEW = blocks()[1:3]


@dataclass
class Sender:
    """Sends requests one by one, with the numbers that it is told."""

    drive: Drive
    next: int = 1

    def raw(self, octets: bytes, passes: int = 4) -> list[Frame]:
        self.drive.code.drive_feed(octets, len(octets))
        self.drive.code.drive_wait(1, passes)
        return list(FrameReader().feed(self.drive.take()))

    def ask(self, request: int, payload: bytes = b"", sequence: int | None = None) -> Reply:
        """Send a request; without a number the next one, which counts if it is taken."""
        number = self.next if sequence is None else sequence
        (frame,) = self.raw(Frame(type=request, sequence=number, payload=payload).octets())
        assert (frame.type, frame.sequence) == (request | REPLY, number)
        reply = frame.reply()
        assert reply is not None
        if sequence is None and reply.reason == Reason.DONE:
            self.next = (number + 1) % 256
        return reply

    def begin(self, block: bytes = NEW, **changes: int) -> Reply:
        values = {"words": WORDS, "crc": crc_of_block(block), "origin": origin_of_block(block)} | changes
        payload = values["words"].to_bytes(2, "big") + values["crc"].to_bytes(4, "big")
        return self.ask(Request.BEGIN, payload + values["origin"].to_bytes(4, "big"))

    def data(self, at: int, count: int = MOST_WORDS, block: bytes = NEW) -> Reply:
        return self.ask(Request.DATA, data(at, count, block))

    def all_data(self, block: bytes = NEW) -> None:
        for at in range(0, WORDS, MOST_WORDS):
            assert self.data(at, min(MOST_WORDS, WORDS - at), block).reason == Reason.DONE

    def commit(self, crc: int = crc_of_block(NEW)) -> Reply:
        return self.ask(Request.COMMIT, crc.to_bytes(4, "big"))

    def wait(self, time_s: float) -> None:
        self.drive.code.drive_wait(round(time_s * TICK_HZ), 4)


def data(at: int, count: int, block: bytes = NEW) -> bytes:
    return at.to_bytes(2, "big") + block[2 * at : 2 * (at + count)].ljust(2 * count, b"\0")


def fresh(drive: Drive) -> Sender:
    """Have OLD in slot 0, and nothing of a load before."""
    drive.erase()
    drive.power_on()
    assert load(session(drive), OLD) == "done"
    assert drive.power_on() == OLD
    return Sender(drive)


def requests_out_of_order(drive: Drive) -> None:
    sender = fresh(drive)
    assert sender.data(0).reason == sender.commit().reason == Reason.NO_LOAD
    assert sender.begin().reason == Reason.DONE
    assert sender.commit().reason == Reason.INCOMPLETE
    reply = sender.ask(Request.DATA, data(0, 8), sequence=77)
    assert (reply.reason, reply.expected, reply.words) == (Reason.SEQUENCE, 2, 0)
    assert sender.data(8).reason == Reason.SEQUENCE, "the right number, another place"
    assert sender.data(0, 8).words == 8
    assert sender.data(0, 8).reason == Reason.SEQUENCE
    assert sender.ask(0x7F).reason == sender.ask(0).reason == Reason.TYPE
    assert sender.data(8, 8).words == 16, "none of these ended the load"


def repeated_requests_are_done_once(drive: Drive) -> None:
    sender = fresh(drive)
    assert sender.begin().reason == Reason.DONE
    for at in (0, 32):
        first = sender.data(at)
        written = drive.words
        again = sender.ask(Request.DATA, data(at, MOST_WORDS), sequence=sender.next - 1)
        assert first == again and again.words == at + MOST_WORDS and drive.words == written
    other = sender.ask(Request.DATA, data(64, 8), sequence=sender.next - 1)
    assert other.reason == Reason.SEQUENCE, "the number of the last one, but not its content"
    assert sender.ask(Request.DATA, data(32, MOST_WORDS), sequence=9).reason == Reason.SEQUENCE, "its content only"
    for at in range(64, WORDS, MOST_WORDS):
        assert sender.data(at, min(MOST_WORDS, WORDS - at)).reason == Reason.DONE
    assert sender.commit().reason == Reason.DONE
    written, uses = drive.words, drive.get("uses")
    crc = crc_of_block(NEW).to_bytes(4, "big")
    assert sender.ask(Request.COMMIT, crc, sequence=sender.next - 1).reason == Reason.DONE
    assert drive.words == written and drive.get("uses") == uses == 1
    sender.wait(LOAD_S + 0.1)
    assert sender.ask(Request.COMMIT, crc, sequence=sender.next - 1).reason == Reason.NO_LOAD, "long ago"


def lengths_that_are_not_right(drive: Drive) -> None:
    sender = fresh(drive)
    for words in (0, 1, WORDS - 1, WORDS + 1, 0x7FFF, 0x8000, 0xFFFF):
        assert sender.begin(words=words).reason == Reason.LENGTH
    for octets in (0, 9, 11, MOST_PAYLOAD):
        start = WORDS.to_bytes(2, "big").ljust(octets, b"\0")[:octets]
        assert sender.ask(Request.BEGIN, start).reason == Reason.LENGTH
    assert drive.words == 0 and not drive.code.drive_is_held(), "nothing was erased"
    assert sender.begin().reason == Reason.DONE
    for octets in (0, 1, 2, 3, 5, 65):
        assert sender.ask(Request.DATA, bytes(octets)).reason == Reason.LENGTH
    sender.all_data()
    before = drive.words
    assert sender.data(WORDS, 1).reason == Reason.LENGTH, "one word beyond the end"
    for octets in (0, 3, 5, MOST_PAYLOAD):
        assert sender.ask(Request.COMMIT, bytes(octets)).reason == Reason.LENGTH
    assert drive.words == before and sender.commit().reason == Reason.DONE
    assert drive.block() == NEW
    assert sender.begin(OLD).reason == Reason.DONE
    for at in range(0, WORDS - MOST_WORDS, MOST_WORDS):
        assert sender.data(at, MOST_WORDS, OLD).reason == Reason.DONE
    assert sender.data(at + MOST_WORDS, MOST_WORDS, OLD).reason == Reason.LENGTH, "beyond the end by some words"


def announcements_that_are_not_kept(drive: Drive) -> None:
    refused = refused_blocks()[0]
    for block, changes, commit_crc, reason in (
        (NEW, {"crc": 1}, 1, Reason.CRC),
        (NEW, {}, 1, Reason.CRC),
        (NEW, {"origin": 1}, crc_of_block(NEW), Reason.ORIGIN),
        (refused, {}, crc_of_block(refused), Reason.CHECK),
    ):
        sender = fresh(drive)
        assert sender.begin(block, **changes).reason == Reason.DONE
        sender.all_data(block)
        assert sender.commit(commit_crc).reason == reason
        assert drive.block() == OLD == drive.power_on()


def a_second_begin_begins_anew(drive: Drive) -> None:
    sender = fresh(drive)
    assert sender.begin().reason == Reason.DONE
    assert sender.data(0).words == MOST_WORDS
    reply = sender.begin()
    assert (reply.reason, reply.words) == (Reason.DONE, 0)
    sender.all_data()
    assert sender.commit().reason == Reason.DONE and drive.block() == NEW


def an_abort_ends_a_load(drive: Drive) -> None:
    sender = fresh(drive)
    assert sender.ask(Request.ABORT, sequence=3).reason == Reason.DONE
    assert sender.begin().reason == Reason.DONE and drive.code.drive_is_held()
    assert sender.ask(Request.ABORT, sequence=3).reason == Reason.DONE and not drive.code.drive_is_held()
    assert sender.data(0).reason == Reason.NO_LOAD and drive.code.drive_ended() == Reason.ABORTED


def a_load_ends_when_its_time_is_over(drive: Drive) -> None:
    sender = fresh(drive)
    assert sender.begin().reason == Reason.DONE
    sender.wait(0.9 * LOAD_S)
    assert sender.data(0).reason == Reason.DONE
    sender.wait(0.9 * LOAD_S)
    assert drive.code.drive_is_held()
    sender.wait(0.2 * LOAD_S)
    assert not drive.code.drive_is_held() and drive.code.drive_ended() == Reason.TIME
    assert sender.data(MOST_WORDS).reason == Reason.NO_LOAD
    drive.set(never_holds=1)
    assert not sender.raw(Frame(type=Request.BEGIN, sequence=50, payload=_announced()).octets())
    sender.wait(0.1)
    (frame,) = FrameReader().feed(drive.take())
    assert frame.reply().reason == Reason.TIME, "the interrupt does not hold the output"


def _announced() -> bytes:
    return WORDS.to_bytes(2, "big") + crc_of_block(NEW).to_bytes(4, "big") + origin_of_block(NEW).to_bytes(4, "big")


def only_at_rest_at_zero_command(drive: Drive) -> None:
    for what, reason in (("driving", Reason.DRIVING), ("command", Reason.COMMAND)):
        sender = fresh(drive)
        drive.set(**{what: 1})
        assert sender.begin().reason == reason and drive.words == 0 and not drive.code.drive_is_held()
    for pieces in (0, 3):
        sender = fresh(drive)
        assert sender.begin().reason == Reason.DONE
        for piece in range(pieces):
            assert sender.data(piece * MOST_WORDS).reason == Reason.DONE
        drive.set(command=1)
        sender.wait(0.01)
        assert not drive.code.drive_is_held() and drive.code.drive_ended() == Reason.COMMAND
        assert sender.data(pieces * MOST_WORDS).reason == Reason.NO_LOAD
    sender = fresh(drive)
    drive.set(new_command=1)
    assert sender.begin().reason == Reason.DONE
    sender.all_data()
    assert sender.commit().reason == Reason.COMMAND, "the new block has another zero"
    assert drive.block() == OLD == drive.power_on()


def a_memory_that_does_not_take_a_word(drive: Drive) -> None:
    for word in (0, 40, WORDS - 1):
        sender = fresh(drive)
        drive.set(bad_word=word)
        assert sender.begin().reason == Reason.DONE
        reasons = []
        for at in range(0, WORDS, MOST_WORDS):
            reasons.append(sender.data(at, min(MOST_WORDS, WORDS - at)).reason)
            if reasons[-1] != Reason.DONE:
                break
        assert reasons[-1] == Reason.STORE and at <= word, "as soon as it is read back"
        assert drive.block() == OLD == drive.power_on()
    sender = fresh(drive)
    drive.set(bad_word=WORDS)
    assert sender.begin().reason == Reason.DONE
    sender.all_data()
    assert sender.commit().reason == Reason.STORE, "the mark"
    assert drive.block() == OLD == drive.power_on()


def frames_that_are_not_sound(drive: Drive) -> None:
    sender = fresh(drive)
    sound = Frame(type=Request.QUERY, sequence=9, payload=b"").octets()
    assert len(sender.raw(sound)) == 1
    for bit in range(8 * len(sound)):
        damaged = (int.from_bytes(sound, "big") ^ 1 << bit).to_bytes(len(sound), "big")
        assert sender.raw(damaged) == []
        sender.wait(OCTET_S + 0.01)
    for cut in range(1, len(sound)):
        sender.raw(sound[:cut])
        sender.wait(OCTET_S + 0.01)
        assert len(sender.raw(sound)) == 1, "after a pause a frame begins anew"
    too_long = sound[:4] + bytes((MOST_PAYLOAD + 1,))
    assert sender.raw(too_long) == [] and len(sender.raw(sound)) == 1, "given up at once"
    assert len(sender.raw(b"\xc3" * 5 + sound)) == 1
    longest = Frame(type=0x7F, sequence=0, payload=bytes(MOST_PAYLOAD)).octets()
    assert sender.raw(longest)[0].reply().reason == Reason.TYPE


def the_used_slot_is_never_written(drive: Drive) -> None:
    """Also with several loads after one start."""
    fresh(drive)
    for number in range(5):
        block = blocks()[2 + number % 2]
        other = [drive.slot(0), drive.slot(1)]
        assert load(session(drive), block) == "done"
        changed = [slot for slot in (0, 1) if drive.slot(slot) != other[slot]]
        assert changed == [(number + 1) % 2]
        assert drive.block() == block


CHECKS: tuple[Callable[[Drive], None], ...] = (
    requests_out_of_order,
    repeated_requests_are_done_once,
    lengths_that_are_not_right,
    announcements_that_are_not_kept,
    a_second_begin_begins_anew,
    an_abort_ends_a_load,
    a_load_ends_when_its_time_is_over,
    only_at_rest_at_zero_command,
    a_memory_that_does_not_take_a_word,
    frames_that_are_not_sound,
    the_used_slot_is_never_written,
)
