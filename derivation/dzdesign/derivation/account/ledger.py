"""What may be taken as given, by kind, read off the paper by hand: what is not on the list has to be derived."""

import re
from collections.abc import Collection

from dzdesign.derivation.account.statement import Kind, Statement
from dzdesign.derivation.laws import LAW_NAMES
from dzdesign.derivation.symbols import Name

#: The paper numbers what it starts from as it numbers what it derives.
GIVEN = {
    Kind.PREMISE: ("(1)", "(4)", "(5)", "(6)", "(7)", "(19)", "(20)", "(21)", "(22)", "(23)", "(24)", "converter"),
    Kind.ASSUMPTION: (
        "Fig. 3, line", "(11)", "Fig. 3, command", "opening", "full command", "code of u_0", "code of u_no", "valve",
        "constant threshold",
    ),
    Kind.DEFINITION: (
        "K_e", "gamma_0", "gamma_1", "u_O", "1365", "drive left", "jump", "duty", "transfer function", "overlap",
        "exponent", "S", "travel", "fall",
    ),
    Kind.CHOICE: ("attenuator", "scale of u_0", "scale of u_no", "PWM", "L3", *LAW_NAMES),
}  # fmt: skip
_KIND_OF = {number: kind for kind, numbers in GIVEN.items() for number in numbers}
#: Of what is derived; the first that fits.
_DERIVED = (
    (re.compile(r"\(\d+\)|Q_max"), Kind.PAPER),
    (re.compile(r"\(\d+c\)|T6e"), Kind.CORRECTED),
    (re.compile(r"L\d"), Kind.LAW),
    (re.compile(r".*"), Kind.THEOREM),
)


def find_kind_fault(statement: Statement, known: Collection[Name]) -> str:
    """Say what is wrong with the kind of a statement; `known` are the symbols that occur before it."""
    number = statement.number
    expected = _KIND_OF.get(number) or next(kind for pattern, kind in _DERIVED if pattern.fullmatch(number))
    if statement.kind is not expected:
        return f"it is stated as {statement.kind}, and is {expected}"
    if statement.kind is Kind.DEFINITION and names_in(statement) <= set(known):
        return "it is called a definition, and defines no new name"
    return ""


def names_in(statement: Statement) -> set[Name]:
    """Return the symbols of a statement, its functions included."""
    found: set[Name] = {statement.symbol}
    return found.union(*(member.free_symbols for member in statement.members))
