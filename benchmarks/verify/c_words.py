"""Words of unknown bits: C's integers, what its operators make of them, and the terms of an SMT solver behind them."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field

#: Names of terms.
NAME = re.compile(r"\b(?:t\d+|block_\w+|crc)\b")
#: Of each bit of a word that may be set: statements of which one at least holds where it is.
Flags = tuple[tuple[int, frozenset[str]], ...]


class Unreadable(Exception):
    """C that is not carried out: an index beyond a table, a loop without an end, or a form that no check has."""


@dataclass(frozen=True, slots=True)
class Word:
    """A number of so many bits: an integer, the name of a term, or the statements behind its bits."""

    bits: int
    signed: bool
    term: int | str | Flags


@dataclass(slots=True)
class Terms:
    """Every term once, by its text."""

    names: dict[str, str] = field(default_factory=dict)
    #: Of each name what says what it is; in the order in which they need each other.
    lines: dict[str, str] = field(default_factory=dict)

    def name(self, text: str, bits: int) -> str:
        """Return the name of a term; of a statement for no bits."""
        if text not in self.names:
            self.names[text] = f"t{len(self.names)}"
            sort = f"(_ BitVec {bits})" if bits else "Bool"
            self.lines[self.names[text]] = f"(define-fun {self.names[text]} () {sort} {text})"
        return self.names[text]

    def unknown(self, name: str, bits: int) -> str:
        if name not in self.names:
            self.names[name] = name
            self.lines[name] = f"(declare-const {name} (_ BitVec {bits}))"
        return name

    def needed(self, goal: str) -> list[str]:
        """Return what says what the names of a goal are, and those behind them."""
        found, open_names = set(), set(NAME.findall(goal))
        while open_names:
            name = open_names.pop()
            if name in self.lines and name not in found:
                found.add(name)
                open_names |= set(NAME.findall(self.lines[name]))
        return [line for name, line in self.lines.items() if name in found]


def flags_of(word: Word) -> Flags:
    """Return the statements behind the bits of a word that has such, or is an integer."""
    if isinstance(word.term, int):
        always = frozenset({"true"})
        return tuple((bit, always) for bit in range(word.bits) if word.term >> bit & 1)
    return word.term  # type: ignore[return-value]


def any_of(statements: frozenset[str]) -> str:
    return f"(or false {' '.join(sorted(statements))})"


class Words:
    """What C's operators make of words, where `int` and `long` have so many bits."""

    def __init__(self, int_bits: int, long_bits: int, terms: Terms) -> None:
        self._int, self._long, self._terms = int_bits, long_bits, terms

    def _converted(self, value: Word, bits: int, signed: bool) -> Word:
        if isinstance(value.term, int):
            number = value.term
            if value.signed and bits > value.bits and number >> (value.bits - 1):
                number -= 1 << value.bits
            return Word(bits, signed, number % (1 << bits))
        spread = value.signed and bits > value.bits
        if isinstance(value.term, tuple) and not (spread and any(bit == value.bits - 1 for bit, _ in value.term)):
            return Word(bits, signed, tuple(each for each in value.term if each[0] < bits))
        if bits == value.bits:
            return Word(bits, signed, value.term)
        value = self._plain_word(value)
        if bits < value.bits:
            text = f"((_ extract {bits - 1} 0) {value.term})"
        else:
            text = f"((_ {'sign' if value.signed else 'zero'}_extend {bits - value.bits}) {value.term})"
        return Word(bits, signed, self._terms.name(text, bits))

    def _promoted(self, value: Word) -> Word:
        if value.bits > self._int:
            return value
        return self._converted(value, self._int, value.signed or value.bits < self._int)

    def _alike(self, left: Word, right: Word) -> tuple[Word, Word]:
        left, right = self._promoted(left), self._promoted(right)
        bits = max(left.bits, right.bits)
        signed = all(each.signed for each in (left, right) if each.bits == bits)
        return self._converted(left, bits, signed), self._converted(right, bits, signed)

    def _chosen(self, condition: Word, yes: Word, no: Word) -> Word:
        if isinstance(condition.term, int):
            return yes if condition.term else no
        if yes == no:
            return yes
        holds = self._nonzero(condition)
        if not isinstance(yes.term, str) and not isinstance(no.term, str):
            return Word(yes.bits, yes.signed, self._either(holds, dict(flags_of(yes)), dict(flags_of(no))))
        text = f"(ite {any_of(holds)} {self._written(yes)} {self._written(no)})"
        return Word(yes.bits, yes.signed, self._terms.name(text, yes.bits))

    def _either(self, holds: frozenset[str], yes: dict[int, frozenset[str]], no: dict[int, frozenset[str]]) -> Flags:
        """Return the bits of what is chosen: what both have stays as it is, so that it is found in both checks."""
        found = {}
        for bit in {*yes, *no}:
            one, other = yes.get(bit, frozenset()), no.get(bit, frozenset())
            chosen = set(one & other)
            for statements, where in ((one - other, any_of(holds)), (other - one, f"(not {any_of(holds)})")):
                for each in statements:
                    if each == "true" and where == any_of(holds):
                        chosen |= holds
                    else:
                        chosen.add(self._terms.name(f"(and {where} {each})", 0))
            found[bit] = frozenset(chosen)
        return tuple(sorted(found.items()))

    def _nonzero(self, word: Word) -> frozenset[str]:
        """Return statements of which one holds where a word is not zero."""
        if isinstance(word.term, str):
            return frozenset({self._terms.name(f"(not (= {word.term} (_ bv0 {word.bits})))", 0)})
        return frozenset().union(*(statements for _, statements in flags_of(word)))

    def _written(self, word: Word) -> str:
        if isinstance(word.term, int):
            return f"(_ bv{word.term} {word.bits})"
        return self._plain_word(word).term

    def _plain_word(self, word: Word) -> Word:
        """Return a word as a term."""
        if not isinstance(word.term, tuple):
            return word
        text = f"(_ bv0 {word.bits})"
        for bit, statements in word.term:
            text = f"(bvor {text} (ite {any_of(statements)} (_ bv{1 << bit} {word.bits}) (_ bv0 {word.bits})))"
        return Word(word.bits, word.signed, self._terms.name(text, word.bits))

    def _operated(self, operator: str, left: Word, right: Word) -> Word:
        if operator in ("<<", ">>"):
            left, right = self._promoted(left), self._promoted(right)
            if isinstance(right.term, int) and right.term >= left.bits:
                raise Unreadable("a shift too far")
            right = self._converted(right, left.bits, left.signed)
        elif operator in ("&&", "||"):
            left, right = self._truth(left), self._truth(right)
            none = Word(self._int, True, 0)
            return self._chosen(left, right, none) if operator == "&&" else self._united(left, right)
        else:
            left, right = self._alike(left, right)
        flagged = isinstance(left.term, tuple) or isinstance(right.term, tuple)
        if operator == "|" and flagged and not isinstance(left.term, str) and not isinstance(right.term, str):
            return self._united(left, right)
        if operator in ("!=", "==") and isinstance(left.term, tuple) and right.term == 0:
            one, none = Word(self._int, True, 1), Word(self._int, True, 0)
            return self._chosen(left, one, none) if operator == "!=" else self._chosen(left, none, one)
        if operator == "&" and isinstance(left.term, tuple) and isinstance(right.term, int):
            kept = tuple(each for each in left.term if right.term >> each[0] & 1)
            return Word(left.bits, left.signed, kept or 0)
        return OPERATORS[operator](self, self._plain_word(left), self._plain_word(right))

    def _united(self, left: Word, right: Word) -> Word:
        found = dict(flags_of(left))
        for bit, statements in flags_of(right):
            found[bit] = found.get(bit, frozenset()) | statements
        return Word(left.bits, left.signed, tuple(sorted(found.items())) or 0)

    def _truth(self, value: Word) -> Word:
        """1 where a word is not zero, else 0."""
        return self._chosen(value, Word(self._int, True, 1), Word(self._int, True, 0))

    def compared(self, text: str, holds: Callable[[int, int], bool], left: Word, right: Word) -> Word:
        if isinstance(left.term, int) and isinstance(right.term, int):
            numbers = (each.term - (1 << each.bits) * (each.signed and each.term >> (each.bits - 1))
                       for each in (left, right))  # fmt: skip
            return Word(self._int, True, int(holds(*numbers)))
        if not left.signed and (text, right.term if text == "bv?lt" else left.term) in (("bv?lt", 0), ("bv?gt", 0)):
            return Word(self._int, True, 0)
        written = f"({text.replace('?', 's' if left.signed else 'u')} {self._written(left)} {self._written(right)})"
        return Word(self._int, True, ((0, frozenset({self._terms.name(written, 0)})),))

    def computed(self, text: str, of: Callable[[int, int], int], left: Word, right: Word) -> Word:
        if isinstance(left.term, int) and isinstance(right.term, int):
            return Word(left.bits, left.signed, of(left.term, right.term) % (1 << left.bits))
        sides = [self._written(left), self._written(right)]
        if text == "bvmul" and isinstance(left.term, str) and isinstance(right.term, str):
            text, sides = f"product{left.bits}", sorted(sides)
        return Word(left.bits, left.signed, self._terms.name(f"({text} {' '.join(sides)})", left.bits))


