"""Files that hold the octets of a calibration block: raw (.bin), Intel HEX (.hex) and TI-TXT (.txt)."""

import io
import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path

from dzdesign.codegen.calibration.block_images import swapped
from dzdesign.codegen.calibration.places import Place
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.input_files import read_bytes

#: A block as Intel HEX is a few KiB; what is much larger is something else.
MOST_OCTETS = 1 << 18
#: Octets, and where they begin.
Placed = tuple[bytes, Place | None]
_REMEDY = "write the block again with `dzdesign calibration`"


def octets_in_file(path: Path, form: str | None = None) -> bytes:
    """Return the octets that a file of a block holds, wherever it places them; by default its ending tells the format.

    Errors are those of `placed_in_file`.
    """
    return placed_in_file(path, form)[0]


def placed_in_file(path: Path, form: str | None = None) -> tuple[bytes, Place | None]:
    """Return the octets that a file of a block holds, and where it places them; None of a raw file, which does not say.

    TI-TXT counts octets on every target. A file that can't be read, has an error, or holds more than one run of octets
    is an `InputError`.
    """
    read = READERS[f".{form}"] if form else READERS.get(path.suffix.lower())
    if read is None:
        raise InputError(_no_format(path))
    content = read_bytes(path, "calibration file")
    if len(content) > MOST_OCTETS:
        raise InputError(f"'{path}' has {len(content)} octets, expected a calibration block of a few KiB; {_REMEDY}")
    return read(content, f"'{path}'")


def _no_format(path: Path) -> str:
    """Say what is wrong with a file whose ending tells no format."""
    known = ", ".join(READERS)
    if path.is_dir():
        return f"'{path}' is a folder, expected a calibration file, {known}; name the file in it"
    if path.suffix.lower() == ".a2l":
        return f"'{path}' is an A2L, which has the layout of a block and not its octets; expected one of {known}"
    ending = f"ends with '{path.suffix}'{nearest(path.suffix, READERS)}" if path.suffix else "has no ending"
    return f"'{path}' {ending}, expected a calibration file, {known}; rename it, or with --read say --format"


def _raw(content: bytes, name: str) -> Placed:
    return content, None


def _intel_hex(content: bytes, name: str) -> Placed:
    text = _text(content, name)
    if not re.search(r"^:00000001FF\s*\Z", text, re.MULTILINE | re.IGNORECASE):
        raise InputError(f"{name}: the file does not end with the record :00000001FF, so it is cut; {_REMEDY}")
    rows = sorted(_hex_rows(text, name))
    if len(rows) > 1 and _follow(rows, 2) and all(len(octets) % 2 == 0 for _, octets in rows):
        octets = swapped(b"".join(octets for _, octets in rows))  # of words, as hex2000 --romwidth=16 writes them
        return octets, Place(address=rows[0][0], unit_octets=2)
    return _one_run(_runs(rows), name)


def _hex_rows(text: str, name: str) -> Iterator[tuple[int, bytes]]:
    """Yield address and octets of each record of data; addresses may be of octets or of words."""
    from intelhex import IntelHex, IntelHexError

    end = ":00000001FF"
    extended = ""
    lines = [(row, line.strip()) for row, line in enumerate(text.splitlines(), 1) if line.strip()]
    for row, line in lines[:-1]:
        if line.upper() == end:
            raise InputError(f"{name}, row {row}: something follows the record {end}; {_REMEDY}")
        record = IntelHex()  # of each record a file of its own: rows of words overlap where octets are counted
        try:
            record.loadhex(io.StringIO("\n".join((extended, line, end))))
        except (IntelHexError, ValueError) as error:
            raise InputError(f"{name}, row {row}: not Intel HEX: {error}; {_REMEDY}") from error
        extended = line if line[7:9] in ("02", "04") else extended
        if len(record):
            yield record.minaddr(), bytes(record.tobinarray())


def _follow(rows: list[tuple[int, bytes]], unit_octets: int) -> bool:
    """Tell whether each row begins where the one before it ends, if an address is of so many octets."""
    return all(
        (after - before) * unit_octets == len(octets) for (before, octets), (after, _) in itertools.pairwise(rows)
    )


def _runs(rows: list[tuple[int, bytes]]) -> list[tuple[int, bytes]]:
    """Return rows joined where they follow each other."""
    runs: list[tuple[int, bytearray]] = []
    for at, octets in rows:
        if runs and at == runs[-1][0] + len(runs[-1][1]):
            runs[-1][1].extend(octets)
        else:
            runs.append((at, bytearray(octets)))
    return [(at, bytes(octets)) for at, octets in runs]


def _ti_txt(content: bytes, name: str) -> Placed:
    runs: list[tuple[int, bytearray]] = []
    ended = False
    for row, line in enumerate(_text(content, name).splitlines(), 1):
        words = line.split()
        if not words:
            continue
        if ended:
            raise InputError(f"{name}, row {row}: something follows the 'q' that ends a TI-TXT file; {_REMEDY}")
        if words in (["q"], ["Q"]):
            ended = True
        elif re.fullmatch(r"@[0-9A-Fa-f]{1,8}", words[0]) and len(words) == 1:
            runs.append((int(words[0][1:], 16), bytearray()))
        elif runs and all(re.fullmatch(r"[0-9A-Fa-f]{2}", word) for word in words):
            runs[-1][1].extend(int(word, 16) for word in words)
        else:
            raise InputError(f"{name}, row {row}: expected an address such as @8000 or octets such as 44 5A; {_REMEDY}")
    if not ended:
        raise InputError(f"{name}: the file does not end with 'q', so it is cut; {_REMEDY}")
    return _one_run(((begin, bytes(octets)) for begin, octets in runs), name)


def _one_run(runs: Iterable[tuple[int, bytes]], name: str) -> Placed:
    found = [(octets, Place(address=begin)) for begin, octets in runs if octets]
    if len(found) != 1:
        fault = "parts that do not follow each other" if found else "octets in none of its rows"
        raise InputError(f"{name}: {fault}, expected the block alone, without a gap or a row twice; {_REMEDY}")
    return found[0]


def _text(content: bytes, name: str) -> str:
    try:
        return content.decode("ascii")
    except UnicodeDecodeError as error:
        raise InputError(f"{name}: octet {error.start} is no ASCII, expected text; {_REMEDY}") from error


READERS: Mapping[str, Callable[[bytes, str], Placed]] = {".bin": _raw, ".hex": _intel_hex, ".txt": _ti_txt}
