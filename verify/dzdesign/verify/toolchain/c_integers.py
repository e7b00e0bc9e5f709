"""The integers of C on a target whose int has 16 bits and on this PC: their types, and what is known of a number."""

from dataclasses import dataclass
from typing import NamedTuple

#: Bits of the types that have the same name and width everywhere.
FIXED_BITS = (8, 16, 32, 64)


class Form(NamedTuple):
    """A type of integers on one machine."""

    bits: int
    signed: bool

    @property
    def ends(self) -> tuple[int, int]:
        """The least and the largest number."""
        half = 1 << (self.bits - 1)
        return (-half, half - 1) if self.signed else (0, 2 * half - 1)

    def promoted(self, int_bits: int) -> "Form":
        """Return the type in which arithmetic takes it."""
        return Form(int_bits, True) if self.bits < int_bits else self

    def common(self, other: "Form") -> "Form":
        """Return the type of a sum of two promoted ones."""
        if self.bits == other.bits:
            return Form(self.bits, self.signed and other.signed)
        return max(self, other)


@dataclass(frozen=True, slots=True)
class Int:
    """A type of integers on the target and on this PC."""

    target: Form
    host: Form

    @property
    def is_fixed(self) -> bool:
        """Whether it is the same on both."""
        return self.target == self.host

    @property
    def bits(self) -> int:
        """Bits that it has on both."""
        return min(self.target.bits, self.host.bits)

    @property
    def ends(self) -> tuple[int, int]:
        """The least and the largest number that both hold."""
        (low, high), (host_low, host_high) = self.target.ends, self.host.ends
        return max(low, host_low), min(high, host_high)

    def holds(self, low: int, high: int) -> bool:
        """Tell whether both hold all numbers of a range."""
        return self.ends[0] <= low and high <= self.ends[1]

    def promoted(self) -> "Int":
        """Return the type in which arithmetic takes it."""
        return Int(self.target.promoted(TARGET_INT), self.host.promoted(HOST_INT))

    def common(self, other: "Int") -> "Int":
        """Return the type of a sum."""
        mine, others = self.promoted(), other.promoted()
        return Int(mine.target.common(others.target), mine.host.common(others.host))


TARGET_INT, HOST_INT, TARGET_LARGEST = 16, 32, 32767
INT = Int(Form(TARGET_INT, True), Form(HOST_INT, True))
SIZE = Int(Form(32, False), Form(64, False))
FIXED = {f"{'' if signed else 'u'}int{bits}_t": Int(Form(bits, signed), Form(bits, signed))
         for bits in FIXED_BITS for signed in (True, False)}  # fmt: skip


class Value(NamedTuple):
    """What is known of a number."""

    type: Int
    low: int
    high: int
    #: Low bits that are equal on target and PC; None: the numbers are.
    same: int | None = None


def any_of(of: Int) -> Value:
    """Return that nothing but its type is known of a number."""
    return Value(of, *of.ends)


def fewer(values: tuple[Value, ...]) -> int | None:
    """Return the low bits that all of some numbers have equal on target and PC."""
    return min((each.same for each in values if each.same is not None), default=None)


def ends_of(op: str, left: Value, right: Value) -> tuple[int, int]:
    """Return the least and the largest result of two numbers; of a quotient for a divisor of any size."""
    if op == "+":
        return left.low + right.low, left.high + right.high
    if op == "-":
        return left.low - right.high, left.high - right.low
    if op == "*":
        made = [one * other for one in left[1:3] for other in right[1:3]]
        return min(made), max(made)
    largest = max(abs(end) for end in left[1:3])
    if op in "/%":
        return (-largest if left.low < 0 or right.low < 0 else 0), largest
    bits = max(end.bit_length() for end in (*left[1:3], *right[1:3]))
    return (0 if min(left.low, right.low) >= 0 else -(1 << bits)), (1 << bits) - 1


def constant(text: str) -> Value:
    """Return an integer constant as it is written, in the first type that holds it on each machine.

    Examples
    --------
    >>> constant("40000").type.target, constant("0x8000").type.target
    (Form(bits=32, signed=True), Form(bits=16, signed=False))
    """
    digits = text.lower().rstrip("ul")
    suffix = text.lower()[len(digits) :]
    octal = digits.startswith("0") and digits.isdigit() and len(digits) > 1
    number = int(digits, 8 if octal else 0)
    signs = (False,) if "u" in suffix else (True,) if digits.isdigit() and not octal else (True, False)
    forms = []
    for widths in ((TARGET_INT, 32, 64), (HOST_INT, 64, 64)):
        possible = [Form(bits, signed) for bits in widths[suffix.count("l") :] for signed in signs]
        forms.append(next((form for form in possible if number <= form.ends[1]), possible[-1]))
    return Value(Int(*forms), number, number)
