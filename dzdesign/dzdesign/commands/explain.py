"""`dzdesign explain CODE`: what a warning or a requirement means, and what to do about it."""

import re
from dataclasses import dataclass
from typing import Annotated

from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import Option
from dzdesign.terminal.page import print_json, say_results

#: A link to a page of the documentation, and how it is printed.
LINK, PAGE = re.compile(r"\[([^\]]+)\]\([^)]+\)"), r'"\1"'
EXAMPLES = ("dzdesign explain few-repeats", "dzdesign explain over-compensation")


@dataclass(frozen=True)
class Arguments:
    """Arguments of `explain`."""

    code: Annotated[str, Option("CODE")]
    """Code of a warning, or id of a requirement of verify."""


def run(arguments: Arguments, json: bool) -> int:
    """Print the explanation."""
    from dzdesign.identify.data_quality.catalogue import catalogue
    from dzdesign.verify import requirements

    code = arguments.code.strip().strip("[]")
    known = {each.id: each for each in vars(requirements).values() if isinstance(each, requirements.Requirement)}
    if code in catalogue():
        entry = catalogue()[code]
        found = {"meaning": " ".join(entry.meaning.split()), "remedy": " ".join(entry.remedy.split())}
    elif code in known:
        found = {"requirement": known[code].title, "checked_by": known[code].how}
    else:
        raise InputError(f"there is no warning or requirement '{code}'{nearest(code, [*catalogue(), *known])}")
    if json:
        print_json({"code": code, **found})
    else:
        say_results(*(f"{name.replace('_', ' ')}: {LINK.sub(PAGE, text)}" for name, text in found.items()))
    return 0
