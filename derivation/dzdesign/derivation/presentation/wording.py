"""Says what was found about a statement: its verdict, its derivation, its numbers, in sentences."""

import re
from collections.abc import Iterator, Mapping

import sympy

from dzdesign.derivation.account.proof import CaseProof, Verdict
from dzdesign.derivation.account.statement import Condition, Ground, Outcome, Statement, Value
from dzdesign.derivation.presentation.content import Derivation, Entry, Figure, Line, Premise
from dzdesign.derivation.presentation.formulas import to_text
from dzdesign.derivation.presentation.prose import Formula, Words, inline

_NUMBERED = re.compile(r"\(\d+[a-z]?\)|[TL]\d+[a-z]?")
_FORMS = ("first", "second", "third", "fourth")

Book = Mapping[str, Verdict]


def describe(verdict: Verdict, book: Book) -> Entry:
    """Say what was found about a statement; `book` is the whole account, by number."""
    statement = verdict.statement
    # Members that differ in the order of their terms only look alike.
    sides = (statement.symbol, *{to_text(member): member for member in statement.members}.values())
    see = [number for number in statement.see if number in book and number != statement.corrected_by]
    return Entry(
        number=statement.number,
        title=Words(statement.title),
        kind=statement.kind,
        section=statement.section,
        statement=Formula(*sides),
        premises=tuple(Premise(number=one.number, words=Words(_ground(one, book))) for one in statement.grounds),
        outcome=verdict.outcome,
        as_expected=verdict.as_expected,
        judgement=Words(" ".join(_sentences(verdict, book))),
        rearranges=statement.rearranges,
        necessary=verdict.necessary,
        scope=Words(_scope(statement)),
        derivations=tuple(_derivation(proof, statement, book) for proof in verdict.proofs),
        differences=tuple(_differences(verdict, book)),
        corrected_by=statement.corrected_by,
        see=tuple(see),
        figures=tuple(_figure(value, statement) for value in statement.values),
        note=Words(statement.note),
    )


def refer(number: str, book: Book) -> str:
    """Refer to a statement; what has no number of its own is named by what it is."""
    if _NUMBERED.fullmatch(number):
        return number
    statement = book[number].statement
    kind = statement.kind.value if statement.kind.is_given else "equation"
    name = f"of ${number}$" if number == str(statement.symbol) else f'"{number}"'
    return f"[[{number}|the {kind} {name}]]"


def _ground(ground: Ground, book: Book) -> str:
    """Refer to a ground, with what replaces its symbols."""
    parts = (one if isinstance(one, str) else inline(one) for one in ground.qualified())
    return " ".join((refer(ground.number, book), *parts))


def _sentences(verdict: Verdict, book: Book) -> Iterator[str]:
    statement = verdict.statement
    if verdict.necessary is not None and statement.condition is not None:
        yield _condition(verdict, statement.condition)
    elif statement.positive_if is not None and verdict.outcome is Outcome.FOLLOWS:
        yield f"Follows, and is positive exactly if {inline(statement.positive_if)}."
    elif verdict.words not in (verdict.outcome.value, statement.kind.value) and not verdict.inherited:
        yield f"{verdict.words[0].upper()}{verdict.words[1:]}."
    if verdict.inherited:
        yield f"Rests on the condition of {', '.join(refer(number, book) for number in verdict.inherited)}."
    if verdict.unit_error:
        yield f"Its units do not agree: {verdict.unit_error}."
    if not verdict.as_expected:
        yield f"A correct account finds otherwise: {statement.expected.value}."


def _scope(statement: Statement) -> str:
    """Say where a statement is proved, if not everywhere."""
    limits = [setting.words for setting in statement.scope.settings]
    limits += map(inline, (*statement.scope.comparisons, *statement.provided))
    given = "Stated" if statement.kind.is_given else "Proved"
    return f"{given} for {' and '.join(limits)}." if limits else ""


