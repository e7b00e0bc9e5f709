"""Which libraries a binary asks the system for: of ELF, PE and Mach-O, read from their headers."""

import struct
from collections.abc import Mapping

#: ELF: types of a dynamic entry, and of a program header that holds these.
DT_NULL, DT_NEEDED, DT_STRTAB, PT_LOAD, PT_DYNAMIC = 0, 1, 5, 1, 2
#: Mach-O, 64 bits, little-endian; commands that name a library: needed, needed weakly, again shown, needed late.
MACH_O, LOADS = 0xFEEDFACF, frozenset({0xC, 0x80000018, 0x8000001F, 0x20})
#: PE: where the directory of imports stands in the optional header of 64 bits, and octets of an entry of it.
PE_DIRECTORIES, IMPORT_SIZE, SECTION_SIZE = 112, 20, 40
#: Octets of a library's name, and of the shortest command of Mach-O: a loop over shorter ones could stand still.
LONGEST_NAME, SHORTEST_COMMAND = 1024, 8
#: Headers, commands and libraries that a binary has at most; one of ours has ten.
MOST_HEADERS = 1000


def machine_of(content: bytes) -> str:
    """Return processor and form of a binary of 64 bits; one of another form is a `ValueError`."""
    try:
        if content[:6] == b"\x7fELF\x02\x01":
            return _named(struct.unpack_from("<H", content, 18)[0], {62: "x86_64", 183: "aarch64"}, "ELF")
        if content[:2] == b"MZ":
            (header,) = struct.unpack_from("<I", content, 60)
            return _named(struct.unpack_from("<H", content, header + 4)[0], {0x8664: "x86_64", 0xAA64: "aarch64"}, "PE")
        if len(content) > 8 and struct.unpack_from("<I", content)[0] == MACH_O:
            processor = struct.unpack_from("<I", content, 4)[0]
            return _named(processor, {0x1000007: "x86_64", 0x100000C: "aarch64"}, "Mach-O")
    except (struct.error, OverflowError) as error:
        raise ValueError(f"it ends within its headers ({error})") from error
    raise ValueError("it is neither ELF nor PE nor Mach-O, of 64 bits and little-endian")


def _named(number: int, names: Mapping[int, str], form: str) -> str:
    return f"{names.get(number, f'processor {number}')} {form}"


def needed_libraries(content: bytes) -> list[str]:
    """Return the names of the libraries that a binary of 64 bits needs; one of another form is a `ValueError`."""
    try:
        if content[:4] == b"\x7fELF":
            return _of_elf(content)
        if content[:2] == b"MZ":
            return _of_pe(content)
        if len(content) > 4 and struct.unpack_from("<I", content)[0] == MACH_O:
            return _of_mach_o(content)
    except (struct.error, OverflowError, StopIteration) as error:
        raise ValueError(f"it ends within its headers ({error})") from error
    raise ValueError("it is neither ELF nor PE nor Mach-O")


def _few(count: int) -> int:
    """Return a count; one that no binary of ours has is a `ValueError`."""
    if count > MOST_HEADERS:
        raise ValueError(f"it has {count} headers or libraries, expected at most {MOST_HEADERS}")
    return count


def _text(content: bytes, place: int) -> str:
    return content[place : content.index(b"\0", place, place + LONGEST_NAME)].decode("latin-1")


def _of_elf(content: bytes) -> list[str]:
    (first,) = struct.unpack_from("<Q", content, 32)
    size, count = struct.unpack_from("<HH", content, 54)
    headers = [struct.unpack_from("<IIQQQQQQ", content, first + size * index) for index in range(_few(count))]
    loads = [(header[3], header[2], header[5]) for header in headers if header[0] == PT_LOAD]
    entries: list[tuple[int, int]] = []
    for header in (header for header in headers if header[0] == PT_DYNAMIC):
        found = [struct.unpack_from("<qQ", content, header[2] + 16 * index) for index in range(header[5] // 16)]
        ends = next((index for index, entry in enumerate(found) if entry[0] == DT_NULL), len(found))
        entries += found[:ends]
    strings = next((value for tag, value in entries if tag == DT_STRTAB), 0)
    names = [value for tag, value in entries if tag == DT_NEEDED]
    place = next((strings - address + offset for address, offset, length in loads
                  if address <= strings < address + length), 0)  # fmt: skip
    _few(len(names))
    return [_text(content, place + name) for name in names]


def _of_pe(content: bytes) -> list[str]:
    (header,) = struct.unpack_from("<I", content, 60)
    (sections,) = struct.unpack_from("<H", content, header + 6)
    (optional_size,) = struct.unpack_from("<H", content, header + 20)
    optional = header + 24
    imports, size = struct.unpack_from("<II", content, optional + PE_DIRECTORIES + 8)
    if not imports or not size:
        return []
    table = [
        struct.unpack_from("<IIII", content, optional + optional_size + SECTION_SIZE * index + 8)
        for index in range(_few(sections))
    ]

    def place(address: int) -> int:
        places = (raw + address - start for length, start, raw_size, raw in table
                  if start <= address < start + max(length, raw_size))  # fmt: skip
        return int(next(places))

    found, entry = [], place(imports)
    while name := struct.unpack_from("<I", content, entry + 12)[0]:
        found.append(_text(content, place(name)))
        _few(len(found))
        entry += IMPORT_SIZE
    return found


def _of_mach_o(content: bytes) -> list[str]:
    (count,) = struct.unpack_from("<I", content, 16)
    found, place = [], 32
    for _ in range(_few(count)):
        command, size = struct.unpack_from("<II", content, place)
        if size < SHORTEST_COMMAND:
            raise ValueError(f"it has a command of {size} octets")
        if command in LOADS:
            found.append(_text(content, place + struct.unpack_from("<I", content, place + 8)[0]))
        place += size
    return found
