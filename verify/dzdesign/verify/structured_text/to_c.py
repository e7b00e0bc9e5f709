"""A function block as C that counts every operation whose result is none of its type: the quick evaluator of its text.

Each number is held in 64 bits, and after each operation its range is looked at. A division rounds towards zero, and MOD
has the sign of its dividend, as IEC 61131-3 has both. An operation out of range, a division by zero and an index
outside of its array are faults; the first is kept with its place in the text.
"""

from collections.abc import Iterator, Mapping, Sequence

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

#: Place of a fault as one number.
COLUMNS = 1000
HEADER = "block.h"
#: Operators that C writes likewise, on numbers whose result needs no look; both operands are always evaluated.
SAME = {"=": "==", "<>": "!=", "<": "<", "<=": "<=", ">": ">", ">=": ">=", "AND": "&", "OR": "|"}
FUNCTIONS = """\
#include <stdint.h>

struct faults
{
    int64_t count;
    int64_t first;
};

static inline int64_t fault(struct faults *faults, int64_t place)
{
    if (faults->count++ == 0) {
        faults->first = place;
    }
    return 0;
}

static inline int64_t ranged(int64_t x, int64_t low, int64_t high, struct faults *faults, int64_t place)
{
    return (x >= low && x <= high) ? x : fault(faults, place);
}

static inline int64_t product(int64_t x, int64_t y, int64_t low, int64_t high, struct faults *faults, int64_t place)
{
    if (low == 0) { /* two numbers of 32 bits without sign: their product fits 64 bits without sign */
        const uint64_t xy = (uint64_t)x * (uint64_t)y;
        return xy <= (uint64_t)high ? (int64_t)xy : fault(faults, place);
    }
    return ranged(x * y, low, high, faults, place);
}

static inline int64_t quotient(int64_t x, int64_t y, int64_t low, int64_t high, struct faults *faults, int64_t place)
{
    return y == 0 ? fault(faults, place) : ranged(x / y, low, high, faults, place);
}

static inline int64_t rest(int64_t x, int64_t y, struct faults *faults, int64_t place)
{
    /* What is left of the least number over -1 has a quotient that is none, at which processors stop. */
    return (y == 0 || (y == -1 && x == INT32_MIN)) ? fault(faults, place) : x % y;
}

static inline int64_t least(int64_t x, int64_t y)
{
    return x < y ? x : y;
}

static inline int64_t greatest(int64_t x, int64_t y)
{
    return x > y ? x : y;
}

static inline int64_t size(int64_t x)
{
    return x < 0 ? -x : x;
}

static inline int64_t element(int64_t index, int64_t low, int64_t high, struct faults *faults, int64_t place)
{
    return (index >= low && index <= high) ? index - low : fault(faults, place);
}
"""


def block_in_c(block: FunctionBlock, kinds: Mapping[int, Kind]) -> str:
    """Return a header with ``block(inputs, state, outputs, faults)``, each an array in the order of the declarations.

    ``STATE`` and ``OUTPUTS`` are their numbers, and ``first_state`` is the state of a new instance.
    """
    printer = _Printer(block, kinds)
    return FUNCTIONS + "\n".join(printer.lines()) + "\n"


def place_of(number: int) -> Place:
    """Return the place in the text that C counts as one number."""
    return Place(*divmod(number, COLUMNS))


