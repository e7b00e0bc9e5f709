"""The PC's side of loading a block: each request is sent until its reply comes, a load until it is done or refused."""

from collections.abc import Iterator
from typing import Protocol

from dzdesign.codegen.calibration.files import FINDINGS
from dzdesign.codegen.loading.protocol import (
    ERASE_S,
    MOST_WORDS,
    REPLY,
    SEQUENCES,
    SILENT_S,
    DriveState,
    Frame,
    FrameReader,
    Reason,
    Request,
    reason_text,
)
from dzdesign.core.errors import InputError, RequirementError

#: A reply comes within this time, or its request is sent again, so often.
REPLY_S = 0.3
TRIES, TRIES_IN_ERASE = round(SILENT_S / REPLY_S), round(ERASE_S / REPLY_S)
#: The longest that a drive may say that it is still busy: an erase of flash takes seconds.
BUSY_S = 60.0
#: A load that lost its place (the drive's time was over, another sender) begins again so often.
LOADS = 5
#: Reasons for which a load begins again: what came over the line was not what was sent, or not in its order.
CRC_FINDING = 1 << list(FINDINGS).index("CRC")
_LOST = frozenset({Reason.NO_LOAD, Reason.SEQUENCE, Reason.TIME, Reason.ABORTED, Reason.CRC, Reason.INCOMPLETE})


class Line(Protocol):
    """A serial line, and the time by which it is waited for."""

    def write(self, octets: bytes) -> None:
        """Send octets."""

    def read(self, limit_s: float) -> bytes:
        """Return what comes within at most this time, or nothing."""

    def now(self) -> float:
        """Return the time in s, from any moment on."""


class NoReplyError(InputError):
    """The drive did not answer."""


class RefusedError(RequirementError):
    """The drive answered, and refused; `reason` says why, and `detail` what dz_calibration_check() found."""

    def __init__(self, reason: int, detail: int) -> None:
        self.reason, self.detail = reason, detail
        #: Whether the line made of the block what was not sent, or lost the load's place: it may be tried again.
        self.is_of_the_line = reason in _LOST or (reason == Reason.CHECK and bool(detail & CRC_FINDING))
        super().__init__(reason_text(reason))


class LoadSession:
    """Requests over one line, numbered from `sequence` on."""

    def __init__(self, line: Line, sequence: int = 0) -> None:
        self._line, self._reader, self._sequence = line, FrameReader(), sequence
        #: Requests that were sent again.
        self.repeats = 0

    def query(self) -> DriveState:
        """Return what the drive says of itself."""
        frame = self._exchange(Request.QUERY, b"")
        found = frame.drive_state()
        if found is None:
            raise NoReplyError(
                f"the amplifier answers {len(frame.payload)} octets that this dzdesign does not know; "
                "firmware and dzdesign must be of one version"
            )
        return found

    def loading(self, block: bytes, crc: int, origin: int) -> Iterator[Request]:
        """Write a block of whole words, and yield each request that was done.

        A load that lost its place on the line begins again; what the drive refuses is a `RefusedError`.
        """
        for attempt in range(LOADS):
            try:
                yield from self._once(block, crc, origin)
                return
            except RefusedError as error:
                if not error.is_of_the_line or attempt == LOADS - 1:
                    raise

    @staticmethod
    def requests_of(block: bytes) -> int:
        """Return how many requests a block takes if none is sent twice."""
        return 2 + -(-len(block) // (2 * MOST_WORDS))

    def abort(self) -> None:
        """Give up a load that may be under way."""
        self._exchange(Request.ABORT, b"")

    def _once(self, block: bytes, crc: int, origin: int) -> Iterator[Request]:
        words = len(block) // 2
        announced = words.to_bytes(2, "big") + crc.to_bytes(4, "big") + origin.to_bytes(4, "big")
        yield self._ask(Request.BEGIN, announced)
        for at in range(0, words, MOST_WORDS):
            yield self._ask(Request.DATA, at.to_bytes(2, "big") + block[2 * at : 2 * (at + MOST_WORDS)])
        yield self._ask(Request.COMMIT, crc.to_bytes(4, "big"))

    def _ask(self, request: Request, payload: bytes) -> Request:
        reply = self._exchange(request, payload).reply()
        if reply is None:
            raise NoReplyError(f"the answer to {request.name} is too short")
        if reply.reason != Reason.DONE:
            raise RefusedError(reply.reason, reply.detail)
        return request

    def _exchange(self, request: Request, payload: bytes) -> Frame:
        """Send a request until its reply comes; busy is no reply yet."""
        self._sequence = (self._sequence + 1) % SEQUENCES
        octets = Frame(type=request, sequence=self._sequence, payload=payload).octets()
        tries = TRIES_IN_ERASE if request == Request.BEGIN else TRIES
        begin, unanswered = self._line.now(), 0
        while unanswered < tries:
            self._line.write(octets)
            unanswered += 1
            for frame in self._frames_until(self._line.now() + REPLY_S):
                if (frame.type, frame.sequence) != (request | REPLY, self._sequence):
                    continue
                reply = frame.reply()
                if reply is not None and reply.reason == Reason.BUSY:
                    unanswered = 0  # it lives; the reply itself comes when it is done
                    continue
                return frame
            self.repeats += 1
            if self._line.now() - begin > BUSY_S:
                raise RefusedError(Reason.BUSY, 0)
        raise NoReplyError(f"no answer to {request.name} in {tries} tries")

    def _frames_until(self, end: float) -> Iterator[Frame]:
        while (left := end - self._line.now()) > 0:
            yield from self._reader.feed(self._line.read(left))
