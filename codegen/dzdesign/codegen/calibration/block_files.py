"""Files of a calibration block: Intel HEX (.hex), and its octets alone (.bin).

A C28x has no address for an octet, and its tools count so (SPRU513, hex conversion utility): Intel HEX of
``hex2000 --romwidth=16 --intel`` has addresses of 16-bit words, and of each word the high octet first. A raw file has
the low octet first and no addresses. Every other target counts octets.
"""

from pathlib import Path

from dzdesign.codegen.calibration.places import Place
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.input_files import read_bytes

#: Names of the formats, which are also the endings of their files.
FORMATS = ("hex", "bin")
#: A block as Intel HEX is a few KiB; what is much larger is something else.
MOST_OCTETS = 1 << 18
#: Addresses of a row of Intel HEX, and those under one extended address.
ROW, SEGMENT = 16, 1 << 16
#: The last record of Intel HEX.
END = ":00000001FF"
_REMEDY = "write the block again with `dzdesign calibration`"


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


def octets_in_file(path: Path, form: str | None = None) -> bytes:
    """Return the octets that a file of a block holds, wherever it places them; by default its ending tells the format.

    Errors are those of `placed_in_file`.
    """
    return placed_in_file(path, form)[0]


def placed_in_file(path: Path, form: str | None = None) -> tuple[bytes, Place | None]:
    """Return the octets that a file of a block holds, and where it places them; None of a raw file, which does not say.

    A file that can't be read, has an error, or holds more than one run of octets is an `InputError`.
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
    return f"'{path}' {ending}, {expected}; rename it, or with --read say --format"


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
            return swapped(octets) if unit_octets > 1 else octets, Place(
                address=segment.address, unit_octets=unit_octets
            )
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
