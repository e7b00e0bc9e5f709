"""A calibration block as octets, as the files that programmers take, and back.

The octets are little-endian words with the CRC-32 of zlib at the end. A raw file (.bin) has them alone, Intel HEX
(.hex) with the addresses where they go. A C28x has no address for an octet, and its tools count so (SPRU513, hex
conversion utility): Intel HEX of ``hex2000 --romwidth=16 --intel`` has addresses of 16-bit words, and of each word the
high octet first. Every other target counts octets.
"""

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import islice
from pathlib import Path
from typing import Any

from dzdesign.codegen.calibration.layout import INNER, LAYOUT, LENGTH_WORDS, MAGIC, CalibrationBlock, entries, members
from dzdesign.core.documents import read_bytes
from dzdesign.core.errors import DzdesignError, InputError, nearest

OCTETS = 2 * LENGTH_WORDS
CRC_OCTETS = 4
#: Octets before the entry `length`: magic, version of the layout.
LENGTH_AT = 6
#: Names of the formats, which are also the endings of their files.
FORMATS = ("hex", "bin")
#: A block as Intel HEX is a few KiB; what is much larger is something else.
MOST_OCTETS = 1 << 18
#: Addresses of a row of Intel HEX, and those under one extended address.
ROW, SEGMENT = 16, 1 << 16
#: The last record of Intel HEX.
END = ":00000001FF"
#: Octets that addresses of 32 bits tell apart, and where numbers of 32 bits must begin for the processor.
ADDRESSES, ALIGNED_OCTETS = 1 << 32, 4
ELSEWHERE = "right only if your linker file places it there"
_REMEDY = "write the block again with `dzdesign calibration`"
_LETTERS = {16: "H", 32: "I", 64: "Q"}
_BLOCK = struct.Struct("<" + "".join(f"{each.entry.count}{_LETTERS[each.entry.bits]}" for each in members()))


def pack(block: CalibrationBlock) -> bytes:
    """Return the octets of a block, whose `crc32` is that of what stands before it, whatever the block has there.

    A number that its entry can't hold is a `DzdesignError`.
    """
    try:
        before = _BLOCK.pack(*_numbers(block))[:-CRC_OCTETS]
    except struct.error as error:
        raise DzdesignError(f"a number of the calibration block does not fit its layout: {error}") from error
    return before + zlib.crc32(before).to_bytes(CRC_OCTETS, "little")


def unpack(octets: bytes, name: str = "the calibration block") -> CalibrationBlock:
    """Return the numbers of a block.

    What is no block of this layout, is cut or damaged, is an `InputError` that begins with `name`. Whether the numbers
    are such as the firmware accepts is another question.
    """
    if octets[: len(MAGIC)] != MAGIC:
        raise InputError(f"{name}: not a calibration block: it does not begin with {MAGIC.decode()}; {_REMEDY}")
    layout = int.from_bytes(octets[len(MAGIC) : LENGTH_AT], "little")
    if len(octets) >= LENGTH_AT and layout != LAYOUT:
        raise InputError(f"{name}: layout {layout}, but this version reads layout {LAYOUT}; {_REMEDY}")
    length = int.from_bytes(octets[LENGTH_AT : LENGTH_AT + 2], "little")
    if len(octets) != OCTETS:
        fault = "it is cut" if len(octets) < OCTETS else "something follows the block"
        raise InputError(f"{name}: {len(octets)} octets, expected {OCTETS}: {fault}; {_REMEDY}")
    if length != LENGTH_WORDS:
        raise InputError(f"{name}: the block states {length} words, expected {LENGTH_WORDS}: it is damaged; {_REMEDY}")
    stated, found = int.from_bytes(octets[-CRC_OCTETS:], "little"), zlib.crc32(octets[:-CRC_OCTETS])
    if stated != found:
        raise InputError(f"{name}: the CRC-32 is {stated:08x}, expected {found:08x}: it is damaged; {_REMEDY}")
    return CalibrationBlock(**_members(CalibrationBlock, iter(_BLOCK.unpack(octets))))


