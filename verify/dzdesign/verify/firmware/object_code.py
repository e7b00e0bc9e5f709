"""What a compiler made of one C file: sections, where they refer to others, and symbols, of a 32-bit ELF object.

Format: Tool Interface Standard (TIS), Executable and Linking Format, version 1.2, book I.
"""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from dzdesign.core.errors import RequirementError

HEADER, SECTION, SYMBOL = struct.Struct("<16sHHIIIIIHHHHHH"), struct.Struct("<10I"), struct.Struct("<IIIBBH")
#: Kinds of section.
SYMBOLS, RELA, NO_BITS, REL = 2, 4, 8, 9
ALLOCATED = 2
#: Kinds of symbol: none, a variable, a function, a section. Of none, and local, are a compiler's own marks.
NO_TYPE, OF_SECTION, LOCAL = 0, 3, 0
#: Where a symbol may stand that stands in no section.
NO_SECTION = {0: "none", 0xFFF1: "absolute", 0xFFF2: "common"}
Reference = tuple[int, int, str, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A section that lies in memory: its kind, flags and alignment, its bytes, and what stands where in them.

    Of one without bytes, such as variables at zero, the size counts for nothing.
    """

    kind: tuple[int, int, int]
    content: bytes
    #: Offset, kind of reference, symbol or section, addend.
    references: tuple[Reference, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectCode:
    """An object file, as far as it comes into a program."""

    sections: Mapping[str, Section]
    #: Name to binding, kind, visibility and section.
    symbols: Mapping[str, tuple[int, int, int, str]]

    def differences(self, other: "ObjectCode") -> Iterator[str]:
        """Yield the names of all that `other` has otherwise or has not; what it has beside is no difference."""
        for name, symbol in self.symbols.items():
            if other.symbols.get(name) != symbol:
                yield name
        for name, section in self.sections.items():
            if other.sections.get(name) != section:
                yield name


def read_object(content: bytes) -> ObjectCode:
    """Read a little-endian 32-bit ELF object."""
    try:
        return _read(content)
    except (struct.error, IndexError, ValueError) as error:
        raise RequirementError(f"the compiler wrote no 32-bit ELF object: {error}") from error


def _read(content: bytes) -> ObjectCode:
    magic, *_, at, _, _, _, _, size, count, names_at = HEADER.unpack_from(content)
    if magic[:6] != b"\x7fELF\x01\x01" or size != SECTION.size:
        raise ValueError(f"it begins with {magic[:6].hex()}")
    headers = [SECTION.unpack_from(content, at + size * index) for index in range(count)]
    bodies = [b"" if each[1] == NO_BITS else content[each[4] : each[4] + each[5]] for each in headers]
    names = [_text(bodies[names_at], each[0]) for each in headers]
    symbols: list[tuple[str, tuple[int, int, int, str]]] = []
    references: dict[int, list[Reference]] = {}
    for header, body in zip(headers, bodies, strict=True):
        if header[1] == SYMBOLS:
            symbols = [_symbol(each, bodies[header[6]], names) for each in SYMBOL.iter_unpack(body)]
    for header, body in zip(headers, bodies, strict=True):
        if header[1] in (REL, RELA):
            entry = struct.Struct("<IIi" if header[1] == RELA else "<II")
            references[header[7]] = [
                (place, info & 0xFF, symbols[info >> 8][0], *(added or (0,)))
                for place, info, *added in entry.iter_unpack(body)
            ]
    return ObjectCode(
        sections={
            name: Section(
                kind=(header[1], header[2], header[8]), content=body, references=tuple(references.get(index, ()))
            )
            for index, (name, header, body) in enumerate(zip(names, headers, bodies, strict=True))
            if header[2] & ALLOCATED
        },
        symbols={
            name: symbol
            for name, symbol in symbols
            if name and symbol[1] != OF_SECTION and (symbol[0] != LOCAL or symbol[1] != NO_TYPE)
        },
    )


def _symbol(entry: tuple[int, ...], texts: bytes, sections: list[str]) -> tuple[str, tuple[int, int, int, str]]:
    name_at, _, _, info, visibility, index = entry
    place = NO_SECTION[index] if index in NO_SECTION else sections[index]
    name = place if info & 0xF == OF_SECTION else _text(texts, name_at)
    return name, (info >> 4, info & 0xF, visibility, place)


def _text(texts: bytes, at: int) -> str:
    return texts[at : texts.index(b"\0", at)].decode(errors="replace")
