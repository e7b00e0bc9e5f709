"""The C of a check of calibration blocks, carried out on words of unknown bits: every loop unrolled, no branch left."""

from collections.abc import Callable
from dataclasses import dataclass

from c_words import Terms, Unreadable, Word, Words
from pycparser import c_ast

ENTRY, CRC = "dz_calibration_check", "crc_of"
NAMES = {"uint16_t": (16, False), "uint32_t": (32, False), "uint64_t": (64, False)}


@dataclass(frozen=True, slots=True)
class Place:
    """What a pointer points at: names and numbers from the block on, and its type."""

    path: tuple[str, ...]
    kind: c_ast.Node


class Run(Words):
    """A translation unit, its functions carried out."""

    def __init__(self, unit: c_ast.FileAST, int_bits: int, long_bits: int, terms: Terms) -> None:
        super().__init__(int_bits, long_bits, terms)
        self._functions = {each.decl.name: each for each in unit.ext if isinstance(each, c_ast.FuncDef)}
        kinds = [each.type for each in unit.ext if isinstance(each, c_ast.Decl)]
        structs = [each for each in kinds if isinstance(each, c_ast.Struct)]
        self._members = {each.name: {one.name: one.type for one in each.decls} for each in structs if each.decls}

    def call(self, name: str, arguments: list[Word | Place]) -> Word:
        """Return what a function returns."""
        if name == CRC:
            return Word(32, False, self._terms.unknown("crc", 32))
        function = self._functions[name]
        parameters = function.decl.type.args.params
        variables: dict[str, Word | Place] = {}
        for parameter, value in zip(parameters, arguments, strict=True):
            variables[parameter.name] = self._stored(parameter.type, value)
        returned = self._block(function.body, variables)
        if returned is None:
            raise Unreadable(f"{name} returns nothing")
        return self._stored(function.decl.type.type, returned)  # type: ignore[return-value]

    # ---- statements: each returns what the function returns there, or None ----

    def _block(self, node: c_ast.Node, variables: dict[str, Word | Place]) -> Word | Place | None:
        for each in (node.block_items or []) if isinstance(node, c_ast.Compound) else [node]:
            returned = self._statement(each, variables)
            if returned is not None:
                return returned
        return None

    def _statement(self, node: c_ast.Node, variables: dict[str, Word | Place]) -> Word | Place | None:
        if isinstance(node, c_ast.Return):
            return self._value(node.expr, variables)
        if isinstance(node, c_ast.Decl):
            variables[node.name] = self._stored(node.type, self._value(node.init, variables))
        elif isinstance(node, c_ast.If):
            self._branch(node, variables)
        elif isinstance(node, c_ast.For):
            self._loop(node, variables)
        elif isinstance(node, c_ast.Compound):
            return self._block(node, variables)
        else:
            self._value(node, variables)
        return None

    def _branch(self, node: c_ast.If, variables: dict[str, Word | Place]) -> None:
        condition = self._value(node.cond, variables)
        yes, no = dict(variables), dict(variables)
        for branch, taken, into in ((node.iftrue, True, yes), (node.iffalse, False, no)):
            skipped = isinstance(condition.term, int) and bool(condition.term) != taken
            if branch is not None and not skipped and self._block(branch, into) is not None:
                raise Unreadable("a return in a branch")
        for name in variables:
            if isinstance(variables[name], Word):
                variables[name] = self._chosen(condition, yes[name], no[name])

    def _loop(self, node: c_ast.For, variables: dict[str, Word | Place]) -> None:
        for each in node.init.decls:
            self._statement(each, variables)
        for _ in range(1 << 17):
            going = self._value(node.cond, variables).term
            if going == 0:
                return
            if not isinstance(going, int):
                break
            self._block(node.stmt, variables)
            self._value(node.next, variables)
        raise Unreadable("a loop whose end is not known")

    # ---- expressions ----

    def _value(self, node: c_ast.Node, variables: dict[str, Word | Place]) -> Word | Place:
        kinds: dict[type, Callable[..., Word | Place]] = {
            c_ast.Constant: self._constant, c_ast.ID: lambda each, known: known[each.name],
            c_ast.BinaryOp: self._binary, c_ast.UnaryOp: self._unary, c_ast.TernaryOp: self._ternary,
            c_ast.Cast: lambda each, known: self._stored(each.to_type.type, self._value(each.expr, known)),
            c_ast.StructRef: lambda each, known: self._loaded(self._place(each, known)),
            c_ast.ArrayRef: lambda each, known: self._loaded(self._place(each, known)),
            c_ast.FuncCall: self._called, c_ast.Assignment: self._assigned,
        }  # fmt: skip
        if type(node) not in kinds:
            raise Unreadable(f"C of the form {type(node).__name__}")
        return kinds[type(node)](node, variables)

    def _constant(self, node: c_ast.Constant, _: object) -> Word:
        digits = node.value.rstrip("uUlL")
        suffix = node.value[len(digits) :].lower()
        value, signed = int(digits, 0), "u" not in suffix
        bits = self._long if "l" in suffix else self._int
        while value >= 1 << (bits - signed):
            bits *= 2
        return Word(bits, signed, value)

    def _called(self, node: c_ast.FuncCall, variables: dict[str, Word | Place]) -> Word:
        return self.call(node.name.name, [self._value(each, variables) for each in node.args.exprs])

    def _assigned(self, node: c_ast.Assignment, variables: dict[str, Word | Place]) -> Word | Place:
        value = self._value(node.rvalue, variables)
        name = node.lvalue.name
        if node.op != "=":
            value = self._operated(node.op[:-1], variables[name], value)
        old = variables[name]
        variables[name] = self._converted(value, old.bits, old.signed)
        return variables[name]

    def _unary(self, node: c_ast.UnaryOp, variables: dict[str, Word | Place]) -> Word | Place:
        if node.op == "&":
            return self._place(node.expr, variables)
        if node.op in ("p++", "p--", "++", "--"):
            old = variables[node.expr.name]
            one = Word(self._int, True, 1)
            variables[node.expr.name] = self._converted(self._operated(node.op[-1], old, one), old.bits, old.signed)
            return old
        value = self._promoted(self._value(node.expr, variables))
        if node.op == "~":
            return self._operated("^", value, Word(value.bits, value.signed, (1 << value.bits) - 1))
        if node.op == "-":
            return self._operated("-", Word(value.bits, value.signed, 0), value)
        raise Unreadable(f"the operator {node.op}")

    def _ternary(self, node: c_ast.TernaryOp, variables: dict[str, Word | Place]) -> Word:
        yes, no = (self._promoted(self._value(each, variables)) for each in (node.iftrue, node.iffalse))
        return self._chosen(self._value(node.cond, variables), *self._alike(yes, no))

    def _binary(self, node: c_ast.BinaryOp, variables: dict[str, Word | Place]) -> Word:
        left, right = (self._value(each, variables) for each in (node.left, node.right))
        return self._operated(node.op, left, right)

    # ---- places in the block ----

    def _place(self, node: c_ast.Node, variables: dict[str, Word | Place]) -> Place:
        if isinstance(node, c_ast.ID):
            return variables[node.name]
        if isinstance(node, c_ast.StructRef):
            place = self._place(node.name, variables)
            kind = self._members[place.kind.name][node.field.name]
            return Place((*place.path, node.field.name), _plain(kind))
        place, index = self._place(node.name, variables), self._value(node.subscript, variables).term
        if not isinstance(index, int) or index >= int(place.kind.dim.value.rstrip("uUlL")):
            raise Unreadable("an index beyond its table")
        return Place((*place.path, str(index)), _plain(place.kind.type))

    def _loaded(self, place: Place) -> Word | Place:
        if not isinstance(place.kind, c_ast.IdentifierType):
            return place
        bits, signed = self._kind(place.kind)
        return Word(bits, signed, self._terms.unknown("_".join(place.path), bits))

    def _kind(self, kind: c_ast.IdentifierType) -> tuple[int, bool]:
        if kind.names[0] not in NAMES:
            raise Unreadable(f"the type {' '.join(kind.names)}")
        return NAMES[kind.names[0]]

    def _stored(self, kind: c_ast.Node, value: Word | Place) -> Word | Place:
        return value if isinstance(value, Place) else self._converted(value, *self._kind(_plain(kind)))


def _plain(kind: c_ast.Node) -> c_ast.Node:
    """Return a type without what declares a name with it."""
    while isinstance(kind, c_ast.TypeDecl | c_ast.PtrDecl):
        kind = kind.type
    return kind
