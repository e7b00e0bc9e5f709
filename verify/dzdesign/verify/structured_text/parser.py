"""Structured Text in, a tree out. Exactly this subset is read; anything else is refused with its line and column.

Comments stand between ``(*`` and ``*)`` and nest in none. Words of the language are written in capitals, and names are
the same in any case; what a PLC's tool reserves is no name. A loop's limits are numbers: nothing in it moves them. ::

    block      = "FUNCTION_BLOCK" name {section} {statement} "END_FUNCTION_BLOCK"
    section    = ("VAR_INPUT" | "VAR_OUTPUT" | "VAR" ["CONSTANT"] | "VAR_TEMP") {declared} "END_VAR"
    declared   = name {"," name} ":" ["ARRAY" "[" whole ".." whole "]" "OF"] kind [":=" initial] ";"
    kind       = "DINT" | "UDINT" | "BOOL"
    initial    = constant | "[" constant {"," constant} "]"
    constant   = ["-"] whole | "TRUE" | "FALSE"
    statement  = variable ":=" expression ";"
               | "IF" expression "THEN" {statement} {"ELSIF" expression "THEN" {statement}}
                 ["ELSE" {statement}] "END_IF"
               | "FOR" name ":=" whole "TO" whole "DO" {statement} "END_FOR"
    expression = conjunction {"OR" conjunction}
    conjunction = compared {"AND" compared}
    compared   = sum [("=" | "<>" | "<" | "<=" | ">" | ">=") sum]
    sum        = product {("+" | "-") product}
    product    = signed {("*" | "/" | "MOD") signed}
    signed     = ["-" | "NOT"] (whole | "TRUE" | "FALSE" | variable | function "(" expression {"," expression} ")"
               | "(" expression ")")
    variable   = name ["[" expression "]"]
    function   = "MIN" | "MAX" | "ABS" | "DINT_TO_UDINT" | "UDINT_TO_DINT"

``END_IF`` and ``END_FOR`` may be followed by a semicolon.
"""

from collections.abc import Callable
from typing import NoReturn, TypeVar, cast

from dzdesign.core.errors import InputError, quoted
from dzdesign.verify.structured_text.reserved_words import is_reserved
from dzdesign.verify.structured_text.syntax import (
    RANGES,
    Assignment,
    Expression,
    For,
    FunctionBlock,
    If,
    Kind,
    Name,
    Number,
    Operation,
    Place,
    Statement,
    Variable,
)
from dzdesign.verify.structured_text.tokens import Token, tokens_of

Inner = TypeVar("Inner")
KINDS = ("DINT", "UDINT", "BOOL")
FUNCTIONS = {"MIN": 2, "MAX": 2, "ABS": 1, "DINT_TO_UDINT": 1, "UDINT_TO_DINT": 1}
COMPARED = ("=", "<>", "<", "<=", ">", ">=")
WORDS = frozenset(
    {"FUNCTION_BLOCK", "END_FUNCTION_BLOCK", "VAR_INPUT", "VAR_OUTPUT", "VAR", "CONSTANT", "VAR_TEMP", "END_VAR"}
    | {"ARRAY", "OF", *KINDS, "TRUE", "FALSE", "IF", "THEN", "ELSIF", "ELSE", "END_IF", "FOR", "TO", "DO", "END_FOR"}
    | {"OR", "AND", "MOD", "NOT", *FUNCTIONS}
)
#: A whole number with more digits is none of 32 bits.
MOST_DIGITS = 10
#: Elements of an array, and rounds of a loop with those around it.
MOST = 4096
#: Characters of a text, and brackets and statements inside of each other.
LONGEST, DEEPEST = 100_000, 40
#: Operations of one expression; statements and operations of one call; numbers that variables hold at once. A generated
#: block has 12, some hundreds and some tens. More would take the checks of all inputs hours, or all memory.
MOST_OPERATIONS, MOST_EXECUTED, MOST_HELD = 50, 20_000, 256


def parse(text: str, source: str) -> FunctionBlock:
    """Return the function block that a text is; what is none is an `InputError` that names the place."""
    return _Parser(text, source).block()


