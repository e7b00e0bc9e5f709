"""The report for machines: JSON whose formulas SymPy reads back."""

import keyword
from functools import cache

import sympy
from sympy.core.function import AppliedUndef
from sympy.printing.str import StrPrinter

from dzdesign.core.artefact_types import THIS_TOOL, to_json_bytes
from dzdesign.derivation import symbols
from dzdesign.derivation.account.statement import Condition, Ground, Replacements, Statement, Value
from dzdesign.derivation.presentation.content import Content, Derivation, Entry
from dzdesign.derivation.presentation.derivation_file import (
    CaseRow,
    ConditionRow,
    DerivationFile,
    GroundRow,
    StatementRow,
    StepRow,
    SymbolRow,
    ValueRow,
)
from dzdesign.derivation.presentation.formulas import to_latex
from dzdesign.derivation.presentation.text import plain
from dzdesign.derivation.symbols import QUANTITIES, Name


def write_json(content: Content) -> str:
    """Return the report as derivation.json.

    Names that Python cannot read, such as ``u_i'``, are replaced by identifiers; ``symbols`` lists them all.

    Parameters
    ----------
    content : Content

    Returns
    -------
    str
    """
    document = DerivationFile(
        tool=THIS_TOOL,
        made_from=(),
        title=content.title,
        source=content.source,
        holds=all(entry.verdict.as_expected for entry in content.entries),
        summary=tuple(map(plain, content.summary)),
        symbols=_symbols(content.entries),
        statements=tuple(map(_statement, content.entries)),
    )
    return to_json_bytes(document).decode()


def _statement(entry: Entry) -> StatementRow:
    verdict, statement = entry.verdict, entry.verdict.statement
    sides = (statement.symbol, *statement.members)
    return StatementRow(
        number=statement.number,
        title=statement.title,
        kind=statement.kind.value,
        section=statement.section,
        statement=" = ".join(map(_text, sides)),
        latex=" = ".join(map(to_latex, sides)),
        premises=tuple(map(_ground, statement.grounds)),
        verdict=verdict.words,
        outcome=verdict.outcome.value,
        expected=statement.expected.value,
        as_expected=verdict.as_expected,
        holds=verdict.holds,
        cases=tuple(map(_case, entry.derivations)),
        condition=None if statement.condition is None else _condition(statement.condition),
        positive_if=None if statement.positive_if is None else _text(statement.positive_if),
        necessary=verdict.necessary,
        scope=statement.scope,
        provided=tuple(f"{_text(one.lhs)} != {_text(one.rhs)}" for one in statement.provided),
        limited_by=verdict.limited_by,
        inherited=verdict.inherited,
        unit_error=verdict.unit_error,
        corrected_by=statement.corrected_by,
        see=statement.see,
        values=tuple(_value(value, statement) for value in statement.values),
        assumptions={sign: tuple(map(_text, names)) for sign, names in entry.signs.items()},
        note=statement.note,
    )


def _value(value: Value, statement: Statement) -> ValueRow:
    exact = value.exact(statement)
    return ValueRow(
        label=value.label,
        exact=_text(exact),
        value=float(exact),
        unit=value.unit,
        published=value.published,
        agrees=value.agrees(statement) if value.published else None,
        remark=value.remark,
    )


def _ground(ground: Ground) -> GroundRow:
    return GroundRow(number=ground.number, where=ground.where, at=_replacements(ground.at))


def _case(derivation: Derivation) -> CaseRow:
    proof = derivation.proof
    return CaseRow(
        where=proof.where,
        derived=_text(proof.derived),
        discrepancies=tuple(_text(sympy.factor(value)) for value in proof.discrepancies),
        steps=tuple(
            StepRow(
                words=plain(line.words),
                used=tuple(map(_ground, step.used)),
                name=_text(step.name),
                gives=_text(step.gives),
                result=_text(step.result),
            )
            for step, line in zip(derivation.steps, derivation.lines, strict=False)  # without steps there is one line
        ),
    )


def _condition(condition: Condition) -> ConditionRow:
    return ConditionRow(
        any_of=tuple(
            tuple(f"{_text(one.lhs)} = {_text(one.rhs)}" for one in alternative) for alternative in condition.any_of
        ),
        words=condition.words,
        ruled_out_by=_replacements(condition.ruled_out_by),
    )


def _replacements(pairs: Replacements) -> dict[str, str]:
    return {_text(name): _text(value) for name, value in pairs}


# --- names --------------------------------------------------------------------------------------------------


@cache
def _python_names() -> dict[sympy.Basic, str]:
    """Return the names in `symbols.py` of what Python can't read by its own name, and of transforms: Q(s) is not Q."""
    known = {value: name for name, value in vars(symbols).items() if isinstance(value, Name)}
    functions = {value.func: name for value, name in known.items() if isinstance(value, AppliedUndef)}
    unreadable = {
        value: name
        for value, name in known.items()
        if isinstance(value, sympy.Symbol) and (not value.name.isidentifier() or keyword.iskeyword(value.name))
    }
    return functions | unreadable


class _PythonPrinter(StrPrinter):
    def _print_Symbol(self, symbol: sympy.Symbol) -> str:
        return _python_names().get(symbol, symbol.name)

    def _print_AppliedUndef(self, function: AppliedUndef) -> str:
        return f"{_function_name(function)}({self.stringify(function.args, ', ')})"


def _text(expression: sympy.Basic) -> str:
    return _PythonPrinter().doprint(expression)


def _function_name(function: AppliedUndef) -> str:
    return _python_names().get(function.func, function.func.__name__)


def _symbols(entries: tuple[Entry, ...]) -> dict[str, SymbolRow]:
    """Return what is known of every symbol, and that a name stands for a function."""
    signs = {name: sign for entry in entries for sign, names in entry.signs.items() for name in names}
    rows = {_text(name): _symbol(name, sign) for name, sign in sorted(signs.items(), key=lambda item: item[0].name)}
    members = [side for entry in entries for side in entry.chain.sides]
    functions = {function for side in members for function in side.atoms(AppliedUndef)}
    return rows | {_function_name(function): _symbol(function, "function") for function in sorted(functions, key=str)}


def _symbol(name: Name, sign: str) -> SymbolRow:
    known = QUANTITIES.get(name)
    meaning, unit = (known.meaning, known.unit) if known else ("", "")
    return SymbolRow(latex=to_latex(name), meaning=meaning, unit=unit, sign=sign)
