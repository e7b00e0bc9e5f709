"""Integer operations on named values, each with the exact range of its results: the proof that none overflows.

A sum of products that needs more than 32 bits is one of limbs of 15 bits, each operation of which fits a word of 32.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Union

from dzdesign.core.errors import DzdesignError, InputError

Given = Union["Node", int]
REMEDY = "choose scalings with smaller common denominators"
#: Bits of a limb; a word of 32 bits with sign is one limb and 16 bits and its sign.
LIMB = 15
RADIX = 1 << LIMB
#: Products below this are added as they are: some hundred of them fit a word.
SMALL = 1 << 24


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Node:
    """One operation, or an input, a constant or a name of one; `low` and `high` are the ends of its values."""

    #: What it does, as `text` spells it; "input", "number" and "constant" are leaves, "let" names its operand.
    operation: str
    operands: tuple["Node", ...] = ()
    low: int
    high: int
    #: Bits of the signed word that holds the value.
    bits: int
    boolean: bool = False
    name: str = ""
    #: What it is, with its unit and equation; of a constant and of a named operation.
    meaning: str = ""
    #: Values of a constant, one or those of a table; the first value of what is remembered.
    values: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        limit = 1 << self.bits - 1
        if not -limit <= self.low <= self.high < limit:
            raise InputError(
                f"'{self.name or self.operation}' of the law goes from {self.low} to {self.high}, beyond "
                f"{self.bits} bits; {REMEDY}"
            )

    def _made(self, operation: str, others: tuple[Given, ...], ends: list[int], *, boolean: bool = False) -> "Node":
        operands = (self, *map(self.number, others))
        return Node(
            operation=operation, operands=operands, low=min(ends), high=max(ends), bits=self.bits, boolean=boolean
        )

    def number(self, value: Given) -> "Node":
        """Return a whole number as a node beside this one."""
        if isinstance(value, Node):
            return value
        return Node(operation="number", low=value, high=value, bits=self.bits, values=(value,))

    def _ends(self, other: Given, of: Callable[[int, int], int]) -> list[int]:
        second = self.number(other)
        return [of(x, y) for x in (self.low, self.high) for y in (second.low, second.high)]

    def __add__(self, other: Given) -> "Node":
        return self._made("+", (other,), self._ends(other, lambda x, y: x + y))

    def __sub__(self, other: Given) -> "Node":
        return self._made("-", (other,), self._ends(other, lambda x, y: x - y))

    def __mul__(self, other: Given) -> "Node":
        return self._made("*", (other,), self._ends(other, lambda x, y: x * y))

    def __neg__(self) -> "Node":
        return self._made("neg", (), [-self.low, -self.high])

    def __rshift__(self, shift: int) -> "Node":
        return self._made(">>", (shift,), self._ends(shift, lambda x, y: x >> y))

    def least(self, other: Given) -> "Node":
        """Return the smaller of two values."""
        return self._made("min", (other,), self._ends(other, min))

    def most(self, other: Given) -> "Node":
        """Return the larger of two values."""
        return self._made("max", (other,), self._ends(other, max))

    def quotient(self, divisor: Given) -> "Node":
        """Return the quotient by a positive number, rounded towards zero as IEC 61131-3 has it."""
        return self._made("/", (divisor,), self._ends(divisor, truncated))

    def remainder(self, divisor: int) -> "Node":
        """Return what `quotient` leaves, with the sign of the dividend."""
        return self._made("mod", (divisor,), [max(self.low, 1 - divisor) if self.low < 0 else 0,
                                              min(self.high, divisor - 1) if self.high > 0 else 0])  # fmt: skip

    def over(self, power: int) -> "Node":
        """Return the quotient of a value that is not negative by a power of two: a shift, where the language has it."""
        return self >> power.bit_length() - 1 if self.bits == 64 else self.quotient(power)

    def past(self, power: int) -> "Node":
        """Return what `over` leaves."""
        rest = self - self.over(power) * power if self.bits == 64 else self.remainder(power)
        # What a division leaves is below its divisor, whatever its operands are by themselves.
        return replace(rest, low=0, high=power - 1)

    def _compared(self, operation: str, other: Given) -> "Node":
        return self._made(operation, (other,), [0, 1], boolean=True)

    def __lt__(self, other: Given) -> "Node":
        return self._compared("<", other)

    def __gt__(self, other: Given) -> "Node":
        return self._compared(">", other)

    def __le__(self, other: Given) -> "Node":
        return self._compared("<=", other)

    def __or__(self, other: "Node") -> "Node":
        return self._compared("or", other)

    def __and__(self, other: "Node") -> "Node":
        return self._compared("and", other)

    def __invert__(self) -> "Node":
        return self._made("not", (), [0, 1], boolean=True)

    def as_number(self) -> "Node":
        """Return 1 for true and 0 for false."""
        return self._made("int", (), [0, 1])

    def choose(self, yes: Given, no: Given) -> "Node":
        """Return one of two values, by this condition."""
        first, second = self.number(yes), self.number(no)
        ends = [first.low, first.high, second.low, second.high]
        return self._made("choose", (first, second), ends)

    def of(self, index: "Node") -> "Node":
        """Return an element of this table; an index outside of it is an error of the trace."""
        if not 0 <= index.low <= index.high < len(self.values):
            raise DzdesignError(f"{self.name} has {len(self.values)} elements; its index goes to {index.high}")
        return self._made("of", (index,), [min(self.values), max(self.values)])

    def interpolated(self, row: "Node", past: "Node", step: int) -> "Node":
        """Return `step` times the table's value between two rows; a mean of two nodes lies within the nodes."""
        left = self.of(row)
        made = left * step + (self.of(row + 1) - left) * past
        if past.low < 0 or past.high > step:
            raise DzdesignError(f"{past.name} goes from {past.low} to {past.high}, beyond its step {step}")
        return replace(made, low=min(self.values) * step, high=max(self.values) * step)

    def mean(self, other: "Node", weight: "Node", rest: "Node", whole: int) -> "Node":
        """Return two values by weights that are `whole` together: within theirs, times `whole`."""
        made = self * weight + other * rest
        ends = [value * whole for value in (self.low, self.high, other.low, other.high)]
        return replace(made, low=min(ends), high=max(ends))


