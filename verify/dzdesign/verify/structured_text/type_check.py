"""Whether a function block keeps the rules of its types: then each operation has one type, which no PLC can doubt.

A whole number takes the type of what it meets, and it meets no other number: of ``30000 * 2`` each tool makes its own,
as a number by itself has the least type that holds it. DINT and UDINT meet nowhere but in a conversion that is written.
What is constant is never assigned, an input neither. No variable of VAR_TEMP is read before it was assigned, and every
output is assigned in every call: one that is not would keep its last value.
"""

from collections.abc import Sequence
from typing import NoReturn

from dzdesign.core.errors import InputError
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

#: What may be assigned.
ASSIGNED = ("VAR_OUTPUT", "VAR", "VAR_TEMP")
CONVERTED: dict[str, tuple[Kind, Kind]] = {"DINT_TO_UDINT": ("DINT", "UDINT"), "UDINT_TO_DINT": ("UDINT", "DINT")}


def check_types(block: FunctionBlock, source: str) -> dict[int, Kind]:
    """Return the type of each expression, by its ``id``; what keeps not to the rules is an `InputError`."""
    checker = _Checker(block, source)
    for variable in block.variables.values():
        checker.declared(variable)
    known = checker.statements(block.body, set())
    for output in block.of_section("VAR_OUTPUT"):
        if output.name.lower() not in known:
            checker.refuse(output.place, f"{output.name} is not assigned in every call")
    return checker.kinds


class _Checker:
    def __init__(self, block: FunctionBlock, source: str) -> None:
        self.block, self.source = block, source
        self.kinds: dict[int, Kind] = {}
        #: Variables of the loops around a statement.
        self.loops: list[str] = []

    def refuse(self, place: Place, what: str) -> NoReturn:
        raise InputError(f"{self.source}, {place}: {what}")

    def declared(self, variable: Variable) -> None:
        low, high = RANGES[variable.kind]
        if variable.section == "VAR CONSTANT" and variable.initial is None:
            self.refuse(variable.place, f"constant {variable.name} has no value")
        if variable.section not in ("VAR CONSTANT", "VAR") and variable.initial is not None:
            self.refuse(variable.place, f"{variable.name} of {variable.section} has a first value")
        if variable.bounds and variable.section not in ("VAR CONSTANT", "VAR_TEMP"):
            self.refuse(variable.place, f"{variable.name} is an array, expected that of constants and VAR_TEMP only")
        for value in variable.initial or ():
            if not low <= value <= high:
                self.refuse(variable.place, f"{value} is no {variable.kind}")

    def statements(self, body: Sequence[Statement], known: set[str]) -> set[str]:
        """Check statements; return what was assigned on every way through them, given what was before."""
        for each in body:
            match each:
                case Assignment():
                    self._assignment(each, known)
                case If():
                    known = self._if(each, known)
                case For():
                    known = self._for(each, known)
        return known

    def _assignment(self, each: Assignment, known: set[str]) -> None:
        variable = self._of(each.target)
        if variable.section not in ASSIGNED or variable.name.lower() in self.loops:
            self.refuse(each.place, f"{variable.name} may not be assigned here")
        self.expect(each.value, variable.kind, known)
        if each.target.index is not None:
            self.expect(each.target.index, "DINT", known)
            if isinstance(each.target.index, Number):
                known.add(f"{each.target.name}[{each.target.index.value}]")
        else:
            known.add(each.target.name)

    def _if(self, each: If, known: set[str]) -> set[str]:
        after = []
        for condition, body in each.branches:
            if condition is not None:
                self.expect(condition, "BOOL", known)
            after.append(self.statements(body, set(known)))
        if each.branches[-1][0] is not None:
            after.append(known)
        return set.intersection(*after)

    def _for(self, each: For, known: set[str]) -> set[str]:
        variable = self._of(each.variable)
        free = variable.section == "VAR_TEMP" and not variable.bounds and each.variable.name not in self.loops
        if variable.kind != "DINT" or not free:
            self.refuse(each.place, f"{variable.name} can't be the variable of a loop")
        self.loops.append(each.variable.name)
        after = self.statements(each.body, known | {each.variable.name})
        self.loops.pop()
        # Behind a loop its variable is another number from tool to tool.
        return (after if each.last >= each.first else known) - {each.variable.name}

    def _of(self, name: Name) -> Variable:
        variable = self.block.variables.get(name.name)
        if variable is None:
            self.refuse(name.place, f"{name.name} is not declared")
        if (variable.bounds is None) != (name.index is None):
            self.refuse(name.place, f"{variable.name} is {'no' if name.index else 'an'} array")
        return variable

    def expect(self, each: Expression, kind: Kind, known: set[str]) -> None:
        """Check an expression that must be of a type."""
        found = self.kind_of(each, kind, known)
        if found != kind:
            self.refuse(each.place, f"a {found} stands where a {kind} is expected")

    def kind_of(self, each: Expression, wanted: Kind | None, known: set[str]) -> Kind:
        """Check an expression and return its type; a whole number takes the one that is wanted, or DINT."""
        match each:
            case Number():
                kind: Kind = each.kind or (wanted if wanted and wanted != "BOOL" else "DINT")
                if each.value > RANGES[kind][1]:
                    self.refuse(each.place, f"{each.value} is no {kind}")
            case Name():
                kind = self._read(each, known)
            case Operation():
                kind = self._operation(each, wanted, known)
        self.kinds[id(each)] = kind
        return kind

    def _read(self, name: Name, known: set[str]) -> Kind:
        variable = self._of(name)
        if name.index is not None:
            self.expect(name.index, "DINT", known)
        if variable.section in ("VAR_TEMP", "VAR_OUTPUT"):
            low, high = variable.bounds or (0, -1)
            elements = {f"{name.name}[{index}]" for index in range(low, high + 1)} or {name.name}
            if not elements <= known:
                self.refuse(name.place, f"{variable.name} is read before it was assigned")
        return variable.kind

    def _operation(self, each: Operation, wanted: Kind | None, known: set[str]) -> Kind:
        operator, operands = each.operator, each.operands
        if operator in CONVERTED:
            source, result = CONVERTED[operator]
            self.expect(operands[0], source, known)
            return result
        if operator in ("AND", "OR", "NOT"):
            for operand in operands:
                self.expect(operand, "BOOL", known)
            return "BOOL"
        if all(map(_is_number, operands)) and not (operator == "NEG" and isinstance(operands[0], Number)):
            self.refuse(each.place, f"{operator} of whole numbers alone: tools differ in its type; write its result")
        if operator in ("NEG", "ABS"):
            self.expect(operands[0], "DINT", known)
            return "DINT"
        compares = operator in ("=", "<>", "<", "<=", ">", ">=")
        kind = self._common(operands, None if compares else wanted, known)
        if kind == "BOOL":
            self.refuse(each.place, f"{operator} has operands of BOOL")
        return "BOOL" if compares else kind

    def _common(self, operands: Sequence[Expression], wanted: Kind | None, known: set[str]) -> Kind:
        """Return the type of operands, of which one is more than a whole number: that of the first such."""
        kind = self.kind_of(next(each for each in operands if not _is_number(each)), wanted, known)
        for operand in operands:
            self.expect(operand, kind, known)
        return kind


def _is_number(each: Expression) -> bool:
    """Tell whether an expression is a whole number, or one negated."""
    if isinstance(each, Operation):
        return each.operator == "NEG" and _is_number(each.operands[0])
    return isinstance(each, Number) and each.kind is None
