"""The assignments of a function block or of a function for MATLAB, evaluated by NumPy as they are written.

Each expression is rewritten into the operators of Python, read by Python's own parser and evaluated in the type that is
declared, DINT or int64. Ranges are followed beside the values; where they do not fit, the values are looked at, and a
result that is none of its type is an `Overflow`. What depends on one of several inputs that broadcast against each
other is computed for that one alone.
"""

import ast
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from dzdesign.core.errors import RequirementError

COMMENT = re.compile(r"\(\*.*?\*\)", re.DOTALL)
SECTION = re.compile(r"^VAR(_INPUT|_OUTPUT| CONSTANT|)\n(.*?)^END_VAR$", re.DOTALL | re.MULTILINE)
DECLARED = re.compile(r"([\w\s,]+?)\s*:\s*(?:ARRAY\[0\.\.\d+\] OF )?(?:DINT|BOOL)(?:\s*:=\s*(.+))?", re.DOTALL)
#: Target, mask and expression of an assignment.
ASSIGNED = {
    "st": re.compile(r"(\w+)()\s*:=\s*([\w\s+\-*/()<>=,\[\]]+)"),
    "m": re.compile(r"(\w+)(?:\((~?\w+)\))?\s*=\s*([\w\s+\-.*/()<>=,;\[\]|&~^]+)"),
}
#: Of a function for MATLAB: the law stands between these lines.
FIRST, LAST = "    % ---- constants ----\n", "    compare = reshape("
Operation = Callable[..., np.ndarray]
#: Operators as Python writes them; Python binds them as both languages do.
REWRITTEN = {
    "st": {
        r"\bAND\b": "and",
        r"\bOR\b": "or",
        r"\bNOT\b": "~",
        r"\bMOD\b": "%",
        "<>": "!=",
        "(?<![<>!])=": "==",
        r"\*\*": "@",
    },
    "m": {r"\.\*": "*", r"\|": " or ", "&": " and ", r"\^": "**", ";": ","},
}  # fmt: skip
ENDS: Mapping[str, Any] = {"st": np.iinfo(np.int32), "m": np.iinfo(np.int64)}
OPERATIONS: Mapping[type, Operation] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.And: np.logical_and, ast.Or: np.logical_or,
    ast.Lt: np.less, ast.Gt: np.greater, ast.LtE: np.less_equal, ast.GtE: np.greater_equal, ast.Eq: np.equal,
    ast.NotEq: np.not_equal,
}  # fmt: skip


class Overflow(RequirementError):
    """A result that its type does not hold, an index outside of its table, or a division by no positive number."""


class Value(NamedTuple):
    """Numbers and the ends of their range; conditions, whose ends say nothing."""

    data: np.ndarray
    low: int = 0
    high: int = 1

    def looked_at(self) -> "Value":
        """Return the same with the ends of these values."""
        return Value(self.data, int(self.data.min()), int(self.data.max()))


