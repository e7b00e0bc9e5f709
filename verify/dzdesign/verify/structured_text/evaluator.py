"""A function block's text evaluated by NumPy: slow, and the referee of the C code that the text is turned into.

Every variable is an array with an element for each input; a branch acts on the elements of its condition.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

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
    Statement,
)


class Evaluator:
    """One run of a block over many inputs at once."""

    def __init__(self, block: FunctionBlock, kinds: Mapping[int, Kind], size: int) -> None:
        self.block, self.kinds = block, kinds
        #: How many operations had a result outside of their type.
        self.faults = 0
        self.values: dict[str, np.ndarray] = {}
        for name, variable in block.variables.items():
            low, high = variable.bounds or (0, 0)
            if variable.initial is not None and variable.section == "VAR CONSTANT":
                self.values[name] = np.array(variable.initial, dtype=np.int64)[:, None]
            else:
                first = (variable.initial or (0,))[0]
                self.values[name] = np.full((high - low + 1, size), first, dtype=np.int64)
        self.size = size

    def run(self, given: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return every output and state, given the inputs and, where they are no first ones, the states."""
        for name, values in given.items():
            self.values[name][0] = values
        self._statements(self.block.body, np.ones(self.size, dtype=bool))
        names = [each.name.lower() for each in (*self.block.of_section("VAR_OUTPUT"), *self.block.of_section("VAR"))]
        return {name: self.values[name][0].copy() for name in names}

    def _statements(self, body: Sequence[Statement], acts: np.ndarray) -> None:
        for each in body:
            match each:
                case Assignment():
                    self._assign(each.target, self._of(each.value, acts), acts)
                case For():
                    for number in range(each.first, each.last + 1):
                        self._assign(each.variable, np.full(self.size, number), acts)
                        self._statements(each.body, acts)
                case If():
                    left = acts
                    for condition, inside in each.branches:
                        here = left if condition is None else left & (self._of(condition, left) != 0)
                        self._statements(inside, here)
                        left = left & ~here

    def _assign(self, target: Name, value: np.ndarray, acts: np.ndarray) -> None:
        row = self._row(target, acts)
        column = np.arange(self.size)
        self.values[target.name][row[acts], column[acts]] = np.broadcast_to(value, (self.size,))[acts]

    def _row(self, name: Name, acts: np.ndarray) -> np.ndarray:
        """Return the place in its array that each element means."""
        if name.index is None:
            return np.zeros(self.size, dtype=np.int64)
        low, high = self.block.variables[name.name].bounds or (0, 0)
        place = self._of(name.index, acts)
        return self._checked(place, low, high, acts, low) - low

    def _checked(self, x: np.ndarray, low: int, high: int, acts: np.ndarray, instead: int = 0) -> np.ndarray:
        x = np.broadcast_to(x, (self.size,))
        wrong = acts & ((x < low) | (x > high))
        self.faults += int(wrong.sum())
        return np.where((x < low) | (x > high), instead, x)

    def _of(self, each: Expression, acts: np.ndarray) -> np.ndarray:
        match each:
            case Number():
                return np.full(self.size, each.value, dtype=np.int64)
            case Name():
                held = self.values[each.name]
                column = 0 if held.shape[1] == 1 else np.arange(self.size)
                read: np.ndarray = held[self._row(each, acts), column]
                return read
            case Operation():
                return self._operation(each, [self._of(operand, acts) for operand in each.operands], acts)

    def _operation(self, each: Operation, x: list[np.ndarray], acts: np.ndarray) -> np.ndarray:
        kind = self.kinds[id(each)]
        found: np.ndarray
        match each.operator:
            case "+":
                found = x[0] + x[1]
            case "-":
                found = x[0] - x[1]
            case "*":
                return self._product(x, kind, acts)
            case "/" | "MOD":
                return self._divided(each.operator, x, kind, acts)
            case "NEG":
                found = -x[0]
            case "ABS":
                found = np.abs(x[0])
            case "MIN":
                found = np.minimum(x[0], x[1])
            case "MAX":
                found = np.maximum(x[0], x[1])
            case "DINT_TO_UDINT" | "UDINT_TO_DINT":
                found = x[0]
            case operator:
                return LOGICAL[operator](*x).astype(np.int64)
        return self._checked(found, *RANGES[kind], acts)

    def _product(self, x: list[np.ndarray], kind: Kind, acts: np.ndarray) -> np.ndarray:
        """Return products; those of 64 bits without sign are too large by their size in doubles already."""
        near = x[0].astype(np.float64) * x[1].astype(np.float64)
        small = np.abs(near) < 2.0**62
        product = np.where(small, x[0], 0) * np.where(small, x[1], 0)
        return self._checked(np.where(small, product, 2**62), *RANGES[kind], acts)

    def _divided(self, operator: str, x: list[np.ndarray], kind: Kind, acts: np.ndarray) -> np.ndarray:
        """Return quotients rounded towards zero, or what is left of them, with the sign of the dividend."""
        self.faults += int((acts & (x[1] == 0)).sum())
        divisor = np.where(x[1] == 0, 1, x[1])
        size = np.abs(x[0]) // np.abs(divisor)
        quotient = np.where((x[0] < 0) != (divisor < 0), -size, size)
        within = self._checked(quotient, *RANGES[kind], acts)  # of a rest too: processors stop at one of 2^31
        return np.where(x[1] == 0, 0, within if operator == "/" else x[0] - quotient * divisor)


#: Operators on numbers and conditions whose result is a condition.
LOGICAL: dict[str, Callable[..., np.ndarray]] = {
    "AND": np.logical_and, "OR": np.logical_or, "NOT": np.logical_not, "=": np.equal, "<>": np.not_equal,
    "<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal,
}  # fmt: skip