def _condition(verdict: Verdict, condition: Condition) -> str:
    words = " or ".join(" and ".join(map(inline, every)) for every in condition.any_of)
    words += f" {condition.words}" if condition.words else ""
    if verdict.outcome is not Outcome.DOES_NOT_FOLLOW:
        return f"Follows if {words}{', and only then (proved)' if verdict.necessary else ', perhaps not only then'}."
    published = ", ".join(inline(name, _decimal(value)) for name, value in condition.ruled_out_by)
    only = "only if" if verdict.necessary else "if"
    return f"It would follow {only} {words}; the published numbers give {published}."


def _decimal(value: sympy.Expr) -> sympy.Expr:
    """Write fractions and logarithms as decimal numbers."""
    if value.is_number:
        return value if value.is_Integer else value.evalf(4)
    return value.xreplace({part: part.evalf(4) for part in value.atoms(sympy.Rational) if not part.is_Integer})


def _differences(verdict: Verdict, book: Book) -> Iterator[Line]:
    """Say what was derived minus what is published, and what the statement should read."""
    statement, condition = verdict.statement, verdict.statement.condition
    # What the condition was judged by, as a person would write it; it is the first of them.
    stated = condition.discrepancy if condition is not None and verdict.necessary is not None else None
    for proof in verdict.proofs:
        for form, value in zip(_FORMS, proof.discrepancies, strict=False):
            if value == 0:
                continue
            which = f", {form} form" if len(proof.discrepancies) > 1 else ""
            where = f", {proof.case.where}" if proof.case.where else ""
            formula = Formula(sympy.factor(value) if stated is None else stated)
            yield Line(words=Words(f"Derived minus published{which}{where}:"), formula=formula)
            stated = None
    if statement.corrected_by in book:
        corrected, by = book[statement.corrected_by].statement, refer(statement.corrected_by, book)
        if corrected.published == statement.published:  # the same claim, of something else
            yield Line(words=Words(f"What holds is {by}: {corrected.title}."))
        else:
            start = f"For {statement.corrected_for} it" if statement.corrected_for else "It"
            formula = Formula(corrected.symbol, corrected.members[-1])
            yield Line(words=Words(f"{start} should read, by {by}:"), formula=formula)


def _figure(value: Value, statement: Statement) -> Figure:
    ours = float(value.exact(statement))
    unit = "" if value.unit == "1" else f" {value.unit}"
    agrees, paper = None, ""
    if value.published:
        agrees = value.agrees(statement)
        remark = "agrees" if agrees else f"ours {100 * (ours / float(value.published) - 1):+.1f} %"
        paper = f"{value.published}{unit} ({remark})"
    return Figure(
        label=Words(value.label),
        value=ours,
        unit=value.unit,
        published=value.published,
        agrees=agrees,
        # Four digits, or all before the point if there are more.
        ours=f"{ours:.0f}{unit}" if abs(ours) >= 1000 else f"{ours:.4g}{unit}",
        paper=paper,
        remark=Words(value.remark),
    )


def _derivation(proof: CaseProof, statement: Statement, book: Book) -> Derivation:
    """Return the steps of a case: what each ground gives, what they give together, and the form stated."""
    where = proof.case.where
    if statement.cases:
        made = ", ".join(inline(*pair) for pair in proof.case.at)
        where = f"Case: {where}, that is {made}" if where else f"With {made}"
    lines = []
    for step in proof.steps:
        solved = "" if step.as_stated else f", solved for {inline(step.name)}"
        words = Words(f"From {_ground(step.ground, book)}{solved}:")
        lines.append(Line(words=words, formula=Formula(step.name, step.gives)))
    if to_text(proof.steps[-1].gives) != to_text(proof.reached) or len(proof.steps) > 1:
        lines.append(Line(words=Words("Together:"), formula=Formula(statement.symbol, proof.reached)))
    if statement.cases and not any(proof.discrepancies) and to_text(proof.published) != to_text(proof.reached):
        lines.append(Line(words=Words("In the form stated:"), formula=Formula(statement.symbol, proof.published)))
    return Derivation(where=Words(where), lines=tuple(lines))
