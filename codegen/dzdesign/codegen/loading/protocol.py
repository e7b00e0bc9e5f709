"""The frames by which a PC writes a calibration block into a drive; their C is printed from here.

    sync (2)   type (1)   sequence (1)   length (1)   payload (length)   CRC (2)

Octets; numbers of more than one octet come with the most significant first, but the words of a block are the octets of
its file, least significant first. The CRC is that of the telemetry's frame, over type, sequence, length and payload.
Each request is answered by a reply with the same sequence number; the PC sends the next one only after it.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated, Self

from dzdesign.codegen.telemetry.frame import CRC_OCTETS, FrameSearch, Number, crc_of, numbers_of, struct_of

SOURCES = ("dz_load.c", "dz_load_frame.c", "dz_slots.c")
HEADERS = ("dz_load.h", "dz_load_frame.h", "dz_slots.h")
#: Where the blocks are kept: RAM, until the user writes their memory's.
STORE = ("dz_store.c", "dz_store.h")
LOAD_FILES = (*SOURCES, *HEADERS, *STORE)
SYNC = 0xC33C
HEADER_OCTETS = 5
#: Type of a reply: that of its request with this bit.
REPLY = 0x80
#: Words of the block in one request.
MOST_WORDS = 32
MOST_PAYLOAD = 2 + 2 * MOST_WORDS
FRAME_OCTETS = HEADER_OCTETS + MOST_PAYLOAD + CRC_OCTETS
SEQUENCES = 1 << 8
#: Within a frame two octets are at most this far apart; a load without a request for this time is over.
OCTET_S, LOAD_S = 0.1, 2.0
#: The longest that a drive may be silent in an erase, and in all else: one that waits for its flash answers nobody.
ERASE_S, SILENT_S = 20.0, 3.0
#: An interrupt holds the output low within this time.
HOLD_S = 0.02
#: Octets of the serial number that a drive states.
SERIAL_OCTETS = 24
_SYNC = struct.pack(">H", SYNC)


class _Named(IntEnum):
    """A number of the protocol, with what it means."""

    text: str

    def __new__(cls, value: int, text: str) -> Self:
        """Return the number that carries its text."""
        made = int.__new__(cls, value)
        made._value_, made.text = value, text
        return made


class Request(_Named):
    """What the PC asks for."""

    BEGIN = 1, "length of the block in words (2), its CRC-32 (4), start of its compensator's SHA-256 (4)"
    DATA = 2, f"words before these (2), then 1 to {MOST_WORDS} words of the block"
    COMMIT = 3, "the block's CRC-32 again (4)"
    ABORT = 4, "nothing; the load under way is given up"
    QUERY = 5, "nothing; the reply goes on with the drive's block and state"


class Reason(_Named):
    """Why a request was not done; DONE if it was."""

    DONE = 0, "done"
    BUSY = 1, "the request before this one is still being done"
    NO_LOAD = 2, "no load is under way"
    SEQUENCE = 3, "another sequence number, or another place in the block, was due"
    LENGTH = 4, "the length is not that of a block of this firmware, or of this request"
    DRIVING = 5, "the amplifier still drives: its ramp has not run out"
    COMMAND = 6, "the command is not zero"
    STORE = 7, "the memory did not take the words"
    CRC = 8, "the block's CRC-32 is not the one that was announced"
    CHECK = 9, "dz_calibration_check() refuses the block"
    INCOMPLETE = 10, "words of the block are missing"
    TYPE = 11, "the type of request is not known"
    ORIGIN = 12, "the block belongs to another compensator than was announced"
    TIME = 13, "the time was over"
    ABORTED = 14, "the load was given up by its sender"


def reason_text(reason: int) -> str:
    """Return what a reason means; a drive's newer firmware may have others."""
    known = {each.value: each.text for each in Reason}
    return known.get(reason, f"reason {reason}, which this dzdesign does not know")