def truncated(x: int, y: int) -> int:
    """Return a quotient rounded towards zero."""
    return abs(x) // y * (1 if x >= 0 else -1)


@dataclass(slots=True, kw_only=True)
class Form:
    """The operations of one text, in their order."""

    #: Of the word that every value fits.
    bits: int
    inputs: list[Node] = field(default_factory=list)
    constants: list[Node] = field(default_factory=list)
    #: Named operations; what stands between two names is used once.
    lines: list[Node] = field(default_factory=list)
    #: Heading to the place of the line that it stands before.
    headings: dict[int, str] = field(default_factory=dict)
    outputs: tuple[str, ...] = ()

    def input(self, name: str, low: int, high: int, *, boolean: bool = False) -> Node:
        """Return an input."""
        self.inputs.append(Node(operation="input", low=low, high=high, bits=self.bits, name=name, boolean=boolean))
        return self.inputs[-1]

    def memory(self, name: str, low: int, high: int, first: int, meaning: str, *, boolean: bool = False) -> Node:
        """Return what is remembered of the last call, in the first one its first value; a line assigns it anew."""
        self.inputs.append(
            Node(operation="input", low=low, high=high, bits=self.bits, name=name, boolean=boolean, meaning=meaning,
                 values=(first,))
        )  # fmt: skip
        return self.inputs[-1]

    def constant(self, name: str, values: tuple[int, ...], meaning: str) -> Node:
        """Return a number, or a table, that has a name."""
        self.constants.append(
            Node(operation="constant", low=min(values), high=max(values), bits=self.bits, name=name, meaning=meaning,
                 values=values)
        )  # fmt: skip
        return self.constants[-1]

    def let(self, name: str, node: Node, meaning: str = "") -> Node:
        """Return an operation under a name: it gets a line of its own."""
        self.lines.append(replace(node, operation="let", operands=(node,), name=name, meaning=meaning, values=()))
        return self.lines[-1]

    @property
    def remembered(self) -> list[Node]:
        """What is remembered for the next call."""
        return [each for each in self.inputs if each.values]

    @property
    def own(self) -> list[Node]:
        """Lines that are neither outputs nor remembered, the conditions last."""
        others = {*self.outputs, *(each.name for each in self.inputs)}
        return sorted((line for line in self.lines if line.name not in others), key=lambda line: line.boolean)

    def heading(self, text: str) -> None:
        """Put a heading before the next line."""
        self.headings[len(self.lines)] = text


