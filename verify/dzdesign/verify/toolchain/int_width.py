"""Whether the C computes on a target whose int has 16 bits what it computes on this PC, argued over the C's text.

Every expression is typed twice, with the int of the target and with the PC's, and has a range from its operands, those
of objects being all that their types hold. Where the two types differ and the range fits both, the values are equal.
Where it does not fit, the values agree in their low bits alone: that is right where nothing but these is used, as in
``(uint16_t)(a + b)``, and a finding where they are compared, divided, shifted down, widened or passed on. A signed sum
or product that may overflow on the target is a finding by itself, as the language does not say what it gives.
"""

import re
from collections import ChainMap
from collections.abc import Mapping
from dataclasses import dataclass

from pycparser import c_ast
from pycparser.c_generator import CGenerator
from pycparser.c_parser import CParser, ParseError

from dzdesign.core.errors import RequirementError
from dzdesign.verify.toolchain.c_integers import (
    FIXED,
    FIXED_BITS,
    HOST_INT,
    INT,
    SIZE,
    TARGET_INT,
    TARGET_LARGEST,
    Form,
    Int,
    Value,
    any_of,
    constant,
    ends_of,
    fewer,
)
from dzdesign.verify.toolchain.host_compiler import built, host_compiler, words_of

#: In place of the compiler's own headers: names of types that are known here by their widths, and the limits in use.
STANDARD = {
    "stdint.h": "".join(f"typedef int int{bits}_t, uint{bits}_t;\n" for bits in FIXED_BITS)
    + "".join(f"#define UINT{bits}_C(c) ((uint{bits}_t)c##uLL)\n#define INT{bits}_C(c) ((int{bits}_t)c##LL)\n"
              for bits in FIXED_BITS),
    "stddef.h": "typedef int size_t;\n#define NULL ((void *)0)\n#define offsetof(type, member) sizeof(type)\n",
    "string.h": "#include <stddef.h>\nvoid *memcpy(void *to, const void *from, size_t count);\n",
    "limits.h": "#define CHAR_BIT 16\n",
}  # fmt: skip
#: Words of a compiler that the language lacks.
UNKNOWN_WORDS = ("-D__interrupt=", "-D__attribute__(x)=", "-D__inline=inline", "-D__volatile__=volatile")
INCLUDED = re.compile(rb'^\s*#\s*include\s+["<]([^">]+)[">]', re.MULTILINE)
#: Of a header of the device's maker, which is not here, nothing can be demanded.
REFUSAL = re.compile(rb"#\s*error")
#: Its types: a word with a capital before a name. In a comment it does no harm. Here no number is known to be of one.
MAKERS_TYPE = re.compile(rb"\b([A-Z]\w*[a-z]\w*)\s+\**[a-z]\w*\s*[;,)=\[]")
COMPARISONS = ("<", ">", "<=", ">=", "==", "!=")
#: Characters of an expression in a sentence, and shifts that no type has.
LONGEST, FARTHEST = 60, 64


@dataclass(frozen=True, slots=True)
class Pointer:
    """Also an array."""

    to: "Typed"


@dataclass(frozen=True, slots=True)
class Record:
    """A struct or union."""

    name: str


@dataclass(frozen=True, slots=True)
class Function:
    """What is called."""

    returns: "Typed"
    parameters: "tuple[Typed, ...]"


#: None: nothing is known, as of a register in a header of the device's maker.
Typed = Int | Pointer | Record | Function | None
Known = Value | Pointer | Record | Function | None


def typed(sources: Mapping[str, bytes], name: str) -> "Widths":
    """Return one file of `sources`, typed: what in it may differ on the target, each with its line."""
    given = {each: text.encode() for each, text in STANDARD.items()}
    given |= {each: REFUSAL.sub(rb"#pragma", text) for each, text in sources.items()}
    missing = {found.decode() for text in given.values() for found in INCLUDED.findall(text)} - given.keys()
    makers = b"".join(b"typedef double %s;\n" % each for each in sorted({*MAKERS_TYPE.findall(sources[name])}))
    command = [*words_of(host_compiler()), "-E", "-nostdinc", "-I.", *UNKNOWN_WORDS, name]
    text = built(f"{name}.i", command, given | dict.fromkeys(sorted(missing), makers), name).read_text(errors="replace")
    try:
        tree = CParser().parse(text, name)
    except ParseError as error:
        raise RequirementError(f"{name} can't be read as C99: {error}") from error
    return Widths(tree)


