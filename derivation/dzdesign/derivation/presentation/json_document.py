"""The report for machines: JSON whose formulas SymPy reads back."""

import keyword
from functools import cache
from typing import Any

import sympy
from sympy.core.function import AppliedUndef

from dzdesign.core.artefact_files import TOOL, to_json
from dzdesign.derivation import symbols
from dzdesign.derivation.account.statement import Condition, Ground, Replacements
from dzdesign.derivation.account.symbol_units import unit_table
from dzdesign.derivation.presentation.content import Content, Derivation, Entry
from dzdesign.derivation.presentation.glossary import MEANINGS
from dzdesign.derivation.presentation.text import plain
from dzdesign.derivation.presentation.typeset import LATEX, typeset

SCHEMA = "dzdesign.derivation/2"


def write_json(content: Content) -> str:
    """Return the report as JSON of the schema `SCHEMA`.

    Names that Python cannot read, such as ``u_i'``, are replaced by identifiers; ``symbols`` lists them all.

    Parameters
    ----------
    content : Content

    Returns
    -------
    str
    """
    entries = [entry for _, members in content.sections for entry in members]
    document = {
        "schema": SCHEMA,
        "tool": TOOL,
        "title": content.title,
        "source": content.source,
        "holds": all(entry.verdict.as_expected for entry in entries),
        "summary": [plain(words) for words in content.summary],
        "symbols": _symbols(entries),
        "statements": [_statement(entry) for entry in entries],
    }
    return to_json(document)


def _statement(entry: Entry) -> dict[str, Any]:
    verdict, statement = entry.verdict, entry.verdict.statement
    sides = (statement.symbol, *statement.members)
    nonzero = verdict.discrepancy
    return {
        "number": statement.number,
        "title": statement.title,
        "kind": statement.kind.value,
        "section": statement.section,
        "statement": " = ".join(map(_text, sides)),
        "latex": " = ".join(typeset(side, LATEX) for side in sides),
        "premises": [_ground(ground) for ground in statement.grounds],
        "verdict": verdict.words,
        "outcome": verdict.outcome.value,
        "expected": statement.expected.value,
        "as_expected": verdict.as_expected,
        "holds": verdict.holds,
        "derived": _text(verdict.proofs[0].derived) if verdict.proofs else None,
        "discrepancy": None if nonzero is None else _text(nonzero),
        "cases": [_case(derivation) for derivation in entry.derivations],
        "steps": [step for derivation in entry.derivations for step in _steps(derivation)],
        "condition": None if statement.condition is None else _condition(statement.condition),
        "positive_if": None if statement.positive_if is None else _text(statement.positive_if),
        "necessary": verdict.necessary,
        "scope": statement.scope,
        "provided": [f"{_text(one.lhs)} != {_text(one.rhs)}" for one in statement.provided],
        "limited_by": list(verdict.limited_by),
        "inherited": list(verdict.inherited),
        "unit_error": verdict.unit_error,
        "corrected_by": statement.corrected_by,
        "see": list(statement.see),
        "values": [
            {
                "label": value.label,
                "exact": _text(value.exact(statement)),
                "value": float(value.exact(statement)),
                "unit": value.unit,
                "published": value.published,
                "agrees": value.agrees(statement) if value.published else None,
                "remark": value.remark,
            }
            for value in statement.values
        ],
        "assumptions": {sign: [_identifier(name) for name in names] for sign, names in entry.signs.items()},
        "note": statement.note,
    }


def _ground(ground: Ground) -> dict[str, Any]:
    return {"number": ground.number, "where": ground.where, "at": _replacements(ground.at)}


def _case(derivation: Derivation) -> dict[str, Any]:
    proof = derivation.proof
    return {
        "where": proof.where,
        "derived": _text(proof.derived),
        "discrepancies": [_text(sympy.factor(value)) for value in proof.discrepancies],
    }


def _steps(derivation: Derivation) -> list[dict[str, Any]]:
    return [
        {
            "case": derivation.proof.where,
            "words": plain(line.words),
            "used": [_ground(ground) for ground in step.used],
            "name": _text(step.name),
            "gives": _text(step.gives),
            "result": _text(step.result),
        }
        for step, line in zip(derivation.steps, derivation.lines, strict=False)  # without steps there is one line
    ]


def _condition(condition: Condition) -> dict[str, Any]:
    return {
        "any_of": [[f"{_text(one.lhs)} = {_text(one.rhs)}" for one in alternative] for alternative in condition.any_of],
        "words": condition.words,
        "ruled_out_by": _replacements(condition.ruled_out_by),
    }


def _replacements(pairs: Replacements) -> dict[str, str]:
    return {_text(name): _text(value) for name, value in pairs}


# --- names --------------------------------------------------------------------------------------------------


@cache
def _identifiers() -> dict[sympy.Symbol, str]:
    """Return, for the symbols whose own names Python cannot read, those under which `symbols.py` has them."""
    known = {value: name for name, value in vars(symbols).items() if isinstance(value, sympy.Symbol)}
    return {
        symbol: name
        for symbol, name in known.items()
        if not symbol.name.isidentifier() or keyword.iskeyword(symbol.name)
    }


@cache
def _functions() -> dict[str, str]:
    """Return, for the transforms, the names under which `symbols.py` has them: Q(s) is not Q, I(s) is no unit."""
    known = vars(symbols).items()
    return {value.func.__name__: name for name, value in known if isinstance(value, AppliedUndef)}


def _identifier(symbol: sympy.Symbol) -> str:
    return _identifiers().get(symbol, symbol.name)


def _function(function: AppliedUndef) -> str:
    return _functions().get(function.func.__name__, function.func.__name__)


def _text(expression: sympy.Basic) -> str:
    readable = {
        symbol: sympy.Symbol(name, **symbol.assumptions0)
        for symbol, name in _identifiers().items()
        if expression.has(symbol)
    }
    readable |= {one: sympy.Function(_function(one))(*one.args) for one in expression.atoms(AppliedUndef)}
    return sympy.sstr(expression.xreplace(readable))


def _symbols(entries: list[Entry]) -> dict[str, dict[str, str]]:
    """Return the unit and the sign of every symbol, and that a name stands for a function."""
    signs = {name: sign for entry in entries for sign, names in entry.signs.items() for name in names}
    table = {
        _identifier(name): {
            "latex": typeset(name, LATEX),
            "meaning": MEANINGS.get(name, ""),
            "unit": unit_table().get(name, ""),
            "sign": sign,
        }
        for name, sign in sorted(signs.items(), key=lambda item: item[0].name)
    }
    members = [side for entry in entries for side in (entry.verdict.statement.symbol, *entry.verdict.statement.members)]
    functions = {function for side in members for function in side.atoms(AppliedUndef)}
    for function in sorted(functions, key=str):
        table[_function(function)] = {
            "latex": typeset(function, LATEX),
            "meaning": MEANINGS.get(function, ""),
            "unit": unit_table().get(function, ""),
            "sign": "function",
        }
    return table
