"""Libraries that binaries ask for, of the three forms; those of Windows and macOS made here by their headers."""

import struct

import pytest

from dzdesign.verify.fmu.needed_libraries import needed_libraries


def pe(*names: str) -> bytes:
    """Return the headers of a DLL with one section, in which its imports stand."""
    address, place = 0x1000, 0x400
    entries, texts = b"", b""
    begin = 20 * (len(names) + 1)
    for name in names:
        entries += struct.pack("<5I", 0, 0, 0, address + begin + len(texts), 0)
        texts += name.encode() + b"\0"
    section = entries + bytes(20) + texts
    optional = bytearray(240)
    struct.pack_into("<II", optional, 120, address if names else 0, len(entries))
    head = b"MZ".ljust(60, b"\0") + struct.pack("<I", 64) + b"PE\0\0"
    head += struct.pack("<HHIIIHH", 0x8664, 1, 0, 0, 0, len(optional), 0x2022) + bytes(optional)
    head += b".rdata\0\0" + struct.pack("<IIII", len(section), address, len(section), place) + bytes(16)
    return head.ljust(place, b"\0") + section


def mach_o(*names: str) -> bytes:
    """Return the headers of a dylib with a command that names each library, after one that names none."""
    commands = [struct.pack("<II", 0x1B, 24) + bytes(16)]
    for name in names:
        text = name.encode().ljust(len(name) + 8 - len(name) % 8, b"\0")
        commands.append(struct.pack("<IIIIII", 0xC, 24 + len(text), 24, 0, 0, 0) + text)
    return struct.pack("<8I", 0xFEEDFACF, 0, 0, 6, len(commands), 0, 0, 0) + b"".join(commands)


@pytest.mark.parametrize("made", (pe, mach_o))
@pytest.mark.parametrize("names", ((), ("KERNEL32.dll",), ("KERNEL32.dll", "libgcc_s_seh-1.dll")))
def test_every_library_is_named(made, names):
    assert needed_libraries(made(*names)) == list(names)


@pytest.mark.parametrize(
    "content", (b"", b"\x7fELF\x02", b"MZ", pe("a.dll")[:80], mach_o("a")[:40], b"#!/bin/sh\n" * 9)
)
def test_what_is_no_binary_is_refused(content):
    with pytest.raises(ValueError):
        needed_libraries(content)
