"""The first function of a file evaluated here, in whole numbers of any length: which operation leaves its class.

The rules are MATLAB's: an operation has integers of one class, or of one class and a double that is a scalar; its
result is of that class, which saturates. A result that does not fit, a shift of a negative number, whose result the
tools do not agree on, and classes that are mixed are faults. What the file's other functions make of the inputs is
tried in Octave; here they are given as columns of codes.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.verify.matlab.parser import Branch, Expression, Statement

LIMITS = {
    "int32": (-(2**31), 2**31 - 1),
    "int64": (-(2**63), 2**63 - 1),
    "uint16": (0, 2**16 - 1),
    "double": (-(2**53), 2**53),
}
COMPARED: Mapping[str, Callable[..., np.ndarray]] = {
    "<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal, "==": np.equal, "~=": np.not_equal,
}  # fmt: skip
JOINED: Mapping[str, Callable[..., np.ndarray]] = {"&": np.logical_and, "|": np.logical_or}
COMPUTED: Mapping[str, Callable[..., np.ndarray]] = {
    "+": np.add, "-": np.subtract, ".*": np.multiply, "*": np.multiply, "max": np.maximum, "min": np.minimum,
}  # fmt: skip
#: Arguments of the functions that are known here.
ARGUMENTS = {"int32": 1, "int64": 1, "uint16": 1, "max": 2, "min": 2, "bitshift": 2}
#: Bits that a shift moves by at most, and the largest exponent.
MOST_BITS = 64
#: Functions that bring the inputs into columns, and the results into the inputs' shape.
SAME = frozenset({"codes_of", "column_of", "reshape"})


@dataclass(frozen=True, slots=True)
class Value:
    """Numbers of a class: Python's integers, or truth values of class logical."""

    kind: str
    data: np.ndarray

    @property
    def is_scalar(self) -> bool:
        """True for one number."""
        return self.data.size == 1