class TextValues:
    """One text, ready to be evaluated; one that is more than assignments is a `RequirementError`."""

    def __init__(self, text: str, language: str, name: str) -> None:
        self.name, self.ends = name, ENDS[language]
        self.kind = self.ends.dtype
        #: Constants, and the first value of what is remembered.
        self.known: dict[str, Value] = {}
        self.first: dict[str, str] = {}
        self.lines: list[tuple[int, str, ast.expr | None, ast.expr]] = []
        for line, statement in (self._of_block if language == "st" else self._of_function)(text):
            found = ASSIGNED[language].fullmatch(statement)
            if found is None:
                raise RequirementError(f"{name}, line {line}: no assignment: {statement[:60]}")
            target, mask, expression = found.groups()
            for old, new in REWRITTEN[language].items():
                expression = re.sub(old, new, expression)
            try:
                self.lines.append((line, target, _parsed(mask) if mask else None, _parsed(expression)))
            except SyntaxError as error:
                raise RequirementError(f"{name}, line {line}: no expression: {statement[:60]}") from error

    def _of_block(self, text: str) -> Iterator[tuple[int, str]]:
        text = COMMENT.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
        for section in SECTION.finditer(text):
            for entry in filter(None, map(str.strip, section[2].split(";"))):
                found = DECLARED.fullmatch(entry)
                if found is None:
                    raise RequirementError(f"{self.name}: no declaration: {entry[:60]}")
                if section[1] == " CONSTANT":
                    data = np.array(ast.literal_eval(found[2].strip()), dtype=np.int64)
                    self.known[found[1]] = self._fits(data)
                elif found[2]:
                    self.first[found[1]] = found[2]
        begins = text.rindex("END_VAR\n") + len("END_VAR\n")
        for found in re.finditer(r"[^;]*;", text[begins:]):
            statement = found[0].lstrip()
            yield text.count("\n", 0, begins + found.end() - len(statement)) + 1, statement[:-1].rstrip()
        if text[begins:].rpartition(";")[2].strip() != "END_FUNCTION_BLOCK":
            raise RequirementError(f"{self.name} does not end with its last statement")

    def _of_function(self, text: str) -> Iterator[tuple[int, str]]:
        first, last = text.find(FIRST) + len(FIRST), text.find(LAST)
        if not len(FIRST) <= first < last:
            raise RequirementError(f"{self.name}: the law does not stand where it is generated")
        statement = ""
        for line, row in enumerate(text[first:last].splitlines(), text.count("\n", 0, first) + 1):
            statement += row.partition("%")[0].strip()
            if statement.endswith("..."):
                statement = statement[:-3]
            elif statement:
                yield line, statement.removesuffix(";")
                statement = ""

    def run(self, given: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the values of all names after the assignments."""
        known = self.known | {name: Value(data).looked_at() for name, data in given.items()}
        for line, target, mask, expression in self.lines:
            try:
                value = self._of(expression, known)
                known[target] = self._chosen(self._of(mask, known), value, known[target]) if mask else value
            except Overflow as error:
                raise Overflow(f"{self.name}, line {line}: {target}: {error}") from error
            except (KeyError, TypeError, AttributeError) as error:
                raise RequirementError(f"{self.name}, line {line}: {target} can't be evaluated: {error}") from error
        return {name: value.data for name, value in known.items()}

    def _fits(self, exact: np.ndarray) -> Value:
        value = Value(exact).looked_at()
        if value.low < self.ends.min or value.high > self.ends.max:
            raise Overflow(f"a value goes from {value.low} to {value.high}, beyond {self.ends.bits} bits")
        return value._replace(data=exact.astype(self.kind))

    def _number(self, value: int) -> Value:
        return Value(np.array(value, dtype=self.kind), value, value)

    def _of(self, node: ast.expr, known: Mapping[str, Value]) -> Value:
        match node:
            case ast.Constant(value=int(number)):
                return self._number(number)
            case ast.Name(id=name):
                return known[name]
            case ast.List(elts=elements):
                return Value(np.array([self._of(each, known).data for each in elements])).looked_at()
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self._arithmetic(np.subtract, self._number(0), self._of(operand, known))
            case ast.UnaryOp(op=ast.Invert(), operand=operand):
                return Value(~_alike(True, self._of(operand, known))[0])
            case ast.BoolOp(op=operator, values=operands):
                found = _alike(True, *(self._of(each, known) for each in operands))
                for each in found[1:]:
                    found[0] = OPERATIONS[type(operator)](found[0], each)
                return Value(found[0])
            case ast.Compare(left=left, ops=[operator], comparators=[right]):
                return Value(OPERATIONS[type(operator)](*_alike(False, self._of(left, known), self._of(right, known))))
            case ast.BinOp(left=ast.Constant(value=2), op=ast.Pow(), right=ast.Constant(value=int(power))):
                return self._number(1 << power)
            case ast.BinOp(left=left, op=operator, right=right):
                x, y = self._of(left, known), self._of(right, known)
                _alike(False, x, y)
                if isinstance(operator, ast.Div | ast.Mod) and self.ends.bits == 32:
                    return self._divided(x, y, rest=isinstance(operator, ast.Mod))
                return self._arithmetic(OPERATIONS[type(operator)], x, y)
            case ast.Subscript(value=ast.Name(id=name), slice=index):
                return self._element(known[name], self._of(index, known), 0)
            case ast.Call(func=ast.Name(id=name), args=arguments):
                parts = [self._of(each, known) for each in arguments]
                return self._element(known[name], parts[0], 1) if name in known else self._call(name, *parts)
        raise TypeError(f"{ast.unparse(node)[:60]} is no operation of the law's text")

    def _call(self, name: str, x: Value, *others: Value) -> Value:
        match name, others:
            case (("MIN" | "min" | "MAX" | "max"), [y]):
                data, of = (np.minimum, min) if name.lower() == "min" else (np.maximum, max)
                return Value(data(*_alike(False, x, y)), of(x.low, y.low), of(x.high, y.high))
            case "SEL", [no, yes]:
                return self._chosen(x, yes, no)
            case (("BOOL_TO_DINT" | "int64"), []):
                return x._replace(data=x.data.astype(self.kind))
            case "bitshift", [shift] if shift.low == shift.high < 0 <= x.looked_at().low:
                return Value(x.data >> -shift.low, max(x.low, 0) >> -shift.low, x.high >> -shift.low)
        raise TypeError(f"{name} is no function of the law's text, or not of these operands")

    def _chosen(self, condition: Value, yes: Value, no: Value) -> Value:
        _alike(yes.data.dtype == bool, yes, no)
        data = np.where(_alike(True, condition)[0], yes.data, no.data)
        return Value(data, min(yes.low, no.low), max(yes.high, no.high))

    def _arithmetic(self, operation: Operation, x: Value, y: Value) -> Value:
        for first, second in ((x, y), (x.looked_at(), y.looked_at())):
            ends = [operation(np.array(a, dtype=object), b) for a in first[1:] for b in second[1:]]
            if self.ends.min <= min(ends) <= max(ends) <= self.ends.max:
                return Value(operation(x.data, y.data), int(min(ends)), int(max(ends)))
        # The operands' ends do not meet, or the result is none of the type: exactly, which takes longer.
        wide = np.dtype(np.int64 if self.ends.bits == 32 else object)
        return self._fits(operation(x.data.astype(wide), y.data.astype(wide)))

    def _divided(self, x: Value, y: Value, *, rest: bool) -> Value:
        """Return a quotient rounded towards zero, or what it leaves; of a power of two by shifts, which are quicker."""
        if y.low <= 0:
            raise Overflow(f"a division by {y.low}")
        if y.low == y.high == y.low & -y.low:
            lifted = (
                x.data if x.low >= 0 else x.data + ((x.data >> self.ends.bits - 1) & np.array(y.low - 1, self.kind))
            )
            quotient = lifted >> y.low.bit_length() - 1
        else:
            size = np.abs(x.data.astype(np.int64)) // y.data
            quotient = (size if x.low >= 0 else np.where(x.data < 0, -size, size)).astype(self.kind)
        if rest:
            return Value(x.data - quotient * y.data, max(min(x.low, 0), 1 - y.high), min(max(x.high, 0), y.high - 1))
        return Value(quotient, min(-(-x.low // y.low), x.low // y.high), max(x.high // y.low, -(-x.high // y.high)))

    def _element(self, table: Value, index: Value, first: int) -> Value:
        if not first <= index.low <= index.high < first + table.data.size:
            index = index.looked_at()
        if not first <= index.low <= index.high < first + table.data.size:
            raise Overflow(f"an index goes from {index.low} to {index.high} in a table of {table.data.size}")
        return Value(table.data[index.data - first], table.low, table.high)


def _parsed(text: str) -> ast.expr:
    return ast.parse(" ".join(text.split()), mode="eval").body


def _alike(boolean: bool, *values: Value) -> list[np.ndarray]:
    """Return the data of values that must all be conditions, or all be numbers."""
    if any((each.data.dtype == bool) is not boolean for each in values):
        raise TypeError("a number stands where a condition is expected, or the other way round")
    return [each.data for each in values]
