"""Reading of TOML files with a limit on their size, which bounds the memory of the parser."""

import tomllib
from collections.abc import Callable
from typing import Any

from dzdesign.core.errors import InputError

#: Largest file and longest row, octets: ten times what people write. The parser keeps the beginning of every part of a
#: dotted key: of one row of 64 kB it would make 4 GB, of such a file in rows of this length 0.5 GB.
MOST_OCTETS, LONGEST_ROW = 1 << 16, 1 << 13


def read_toml(
    content: bytes, source: str, expected: str, parse_float: Callable[[str], Any] = float
) -> dict[str, Any]:
    """Return the content of a TOML file in UTF-8; what is none, or too large, is an `InputError`.

    `source` names the file, `expected` says what was expected in it, for the message.
    """
    try:
        if len(content) > MOST_OCTETS:
            raise ValueError(f"it is larger than {MOST_OCTETS >> 10} KiB")
        for row, octets in enumerate(content.split(b"\n"), start=1):
            if len(octets) > LONGEST_ROW:
                raise ValueError(f"row {row} is longer than {LONGEST_ROW >> 10} KiB; break it, or make it a table")
        return tomllib.loads(content.decode("utf-8-sig"), parse_float=parse_float)
    except (ValueError, RecursionError) as error:
        reason = str(error).partition("; use sys.")[0]  # Python's advice to a programmer
        raise InputError(f"'{source}' is not TOML: {reason}; expected {expected}") from error