@dataclass(slots=True, kw_only=True)
class Evaluator:
    """One run of a function over many inputs at once."""

    source: str
    values: dict[str, Value]
    #: Operations with an integer result, and those that have a fault, each by its line.
    operations: int = 0
    faults: list[str] = field(default_factory=list)

    def run(self, body: tuple[Statement | Branch, ...]) -> None:
        """Run statements; what this evaluator does not know is an `InputError`."""
        for each in body:
            if isinstance(each, Branch):
                if bool(np.all(self._of(each.condition).data)):
                    self.run(each.body)
                continue
            if each.target == "shape":
                continue  # of the inputs, which are columns here
            value = self._of(each.value)
            self.values[each.target] = value if each.mask is None else self._with_elements(each, each.mask, value)

    def _with_elements(self, each: Statement, mask: Expression, value: Value) -> Value:
        held, where = self._named(each.target, each.line), self._of(mask)
        self._refuse_unlike(each.line, held, where)
        fits = value.kind in (held.kind, "double") and value.is_scalar and where.kind == "logical"
        if not fits:
            self._fault(each.line, f"elements of {each.target} get a {value.kind}")
        data = np.broadcast_to(held.data, where.data.shape).copy()
        data[where.data.astype(bool)] = self._one(value, each.line)
        return self._checked(Value(held.kind, data), each.line, each.target)

    def _of(self, each: Expression) -> Value:
        match each.kind:
            case "number":
                return _scalar(int(each.text))
            case "name":
                return self._named(each.text, each.line)
            case "column":
                numbers = [self._one(self._of(part), each.line) for part in each.parts]
                return Value("double", np.array(numbers, dtype=object))
            case "operator":
                return self._operation(each)
            case "call":
                return self._call(each)
        raise InputError(f"{self.source}, line {each.line}: {each.text} can't be evaluated")

    def _named(self, name: str, line: int) -> Value:
        if name not in self.values:
            raise InputError(f"{self.source}, line {line}: {name} has no value")
        return self.values[name]

    def _one(self, value: Value, line: int) -> int:
        """Return the only number of a value."""
        if not value.is_scalar:
            raise InputError(f"{self.source}, line {line}: {value.data.size} numbers stand where one is expected")
        return int(value.data.item())

    def _refuse_unlike(self, line: int, *values: Value) -> None:
        """Refuse arrays of two sizes in one operation."""
        if len(sizes := {value.data.size for value in values} - {1}) > 1:
            raise InputError(f"{self.source}, line {line}: arrays of {' and '.join(map(str, sorted(sizes)))} numbers")

    def _operation(self, each: Expression) -> Value:
        operands = [self._of(part) for part in each.parts]
        if len(operands) == 1:
            (only,) = operands
            if each.text == "~":
                return Value("logical", np.logical_not(only.data.astype(bool)))
            return self._checked(Value(only.kind, -only.data), each.line, "-")
        left, right = operands
        self._refuse_unlike(each.line, left, right)
        if each.text in COMPARED:
            return Value("logical", COMPARED[each.text](left.data, right.data).astype(bool))
        if each.text in JOINED:
            if (left.kind, right.kind) != ("logical", "logical"):
                self._fault(each.line, f"{each.text} of a {left.kind} and a {right.kind}")
            return Value("logical", JOINED[each.text](left.data.astype(bool), right.data.astype(bool)))
        if each.text == "^":
            return self._power(each.line, self._one(left, each.line), self._one(right, each.line))
        if each.text == "*" and not (left.is_scalar or right.is_scalar):
            self._fault(each.line, "* of two arrays")
        return self._computed(each, left, right)

    def _power(self, line: int, base: int, exponent: int) -> Value:
        if not 0 <= exponent <= MOST_BITS or abs(base) > LIMITS["double"][1]:
            raise InputError(f"{self.source}, line {line}: the power {base}^{exponent} can't be evaluated")
        power = base**exponent
        if float(power) != power:
            self._fault(line, f"{power} is no double")
        return _scalar(power)

    def _computed(self, each: Expression, left: Value, right: Value) -> Value:
        """Return a sum, product or extreme of two values."""
        self._refuse_unlike(each.line, left, right)
        if each.text not in COMPUTED:
            raise InputError(f"{self.source}, line {each.line}: {each.text} can't be evaluated")
        kinds = {left.kind, right.kind}
        integers = kinds - {"double"}
        doubles = [value for value in (left, right) if value.kind == "double"]
        if len(integers) > 1 or "logical" in kinds or (integers and not all(value.is_scalar for value in doubles)):
            self._fault(each.line, f"{each.text} of a {left.kind} and a {right.kind}")
        kind = next(iter(integers), "double")
        return self._checked(Value(kind, COMPUTED[each.text](left.data, right.data)), each.line, each.text)

    def _call(self, each: Expression) -> Value:
        wanted = ARGUMENTS.get(each.text, len(each.parts)) if each.text not in self.values else 1
        if not each.parts or len(each.parts) != wanted:
            raise InputError(f"{self.source}, line {each.line}: {each.text} has {len(each.parts)} arguments")
        if each.text in self.values:
            return self._element(each)
        if each.text in SAME:
            return self._of(each.parts[0])
        arguments = [self._of(part) for part in each.parts]
        if each.text in ("int32", "int64", "uint16"):
            data = arguments[0].data.astype(object) + 0
            return self._checked(Value(each.text, data), each.line, each.text)
        if each.text in ("max", "min"):
            return self._computed(each, *arguments)
        if each.text == "bitshift":
            held, by = arguments[0], self._one(arguments[1], each.line)
            if by < -MOST_BITS:
                raise InputError(f"{self.source}, line {each.line}: a shift by {by} bits can't be evaluated")
            if by > 0 or bool(np.any(held.data < 0)) or held.kind == "double":
                self._fault(each.line, "bitshift of a negative number, of a double, or to the left")
            self.operations += 1
            return Value(held.kind, held.data // 2**-by if by <= 0 else held.data)
        raise InputError(f"{self.source}, line {each.line}: {each.text} can't be evaluated")

    def _element(self, each: Expression) -> Value:
        held, place = self.values[each.text], self._of(each.parts[0])
        inside = (place.data >= 1) & (place.data <= held.data.size)
        if not bool(np.all(inside)):
            self._fault(each.line, f"{each.text} has no element {place.data[~inside.astype(bool)][0]}")
        index = np.where(inside, place.data, 1).astype(np.int64) - 1
        return Value(held.kind, held.data[index])

    def _checked(self, value: Value, line: int, what: str) -> Value:
        """Return a result within the limits of its class; one that is beyond them is a fault."""
        self.operations += 1
        low, high = LIMITS.get(value.kind, (0, 1))
        if value.data.size and (value.data.min() < low or value.data.max() > high):
            self._fault(line, f"{what} gives {value.data.min()} to {value.data.max()}, beyond its {value.kind}")
            return Value(value.kind, np.minimum(np.maximum(value.data, low), high))
        return value

    def _fault(self, line: int, text: str) -> None:
        self.faults.append(f"{self.source}, line {line}: {text}")


def _scalar(value: int) -> Value:
    return Value("double", np.array([value], dtype=object))
