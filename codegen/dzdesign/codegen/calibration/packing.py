"""A calibration block as octets and back: little-endian words, and the CRC-32 of zlib at the end."""

import zlib
from collections.abc import Mapping, Sequence

from dzdesign.codegen.calibration.layout import (
    INNER,
    LAYOUT,
    LENGTH_WORDS,
    MAGIC,
    CalibrationBlock,
    Words,
    entries,
    words_of,
)
from dzdesign.core.errors import DzdesignError, InputError

OCTETS = 2 * LENGTH_WORDS
CRC_OCTETS = 4
#: Octets before the entry `length`: magic, version of the layout.
LENGTH_AT = 6


def pack(block: CalibrationBlock) -> bytes:
    """Return the octets of a block, whose `crc32` is that of what stands before it, whatever the block has there.

    A number that its entry can't hold is a `DzdesignError`.
    """
    before = _packed(block)[:-CRC_OCTETS]
    return before + zlib.crc32(before).to_bytes(CRC_OCTETS, "little")


def unpack(octets: bytes, name: str = "the calibration block") -> CalibrationBlock:
    """Return the numbers of a block.

    What is no block of this layout, is cut or damaged, is an `InputError` that begins with `name`. Whether the numbers
    are such as the firmware accepts is another question.
    """
    remedy = "write the block again with `dzdesign calibration`"
    if octets[: len(MAGIC)] != MAGIC:
        raise InputError(f"{name}: not a calibration block: it does not begin with {MAGIC.decode()}; {remedy}")
    layout = int.from_bytes(octets[len(MAGIC) : LENGTH_AT], "little")
    if len(octets) >= LENGTH_AT and layout != LAYOUT:
        raise InputError(f"{name}: layout {layout}, but this version reads layout {LAYOUT}; {remedy}")
    length = int.from_bytes(octets[LENGTH_AT : LENGTH_AT + 2], "little")
    if len(octets) != OCTETS:
        fault = "it is cut" if len(octets) < OCTETS else "something follows the block"
        raise InputError(f"{name}: {len(octets)} octets, expected {OCTETS}: {fault}; {remedy}")
    if length != LENGTH_WORDS:
        raise InputError(f"{name}: the block states {length} words, expected {LENGTH_WORDS}: it is damaged; {remedy}")
    stated, found = int.from_bytes(octets[-CRC_OCTETS:], "little"), zlib.crc32(octets[:-CRC_OCTETS])
    if stated != found:
        raise InputError(f"{name}: the CRC-32 is {stated:08x}, expected {found:08x}: it is damaged; {remedy}")
    block = _unpacked(CalibrationBlock, octets)
    if not isinstance(block, CalibrationBlock):
        raise DzdesignError("a block was unpacked as something else")
    return block


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
    return tuple(int.from_bytes(octets[at : at + 2], "little") for at in range(0, len(octets), 2))


def text_of(words: Sequence[int]) -> str:
    """Return the text that words hold; what is not UTF-8 is replaced.

    Examples
    --------
    >>> text_of(text_words("V-7", 3, "the serial number"))
    'V-7'
    """
    return octets_of(words).rstrip(b"\0").decode(errors="replace")


def octets_of(words: Sequence[int]) -> bytes:
    """Return the octets of words, the low half of each first."""
    return b"".join(word.to_bytes(2, "little") for word in words)


def _packed(block: object) -> bytes:
    own: Mapping[str, Words] = entries(type(block))
    found = b""
    for name in block.__dataclass_fields__:  # type: ignore[attr-defined]
        value = getattr(block, name)
        if name in INNER:
            found += b"".join(_packed(each) for each in (value if isinstance(value, tuple) else (value,)))
            continue
        entry = own[name]
        numbers = value if isinstance(value, tuple) else (value,)
        if len(numbers) != entry.count or not all(0 <= number < 1 << entry.bits for number in numbers):
            raise DzdesignError(f"{name} of the block does not fit {entry.count} numbers of {entry.bits} bits")
        found += b"".join(number.to_bytes(entry.bits // 8, "little") for number in numbers)
    return found


def _unpacked(kind: type, octets: bytes) -> object:
    own = entries(kind)
    values: dict[str, object] = {}
    at = 0
    for name in kind.__dataclass_fields__:  # type: ignore[attr-defined]
        if name in INNER:
            inner, count = INNER[name]
            size = 2 * words_of(inner)
            found = [_unpacked(inner, octets[at + size * index : at + size * (index + 1)]) for index in range(count)]
            values[name] = tuple(found) if count > 1 else found[0]
            at += size * count
            continue
        size, count = own[name].bits // 8, own[name].count
        places = range(at, at + size * count, size)
        numbers = tuple(int.from_bytes(octets[place : place + size], "little") for place in places)
        values[name] = numbers if count > 1 else numbers[0]
        at += size * count
    return kind(**values)
