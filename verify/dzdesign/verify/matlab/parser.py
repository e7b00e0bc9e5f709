"""The first function of a file as statements and expressions, by the grammar of the subset.

A statement is ``name = expression``, ``name(mask) = expression``, a call by itself, or ``if expression`` with
statements up to ``end``. Operators bind as in MATLAB: ``||``, ``&&``, ``|``, ``&``, comparisons, sums, products, a sign
or ``~``, ``^``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from dzdesign.core.errors import InputError
from dzdesign.verify.matlab.subset import ReadFunction, Token

#: Binary operators, from those that bind least.
LEVELS = (
    ("||",), ("&&",), ("|",), ("&",), ("<", "<=", ">", ">=", "==", "~="), ("+", "-"), ("*", ".*"),
)  # fmt: skip
#: Brackets, signs and branches inside of each other, and operations of one statement; a generated one has 8.
DEEPEST, MOST_OPERATIONS = 30, 50
Inner = TypeVar("Inner")


@dataclass(frozen=True, slots=True)
class Expression:
    """A number, text or name, an operator and its operands, a call or index and its arguments, or a column."""

    kind: str
    text: str
    line: int
    parts: tuple["Expression", ...] = ()


@dataclass(frozen=True, slots=True)
class Statement:
    """An assignment to a variable, or to the elements of one that `mask` has; a call has no target."""

    line: int
    target: str
    mask: Expression | None
    value: Expression


@dataclass(frozen=True, slots=True)
class Branch:
    """Statements under a condition."""

    line: int
    condition: Expression
    body: tuple["Statement | Branch", ...]


def parse_body(function: ReadFunction, source: str) -> tuple[Statement | Branch, ...]:
    """Return the statements of a function; what is none of the subset's is an `InputError` with its line."""
    reader = _Reader(function.body, source)
    body = reader.statements()
    reader.expect("end")
    return body


class _Reader:
    def __init__(self, words: tuple[Token, ...], source: str) -> None:
        self.words, self.source, self.place = words, source, 0
        #: How deep the word stands, and operations of its statement.
        self.depth, self.operations = 0, 0

    @property
    def word(self) -> Token:
        return self.words[self.place] if self.place < len(self.words) else Token("line", "", 0)

    def take(self) -> Token:
        word = self.word
        self.place += 1
        return word

    def expect(self, text: str) -> Token:
        word = self.take()
        if word.text != text:
            raise InputError(f"{self.source}, line {word.line}: {word.text!r} stands where {text!r} is expected")
        return word

    def inside(self, part: Callable[[], Inner]) -> Inner:
        """Read what stands inside of something else, up to a depth."""
        self.depth += 1
        if self.depth > DEEPEST:
            raise InputError(f"{self.source}, line {self.word.line}: more than {DEEPEST} parts stand inside each other")
        found = part()
        self.depth -= 1
        return found

    def operation(self, word: Token, *operands: Expression) -> Expression:
        self.operations += 1
        if self.operations > MOST_OPERATIONS:
            raise InputError(f"{self.source}, line {word.line}: a statement has more than {MOST_OPERATIONS} operations")
        return Expression("operator", word.text, word.line, operands)

    def statements(self) -> tuple[Statement | Branch, ...]:
        found: list[Statement | Branch] = []
        while self.place < len(self.words):
            if self.word.kind == "line" or self.word.text == ";":
                self.take()
            elif self.word.text == "end":
                break
            else:
                found.append(self.statement())
        return tuple(found)

    def statement(self) -> Statement | Branch:
        line, self.operations = self.word.line, 0
        if self.word.text == "if":
            self.take()
            condition = self.expression()
            body = self.inside(self.statements)
            self.expect("end")
            return Branch(line, condition, body)
        target = self.expression()
        if self.word.text != "=":
            return Statement(line, "", None, target)
        self.take()
        value = self.expression()
        if target.kind == "name":
            return Statement(line, target.text, None, value)
        if target.kind != "call" or len(target.parts) != 1:
            raise InputError(f"{self.source}, line {line}: this can't be assigned")
        return Statement(line, target.text, target.parts[0], value)

    def expression(self, level: int = 0) -> Expression:
        if level == len(LEVELS):
            return self.signed()
        left = self.expression(level + 1)
        while self.word.kind == "sign" and self.word.text in LEVELS[level]:
            word = self.take()
            left = self.operation(word, left, self.expression(level + 1))
        return left

    def signed(self) -> Expression:
        if self.word.kind == "sign" and self.word.text in ("-", "~"):
            word = self.take()
            return self.operation(word, self.inside(self.signed))
        base = self.primary()
        if self.word.text == "^":
            return self.operation(self.take(), base, self.primary())
        return base

    def primary(self) -> Expression:
        word = self.take()
        if word.kind in ("number", "text"):
            return Expression(word.kind, word.text, word.line)
        if word.text == "(":
            inside = self.inside(self.expression)
            self.expect(")")
            return inside
        if word.text == "[":
            return Expression("column", "", word.line, self.listed("]", ";"))
        if word.kind == "name" and word.text not in ("if", "end", "function"):
            if self.word.text != "(":
                return Expression("name", word.text, word.line)
            self.take()
            return Expression("call", word.text, word.line, self.listed(")", ","))
        raise InputError(f"{self.source}, line {word.line}: {word.text!r} stands where a value is expected")

    def listed(self, end: str, separator: str) -> tuple[Expression, ...]:
        found: list[Expression] = []
        while self.word.text != end:
            found.append(self.inside(self.expression))
            if self.word.text != end:
                self.expect(separator)
        self.take()
        return tuple(found)
