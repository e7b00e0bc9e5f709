"""A sum of products that need more than 32 bits, in limbs of 15 bits: each operation fits a word of 32 bits."""

from collections.abc import Sequence

from dzdesign.codegen.integers.form import Form, Node
from dzdesign.core.errors import DzdesignError

#: Bits of a limb; a word of 32 bits with sign is one limb and 16 bits and its sign.
LIMB = 15
RADIX = 1 << LIMB
#: Products below this are added as they are: some hundred of them fit a word.
SMALL = 1 << 24


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
