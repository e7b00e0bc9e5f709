"""`dzdesign init RAMP...`: look at recordings, write a commented dzdesign.toml with what was seen and what was not."""

import os
import re
import shlex

from dzdesign.core.errors import one_line
from dzdesign.core.options import paths_of
from dzdesign.stages.init import InitArguments, init
from dzdesign.terminal.page import print_json

Arguments = InitArguments
EXAMPLES = ("dzdesign init ramps/*.csv", "dzdesign init ramps/*.tdms -o bench2.toml")
NOT_LOOKED_AT = (
    "Until that is settled, full command, sides and meter are not looked at. Init with that option and another -o "
    "does so."
)
#: Names of recordings that are repeated in the command to give next.
MOST_NAMES = 3
#: A name or a pattern in which no shell finds anything but a name or a pattern.
PLAIN = re.compile(r"[\w ./*?:\[\],+@%=-]*")


def run(arguments: Arguments, json: bool) -> int:
    """Write the options file; 1 if it leaves something open without which `identify` can't run."""
    proposal = init(arguments)
    output = os.fspath(arguments.output or "")
    if json:
        keys = ("labels", "columns", "dp", "u_max_V", "u_seen_V", "valve")
        print_json({
            "file": output,
            "recordings": [path.as_posix() for path in proposal.recordings],
            **{key: getattr(proposal, key) for key in keys},
            "open": proposal.opens,
        })  # fmt: skip
        return 1 if proposal.opens else 0
    for line in (*proposal.seen, *(f"open: {line}" for line in proposal.opens)):
        print(one_line(line))
    if proposal.opens and proposal.u_seen_V is None:
        print(NOT_LOOKED_AT)
    ramps = [os.fspath(path) for path in paths_of(arguments.ramps)]
    names = " ".join(map(_word, ramps)) if 0 < len(ramps) <= MOST_NAMES else "RAMP..."
    print(f"Written: {one_line(output)}" + ("; fill in what is open, then" if proposal.opens else "; read it, then"))
    print(f"  dzdesign identify {names} --config {_word(output)}")
    return 1 if proposal.opens else 0


def _word(name: str) -> str:
    """Return a name as one word of any shell; a pattern stays one, and what a shell would run is in quotes."""
    name = one_line(name)
    if os.name != "nt" and not PLAIN.fullmatch(name):
        return shlex.quote(name)
    return f'"{name}"' if " " in name else name
