"""What `dzdesign --help` prints: the commands in groups, examples, exit statuses.

Set by hand: importing argparse takes as long as starting Python, and this page is what a person waits for first.
"""

import os
import sys
from collections.abc import Iterable, Mapping

#: The widest that help is set, in columns: longer lines are hard to read.
WIDEST, NARROWEST = 100, 40
ABOUT = "Dead-zone compensators for proportional valves without a spool sensor: from ramp tests to checked C."
#: Of every command, before it or after it: (names, keywords of add_argument).
COMMON = (
    (("--config",), {"metavar": "TOML", "help": "file with options of the same names (dzdesign init writes one)"}),
    (("--json",), {"action": "store_true", "help": "print the result as JSON"}),
    (("-q", "--quiet"), {"action": "store_true", "help": "print results and errors only"}),
    (
        ("-v", "--verbose"),
        {"action": "store_true", "help": "say what is done, with times, files and the solver's words"},
    ),
)
EXIT_STATUS = """exit status:
  0    every requirement holds
  1    one does not, or could not be checked (said which)
  2    bad input or usage
  130  interrupted"""


def front_page(
    commands: Mapping[str, tuple[str, str, tuple]], groups: Mapping[str, tuple[str, ...]], examples: Iterable[str]
) -> str:
    """Return the page.

    Parameters
    ----------
    commands : mapping
        Command -> (one line of help, ...).
    groups : mapping
        Heading -> commands under it; one that is nowhere stands under the last.
    examples : iterable of str
        Lines.
    """
    width = page_width()
    options = {"-h, --help": "show this page and exit", "--version": "print the version"}
    for names, keywords in COMMON:
        options[f"{', '.join(names)} {keywords.get('metavar', '')}".rstrip()] = keywords["help"]
    column = max(map(len, (*commands, *options))) + 4
    lines = ["usage: dzdesign COMMAND [OPTIONS]", "", *_wrapped(ABOUT, width, ""), ""]
    named = {name for names in groups.values() for name in names}
    last = list(groups)[-1]
    for heading, names in groups.items():
        rest = [name for name in commands if name not in named] if heading == last else []
        mine = [name for name in (*names, *rest) if name in commands]
        if mine:
            entries = [_entry(name, commands[name][0], column, width) for name in mine]
            lines += [f"{heading}:", *entries, ""]
    entries = [_entry(name, text, column, width) for name, text in options.items()]
    lines += ["options:", *entries, ""]
    lines += ["examples:", *(f"  {line}" for line in examples), "", EXIT_STATUS, ""]
    return "\n".join([*lines, "`dzdesign COMMAND --help` says more of each.", ""])


def page_width() -> int:
    """Return the columns of the terminal, or what COLUMNS says, within what can be read."""
    columns = os.environ.get("COLUMNS", "")
    if not columns.isdecimal() or columns == "0":
        try:
            columns = os.get_terminal_size(sys.__stdout__.fileno()).columns
        except (AttributeError, ValueError, OSError):
            columns = 80
    return min(max(int(columns), NARROWEST) - 2, WIDEST)


def _entry(name: str, text: str, column: int, width: int) -> str:
    first, *more = _wrapped(text, width, " " * column)
    return "\n".join([f"  {name}".ljust(column) + first.lstrip(), *more])


def _wrapped(text: str, width: int, indent: str) -> list[str]:
    """Return a text as lines; textwrap would import more than all the rest of this."""
    lines, line = [], ""
    for word in text.split():
        if line and len(indent) + len(line) + 1 + len(word) > width:
            lines.append(indent + line)
            line = word
        else:
            line = f"{line} {word}" if line else word
    return [*lines, indent + line]