def _numbers(value: object) -> Iterator[int]:
    """Yield the numbers of a block, or of a part of one, in their order."""
    if isinstance(value, int):
        yield value
        return
    parts = value if isinstance(value, tuple) else [getattr(value, each.name) for each in fields(value)]  # type: ignore[arg-type]
    for each in parts:
        yield from _numbers(each)


def _members(kind: type, numbers: Iterator[int]) -> dict[str, Any]:
    """Return what the members of a struct hold, taken from the numbers that begin with it."""
    own, found = entries(kind), {}
    for name in (each.name for each in fields(kind)):
        inner, count = INNER.get(name, (None, 0))
        if inner is not None:
            values: tuple[Any, ...] = tuple(inner(**_members(inner, numbers)) for _ in range(count))
        else:
            values = tuple(islice(numbers, own[name].count))
        found[name] = values if len(values) > 1 else values[0]
    return found


def text_words(text: str, words: int, what: str) -> tuple[int, ...]:
    """Return a text as words, two octets of UTF-8 each, zeros behind it; one that does not fit is an `InputError`.

    Examples
    --------
    >>> [hex(word) for word in text_words("V-7", 3, "the serial number")]
    ['0x2d56', '0x37', '0x0']
    """
    octets = text.encode()
    if len(octets) > 2 * words:
        raise InputError(f"{what} '{text}' has {len(octets)} octets in UTF-8, expected at most {2 * words}; shorten it")
    if not text.isprintable() or text.isspace():
        fault = "is blank" if text.isspace() else "has characters that can't be printed"
        raise InputError(f"{what} {text!r} {fault}, expected a plain text")
    return octet_words(octets.ljust(2 * words, b"\0"))


def octet_words(octets: bytes) -> tuple[int, ...]:
    """Return octets as words, the first octet of each in its low half."""
    return struct.unpack(f"<{len(octets) // 2}H", octets)


def octets_of(words: Sequence[int]) -> bytes:
    """Return the octets of words, the low half of each first."""
    return struct.pack(f"<{len(words)}H", *words)


def text_of(words: Sequence[int]) -> str:
    """Return the text that words hold; what is not UTF-8 is replaced.

    Examples
    --------
    >>> text_of(text_words("V-7", 3, "the serial number"))
    'V-7'
    """
    return octets_of(words).rstrip(b"\0").decode(errors="replace")


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """An address, in the units of the target: octets, or words of 16 bits on a C28x, where no octet has an address."""

    address: int = 0
    unit_octets: int = 1

    def at(self, address: int, octets: int) -> "Place":
        """Return the same memory at another address, where so many octets must have room."""
        last, step = (ADDRESSES - octets) // self.unit_octets, ALIGNED_OCTETS // self.unit_octets
        if not 0 <= address <= last or address % step:
            unit = "words of 16 bits" if self.unit_octets > 1 else "octets"
            raise InputError(
                f"--address is {address:#x}, expected a multiple of {step} up to {last - last % step:#x}, in {unit}"
            )
        return Place(address=address, unit_octets=self.unit_octets)

    def in_words(self, sectors: Mapping[str, "Place"]) -> str:
        """Say whether it is where a target's firmware has its block; `sectors` are these places, by the targets' names.

        A programmer writes wherever the file says: at another address the drive keeps its old block, or another part
        of its program is lost.

        Examples
        --------
        >>> sectors = {"f28335": Place(address=0x33_0000, unit_octets=2)}
        >>> Place(address=0x33_0000, unit_octets=2).in_words(sectors)
        "word 0x330000, where f28335's firmware has its block"
        >>> Place(address=0x30_0000, unit_octets=2).in_words(sectors)
        'word 0x300000, WHERE NO GENERATED FIRMWARE HAS ITS BLOCK: right only if your linker file places it there'
        """
        where = f"{'word' if self.unit_octets > 1 else 'octet'} {self.address:#x}"
        for target, sector in sectors.items():
            if self == sector:
                return f"{where}, where {target}'s firmware has its block"
        return f"{where}, WHERE NO GENERATED FIRMWARE HAS ITS BLOCK: {ELSEWHERE}"


