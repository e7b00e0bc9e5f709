"""Whether an object file can keep anything from one call to the next: its writable data, and what it calls outside.

Read from the object itself, of ELF (Linux), COFF (Windows) and Mach-O (macOS): a compiler such as Zig's has no `nm`.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from dzdesign.verify.checks import Check
from dzdesign.verify.exhaustive.drive_check import CompiledDrive

#: What a compiler calls by itself beside names that begin with an underscore, which C reserves for it.
OF_THE_COMPILER = ("memcpy", "memset", "memmove", "memcmp")


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectData:
    """What of an object file could hold a state.

    Attributes
    ----------
    writable : tuple of str
        Variables, or the sections where no symbol names one.
    defined, outside : frozenset of str
        Symbols that it has, and those that it needs from elsewhere.
    """

    writable: tuple[str, ...]
    defined: frozenset[str]
    outside: frozenset[str]


def keeps_no_state(folder: Path) -> Check:
    """Tell whether the core can behave otherwise after other calls: then trying every input once would not do.

    Parameters
    ----------
    folder : Path
        Of the firmware.

    Raises
    ------
    RequirementError
        If it does not compile.
    """
    name = "the core keeps no state between calls"
    objects = {path.name.removesuffix(".o"): path for path in CompiledDrive(folder).objects()}
    read = {source: object_data(path.read_bytes()) for source, path in objects.items()}
    unknown = [source for source, data in read.items() if data is None]
    if unknown:
        text = f"the compiler's object of {unknown[0]} is none of ELF, COFF or Mach-O; take another compiler with $CC"
        return Check(name=name, holds=None, text=text)
    ours = frozenset[str]().union(*(data.defined for data in read.values() if data))
    faults = []
    for source, data in read.items():
        outside = sorted(one for one in data.outside - ours if not one.startswith("_") and one not in OF_THE_COMPILER)
        if data.writable:
            faults.append(f"{source} has writable data: {', '.join(data.writable)}")
        if outside:
            faults.append(f"{source} uses what is not in the core: {', '.join(outside)}")
    text = f"no writable data in the objects of {', '.join(objects)}, and nothing from outside; "
    text += "the drive's state is in the struct dz_drive that its caller hands it"
    return Check(name=name, holds=not faults, text="; ".join(faults) or text)


def object_data(content: bytes) -> ObjectData | None:
    """Return what an object file could hold a state in; None of a format that is not known, or cut short.

    Parameters
    ----------
    content : bytes
        Of the file.
    """
    readers = {b"\x7fELF": _elf, b"\xcf\xfa\xed\xfe": _mach_o, **dict.fromkeys(COFF_MACHINES, _coff)}
    for begins, read in readers.items():
        if content.startswith(begins):
            try:
                return _summed(*read(content))
            except (struct.error, IndexError, ValueError):
                return None
    return None


#: Of a section that can be written to: its name. Of a symbol: name, and the place of its section, or one of these.
Sections = dict[int, str]
UNDEFINED, COMMON, OTHER = 0, -1, -2
Symbols = Iterator[tuple[str, int]]


def _summed(writable: Sections, symbols: Symbols) -> ObjectData:
    named: dict[int, list[str]] = {place: [] for place in writable}
    defined, outside, common = set(), set(), []
    for symbol, place in symbols:
        if place == UNDEFINED:
            outside.add(symbol)
            continue
        defined.add(symbol)
        if place == COMMON:
            common.append(symbol)
        elif place in named and symbol != writable[place]:
            named[place].append(symbol)
    found = [one for place, names in named.items() for one in (names or [writable[place]])]
    return ObjectData(writable=(*found, *common), defined=frozenset(defined), outside=frozenset(outside - {""}))


def _string(content: bytes, at: int) -> str:
    return content[at : content.index(b"\0", at)].decode(errors="replace")


def _elf(content: bytes) -> tuple[Sections, Symbols]:
    """Read ELF of 32 and 64 bits: section headers with SHF_WRITE and SHF_ALLOC, and the symbol table."""
    wide, end = content[4] == 2, "<" if content[5] == 1 else ">"
    at, size, count, names = (
        *struct.unpack_from(f"{end}{'Q' if wide else 'I'}", content, 40 if wide else 32),
        *struct.unpack_from(f"{end}HHH", content, 58 if wide else 46),
    )
    form = f"{end}IIQQQQIIQQ" if wide else f"{end}10I"
    headers = [struct.unpack_from(form, content, at + size * number) for number in range(count)]
    strings = headers[names][4]
    writable = {}
    for number, (name, _, flags, _, _, length, *_) in enumerate(headers):
        section = _string(content, strings + name)
        # Relocated once by the loader, then read only.
        if flags & 3 == 3 and length and not section.startswith(".data.rel.ro"):
            writable[number] = section

    def symbols() -> Symbols:
        for _, kind, _, _, offset, length, link, _, _, each in headers:
            if kind != 2:
                continue
            for place in range(offset + each, offset + length, each):  # the first is nobody's
                entry = struct.unpack_from(f"{end}IBBHQQ" if wide else f"{end}IIIBBH", content, place)
                name, info, section = (entry[0], entry[1], entry[3]) if wide else (entry[0], entry[3], entry[5])
                if info & 15 in (3, 4):  # a section, a file
                    continue
                yield _string(content, headers[link][4] + name), {0xFFF2: COMMON}.get(section, section)

    return writable, symbols()


#: x86-64, i386, ARM64 and ARM, as their objects begin.
COFF_MACHINES = (b"\x64\x86", b"\x4c\x01", b"\x64\xaa", b"\xc4\x01")


def _coff(content: bytes) -> tuple[Sections, Symbols]:
    """Read COFF: section headers with IMAGE_SCN_MEM_WRITE, and the symbol table."""
    _, count, _, table, entries, optional, _ = struct.unpack_from("<HHIIIHH", content)
    strings = table + 18 * entries

    def named(raw: bytes) -> str:
        if raw[:4] == bytes(4):
            return _string(content, strings + struct.unpack("<I", raw[4:])[0])
        return raw.rstrip(b"\0").decode(errors="replace")

    writable = {}
    for number in range(count):
        header = struct.unpack_from("<8sIIIIIIHHI", content, 20 + optional + 40 * number)
        name, length, flags = header[0], header[3], header[9]
        if flags & 0x80000000 and length:
            writable[number + 1] = named(name)

    def symbols() -> Symbols:
        place = 0
        while place < entries:
            name, value, section, _, kind, more = struct.unpack_from("<8sIhHBB", content, table + 18 * place)
            place += 1 + more
            if (kind == 3 and more) or section < 0:  # a section's own, a file's, an absolute one
                continue
            yield named(name), COMMON if section == 0 and value else section

    return writable, symbols()


def _mach_o(content: bytes) -> tuple[Sections, Symbols]:
    """Read Mach-O of 64 bits: sections of __DATA but for constants, and the symbol table; C's names begin with _."""
    (commands,) = struct.unpack_from("<I", content, 16)
    writable: Sections = {}
    table, number, at = (0, 0, 0), 0, 32
    for _ in range(commands):
        kind, size = struct.unpack_from("<II", content, at)
        if kind == 0x19:
            (sections,) = struct.unpack_from("<I", content, at + 64)
            for each in range(sections):
                name, segment, _, length = struct.unpack_from("<16s16sQQ", content, at + 72 + 80 * each)
                number += 1
                section = name.rstrip(b"\0").decode(errors="replace")
                if segment.rstrip(b"\0") == b"__DATA" and section != "__const" and length:
                    writable[number] = section
        elif kind == 2:
            table = struct.unpack_from("<III", content, at + 8)
        at += size

    def symbols() -> Symbols:
        offset, entries, strings = table
        for entry in range(entries):
            name, kind, section, _, value = struct.unpack_from("<IBBHQ", content, offset + 16 * entry)
            if kind & 0xE0:  # for debuggers
                continue
            place = section if kind & 0x0E else COMMON if value else UNDEFINED
            yield _string(content, strings + name).removeprefix("_"), place

    return writable, symbols()