class _Parser:
    def __init__(self, text: str, source: str) -> None:
        self.source, self.at, self.depth, self.rounds = source, 0, 0, 1
        #: Of the expression that is read, and of a call as far as it is read.
        self.operations, self.executed = 0, 0
        if len(text) > LONGEST:
            self._refuse(Place(1, 1), f"the text has {len(text)} characters, expected at most {LONGEST}")
        self.tokens = tokens_of(text, source)
        self.variables: dict[str, Variable] = {}
        self.held = 0

    def _refuse(self, place: Place, what: str) -> NoReturn:
        raise InputError(f"{self.source}, {place}: {what}")

    @property
    def next(self) -> Token:
        return self.tokens[self.at]

    def _is(self, *texts: str) -> bool:
        return self.next.text in texts and self.next.kind != "end"

    def _take(self) -> Token:
        token = self.next
        self.at += token.kind != "end"
        return token

    def _may(self, *texts: str) -> Token | None:
        return self._take() if self._is(*texts) else None

    def _must(self, *texts: str) -> Token:
        if not self._is(*texts):
            self._refuse(self.next.place, f"{quoted(self.next.text)} stands where {' or '.join(texts)} is expected")
        return self._take()

    def _name(self) -> Token:
        token = self._take()
        if token.kind != "word" or token.text.upper() in WORDS:
            self._refuse(token.place, f"{quoted(token.text)} stands where a name is expected")
        if is_reserved(token.text):
            self._refuse(token.place, f"{quoted(token.text)} is a word that PLC tools reserve")
        return token

    def _whole(self) -> int:
        token = self._take()
        if token.kind != "whole" or len(token.text) > MOST_DIGITS:
            self._refuse(token.place, f"{quoted(token.text)} stands where a whole number of 32 bits is expected")
        return int(token.text)

    def block(self) -> FunctionBlock:
        self._must("FUNCTION_BLOCK")
        name = self._name().text
        while heading := self._may("VAR_INPUT", "VAR_OUTPUT", "VAR", "VAR_TEMP"):
            section = heading.text
            if section == "VAR" and self._may("CONSTANT"):
                section = "VAR CONSTANT"
            while not self._may("END_VAR"):
                self._declared(section)
        body = self._statements("END_FUNCTION_BLOCK")
        self._must("END_FUNCTION_BLOCK")
        if self.next.kind != "end":
            self._refuse(self.next.place, "something stands behind END_FUNCTION_BLOCK")
        return FunctionBlock(name=name, variables=self.variables, body=body)

    def _declared(self, section: str) -> None:
        names, bounds, initial = [self._name()], None, None
        while self._may(","):
            names.append(self._name())
        self._must(":")
        if self._may("ARRAY"):
            bounds = self._bounds()
        kind = cast(Kind, self._must(*KINDS).text)
        if self._may(":="):
            initial = self._initial(bounds)
        self._must(";")
        for name in names:
            if name.text.lower() in self.variables:
                self._refuse(name.place, f"{name.text} is declared twice")
            self.variables[name.text.lower()] = Variable(
                place=name.place, name=name.text, section=section, kind=kind, bounds=bounds, initial=initial
            )
            self.held += 0 if section == "VAR CONSTANT" else bounds[1] - bounds[0] + 1 if bounds else 1
            if self.held > MOST_HELD:
                self._refuse(name.place, f"the variables hold more than {MOST_HELD} numbers")

    def _bounds(self) -> tuple[int, int]:
        place = self._must("[").place
        first = self._whole()
        self._must("..")
        last = self._whole()
        if not 0 <= last - first < MOST:
            self._refuse(place, f"an array goes from {first} to {last}, expected up to {MOST} elements")
        self._must("]")
        self._must("OF")
        return first, last

    def _initial(self, bounds: tuple[int, int] | None) -> tuple[int, ...]:
        if bounds is None:
            return (self._constant(),)
        place = self._must("[").place
        values = [self._constant()]
        while self._may(","):
            values.append(self._constant())
        self._must("]")
        if len(values) != bounds[1] - bounds[0] + 1:
            self._refuse(place, f"{len(values)} values for {bounds[1] - bounds[0] + 1} elements")
        return tuple(values)

    def _constant(self) -> int:
        if word := self._may("TRUE", "FALSE"):
            return int(word.text == "TRUE")
        return -self._whole() if self._may("-") else self._whole()

    def _statements(self, *ends: str) -> tuple[Statement, ...]:
        found: list[Statement] = []
        while not self._is(*ends) and self.next.kind != "end":
            found.append(self._statement())
        return tuple(found)

    def _inside(self, part: Callable[[], Inner]) -> Inner:
        """Read what stands inside of something else, up to a depth."""
        self.depth += 1
        if self.depth > DEEPEST:
            self._refuse(self.next.place, f"more than {DEEPEST} brackets or statements stand inside of each other")
        found = part()
        self.depth -= 1
        return found

    def _executes(self, place: Place) -> None:
        """Count a statement or an operation, as often as the loops around it have it."""
        self.executed += self.rounds
        if self.executed > MOST_EXECUTED:
            self._refuse(place, f"a call has more than {MOST_EXECUTED} statements and operations")

    def _operation(self, place: Place, operator: str, *operands: Expression) -> Operation:
        self._executes(place)
        self.operations += 1
        if self.operations > MOST_OPERATIONS:
            self._refuse(place, f"an expression has more than {MOST_OPERATIONS} operations")
        return Operation(place=place, operator=operator, operands=operands)

    def _statement(self) -> Statement:
        place, self.operations = self.next.place, 0
        self._executes(place)
        if self._may("IF"):
            return self._inside(lambda: self._if(place))
        if self._may("FOR"):
            return self._inside(lambda: self._for(place))
        target = self._variable()
        self._must(":=")
        value = self.expression()
        self._must(";")
        return Assignment(place=target.place, target=target, value=value)

    def _if(self, place: Place) -> If:
        branches: list[tuple[Expression | None, tuple[Statement, ...]]] = []
        while True:
            self.operations = 0
            condition = self.expression()
            self._must("THEN")
            branches.append((condition, self._statements("ELSIF", "ELSE", "END_IF")))
            if not self._may("ELSIF"):
                break
        if self._may("ELSE"):
            branches.append((None, self._statements("END_IF")))
        self._must("END_IF")
        self._may(";")
        return If(place=place, branches=tuple(branches))

    def _for(self, place: Place) -> For:
        name = self._name()
        self._must(":=")
        first = self._whole()
        self._must("TO")
        last = self._whole()
        rounds = max(last - first + 1, 1) * self.rounds
        if rounds > MOST:
            self._refuse(place, f"a loop, with those around it, has more than {MOST} rounds")
        if max(first, last) >= RANGES["DINT"][1]:
            self._refuse(place, f"a loop to {max(first, last)} never ends: its variable can't be one more")
        self._must("DO")
        outside, self.rounds = self.rounds, rounds
        body = self._statements("END_FOR")
        self.rounds = outside
        self._must("END_FOR")
        self._may(";")
        variable = Name(place=name.place, name=name.text.lower())
        return For(place=place, variable=variable, first=first, last=last, body=body)

    def expression(self) -> Expression:
        return self._chain(lambda: self._chain(self._compared, "AND"), "OR")

    def _compared(self) -> Expression:
        left = self._sum()
        sign = self._may(*COMPARED)
        if sign is None:
            return left
        return self._operation(sign.place, sign.text, left, self._sum())

    def _sum(self) -> Expression:
        return self._chain(lambda: self._chain(self._signed, "*", "/", "MOD"), "+", "-")

    def _chain(self, part: Callable[[], Expression], *signs: str) -> Expression:
        """Read parts with any of the signs between them, from the left."""
        found = part()
        while sign := self._may(*signs):
            found = self._operation(sign.place, sign.text, found, part())
        return found

    def _signed(self) -> Expression:
        if sign := self._may("-", "NOT"):
            operator = "NEG" if sign.text == "-" else "NOT"
            return self._operation(sign.place, operator, self._operand())
        return self._operand()

    def _operand(self) -> Expression:
        token = self.next
        if self._may("("):
            found = self._inside(self.expression)
            self._must(")")
            return found
        if token.kind == "whole":
            return Number(place=token.place, value=self._whole(), kind=None)
        if self._may("TRUE", "FALSE"):
            return Number(place=token.place, value=int(token.text == "TRUE"), kind="BOOL")
        if self._may(*FUNCTIONS):
            self._must("(")
            operands = [self._inside(self.expression)]
            while self._may(","):
                operands.append(self._inside(self.expression))
            self._must(")")
            if len(operands) != FUNCTIONS[token.text]:
                self._refuse(token.place, f"{token.text} has {len(operands)} operands")
            return self._operation(token.place, token.text, *operands)
        return self._variable()

    def _variable(self) -> Name:
        token, index = self._name(), None
        if self._may("["):
            index = self._inside(self.expression)
            self._must("]")
        return Name(place=token.place, name=token.text.lower(), index=index)
