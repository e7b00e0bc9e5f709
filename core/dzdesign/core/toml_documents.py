"""Reading of TOML files with a limit on the depth of keys, which bounds the memory of the parser."""

import re
import tomllib
from collections.abc import Callable
from typing import Any

from dzdesign.core.errors import InputError

#: Parts of a dotted key, ``a.b.c``; the deepest that dzdesign reads has two. A parser keeps each one's beginning: of a
#: line of 200 kB it would make 24 GB.
MOST_PARTS = 16
_PART = r"""(?:"[^"\n]*+"|'[^'\n]*+'|[A-Za-z0-9_-]++)"""
#: It begins only where a word does, and takes back nothing: a file is searched in a time as long as the file.
_DEEP_KEY = re.compile(rf"(?<![A-Za-z0-9_-])(?:{_PART}[ \t]*+\.[ \t]*+){{{MOST_PARTS}}}")


def read_toml(
    content: bytes, source: str, expected: str, parse_float: Callable[[str], Any] = float
) -> dict[str, Any]:
    """Return the content of a TOML file in UTF-8; what is none, or too deep, is an `InputError`.

    `source` names the file, `expected` says what was expected in it, for the message.
    """
    try:
        text = content.decode("utf-8-sig")
        if deep := _DEEP_KEY.search(text):
            row = text.count("\n", 0, deep.start()) + 1
            raise ValueError(f"row {row} has a key of more than {MOST_PARTS} parts")
        return tomllib.loads(text, parse_float=parse_float)
    except (ValueError, RecursionError) as error:
        reason = str(error).partition("; use sys.")[0]  # Python's advice to a programmer
        raise InputError(f"'{source}' is not TOML: {reason}; expected {expected}") from error