def _computing(text: str, of: Callable[[int, int], int]) -> Callable[[Words, Word, Word], Word]:
    return lambda run, left, right: run.computed(text, of, left, right)


def _comparing(text: str, holds: Callable[[int, int], bool]) -> Callable[[Words, Word, Word], Word]:
    return lambda run, left, right: run.compared(text, holds, left, right)


OPERATORS: dict[str, Callable[[Words, Word, Word], Word]] = {
    "+": _computing("bvadd", lambda x, y: x + y), "-": _computing("bvsub", lambda x, y: x - y),
    "*": _computing("bvmul", lambda x, y: x * y), "&": _computing("bvand", lambda x, y: x & y),
    "|": _computing("bvor", lambda x, y: x | y), "^": _computing("bvxor", lambda x, y: x ^ y),
    "<<": _computing("bvshl", lambda x, y: x << y), ">>": _computing("bvlshr", lambda x, y: x >> y),
    "<": _comparing("bv?lt", lambda x, y: x < y), "<=": _comparing("bv?le", lambda x, y: x <= y),
    ">": _comparing("bv?gt", lambda x, y: x > y), ">=": _comparing("bv?ge", lambda x, y: x >= y),
    "==": _comparing("=", lambda x, y: x == y), "!=": _comparing("distinct", lambda x, y: x != y),
}  # fmt: skip