class _Printer:
    def __init__(self, block: FunctionBlock, kinds: Mapping[int, Kind]) -> None:
        self.block, self.kinds = block, kinds

    def lines(self) -> Iterator[str]:
        inputs, outputs, state = (self.block.of_section(name) for name in ("VAR_INPUT", "VAR_OUTPUT", "VAR"))
        yield f"\nenum {{ STATE = {len(state)}, OUTPUTS = {len(outputs)} }};\n"
        first = ", ".join(str((variable.initial or (0,))[0]) for variable in state) or "0"
        yield f"static const int64_t first_state[STATE + 1] = {{{first}}};\n"
        for variable in self.block.of_section("VAR CONSTANT"):
            yield f"static const int64_t {_declared(variable)} = {_values(variable.initial or ())};"
        yield "\nstatic void block(const int64_t *inputs, int64_t *state, int64_t *outputs, struct faults *faults)\n{"
        for section, held in (("inputs", inputs), ("state", state)):
            yield from (f"    int64_t {_c(each.name)} = {section}[{place}];" for place, each in enumerate(held))
        for variable in (*outputs, *self.block.of_section("VAR_TEMP")):
            yield f"    int64_t {_declared(variable)} = {{0}};"
        yield from self.statements(self.block.body, 1)
        for section, held in (("outputs", outputs), ("state", state)):
            yield from (f"    {section}[{place}] = {_c(each.name)};" for place, each in enumerate(held))
        yield "    (void)inputs;\n    (void)state;\n}"

    def statements(self, body: Sequence[Statement], depth: int) -> Iterator[str]:
        margin = "    " * depth
        for each in body:
            match each:
                case Assignment():
                    yield f"{margin}{self.name(each.target)} = {self.expression(each.value)};"
                case For():
                    name = _c(each.variable.name)
                    yield f"{margin}for ({name} = {each.first}; {name} <= {each.last}; {name}++) {{"
                    yield from self.statements(each.body, depth + 1)
                    yield f"{margin}}}"
                case If():
                    for place, (condition, inside) in enumerate(each.branches):
                        head = "else " if place else ""
                        head += f"if ({self.expression(condition)}) " if condition is not None else ""
                        yield f"{margin}{head}{{"
                        yield from self.statements(inside, depth + 1)
                        yield f"{margin}}}"

    def name(self, each: Name) -> str:
        if each.index is None:
            return _c(each.name)
        low, high = self.block.variables[each.name].bounds or (0, 0)
        where = f"faults, {_number(each.place)}"
        return f"{_c(each.name)}[element({self.expression(each.index)}, {low}, {high}, {where})]"

    def expression(self, each: Expression) -> str:
        match each:
            case Number():
                return f"INT64_C({each.value})"
            case Name():
                return self.name(each)
            case Operation():
                return self.operation(each)

    def operation(self, each: Operation) -> str:
        operands = [self.expression(operand) for operand in each.operands]
        where = f"faults, {_number(each.place)}"
        low, high = (f"INT64_C({end})" for end in RANGES[self.kinds[id(each)]])
        match each.operator:
            case "NOT":
                return f"(!{operands[0]})"
            case "NEG":
                return f"ranged(-{operands[0]}, {low}, {high}, {where})"
            case "ABS":
                return f"ranged(size({operands[0]}), {low}, {high}, {where})"
            case "DINT_TO_UDINT" | "UDINT_TO_DINT":
                return f"ranged({operands[0]}, {low}, {high}, {where})"
            case "MIN" | "MAX":
                name = "least" if each.operator == "MIN" else "greatest"
                return f"{name}({operands[0]}, {operands[1]})"
            case "*":
                return f"product({operands[0]}, {operands[1]}, {low}, {high}, {where})"
            case "/":
                return f"quotient({operands[0]}, {operands[1]}, {low}, {high}, {where})"
            case "MOD":
                return f"rest({operands[0]}, {operands[1]}, {where})"
            case "+" | "-":
                return f"ranged({operands[0]} {each.operator} {operands[1]}, {low}, {high}, {where})"
        return f"({operands[0]} {SAME[each.operator]} {operands[1]})"


def _c(name: str) -> str:
    """Return a name that is none of C."""
    return f"v_{name.lower()}"


def _declared(variable: Variable) -> str:
    size = f"[{variable.bounds[1] - variable.bounds[0] + 1}]" if variable.bounds else ""
    return f"{_c(variable.name)}{size}"


def _values(values: Sequence[int]) -> str:
    return "{" + ", ".join(f"INT64_C({value})" for value in values) + "}"


def _number(place: Place) -> int:
    return place.line * COLUMNS + min(place.column, COLUMNS - 1)
