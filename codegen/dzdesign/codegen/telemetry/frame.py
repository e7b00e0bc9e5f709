"""The telemetry frame, stated once: its C is printed from here, and `dzdesign monitor` reads by it.

    sync (2)   version (1)   length (1)   payload (length)   CRC (2)

Octets; numbers of more than one octet come with the most significant first. The CRC runs over version, length and
payload: CRC-16/IBM-3740 (also called CCITT-FALSE), polynomial x^16 + x^12 + x^5 + 1 (1021h), start FFFFh, not
reflected, nothing added at the end; of the octets of "123456789" it is 29B1h.
"""

import binascii
import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, get_origin, get_type_hints

from dzdesign.codegen.core.constants import DRIVE_BITS
from dzdesign.codegen.core.constants import STATUS_BITS as LAW_BITS
from dzdesign.codegen.core.integer_form import exact_factors
from dzdesign.core.errors import InputError

SYNC = 0xA55A
VERSION = 3
CRC_POLYNOMIAL, CRC_START = 0x1021, 0xFFFF
HEADER_OCTETS, CRC_OCTETS = 4, 2
#: A start bit, eight of data, a stop bit.
BITS_PER_OCTET = 10
#: Fraction bits of beta in a frame.
BETA_BITS = 15
#: Ticks count modulo this.
TICKS_MODULUS = 1 << 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Number:
    """One number of a payload: its bits (8, 16 or 32), and what it is."""

    bits: int
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """The numbers of the payload, in their order; names are those in C too."""

    ticks: Annotated[int, Number(bits=32, text="PWM periods since the start, modulo 2^32")]
    origin: Annotated[int, Number(bits=16, text="first 16 bits of the SHA-256 of compensator.json")]
    u_adc: Annotated[int, Number(bits=16, text="code of the command")]
    p_a_adc: Annotated[int, Number(bits=16, text="code of pressure A")]
    p_b_adc: Annotated[int, Number(bits=16, text="code of pressure B")]
    p_c_adc: Annotated[int, Number(bits=16, text="code of pressure C; 0 without one")] = 0
    beta: Annotated[int, Number(bits=16, text="beta(dP) times 2^15, rounded down")]
    compare_a: Annotated[int, Number(bits=16, text="PWM compare value of solenoid A")]
    compare_b: Annotated[int, Number(bits=16, text="of solenoid B; one of the two is 0")]
    status: Annotated[int, Number(bits=16, text="bits of the status word")]


def numbers_of(kind: type) -> Mapping[str, Number]:
    """Return the numbers of a payload, or of a part of one, by name."""
    hints = get_type_hints(kind, include_extras=True)
    return {name: hint.__metadata__[0] for name, hint in hints.items() if get_origin(hint) is Annotated}


def struct_of(numbers: Mapping[str, Number]) -> struct.Struct:
    """Return the octets of such numbers, the most significant one of each first."""
    return struct.Struct(">" + "".join({8: "B", 16: "H", 32: "I"}[number.bits] for number in numbers.values()))


NUMBERS = numbers_of(Frame)
#: The status word: what the hardware reports, in its low octet, and in the high one the status of law and drive.
STATUS_BITS = {
    0x0001: "no usable sample in time",
    0x0002: "trip input went low",
    0x0004: "watchdog reset",
    0x0008: "crystal or PLL not as expected",
    0x0010: "current not converted in time",
    0x0020: "current sensor, open load, short or over-current",
    0x0040: "no valid calibration block",
    **{0x0100 << place: text for place, text in (*enumerate(LAW_BITS.values()), *DRIVE_BITS.values())},
}
#: The output is in use; without it the trip zone holds the pin low, whatever the compare value.
STATUS_RELEASED = 0x0080
#: A firmware of block form has no block that it accepts.
STATUS_CALIBRATION = 0x0040
PAYLOAD_OCTETS = struct_of(NUMBERS).size
FRAME_OCTETS = HEADER_OCTETS + PAYLOAD_OCTETS + CRC_OCTETS
FRAME_BITS = FRAME_OCTETS * BITS_PER_OCTET
_PAYLOAD = struct_of(NUMBERS)
_START = struct.pack(">HBB", SYNC, VERSION, PAYLOAD_OCTETS)
_SYNC = _START[:2]


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """The serial line of a target: PWM periods per second and from frame to frame, and nominal bits per second."""

    tick_Hz: int
    frame_ticks: int
    baud: int


