"""An FMU's zip, octet by octet: a tool that reads it otherwise than Python's zipfile must find the same files in it.

Entries stand one behind the other from the first octet on, each named once, with the same header in front of it and in
the directory; nothing is encrypted, and no name leads out of the folder that a tool unpacks to.
"""

import re
import struct
from io import BytesIO
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile, ZipInfo
from zlib import error as ZlibError

from dzdesign.core.errors import InputError, quoted

#: Larger than any FMU of ours unpacked, and more files than it has.
LARGEST_OCTETS, MOST_FILES = 64 * 2**20, 100
#: Octets that are unpacked at a time.
STEP = 2**16
#: A path inside: names with no sign that a system reads as another, none of them dots alone.
PLAIN = re.compile(r"(?!\.)[A-Za-z0-9_.-]+(?:/(?!\.)[A-Za-z0-9_.-]+)*")
#: Header in front of an entry, of one in the directory, and the end of an archive: octets, and where they begin.
LOCAL, LOCAL_MARK, CENTRAL_SIZE, END_SIZE = struct.Struct("<4sHHHHHIIIHH"), b"PK\3\4", 46, 22
#: Kind of file in the mode that Unix has for it; zero where none is stated.
KIND_BITS, REGULAR = 0o170000, (0, 0o100000)


def unpacked(content: bytes, source: str) -> dict[str, bytes]:
    """Return the files of a zip, path to content; one that tools could read otherwise is an `InputError`."""
    try:
        with ZipFile(BytesIO(content)) as packed:
            entries = packed.infolist()
            if len(entries) > MOST_FILES or sum(entry.file_size for entry in entries) > LARGEST_OCTETS:
                raise InputError(
                    f"{source} has {len(entries)} files, or unpacks to more than {LARGEST_OCTETS // 2**20} MB, as no "
                    "FMU of dzdesign; make it again"
                )
            if fault := _fault(content, entries, packed.comment):
                raise InputError(f"{source}: {fault}, as in no FMU of dzdesign; make it again with `dzdesign codegen`")
            return {entry.filename: _content(packed, entry) for entry in entries}
    except (BadZipFile, ZlibError, struct.error, EOFError, RuntimeError, OSError, ValueError) as error:
        raise InputError(f"{source} is no FMU of dzdesign: {error}; make it again with `dzdesign codegen`") from error


def _content(packed: ZipFile, entry: ZipInfo) -> bytes:
    """Return an entry, unpacked in steps: all at once takes the memory of all that is packed, whatever it states."""
    with packed.open(entry) as file:
        return b"".join(iter(lambda: file.read(STEP), b""))


def _fault(content: bytes, entries: list[ZipInfo], comment: bytes) -> str:
    """Return what stands otherwise in a zip than in one that every tool reads alike; empty if nothing does."""
    place, names = 0, set[str]()
    for entry in entries:
        name = entry.orig_filename
        if not PLAIN.fullmatch(name) or name.endswith((".", "/")):
            return f"an entry is named {quoted(name)}"
        if name.lower() in names:
            return f"two entries are named {quoted(name)}"
        names.add(name.lower())
        if entry.compress_type not in (ZIP_STORED, ZIP_DEFLATED) or entry.flag_bits or entry.extra or entry.comment:
            return f"{quoted(name)} is encrypted, or packed in another way"
        if entry.external_attr >> 16 & KIND_BITS not in REGULAR:
            return f"{quoted(name)} is no plain file"
        if (end := _end_of(content, entry, place)) is None:
            return f"{quoted(name)} is described otherwise in front of it than in the directory"
        place = end
    directory = sum(CENTRAL_SIZE + len(entry.orig_filename) for entry in entries)
    return "it has octets that are no entry's" if comment or place + directory + END_SIZE != len(content) else ""


def _end_of(content: bytes, entry: ZipInfo, place: int) -> int | None:
    """Return where an entry ends that begins at a place; None if its header says something else than the directory."""
    mark, _, flags, kind, _, _, crc, packed, size, name_size, extra_size = LOCAL.unpack_from(content, place)
    begin = place + LOCAL.size
    name = content[begin : begin + name_size]
    stated = (mark, flags, kind, crc, packed, size, name, extra_size, place)
    known = (LOCAL_MARK, 0, entry.compress_type, entry.CRC, entry.compress_size, entry.file_size,
             entry.orig_filename.encode(), 0, entry.header_offset)  # fmt: skip
    return begin + name_size + packed if stated == known else None
