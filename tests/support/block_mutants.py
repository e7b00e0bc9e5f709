"""Wrong versions of a function block's text, one change each, and what catches them."""

import re
from dataclasses import dataclass

from dzdesign.core.errors import InputError
from dzdesign.verify.structured_text.every_pair import Tried, TriedBlock
from dzdesign.verify.structured_text.parser import parse
from dzdesign.verify.structured_text.type_check import check_types

COMMENT = re.compile(r"\(\*.*?\*\)", re.DOTALL)
TOKEN = re.compile(r"\b(?:AND|OR|MIN|MAX|MOD|TRUE|FALSE)\b|<>|<=|>=|:=|(?<![\w.])\d+\b(?!\s*\.\.)|[-+*/<>]")
OTHERS = {
    "+": "-", "-": "+", "*": "+", "/": "*", "<": "<=", ">": ">=", "<=": "<", ">=": ">", "AND": "OR", "OR": "AND",
    "MIN": "MAX", "MAX": "MIN", "MOD": "/", "TRUE": "FALSE", "FALSE": "TRUE",
}  # fmt: skip
#: Not of the law: sizes of arrays and numbers of a declaration's type.
SKIPPED = re.compile(r"ARRAY\[[^\]]*\]")


@dataclass(frozen=True)
class Mutant:
    line: int
    change: str
    text: str


def mutants(text):
    """Return every mutant of a text, in its order: an operator exchanged, a number one more."""
    hidden = SKIPPED.sub(lambda found: "~" * len(found[0]), COMMENT.sub(lambda found: blank(found[0]), text))
    found = []
    for match in TOKEN.finditer(hidden):
        old = match[0]
        new = str(int(old) + 1) if old.isdigit() else OTHERS.get(old)
        if new is not None:
            changed = text[: match.start()] + new + text[match.end() :]
            found.append(Mutant(text.count("\n", 0, match.start()) + 1, f"{old} to {new}", changed))
    return found


def blank(comment):
    return re.sub(r"[^\n]", " ", comment)


def evenly(found, count):
    """Return so many of them, spread evenly."""
    return [found[place * len(found) // count] for place in range(count)]


def killer(mutant, tables, drops=None, pressures=None):
    """Return what catches a mutant; empty if nothing does, on some pressure drops and pressures or on all."""
    try:
        block = parse(mutant.text, "mutant")
        kinds = check_types(block, "mutant")
    except InputError:
        return "refused"
    tried = TriedBlock(block, kinds, tables, ["-O1"])
    for name, work in (
        ("extremes", lambda: [tried.extremes()]),
        ("pressures", lambda: [tried.every_pressure(pressures)]),
        ("pairs", lambda: tried.every_pair(drops)),
    ):
        if any(map(is_wrong, work())):
            return name
    first = {"side": (0,), "at_rest": (1,)}
    return "" if all(each.initial == first[each.name] for each in block.of_section("VAR")) else "first state"


def is_wrong(tried: Tried):
    return tried.wrong + tried.wrong_status + tried.wrong_state + tried.faults > 0