def image_of(octets: bytes, form: str, place: Place) -> bytes:
    """Return a block as the content of a file of a format, one of `FORMATS`."""
    if form == "bin":
        return octets
    from bincopy import BinFile

    octets = swapped(octets) if place.unit_octets > 1 else octets
    # Two pieces: a row of bincopy's may run over the end of a segment, behind which an extended address must stand.
    room = (SEGMENT - place.address % SEGMENT) * place.unit_octets
    rows: list[str] = []
    for at, piece in ((0, octets[:room]), (room, octets[room:])):
        if not piece:
            continue
        image = BinFile(word_size_bits=8 * place.unit_octets)
        image.add_binary(piece, place.address + at // place.unit_octets)
        rows += image.as_ihex(ROW * place.unit_octets).splitlines()[:-1]
    return "\n".join((*rows, END, "")).encode()


def read_block_file(path: Path, form: str | None = None) -> tuple[bytes, Place | None]:
    """Return the octets that a file of a block holds, and where it places them; None of a raw file, which does not say.

    By default the file's ending tells the format. A file that can't be read, has an error, or holds more than one run
    of octets is an `InputError`.
    """
    form = form or path.suffix.lower().removeprefix(".")
    if form not in FORMATS:
        raise InputError(_no_format(path))
    content = read_bytes(path, "calibration file")
    if len(content) > MOST_OCTETS:
        raise InputError(f"'{path}' has {len(content)} octets, expected a calibration block of a few KiB; {_REMEDY}")
    return (content, None) if form == "bin" else _intel_hex(content, f"'{path}'")


def _no_format(path: Path) -> str:
    """Say what is wrong with a file whose ending tells no format."""
    known = [f".{form}" for form in FORMATS]
    expected = f"expected a calibration file, {', '.join(known)}"
    if path.is_dir():
        return f"'{path}' is a folder, {expected}; name the file in it"
    ending = f"ends with '{path.suffix}'{nearest(path.suffix, known)}" if path.suffix else "has no ending"
    return f"'{path}' {ending}, {expected}; rename it"


def _intel_hex(content: bytes, name: str) -> tuple[bytes, Place]:
    from bincopy import AddDataError, BinFile, Error

    try:
        *records, last = content.decode("ascii").upper().split() or [""]
    except UnicodeDecodeError as error:
        raise InputError(f"{name}: octet {error.start} is no ASCII, expected text; {_REMEDY}") from error
    if last != END:
        raise InputError(f"{name}: the file does not end with the record {END}, so it is cut; {_REMEDY}")
    if END in records:
        raise InputError(f"{name}, row {records.index(END) + 1}: something follows the record {END}; {_REMEDY}")
    for unit_octets in (1, 2):  # of octets, or of words as hex2000 --romwidth=16 writes them
        image = BinFile(word_size_bits=8 * unit_octets)
        try:
            image.add_ihex("\n".join(records))
        except AddDataError:  # rows overlap: those of words do where octets are counted
            continue
        except (Error, ValueError) as error:
            raise InputError(f"{name}: not Intel HEX: {error}; {_REMEDY}") from error
        if len(image.segments) == 1:
            (segment,) = image.segments
            octets = bytes(segment.data)
            place = Place(address=segment.address, unit_octets=unit_octets)
            return (swapped(octets) if unit_octets > 1 else octets), place
        if not image.segments:
            raise InputError(f"{name}: octets in none of its rows, expected a calibration block; {_REMEDY}")
    fault = "parts that do not follow each other, expected the block alone, without a gap or a row twice"
    raise InputError(f"{name}: {fault}; {_REMEDY}")


def swapped(octets: bytes) -> bytes:
    """Return 16-bit words with the octets of each in the other order.

    Examples
    --------
    >>> swapped(b"DZC1")
    b'ZD1C'
    """
    return b"".join(octets[at : at + 2][::-1] for at in range(0, len(octets), 2))