class Widths:
    """The findings in one file, with all that it includes; and how many operations it has."""

    def __init__(self, tree: c_ast.FileAST) -> None:
        self.findings: list[str] = []
        self.operations = 0
        self._records: dict[str, dict[str, Typed]] = {}
        self._typedefs: dict[str, Typed] = {**FIXED, "size_t": SIZE}
        #: Objects and functions, and numbers that never change.
        self._names: ChainMap[str, Typed | Value] = ChainMap()
        self._returns: Typed = None
        for each in tree.ext:
            self._statement(each)

    def _found(self, node: c_ast.Node, what: str) -> None:
        text = " ".join(CGenerator().visit(node).split())
        place = f"{node.coord.file}:{node.coord.line}" if node.coord else "?"
        found = f"{place}: {text[:LONGEST]}{' ...' if len(text) > LONGEST else ''} {what}"
        if found not in self.findings:
            self.findings.append(found)

    def _needs_more(self, node: c_ast.Node, bits: int) -> None:
        self._found(node, f"is computed in {bits} bits on the target and may need more")

    # ---- types ----

    def _type(self, node: c_ast.Node) -> Typed:
        match node:
            case c_ast.PtrDecl() | c_ast.ArrayDecl():
                if isinstance(node, c_ast.ArrayDecl) and node.dim is not None:
                    self._exact(node.dim)
                return Pointer(self._type(node.type))
            case c_ast.FuncDecl():
                given = node.args.params if node.args else []
                parameters = [self._type(each.type) for each in given if not isinstance(each, c_ast.EllipsisParam)]
                return Function(self._type(node.type), tuple(parameters))
            case c_ast.Struct() | c_ast.Union():
                name = node.name or str(node.coord)
                if node.decls is not None:
                    self._records[name] = {each.name: self._object(each) for each in node.decls}
                return Record(name)
            case c_ast.Enum():
                for each in node.values.enumerators if node.values else []:
                    self._names[each.name] = INT
                return INT
            case c_ast.IdentifierType():
                return self._basic(node.names)
            case _:
                return self._type(node.type)

    def _basic(self, names: list[str]) -> Typed:
        signed = "unsigned" not in names
        if names[-1] in self._typedefs:
            return self._typedefs[names[-1]]
        if {"void", "float", "double"} & {*names}:
            return None
        bits = (8, 8) if "char" in names else (16, 16) if "short" in names else (TARGET_INT, HOST_INT)
        if "long" in names:
            bits = (64, 64) if names.count("long") == 2 else (32, 64)
        return Int(Form(bits[0], signed), Form(bits[1], signed))

    def _object(self, node: c_ast.Decl) -> Typed:
        """Return the type of an object that is declared; one whose width differs is a finding."""
        found = self._type(node.type)
        if isinstance(found, Int) and not found.is_fixed:
            bits = found.target.bits
            self._found(node, f"has {bits} bits on the target and {found.host.bits} on a PC: name its width")
        return found

    # ---- statements ----

    def _statement(self, node: c_ast.Node | None) -> None:
        match node:
            case None | c_ast.EmptyStatement() | c_ast.Break() | c_ast.Continue() | c_ast.Goto() | c_ast.Pragma():
                pass
            case c_ast.FuncDef():
                self._function(node)
            case c_ast.Typedef():
                self._typedefs[node.name] = FIXED.get(node.name) or self._typedefs.get(node.name) or self._type(node)
            case c_ast.Decl():
                self._declared(node)
            case c_ast.DeclList():
                for each in node.decls:
                    self._declared(each)
            case c_ast.Compound():
                self._names = self._names.new_child()
                for each in node.block_items or []:
                    self._statement(each)
                self._names = self._names.parents
            case c_ast.If():
                self._exact(node.cond)
                self._statement(node.iftrue)
                self._statement(node.iffalse)
            case c_ast.For():
                self._names = self._names.new_child()
                self._statement(node.init)
                if node.cond is not None:
                    self._exact(node.cond)
                self._statement(node.next)
                self._statement(node.stmt)
                self._names = self._names.parents
            case c_ast.While() | c_ast.DoWhile() | c_ast.Switch():
                self._exact(node.cond)
                self._statement(node.stmt)
            case c_ast.Case() | c_ast.Default():
                if isinstance(node, c_ast.Case):
                    self._exact(node.expr)
                for each in node.stmts or []:
                    self._statement(each)
            case c_ast.Label():
                self._statement(node.stmt)
            case c_ast.Return():
                if node.expr is not None:
                    self._stored(node.expr, self._returns)
            case _:
                self._value(node)

    def _function(self, node: c_ast.FuncDef) -> None:
        found = self._type(node.decl.type)
        self._names[node.decl.name] = found
        self._returns = found.returns if isinstance(found, Function) else None
        self._names = self._names.new_child()
        declared = node.decl.type.args
        for each in declared.params if declared else []:
            if isinstance(each, c_ast.Decl):
                self._names[each.name] = self._object(each)
        self._statement(node.body)
        self._names = self._names.parents

    def _declared(self, node: c_ast.Decl) -> None:
        found = self._type(node.type) if isinstance(node.type, c_ast.FuncDecl) else self._object(node)
        value = None if node.init is None else self._stored(node.init, found)
        constant = isinstance(value, Value) and isinstance(found, Int) and "const" in node.quals
        if node.name:
            self._names[node.name] = value if constant else found

    # ---- numbers ----

    def _exact(self, node: c_ast.Node) -> Known:
        """Return a value of which all bits are used."""
        found = self._value(node)
        if isinstance(found, Value) and found.same is not None:
            self._needs_more(node, found.same)
            return Value(found.type, found.low, found.high)
        return found

    def _stored(self, node: c_ast.Node, to: Typed) -> Known:
        """Return a value as an object of a type holds it."""
        if not isinstance(to, Int) or isinstance(node, c_ast.InitList):
            return self._exact(node)
        found = self._value(node)
        if not isinstance(found, Value):
            return any_of(to)
        stored = self._converted(node, found, to)
        if stored.same is not None:
            self._needs_more(node, stored.same)
        return stored._replace(same=None)

    def _converted(self, node: c_ast.Node, value: Value, to: Int) -> Value:
        if value.same is None and to.holds(value.low, value.high):
            return Value(to, value.low, value.high)
        if to.is_fixed:
            if value.same is not None and value.same < to.bits:
                self._needs_more(node, value.same)
            return any_of(to)
        return Value(to, *to.ends, min(to.bits, value.same or to.bits))

    def _result(self, node: c_ast.Node, of: Int, ends: tuple[int, int], same: int | None) -> Value:
        """Return the result of an operation in a type, by what it may be and the low bits of its operands."""
        if same is None and of.holds(*ends):
            return Value(of, *ends)
        if of.is_fixed:
            return any_of(of)
        leaves = [form for form in (of.target, of.host) if form.signed and not Int(form, form).holds(*ends)]
        if same is None and leaves:
            self._needs_more(node, leaves[0].bits)
            return any_of(of)
        return Value(of, *of.ends, min(of.bits, same or of.bits))

    def _value(self, node: c_ast.Node) -> Known:
        """Return what is known of an expression."""
        match node:
            case c_ast.Constant(type="char"):
                return Value(INT, 0, 127)
            case c_ast.Constant():
                return constant(node.value) if "int" in node.type else None
            case c_ast.ID():
                return _of_type(self._names.get(node.name))
            case c_ast.StructRef():
                base = self._value(node.name)
                record = base.to if isinstance(base, Pointer) else base
                members = self._records.get(record.name, {}) if isinstance(record, Record) else {}
                return _of_type(members.get(node.field.name))
            case c_ast.ArrayRef():
                base = self._value(node.name)
                self._exact(node.subscript)
                return _of_type(base.to) if isinstance(base, Pointer) else None
            case c_ast.FuncCall():
                return self._called(node)
            case c_ast.Cast():
                to, found = self._type(node.to_type), self._value(node.expr)
                if not isinstance(to, Int):
                    return _of_type(to)
                return self._converted(node.expr, found, to) if isinstance(found, Value) else any_of(to)
            case c_ast.Assignment():
                return self._assigned(node)
            case c_ast.TernaryOp():
                self._exact(node.cond)
                return self._chosen(node)
            case c_ast.UnaryOp():
                return self._unary(node)
            case c_ast.BinaryOp():
                return self._binary(node, node.op, node.left, node.right)
            case c_ast.NamedInitializer():
                return self._exact(node.expr)
            case _:
                for _, each in node.children():
                    self._exact(each)
                return None

    def _called(self, node: c_ast.FuncCall) -> Known:
        function, given = self._value(node.name), node.args.exprs if node.args else []
        parameters = function.parameters if isinstance(function, Function) else ()
        for place, each in enumerate(given):
            self._stored(each, parameters[place] if place < len(parameters) else None)
        return _of_type(function.returns) if isinstance(function, Function) else None

    def _assigned(self, node: c_ast.Assignment) -> Known:
        to = self._value(node.lvalue)
        if not isinstance(to, Value):
            return self._exact(node.rvalue) if node.op == "=" else None
        if node.op == "=":
            return self._stored(node.rvalue, to.type)
        found = self._binary(node, node.op[:-1], node.lvalue, node.rvalue)
        return self._converted(node, found, to.type) if isinstance(found, Value) else to

    def _chosen(self, node: c_ast.TernaryOp) -> Known:
        left, right = self._value(node.iftrue), self._value(node.iffalse)
        if not isinstance(left, Value) or not isinstance(right, Value):
            return left or right
        of = left.type.common(right.type)
        both = self._converted(node.iftrue, left, of), self._converted(node.iffalse, right, of)
        return Value(of, min(each.low for each in both), max(each.high for each in both), fewer(both))

    def _unary(self, node: c_ast.UnaryOp) -> Known:
        if node.op == "sizeof":
            return Value(SIZE, 0, TARGET_LARGEST)
        if node.op == "!":
            self._exact(node.expr)
            return Value(INT, 0, 1)
        found = self._value(node.expr)
        if node.op == "&":
            return Pointer(found.type if isinstance(found, Value) else found)
        if not isinstance(found, Value):
            return _of_type(found.to) if node.op == "*" and isinstance(found, Pointer) else found
        if node.op[-2:] in ("++", "--"):
            one = c_ast.Constant("int", "1", node.coord)
            return self._converted(node, self._number(self._binary(node, node.op[-1], node.expr, one)), found.type)
        of = found.type.promoted()
        taken = self._converted(node.expr, found, of)
        ends = {"-": (-taken.high, -taken.low), "~": (-1 - taken.high, -1 - taken.low)}.get(node.op, taken[1:3])
        if node.op == "~" and not of.host.signed & of.target.signed:
            return Value(of, *of.ends, None if of.is_fixed else min(of.bits, taken.same or of.bits))
        return self._result(node, of, ends, taken.same)

    @staticmethod
    def _number(found: Known) -> Value:
        return found if isinstance(found, Value) else any_of(INT)

    def _binary(self, node: c_ast.Node, op: str, left_node: c_ast.Node, right_node: c_ast.Node) -> Known:
        self.operations += 1
        if op in ("&&", "||"):
            self._exact(left_node)
            self._exact(right_node)
            return Value(INT, 0, 1)
        left, right = self._value(left_node), self._value(right_node)
        if not isinstance(left, Value) or not isinstance(right, Value):
            for each in (left_node, right_node):
                self._exact(each)
            if op in COMPARISONS:
                return Value(INT, 0, 1)
            return next((each for each in (left, right) if isinstance(each, Pointer)), None) if op in "+-" else None
        if op in ("<<", ">>"):
            return self._shifted(node, op, left_node, right_node)
        of = left.type.common(right.type)
        both = self._converted(left_node, left, of), self._converted(right_node, right, of)
        if op in COMPARISONS or op in "/%":
            for each, value in zip((left_node, right_node), both, strict=True):
                if value.same is not None:
                    self._needs_more(each, value.same)
            if op in COMPARISONS:
                return Value(INT, 0, 1)
            both = both[0]._replace(same=None), both[1]._replace(same=None)
        if op == "&":
            for mask, other in (both, both[::-1]):
                if mask.same is None and mask.low >= 0 and mask.high.bit_length() <= (other.same or FARTHEST):
                    high = mask.high if other.same or other.low < 0 else min(mask.high, other.high)
                    return Value(of, 0, high)
        return self._result(node, of, ends_of(op, *both), fewer(both))

    def _shifted(self, node: c_ast.Node, op: str, left_node: c_ast.Node, right_node: c_ast.Node) -> Known:
        left, right = self._number(self._value(left_node)), self._number(self._exact(right_node))
        of = left.type.promoted()
        taken = self._converted(left_node, left, of)
        if op == ">>" and taken.same is not None:
            self._needs_more(left_node, taken.same)
            taken = taken._replace(same=None)
        if not of.is_fixed and not (right.low >= 0 and right.high < of.bits):
            self._found(node, f"shifts a number of {of.bits} bits on the target by {of.bits} or more")
            return any_of(of)
        least, most = (min(max(end, 0), FARTHEST) for end in (right.low, right.high))
        made = [end << by if op == "<<" else end >> by for end in taken[1:3] for by in (least, most)]
        return self._result(node, of, (min(made), max(made)), taken.same)


def _of_type(found: Typed | Value) -> Known:
    return any_of(found) if isinstance(found, Int) else found
