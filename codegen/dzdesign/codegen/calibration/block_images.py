"""The octets of a calibration block as files: raw (.bin), Intel HEX (.hex) and TI-TXT (.txt); its layout as A2L.

A C28x has no address for an octet, and its tools count so (SPRU513, hex conversion utility): Intel HEX of
``hex2000 --romwidth=16 --intel`` has addresses of 16-bit words, and of each word the high octet first; TI-TXT, which
is 8 bits wide always, has twice the word's address, and the low octet first. A raw file is as TI-TXT, without
addresses. Every other target counts octets.
"""

from collections.abc import Callable, Iterator, Mapping

from dzdesign.codegen.calibration.a2l import a2l_text
from dzdesign.codegen.calibration.places import Place

#: Octets of a row, where each has an address and where each word has one: those of the usual tools.
ROW_OCTETS, ROW_OCTETS_OF_WORDS, TI_TXT_ROW_OCTETS = 16, 32, 16
#: Addresses under one extended address of Intel HEX.
SEGMENT = 1 << 16


def swapped(octets: bytes) -> bytes:
    """Return 16-bit words with the octets of each in the other order.

    Examples
    --------
    >>> swapped(b"DZC1")
    b'ZD1C'
    """
    return b"".join(octets[at : at + 2][::-1] for at in range(0, len(octets), 2))


def _raw(octets: bytes, place: Place) -> bytes:
    return octets


def _intel_hex(octets: bytes, place: Place) -> bytes:
    return "".join(f"{line}\n" for line in _records(octets, place)).encode()


def _records(octets: bytes, place: Place) -> Iterator[str]:
    """Yield the records: intelhex counts octets, so that rows of words are laid out here."""
    from intelhex import Record

    of_words = place.unit_octets > 1
    upper, at = -1, 0
    octets = swapped(octets) if of_words else octets
    while at < len(octets):
        address = place.address + at // place.unit_octets
        if address // SEGMENT != upper:
            upper = address // SEGMENT
            yield Record.extended_linear_address(upper)
        room = (SEGMENT - address % SEGMENT) * place.unit_octets
        row = octets[at : at + min(ROW_OCTETS_OF_WORDS if of_words else ROW_OCTETS, room)]
        yield Record.data(address % SEGMENT, list(row))
        at += len(row)
    yield Record.eof()


def _ti_txt(octets: bytes, place: Place) -> bytes:
    starts = range(0, len(octets), TI_TXT_ROW_OCTETS)
    rows = (octets[at : at + TI_TXT_ROW_OCTETS].hex(" ").upper() for at in starts)
    return "\n".join((f"@{place.address * place.unit_octets:04X}", *rows, "q", "")).encode()


def _a2l(octets: bytes, place: Place) -> bytes:
    return a2l_text(place).encode()


#: Name of a format, which is also the ending of its files, to what writes it; A2L has the layout, and not the octets.
FORMATS: Mapping[str, Callable[[bytes, Place], bytes]] = {
    "hex": _intel_hex, "bin": _raw, "txt": _ti_txt, "a2l": _a2l,
}  # fmt: skip
#: Those whose files state addresses.
WITH_ADDRESS = ("hex", "txt", "a2l")


def image_of(octets: bytes, name: str, place: Place) -> bytes:
    """Return a block as the content of a file of a format, one of `FORMATS`."""
    return FORMATS[name](octets, place)