#: In place of a slot: the block that the firmware was linked with, and none.
LINKED, NO_BLOCK = 2, 0xFFFF
#: Flags of a drive's state.
VOLATILE, LOADING = 0x0001, 0x0002


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """What every reply begins with; names are those in C too."""

    reason: Annotated[int, Number(bits=8, text="0: done, else why not")]
    expected: Annotated[int, Number(bits=8, text="sequence number that the next request of a load must have")]
    words: Annotated[int, Number(bits=16, text="words of the block that the drive has")]
    detail: Annotated[int, Number(bits=16, text="bits of dz_calibration_check(), if it refused")]


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveState:
    """What the reply to a query goes on with; the serial number of its block stands behind the numbers."""

    block: Annotated[int, Number(bits=16, text="in use: slot 0 or 1, 2: the linked one, 65535: none")]
    flags: Annotated[int, Number(bits=16, text="1: a loaded block is lost without supply, 2: a load is under way")]
    refusal: Annotated[int, Number(bits=16, text="why a load would be refused now, 0: it would not")]
    ended: Annotated[int, Number(bits=16, text="why the last load ended, 0: it was done, or there was none")]
    bad_frames: Annotated[int, Number(bits=16, text="frames that were cut, damaged or too long, modulo 65536")]
    layout: Annotated[int, Number(bits=16, text="layout version of blocks that this firmware takes")]
    length: Annotated[int, Number(bits=16, text="their length in words")]
    shape: Annotated[int, Number(bits=16, text="their shape")]
    code_max: Annotated[int, Number(bits=16, text="largest code of the converter that they must be for")]
    compare_max: Annotated[int, Number(bits=16, text="the same of counts at 100 % duty")]
    sample_Hz: Annotated[int, Number(bits=16, text="the same of samples a second")]
    tick_Hz: Annotated[int, Number(bits=16, text="the same of PWM periods per second")]
    beta_step: Annotated[int, Number(bits=16, text="the same of codes between two nodes of beta")]
    crc: Annotated[int, Number(bits=32, text="CRC-32 of the block in use")]
    origin: Annotated[int, Number(bits=32, text="start of its compensator's SHA-256")]
    serial: str


REPLY_NUMBERS, STATE_NUMBERS = numbers_of(Reply), numbers_of(DriveState)
_REPLY, _STATE = struct_of(REPLY_NUMBERS), struct_of(STATE_NUMBERS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """A frame of either direction."""

    type: int
    sequence: int
    payload: bytes

    def octets(self) -> bytes:
        """Return the frame as it goes over the line."""
        covered = bytes((self.type, self.sequence, len(self.payload))) + self.payload
        return _SYNC + covered + crc_of(covered).to_bytes(CRC_OCTETS, "big")

    def reply(self) -> Reply | None:
        """Return what the frame says as a reply; None if it is too short for one."""
        if len(self.payload) < _REPLY.size:
            return None
        return Reply(**dict(zip(REPLY_NUMBERS, _REPLY.unpack_from(self.payload), strict=True)))

    def drive_state(self) -> DriveState | None:
        """Return what a drive says of itself; None if the frame is no reply to a query."""
        if len(self.payload) != _REPLY.size + _STATE.size + SERIAL_OCTETS:
            return None
        numbers = _STATE.unpack_from(self.payload, _REPLY.size)
        serial = self.payload[-SERIAL_OCTETS:].rstrip(b"\0").decode("utf-8", "replace")
        return DriveState(**dict(zip(STATE_NUMBERS, numbers, strict=True)), serial=serial)


class FrameReader(FrameSearch):
    """Finds the protocol's frames in a stream of octets, telemetry too."""

    def __init__(self) -> None:
        super().__init__(_SYNC, self._octets_of)

    @staticmethod
    def _octets_of(held: bytearray) -> int | None:
        if len(held) < HEADER_OCTETS:
            return None
        return HEADER_OCTETS + held[4] + CRC_OCTETS if held[4] <= MOST_PAYLOAD else 0

    def feed(self, octets: bytes) -> Iterator[Frame]:
        """Yield the frames that are complete with these octets."""
        for frame in self.whole(octets):
            yield Frame(type=frame[2], sequence=frame[3], payload=frame[HEADER_OCTETS:-CRC_OCTETS])


def load_context(tick_Hz: int) -> dict[str, object]:
    """Return what the C by which a drive takes a block prints of the protocol, for a tick of so many a second."""
    return {
        "sync_high": f"0x{SYNC >> 8:02X}",
        "sync_low": f"0x{SYNC & 0xFF:02X}",
        "header_octets": HEADER_OCTETS,
        "crc_octets": CRC_OCTETS,
        "frame_octets": FRAME_OCTETS,
        "most_payload": MOST_PAYLOAD,
        "most_words": MOST_WORDS,
        "reply_bit": f"0x{REPLY:02X}",
        "requests": [(request.name, int(request), request.text) for request in Request],
        "reasons": [(reason.name, int(reason), reason.text) for reason in Reason],
        "reply_numbers": REPLY_NUMBERS,
        "state_numbers": STATE_NUMBERS,
        "octet_ticks": round(OCTET_S * tick_Hz),
        "load_ticks": round(LOAD_S * tick_Hz),
        "hold_ticks": round(HOLD_S * tick_Hz),
        "octet_ms": round(1000 * OCTET_S),
        "load_s": f"{LOAD_S:g}",
        "erase_s": f"{ERASE_S:g}",
        "silent_s": f"{SILENT_S:g}",
        "serial_octets": SERIAL_OCTETS,
        "linked": LINKED,
        "no_block": f"0x{NO_BLOCK:04X}",
        "volatile_flag": f"0x{VOLATILE:04X}",
        "loading_flag": f"0x{LOADING:04X}",
    }