def crc_of(octets: bytes | bytearray) -> int:
    """Return the frame's CRC of some octets.

    Examples
    --------
    >>> hex(crc_of(b"123456789"))
    '0x29b1'
    """
    return binascii.crc_hqx(octets, CRC_START)


class FrameSearch:
    """Finds whole frames in a stream of octets, whatever lies between them.

    All begin with the octets `sync`. `length` tells of octets that do how many the frame has, CRC included: None if its
    header is not complete, 0 if no frame begins so.
    """

    def __init__(self, sync: bytes, length: Callable[[bytearray], int | None]) -> None:
        self._sync, self._length = sync, length
        self._held = bytearray()
        #: Frames found; those whose CRC was wrong; headers of no frame; octets outside good frames.
        self.frames = self.bad_crc = self.other_version = self.skipped = 0

    def whole(self, octets: bytes) -> Iterator[bytes]:
        """Yield the frames that are complete with these octets.

        After a bad frame the search goes on one octet behind its sync word, so that a good frame which begins inside
        the bad one (a cut frame) is not lost with it.
        """
        held = self._held
        held += octets
        while True:
            start = held.find(self._sync)
            if start < 0:  # the last octet may be the first half of a sync word
                self._skip(len(held) - held.endswith(self._sync[:1]))
                return
            self._skip(start)
            length = self._length(held)
            if length is None or length > len(held):
                return
            if not length:
                self.other_version += 1
                self._skip(1)
            elif crc_of(held[2:length]):  # with its own CRC behind it, the CRC of sound octets is zero
                self.bad_crc += 1
                self._skip(1)
            else:
                self.frames += 1
                frame = bytes(held[:length])
                del held[:length]
                yield frame

    def _skip(self, count: int) -> None:
        self.skipped += count
        del self._held[:count]


class FrameReader(FrameSearch):
    """Finds the telemetry's frames in a stream of octets."""

    def __init__(self) -> None:
        super().__init__(_SYNC, lambda held: FRAME_OCTETS if held.startswith(_START) else
                         None if len(held) < HEADER_OCTETS else 0)  # fmt: skip

    def feed(self, octets: bytes) -> Iterator[Frame]:
        """Yield the frames that are complete with these octets."""
        for frame in self.whole(octets):
            yield Frame(**dict(zip(NUMBERS, _PAYLOAD.unpack_from(frame, HEADER_OCTETS), strict=True)))


def frame_context() -> dict[str, str]:
    """Return what the templates of a target print of the frame: sizes, the layout as a comment, the C of the fields."""
    layout, members, puts, at = [], [], [], HEADER_OCTETS
    for name, number in NUMBERS.items():
        layout.append(f" *   {at:2d}  {number.bits // 8}  {name:9s} {number.text}")
        members.append(f"    uint{number.bits}_t {name}; /* {number.text} */")
        puts.append(f"    at = put_{number.bits}(octets, at, frame->{name});")
        at += number.bits // 8
    return {
        "frame_sync": f"0x{SYNC:04X}",
        "frame_version": str(VERSION),
        "frame_payload": str(PAYLOAD_OCTETS),
        "frame_octets": str(FRAME_OCTETS),
        "frame_layout": "\n".join(layout),
        "frame_crc_at": str(at),
        "frame_members": "\n".join(members),
        "frame_puts": "\n".join(puts),
        "crc_polynomial": f"0x{CRC_POLYNOMIAL:04X}",
        "crc_start": f"0x{CRC_START:04X}",
        "status_released": f"0x{STATUS_RELEASED:04X}",
        "status_calibration": f"0x{STATUS_CALIBRATION:04X}",
    }


def beta_factor(unit: int, largest: int) -> tuple[int, int]:
    """Return (m, s) with ``v * m >> s`` equal to ``v * 2^15 // unit`` for every v up to `largest`, below 2^31.

    `unit` stands for beta = 1 on the scale of the core's table. If no 32-bit factor is exact it is an `InputError`.
    """
    for factor in exact_factors(Fraction(1 << BETA_BITS, unit), largest, range(64)):
        return factor
    raise InputError(f"no 32-bit factor brings beta from units of 1/{unit} to 2^-{BETA_BITS} exactly up to {largest}")
