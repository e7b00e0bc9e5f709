"""The PC's side of a load: what it makes of replies, and what it does without them."""

import random

import pytest

from dzdesign.codegen.loading.protocol import (
    FRAME_OCTETS,
    MOST_PAYLOAD,
    REPLY,
    Frame,
    FrameReader,
    Reason,
    Request,
    reason_text,
)
from dzdesign.codegen.loading.session import BUSY_S, TRIES, LoadSession, NoReplyError, RefusedError
from dzdesign.codegen.telemetry.frame import FRAME_OCTETS as TELEMETRY_OCTETS


class Answers:
    """A line on which each request is answered by what a function makes of it."""

    def __init__(self, answer) -> None:
        self.answer, self.sent, self.time_s, self.came = answer, [], 0.0, b""

    def now(self) -> float:
        return self.time_s

    def write(self, octets: bytes) -> None:
        (frame,) = FrameReader().feed(octets)
        self.sent.append(frame)
        self.came += self.answer(frame, len(self.sent))

    def read(self, limit_s: float) -> bytes:
        came, self.came = self.came, b""
        self.time_s += 0.001 if came else limit_s
        return came


def reply(frame: Frame, reason: int = 0, detail: int = 0, **changes: int) -> bytes:
    payload = bytes((reason, 0, 0, 0)) + detail.to_bytes(2, "big")
    values = {"type": frame.type | REPLY, "sequence": frame.sequence} | changes
    return Frame(payload=payload, **values).octets()


def load(answer) -> tuple[Answers, LoadSession]:
    line = Answers(answer)
    session = LoadSession(line)
    list(session.loading(bytes(130), 1, 2))
    return line, session


def test_a_load_is_a_begin_the_words_and_a_commit():
    line, session = load(lambda frame, _: reply(frame))
    assert [frame.type for frame in line.sent] == [Request.BEGIN, *[Request.DATA] * 3, Request.COMMIT]
    assert [frame.sequence for frame in line.sent] == [1, 2, 3, 4, 5]
    assert [int.from_bytes(frame.payload[:2], "big") for frame in line.sent] == [65, 0, 32, 64, 0]
    assert [len(frame.payload) for frame in line.sent] == [10, 66, 66, 4, 4]
    assert session.requests_of(bytes(130)) == 5 and session.repeats == 0


def test_what_is_no_reply_to_the_request_is_passed_over():
    rng = random.Random(2)

    def answer(frame, count):
        telemetry = bytes.fromhex("a55a03") + rng.randbytes(TELEMETRY_OCTETS - 3)
        stale = reply(frame, Reason.STORE, sequence=(frame.sequence - 1) % 256)
        other = reply(frame, Reason.STORE, type=Request.ABORT | REPLY)
        damaged = bytearray(reply(frame, Reason.STORE))
        damaged[rng.randrange(2, len(damaged))] ^= 0x10
        return telemetry + stale + other + bytes(damaged[:5]) + telemetry + bytes(damaged) + b"\xc3" + reply(frame)

    load(answer)


def test_a_request_without_a_reply_is_sent_again_and_then_given_up():
    line, session = load(lambda frame, count: reply(frame) if count % 3 == 0 else b"")
    assert session.repeats == 10 and len(line.sent) == 15
    assert len({(frame.type, frame.sequence, frame.payload) for frame in line.sent}) == 5
    silent = Answers(lambda *_: b"")
    with pytest.raises(NoReplyError):
        LoadSession(silent).query()
    assert len(silent.sent) == TRIES and len(set(silent.sent)) == 1


def test_busy_is_waited_for_but_not_for_ever():
    _, session = load(lambda frame, count: reply(frame, Reason.BUSY if 1 < count < 90 else 0))
    assert session.repeats == 88 > TRIES
    line = Answers(lambda frame, _: reply(frame, Reason.BUSY))
    with pytest.raises(RefusedError) as caught:
        list(LoadSession(line).loading(bytes(4), 1, 2))
    assert caught.value.reason == Reason.BUSY and BUSY_S < line.time_s < 1.1 * BUSY_S


@pytest.mark.parametrize("reason", [reason for reason in Reason if reason not in (Reason.DONE, Reason.BUSY)])
def test_a_refusal_ends_the_load_but_a_lost_place_begins_it_anew(reason):
    lost = {Reason.NO_LOAD, Reason.SEQUENCE, Reason.TIME, Reason.ABORTED, Reason.CRC, Reason.INCOMPLETE}
    if reason in lost:
        line, _ = load(lambda frame, count: reply(frame, reason if count == 3 else 0))
        assert [frame.type for frame in line.sent].count(Request.BEGIN) == 2
    with pytest.raises(RefusedError) as caught:
        load(lambda frame, count: reply(frame, reason, 8))
    assert (caught.value.reason, caught.value.detail) == (reason, 8)
    assert str(caught.value) == reason.text


def test_a_drive_of_another_version_is_told():
    with pytest.raises(RefusedError):
        load(lambda frame, _: reply(frame, 200))
    assert "200" in reason_text(200)
    for payload in (b"", bytes(6), bytes(99)):
        answer = Frame(type=Request.QUERY | REPLY, sequence=1, payload=payload[:MOST_PAYLOAD]).octets()
        with pytest.raises(NoReplyError, match="version"):
            LoadSession(Answers(lambda *_, answer=answer: answer)).query()
    with pytest.raises(NoReplyError, match="too short"):
        load(lambda frame, _: Frame(type=frame.type | REPLY, sequence=frame.sequence, payload=b"").octets())


@pytest.mark.parametrize("size", [1, 7, FRAME_OCTETS, 10_000])
def test_frames_are_found_between_garbage_in_pieces_of_any_size(size):
    rng = random.Random(4)
    lengths = [rng.randrange(MOST_PAYLOAD + 1) for _ in range(40)]
    sent = [
        Frame(type=rng.randrange(256), sequence=rng.randrange(256), payload=rng.randbytes(length)) for length in lengths
    ]
    octets = b"".join(
        frame.octets() + rng.randbytes(rng.randrange(9)).replace(b"\xc3", b"") + rng.choice((b"", b"\xc3\x3c\xff"))
        for frame in sent
    )
    octets += bytes(FRAME_OCTETS)  # what looks like a longer frame's beginning is waited for
    reader = FrameReader()
    found = [frame for at in range(0, len(octets), size) for frame in reader.feed(octets[at : at + size])]
    assert found == sent
