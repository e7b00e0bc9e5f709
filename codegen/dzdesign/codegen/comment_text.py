"""Names that come from users (recordings, valves), made fit for a comment of every language that is generated.

A generated file may be C, make, CMake, XML, a linker script or Markdown, and each has characters that end a comment or
act inside one. So the few characters are listed that act nowhere, and every other one becomes an underscore.
"""

import re
from collections.abc import Sequence

LONGEST = 40
SHOWN = 4


def printable_name(name: str) -> str:
    """Return `name` with only letters, digits, dots, underscores and single hyphens, at most `LONGEST` of them.

    Two hyphens would end nothing in C but are forbidden in a comment of XML; two dots would make a path climb.

    Examples
    --------
    >>> printable_name("*/ #error\\n$(x)??/")
    '_error_x_'
    >>> printable_name("../valve--7.csv")
    '_valve-7.csv'
    """
    safe = re.sub(r"[^A-Za-z0-9._-]+", "_", name)
    safe = re.sub(r"_+", "_", re.sub(r"-+", "-", re.sub(r"\.\.+_*", "_", safe)))
    return safe if len(safe) <= LONGEST else safe[: LONGEST - 1] + "_"


def printable_list(names: Sequence[str]) -> str:
    """Return the names, each made printable, with commas between; beyond `SHOWN` of them only their number.

    Examples
    --------
    >>> printable_list(["a.csv", "b.csv"])
    'a.csv, b.csv'
    """
    shown = ", ".join(printable_name(name) for name in names[:SHOWN])
    return f"{shown} and {len(names) - SHOWN} more" if len(names) > SHOWN else shown
