"""The assignments of a function block, evaluated by NumPy as they are written.

Each expression is rewritten into the operators of Python, read by Python's own parser and evaluated in 64 bits, which
hold every sum and product of two DINT; a result that is no DINT is an `Overflow`. What depends on one of several inputs
that broadcast against each other is computed for that one alone.
"""

import ast
import re
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from dzdesign.core.errors import RequirementError

COMMENT = re.compile(r"\(\*.*?\*\)", re.DOTALL)
SECTION = re.compile(r"^VAR(_INPUT|_OUTPUT| CONSTANT|)\n(.*?)^END_VAR$", re.DOTALL | re.MULTILINE)
DECLARED = re.compile(r"([\w\s,]+?)\s*:\s*(?:ARRAY\[0\.\.\d+\] OF )?(?:DINT|BOOL)(?:\s*:=\s*(.+))?", re.DOTALL)
ASSIGNED = re.compile(r"(\w+)\s*:=\s*([\w\s+\-*/()<>=,\[\]]+)")
#: Operators as Python writes them; Python binds them as Structured Text does.
REWRITTEN = {
    r"\bAND\b": "and", r"\bOR\b": "or", r"\bNOT\b": "~", r"\bMOD\b": "%", "<>": "!=", "(?<![<>!])=": "==", r"\*\*": "@",
}  # fmt: skip
DINT = np.iinfo(np.int32)
ARITHMETIC: Mapping[type, Callable[..., np.ndarray]] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply,
}  # fmt: skip
EXTREMES: Mapping[str, Callable[..., np.ndarray]] = {"MIN": np.minimum, "MAX": np.maximum}
CONDITIONS: Mapping[type, Callable[..., np.ndarray]] = {
    ast.And: np.logical_and, ast.Or: np.logical_or, ast.Lt: np.less, ast.Gt: np.greater, ast.LtE: np.less_equal,
    ast.GtE: np.greater_equal, ast.Eq: np.equal, ast.NotEq: np.not_equal,
}  # fmt: skip


class Overflow(RequirementError):
    """A result that is no DINT, an index outside of its table, or a division by no positive number."""


