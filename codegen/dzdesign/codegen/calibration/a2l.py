"""The layout of a calibration block as ASAM MCD-2 MC (A2L), by which XCP tools show the integers of a running drive.

All of it is read-only: a number changed alone leaves the block with a wrong CRC, which the firmware refuses. Addresses
count octets, as XCP tools do; a C28x's XCP driver halves them.
"""

from collections.abc import Iterator

from dzdesign.codegen.calibration.layout import LAYOUT, MAGIC, Member, Words, members
from dzdesign.codegen.calibration.places import Place

#: How a file begins that is dzdesign's own.
HEAD = f"ASAP2_VERSION 1 71\n/* dzdesign: layout {LAYOUT} of the calibration block */\n"
#: Bits of a number to its type in A2L.
TYPES = {8: "UBYTE", 16: "UWORD", 32: "ULONG", 64: "A_UINT64"}
SIGNED_TYPES = {32: "SLONG"}
#: Members that are octets, and whether they are a text.
OF_OCTETS = {"compensator_sha256": False, "serial": True, "record": True}


def a2l_text(place: Place) -> str:
    """Return the A2L of a block at a place."""
    units = dict.fromkeys(each.entry.unit for each in members() if each.entry.unit)
    methods = {unit: f"unit_{number}" for number, unit in enumerate(units)}
    lines = [
        '/begin PROJECT dzdesign "Dead-zone compensator"',
        '/begin MODULE dz_calibration "Calibration block of one valve"',
        '/begin MOD_PAR ""',
        f"ADDR_EPK {_address(place, 0)}",
        f'EPK "{MAGIC.decode()}"',
        "/end MOD_PAR",
        '/begin MOD_COMMON ""',
        "BYTE_ORDER MSB_LAST",
        "/end MOD_COMMON",
    ]
    for bits, kind in TYPES.items():
        lines += _record_layout(f"U{bits}", kind)
    for bits, kind in SIGNED_TYPES.items():
        lines += _record_layout(f"S{bits}", kind)
    for unit, name in methods.items():
        lines += [f'/begin COMPU_METHOD {name} "" IDENTICAL "%20.0" "{unit}"', "/end COMPU_METHOD"]
    for member in members():
        lines += _characteristic(member, place, methods)
    return HEAD + "\n".join([*lines, "/end MODULE", "/end PROJECT", ""])


def _record_layout(name: str, kind: str) -> list[str]:
    return [f"/begin RECORD_LAYOUT {name}", f"FNC_VALUES 1 {kind} ROW_DIR DIRECT", "/end RECORD_LAYOUT"]


def _characteristic(member: Member, place: Place, methods: dict[str, str]) -> Iterator[str]:
    entry = member.entry
    is_octets = member.path in OF_OCTETS
    bits, count = (8, 2 * entry.count) if is_octets else (entry.bits, entry.count)
    kind = "ASCII" if OF_OCTETS.get(member.path) else "VAL_BLK" if count > 1 else "VALUE"
    method = methods.get(entry.unit, "NO_COMPU_METHOD")
    yield f'/begin CHARACTERISTIC {member.path} "{entry.text}"'
    layout, low, high = f"U{bits}", 0, 2**bits - 1
    if entry.signed:
        layout, low, high = f"S{bits}", -(2 ** (bits - 1)), 2 ** (bits - 1) - 1
    yield f"{kind} {_address(place, 2 * member.at)} {layout} 0 {method} {low} {high}"
    if kind == "ASCII":
        yield f"NUMBER {count}"
    elif count > 1:
        yield f"MATRIX_DIM {_dimensions(entry, count)}"
    yield from ("READ_ONLY", "/end CHARACTERISTIC")


def _dimensions(entry: Words, count: int) -> str:
    return f"2 {count // 2}" if entry.pairs else str(count)


def _address(place: Place, octet: int) -> str:
    return f"{place.address * place.unit_octets + octet:#x}"
