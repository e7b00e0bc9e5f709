"""Whether every compiler sees the same core: a trial on the host says nothing of C that only another one reads."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from dzdesign.verify.checks import Check

NAME = "every compiler sees the same core"
COMMENT_OR_TEXT = re.compile(r"""/\*.*?\*/|//[^\n]*|"[^"\n]*"|'[^'\n]*'""", re.DOTALL)
#: What hides where a line begins or ends, or stands for another character.
HIDING = re.compile(r"\\\r?\n|\?\?[=/'()!<>-]|%:")
#: All that the core needs of the preprocessor: guards, its own headers, numbers by name.
DIRECTIVE = re.compile(
    r'#[ \t]*(include (<stdint\.h>|"dz_(comp|drive)\.h")|ifndef DZ_\w+_H|define DZ_\w+_H|define [A-Z][A-Z0-9_]* [^#]+'
    r"|endif)"
)
#: What is another thing on another compiler or processor: its own words, sizes and limits.
WORD = re.compile(
    r"\b(__\w+|_[A-Z]\w*|asm|defined|sizeof|[A-Z0-9_]+_(?:WIDTH|FAST\w*|LEAST\w*)"
    r"|(?:U?INTPTR|PTRDIFF|SIZE|WCHAR|WINT|SIG_ATOMIC|U?INTMAX)_\w+|u?int(?:ptr|max|_fast\d+|_least\d+)_t)\b"
)


def seen_by_all(folder: Path, manifest: dict[str, Any]) -> Check:
    """Tell whether the core has no condition, no word of a compiler's own and no line that is not what it seems.

    Parameters
    ----------
    folder : Path
        Of the firmware.
    manifest : dict
        Of `read_firmware_manifest`.
    """
    faults = [
        f"{name}: {fault}"
        for name in manifest["core"]
        if (folder / name).is_file()
        for fault in _faults((folder / name).read_text(encoding="utf-8", errors="replace"))
    ]
    if faults:
        more = f", and {len(faults) - 1} more" if len(faults) > 1 else ""
        return Check(name=NAME, holds=False, text=f"{faults[0]}{more}")
    text = "no condition but the headers' guards, no other header, no word of a compiler's own; what an int of 16 bits "
    return Check(name=NAME, holds=True, text=f"{text}makes of it is tried by --machine-code and --proof")


def _faults(text: str) -> Iterator[str]:
    if found := HIDING.search(text):
        yield f"line {text.count(chr(10), 0, found.start()) + 1} is not what it seems ({found[0].strip()!r})"
    # Of a comment its lines are kept, so that a fault's line is known.
    code = COMMENT_OR_TEXT.sub(lambda each: each[0] if each[0][0] == '"' else re.sub(r"[^\n]+", " ", each[0]), text)
    for number, line in enumerate(code.split("\n"), start=1):
        if "#" in line and not DIRECTIVE.fullmatch(line.strip()):
            yield f"line {number} is no directive that the core needs: {line.strip()[:60]}"
        elif found := WORD.search(line):
            yield f"line {number} has a word that compilers read differently: {found[0]}"
