"""Files that hold the octets of a calibration block: raw (.bin), Intel HEX (.hex) and TI-TXT (.txt)."""

import io
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from dzdesign.core.errors import InputError, nearest
from dzdesign.core.input_files import read_bytes

#: A block as Intel HEX is a few KiB; what is much larger is something else.
MOST_OCTETS = 1 << 18
_REMEDY = "write the block again with `dzdesign calibration`"


def octets_in_file(path: Path) -> bytes:
    """Return the octets that a file of a block holds, wherever it places them; the ending of its name tells the format.

    A file that can't be read, has an error, or holds more than one run of octets is an `InputError`.
    """
    read = READERS.get(path.suffix.lower())
    if read is None:
        known = ", ".join(READERS)
        raise InputError(f"'{path}' ends with '{path.suffix}'{nearest(path.suffix, READERS)}; expected one of {known}")
    content = read_bytes(path, "calibration file")
    if len(content) > MOST_OCTETS:
        raise InputError(f"'{path}' has {len(content)} octets, expected a calibration block of a few KiB; {_REMEDY}")
    return read(content, f"'{path}'")


def _raw(content: bytes, name: str) -> bytes:
    return content


def _intel_hex(content: bytes, name: str) -> bytes:
    from intelhex import IntelHex, IntelHexError

    text = _text(content, name)
    if not re.search(r"^:00000001FF\s*\Z", text, re.MULTILINE | re.IGNORECASE):
        raise InputError(f"{name}: the file does not end with the record :00000001FF, so it is cut; {_REMEDY}")
    image = IntelHex()
    try:
        image.loadhex(io.StringIO(text))
    except (IntelHexError, ValueError) as error:
        raise InputError(f"{name}: not Intel HEX: {error}; {_REMEDY}") from error
    runs = image.segments()
    return _one_run(((begin, bytes(image.tobinarray(start=begin, size=end - begin))) for begin, end in runs), name)


def _ti_txt(content: bytes, name: str) -> bytes:
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


def _one_run(runs: Iterable[tuple[int, bytes]], name: str) -> bytes:
    found = [octets for _, octets in runs if octets]
    if len(found) != 1:
        raise InputError(f"{name}: {len(found)} runs of octets, expected one, the block; {_REMEDY}")
    return found[0]


def _text(content: bytes, name: str) -> str:
    try:
        return content.decode("ascii")
    except UnicodeDecodeError as error:
        raise InputError(f"{name}: octet {error.start} is no ASCII, expected text; {_REMEDY}") from error


READERS: Mapping[str, Callable[[bytes, str], bytes]] = {".bin": _raw, ".hex": _intel_hex, ".txt": _ti_txt}
