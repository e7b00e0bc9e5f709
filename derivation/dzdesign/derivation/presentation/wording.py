"""Says what was found about a statement: its verdict, its derivation, its numbers, in sentences."""

import re
from collections.abc import Iterator, Mapping

import sympy

from dzdesign.derivation.account.proof import CaseProof, Verdict
from dzdesign.derivation.account.statement import Condition, Ground, Outcome, Statement, Value
from dzdesign.derivation.presentation.content import Derivation, Entry, Figure, Line, Premise
from dzdesign.derivation.presentation.formulas import to_text
from dzdesign.derivation.presentation.prose import Formula, Part, Reference, Words, parse_prose

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
        title=parse_prose(statement.title, book),
        kind=statement.kind,
        section=statement.section,
        statement=Formula(*sides),
        premises=tuple(Premise(number=one.number, words=_ground(one, book)) for one in statement.grounds),
        outcome=verdict.outcome,
        as_expected=verdict.as_expected,
        judgement=Words.join(_sentences(verdict, book), " "),
        rearranges=statement.rearranges,
        necessary=verdict.necessary,
        scope=_scope(statement, book),
        derivations=tuple(_derivation(proof, statement, book) for proof in verdict.proofs),
        differences=tuple(_differences(verdict, book)),
        corrected_by=(Reference(statement.corrected_by),) if statement.corrected_by else (),
        see=tuple(refer(book[number].statement) for number in see),
        figures=tuple(_figure(value, statement, book) for value in statement.values),
        note=parse_prose(statement.note, book),
    )


def refer(statement: Statement) -> Reference:
    """Refer to a statement; what has no number of its own is named by what it is."""
    number = statement.number
    if _NUMBERED.fullmatch(number):
        return Reference(number)
    kind = statement.kind.value if statement.kind.is_given else "equation"
    if number == str(statement.symbol):
        return Reference(number, f"the {kind} of ", parse_prose(number))
    return Reference(number, f'the {kind} "', parse_prose(number), '"')


def _refer_to_all(numbers: tuple[str, ...], book: Book) -> Words:
    return Words.join(refer(book[number].statement) for number in numbers)


def _ground(ground: Ground, book: Book) -> Words:
    """Refer to a ground, with what replaces its symbols."""
    parts = (one if isinstance(one, str) else _formula(one) for one in ground.qualified())
    return Words.join((refer(book[ground.number].statement), *parts), " ")


def _formula(comparison: sympy.Basic) -> Formula:
    """Return a formula; an equation as its two sides."""
    return Formula(*comparison.args) if isinstance(comparison, sympy.Eq) else Formula(comparison)


def _sentences(verdict: Verdict, book: Book) -> Iterator[Words]:
    statement = verdict.statement
    if verdict.necessary is not None and statement.condition is not None:
        yield _condition(verdict, statement.condition)
    elif statement.positive_if is not None and verdict.outcome is Outcome.FOLLOWS:
        yield Words("Follows, and is positive exactly if ", Formula(statement.positive_if), ".")
    elif verdict.words not in (verdict.outcome.value, statement.kind.value) and not verdict.inherited:
        yield Words(parse_prose(verdict.words[0].upper() + verdict.words[1:], book), ".")
    if verdict.inherited:
        yield Words("Rests on the condition of ", _refer_to_all(verdict.inherited, book), ".")
    if verdict.unit_error:
        yield Words(f"Its units do not agree: {verdict.unit_error}.")
    if not verdict.as_expected:
        yield Words(f"A correct account finds otherwise: {statement.expected.value}.")


def _scope(statement: Statement, book: Book) -> Words:
    """Say where a statement is proved, if not everywhere."""
    limits: list[Part] = [parse_prose(setting.words, book) for setting in statement.scope.settings]
    limits += map(_formula, (*statement.scope.comparisons, *statement.provided))
    given = "Stated" if statement.kind.is_given else "Proved"
    return Words(f"{given} for ", Words.join(limits, " and "), ".") if limits else Words()


def _condition(verdict: Verdict, condition: Condition) -> Words:
    alternatives = (Words.join(map(_formula, every), " and ") for every in condition.any_of)
    words = Words(Words.join(alternatives, " or "), " " if condition.words else "", parse_prose(condition.words))
    if verdict.outcome is not Outcome.DOES_NOT_FOLLOW:
        proved = ", and only then (proved)." if verdict.necessary else ". Whether only then is not proved."
        return Words("Follows if ", words, proved)
    published = Words.join(Formula(name, _decimal(value)) for name, value in condition.ruled_out_by)
    only = "only if " if verdict.necessary else "if "
    return Words("It would follow ", only, words, "; the published numbers give ", published, ".")


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
            where = Words(", ", parse_prose(proof.case.where, book)) if proof.case.where else ""
            formula = Formula(sympy.factor(value) if stated is None else stated)
            yield Line(words=Words("Derived minus published", which, where, ":"), formula=formula)
            stated = None
    if statement.corrected_by in book:
        yield correction(statement, book[statement.corrected_by].statement, book)


def correction(statement: Statement, corrected: Statement, book: Book) -> Line:
    """Say what a statement should read."""
    if corrected.published == statement.published:  # the same claim, of something else
        return Line(words=Words("What holds is ", refer(corrected), ": ", parse_prose(corrected.title, book), "."))
    start = f"For {statement.corrected_for} it" if statement.corrected_for else "It"
    formula = Formula(corrected.symbol, corrected.members[-1])
    return Line(words=Words(start, " should read, by ", refer(corrected), ":"), formula=formula)


def _figure(value: Value, statement: Statement, book: Book) -> Figure:
    ours = float(value.exact(statement))
    unit = "" if value.unit == "1" else f" {value.unit}"
    agrees, paper = None, ""
    if value.published:
        agrees = value.agrees(statement)
        remark = "agrees" if agrees else f"ours {100 * (ours / float(value.published) - 1):+.1f} %"
        paper = f"{value.published}{unit} ({remark})"
    return Figure(
        label=parse_prose(value.label, book),
        value=ours,
        unit=value.unit,
        published=value.published,
        agrees=agrees,
        # Four digits, or all before the point if there are more.
        ours=f"{ours:.0f}{unit}" if abs(ours) >= 1000 else f"{ours:.4g}{unit}",
        paper=paper,
        remark=parse_prose(value.remark, book),
    )


def _derivation(proof: CaseProof, statement: Statement, book: Book) -> Derivation:
    """Return the steps of a case: what each ground gives, what they give together, and the form stated."""
    where = parse_prose(proof.case.where, book)
    if statement.cases:
        made = Words.join(Formula(*pair) for pair in proof.case.at)
        where = Words("Case: ", where, ", that is ", made) if where else Words("With ", made)
    lines = []
    for step in proof.steps:
        solved: tuple[Part, ...] = () if step.as_stated else (", solved for ", Formula(step.name))
        words = Words("From ", _ground(step.ground, book), *solved, ":")
        lines.append(Line(words=words, formula=Formula(step.name, step.gives)))
    if to_text(proof.steps[-1].gives) != to_text(proof.reached) or len(proof.steps) > 1:
        lines.append(Line(words=Words("Together:"), formula=Formula(statement.symbol, proof.reached)))
    if statement.cases and not any(proof.discrepancies) and to_text(proof.published) != to_text(proof.reached):
        lines.append(Line(words=Words("In the form stated:"), formula=Formula(statement.symbol, proof.published)))
    return Derivation(where=where, lines=tuple(lines))