class TextValues:
    """One text, ready to be evaluated; one that is more than assignments is a `RequirementError`."""

    def __init__(self, text: str, name: str) -> None:
        self.name = name
        #: Constants, and the first value of what is remembered.
        self.known: dict[str, np.ndarray] = {}
        self.first: dict[str, str] = {}
        self.lines: list[tuple[int, str, ast.expr]] = []
        for line, statement in self._statements(text):
            found = ASSIGNED.fullmatch(statement)
            if found is None:
                raise RequirementError(f"{name}, line {line}: no assignment: {statement[:60]}")
            target, expression = found.groups()
            for old, new in REWRITTEN.items():
                expression = re.sub(old, new, expression)
            try:
                self.lines.append((line, target, ast.parse(" ".join(expression.split()), mode="eval").body))
            except SyntaxError as error:
                raise RequirementError(f"{name}, line {line}: no expression: {statement[:60]}") from error

    def _statements(self, text: str) -> Iterator[tuple[int, str]]:
        text = COMMENT.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
        for section in SECTION.finditer(text):
            for entry in filter(None, map(str.strip, section[2].split(";"))):
                found = DECLARED.fullmatch(entry)
                if found is None:
                    raise RequirementError(f"{self.name}: no declaration: {entry[:60]}")
                if section[1] == " CONSTANT":
                    self.known[found[1]] = _dint(np.array(ast.literal_eval(found[2].strip()), dtype=np.int64))
                elif found[2]:
                    self.first[found[1]] = found[2]
        begins = text.rindex("END_VAR\n") + len("END_VAR\n")
        for found in re.finditer(r"[^;]*;", text[begins:]):
            statement = found[0].lstrip()
            yield text.count("\n", 0, begins + found.end() - len(statement)) + 1, statement[:-1].rstrip()
        if text[begins:].rpartition(";")[2].strip() != "END_FUNCTION_BLOCK":
            raise RequirementError(f"{self.name} does not end with its last statement")

    def run(self, given: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the values of all names after the assignments."""
        known = {**self.known, **given}
        for line, target, expression in self.lines:
            try:
                known[target] = _value(expression, known)
            except Overflow as error:
                raise Overflow(f"{self.name}, line {line}: {target}: {error}") from error
            except (KeyError, TypeError, AttributeError) as error:
                raise RequirementError(f"{self.name}, line {line}: {target} can't be evaluated: {error}") from error
        return known


def _value(node: ast.expr, known: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return what an expression comes to: whole numbers, or conditions."""
    match node:
        case ast.Constant(value=int(number)):
            return np.array(number, dtype=np.int64)
        case ast.Name(id=name):
            return known[name]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return _dint(-_numbers(_value(operand, known)))
        case ast.UnaryOp(op=ast.Invert(), operand=operand):
            return ~_conditions(_value(operand, known))
        case ast.BoolOp(op=operator, values=operands):
            found = [_conditions(_value(each, known)) for each in operands]
            for each in found[1:]:
                found[0] = CONDITIONS[type(operator)](found[0], each)
            return found[0]
        case ast.Compare(left=left, ops=[operator], comparators=[right]):
            return CONDITIONS[type(operator)](*(_numbers(_value(each, known)) for each in (left, right)))
        case ast.BinOp(left=left, op=operator, right=right):
            x, y = (_numbers(_value(each, known)) for each in (left, right))
            if isinstance(operator, ast.Div | ast.Mod):
                return _divided(x, y, rest=isinstance(operator, ast.Mod))
            return _dint(ARITHMETIC[type(operator)](x, y))
        case ast.Subscript(value=ast.Name(id=name), slice=index):
            return _element(known[name], _numbers(_value(index, known)))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return _called(name, *(_value(each, known) for each in arguments))
    raise TypeError(f"{ast.unparse(node)[:60]} is no operation of the law's text")


def _called(name: str, x: np.ndarray, *others: np.ndarray) -> np.ndarray:
    match name, others:
        case ("MIN" | "MAX"), [y]:
            return EXTREMES[name](_numbers(x), _numbers(y))
        case "SEL", [no, yes] if no.dtype == yes.dtype:
            return np.where(_conditions(x), yes, no)
        case "BOOL_TO_DINT", []:
            return _conditions(x).astype(np.int64)
    raise TypeError(f"{name} is no function of the law's text, or not of these operands")


def _dint(values: np.ndarray) -> np.ndarray:
    low, high = int(values.min()), int(values.max())
    if low < DINT.min or high > DINT.max:
        raise Overflow(f"a value goes from {low} to {high}, beyond {DINT.bits} bits")
    return values


def _divided(x: np.ndarray, y: np.ndarray, *, rest: bool) -> np.ndarray:
    """Return a quotient rounded towards zero, or what it leaves, with the sign of what is divided."""
    if y.min() <= 0:
        raise Overflow(f"a division by {y.min()}")
    size = np.abs(x) // y
    quotient = np.where(x < 0, -size, size)
    found: np.ndarray = x - quotient * y if rest else quotient
    return found


def _element(table: np.ndarray, index: np.ndarray) -> np.ndarray:
    if index.min() < 0 or index.max() >= table.size:
        raise Overflow(f"an index goes from {index.min()} to {index.max()} in a table of {table.size}")
    elements: np.ndarray = table[index]
    return elements


def _numbers(values: np.ndarray) -> np.ndarray:
    if values.dtype == bool:
        raise TypeError("a condition stands where a number is expected")
    return values


def _conditions(values: np.ndarray) -> np.ndarray:
    if values.dtype != bool:
        raise TypeError("a number stands where a condition is expected")
    return values