class Limbs:
    """The sum, as what stands in each limb; limbs have signs, and are carried once, at the end."""

    def __init__(self, form: Form, row: Node | None) -> None:
        self.form, self.row = form, row
        self.limbs: list[list[tuple[Node, Node | None]]] = []

    def _put(self, place: int, node: Node, weight: Node | None) -> None:
        while len(self.limbs) <= place:
            self.limbs.append([])
        self.limbs[place].append((node, weight))

    def _digits(self, x: Node) -> list[Node]:
        """Return a named value as its limbs, both with its sign."""
        if x.low > -RADIX and x.high < RADIX:
            return [x]
        low = self.form.let(f"{x.name}_0", x.remainder(RADIX), f"{x.name} = {x.name}_1 * {RADIX} + {x.name}_0")
        return [low, self.form.let(f"{x.name}_1", x.quotient(RADIX))]

    def add(self, name: str, x: Node, y: Node, weight: Node | None = None) -> None:
        """Add a product to the sum, so many times."""
        self._add(name, self._digits(x), self._digits(y), weight)

    def _add(self, name: str, x: Sequence[Node], y: Sequence[Node | None], weight: Node | None) -> None:
        times = 1 if weight is None else weight.high
        for i, first in enumerate(x):
            for j, second in enumerate(y):
                if second is None:
                    continue
                product = first * second
                if max(-product.low, product.high) * times < SMALL:
                    self._put(i + j, product, weight)
                    continue
                held = self.form.let(f"{name}_{i}{j}", product)
                self._put(i + j, held.remainder(RADIX), weight)
                self._put(i + j + 1, held.quotient(RADIX), weight)

    def add_share(self, name: str, x: Node, constant: Sequence[Node | None], weight: Node | None) -> None:
        """Add a multiple of a value, so many times."""
        self._add(name, self._digits(x), constant, weight)

    def add_number(self, constant: Sequence[Node | None]) -> None:
        """Add a constant."""
        for place, digit in enumerate(constant):
            if digit is not None:
                self._put(place, digit, None)

    def constant(self, name: str, values: Sequence[int], meaning: str) -> list[Node | None]:
        """Return a constant's limbs, `values` being those of each side; None for one that is zero on every side."""
        found: list[Node | None] = []
        place = 0
        while any(value >> LIMB * place for value in values):
            digits = tuple(value >> LIMB * place & RADIX - 1 for value in values)
            told = f"{meaning}, over {RADIX}^{place}" if place else meaning
            alike = digits[:1] if len(set(digits)) == 1 else digits
            if any(digits):
                made = self.form.constant(f"{name}_{place}", alike, told)
                found.append(made if len(alike) == 1 or self.row is None else made.of(self.row))
            else:
                found.append(None)
            place += 1
        return found

    def shifted(self, shift: int) -> Node:
        """Return the sum over 2^shift, rounded down; two limbs go as a whole, and less than one further."""
        carried: Node | None = None
        sums = []
        for place in range(max(len(self.limbs), 3)):
            # What has one weight is added up first.
            parts: dict[Node | None, Node] = {} if carried is None else {None: carried}
            for node, weight in self.limbs[place] if place < len(self.limbs) else []:
                parts[weight] = parts[weight] + node if weight in parts else node
            carried = None
            if not parts:
                continue
            weighted = [node if weight is None else weight * node for weight, node in parts.items()]
            total = weighted[0]
            for each in weighted[1:]:
                total = total + each
            told = "of the law's sum" + (", the carry of that below it included" if 0 < place < 3 else "")
            sums.append((place, self.form.let(f"sum_{place}", total, f"limb {place} {told}")))
            carried = self._down(sums[-1][1], RADIX) if place < 2 else None
        dropped = shift - 2 * LIMB
        quotient: Node | None = None
        for place, each in sums:
            if place == 2:
                quotient = self._down(each, 1 << dropped)
            elif place > 2:
                share = each * (1 << LIMB * (place - 2) - dropped)
                quotient = share if quotient is None else quotient + share
        if quotient is None:
            raise DzdesignError("the law's sum has no limb that its shift leaves")
        return self.form.let("quotient", quotient, f"the sum over 2^{shift}, rounded down")

    @staticmethod
    def _down(x: Node, divisor: int) -> Node:
        """Return a quotient rounded down: lifted above zero first, for a division rounds towards zero."""
        lift = -(x.low // divisor) if x.low < 0 else 0
        return (x + lift * divisor).quotient(divisor) - lift if lift else x.quotient(divisor)
