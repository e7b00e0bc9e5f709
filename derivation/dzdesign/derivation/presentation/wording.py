"""Says what was found about a statement: its verdict, its derivation, its numbers, in sentences."""

import re
from collections.abc import Iterator, Mapping

import sympy

from dzdesign.derivation.account.proof import CaseProof, Verdict
from dzdesign.derivation.account.solving import Step
from dzdesign.derivation.account.statement import Condition, Ground, Outcome, Statement, Value
from dzdesign.derivation.presentation.content import Derivation, Entry, Figure, Line, Premise
from dzdesign.derivation.presentation.formulas import to_text
from dzdesign.derivation.presentation.prose import Formula, Part, Reference, Words, parse_prose

_NUMBERED = re.compile(r"\(\d+[a-z]?\)|[TL]\d+[a-z]?")
_FORMS = ("first", "second", "third", "fourth")


def describe(verdict: Verdict, book: Mapping[str, Verdict]) -> Entry:
    """Say what was found about a statement; `book` is the whole account, by number."""
    statement, condition = verdict.statement, verdict.statement.condition
    # Members that differ in the order of their terms only look alike.
    sides = (statement.symbol, *{to_text(member): member for member in statement.members}.values())
    corrected = book.get(statement.corrected_by)
    see = [number for number in statement.see if number in book and number != statement.corrected_by]
    return Entry(
        number=statement.number,
        title=parse_prose(statement.title, book),
        kind=statement.kind,
        section=statement.section,
        statement=Formula(*sides),
        premises=tuple(_premise(ground, book) for ground in statement.grounds),
        outcome=verdict.outcome,
        expected=statement.expected,
        as_expected=verdict.as_expected,
        holds=verdict.holds,
        verdict=verdict.words,
        judgement=Words.join(_sentences(verdict, book), " "),
        rearranges=statement.rearranges,
        any_of=tuple(tuple(map(Formula, alternative)) for alternative in condition.any_of) if condition else (),
        ruled_out_by=tuple(Formula(*pair) for pair in condition.ruled_out_by) if condition else (),
        necessary=verdict.necessary,
        positive_if=None if statement.positive_if is None else Formula(statement.positive_if),
        provided=tuple(map(Formula, statement.provided)),
        scope=Words.join(_scope(verdict, book), " "),
        limited_by=verdict.limited_by,
        inherited=verdict.inherited,
        unit_error=verdict.unit_error,
        derivations=tuple(_derivation(proof, statement, book) for proof in verdict.proofs),
        differences=tuple(_differences(verdict, book)),
        corrections=(_correction(statement, corrected.statement, book),) if corrected else (),
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
    return Reference(number, f"the {kind} “", parse_prose(number), "”")


def _refer_to_all(numbers: tuple[str, ...], book: Mapping[str, Verdict]) -> Words:
    return Words.join(refer(book[number].statement) for number in numbers)


def _ground(ground: Ground, book: Mapping[str, Verdict]) -> Words:
    parts = (one if isinstance(one, str) else _formula(one) for one in ground.qualified())
    return Words.join((refer(book[ground.number].statement), *parts), " ")


def _formula(comparison: sympy.Basic) -> Formula:
    """Return a formula; an equation as its two sides."""
    return Formula(*comparison.args) if isinstance(comparison, sympy.Eq) else Formula(comparison)


def _premise(ground: Ground, book: Mapping[str, Verdict]) -> Premise:
    """Refer to a ground, with what replaces its symbols."""
    return Premise(number=ground.number, at=tuple(Formula(*pair) for pair in ground.at), words=_ground(ground, book))


def _sentences(verdict: Verdict, book: Mapping[str, Verdict]) -> Iterator[Words]:
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


def _scope(verdict: Verdict, book: Mapping[str, Verdict]) -> Iterator[Words]:
    """Say where a statement is proved, if not everywhere."""
    statement = verdict.statement
    limits: list[Part] = [parse_prose(setting.words, book) for setting in statement.scope.settings]
    limits += map(_formula, (*statement.scope.comparisons, *statement.provided))
    if limits:
        given = "Stated" if statement.kind.is_given else "Proved"
        yield Words(f"{given} for ", Words.join(limits, " and "), ".")
    if verdict.limited_by:
        yield Words("As far as is proved of ", _refer_to_all(verdict.limited_by, book), ".")


def _condition(verdict: Verdict, condition: Condition) -> Words:
    alternatives = (Words.join((Formula(*one.args) for one in every), " and ") for every in condition.any_of)
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


def _differences(verdict: Verdict, book: Mapping[str, Verdict]) -> Iterator[Line]:
    condition = verdict.statement.condition
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


def _correction(statement: Statement, corrected: Statement, book: Mapping[str, Verdict]) -> Line:
    """Say what a statement should read."""
    if corrected.published == statement.published:  # the same claim, of something else
        return Line(words=Words("What holds is ", refer(corrected), ": ", parse_prose(corrected.title, book), "."))
    formula = Formula(corrected.symbol, corrected.members[-1])
    start = f"For {statement.corrected_for} it" if statement.corrected_for else "It"
    return Line(words=Words(start, " should read, by ", refer(corrected), ":"), formula=formula)


def _figure(value: Value, statement: Statement, book: Mapping[str, Verdict]) -> Figure:
    exact = value.exact(statement)
    unit = "" if value.unit == "1" else f" {value.unit}"
    agrees, paper = None, ""
    if value.published:
        agrees = value.agrees(statement)
        deviation = float(exact / sympy.Rational(value.published) - 1)
        remark = "agrees" if agrees else f"ours {100 * deviation:+.1f} %".replace("-", "−")
        paper = f"{value.published}{unit} ({remark})"
    return Figure(
        label=parse_prose(value.label, book),
        exact=Formula(exact),
        value=float(exact),
        unit=value.unit,
        published=value.published,
        agrees=agrees,
        ours=f"{_significant(float(exact))}{unit}",
        paper=paper,
        remark=parse_prose(value.remark, book),
    )


def _significant(number: float) -> str:
    """Write a number with four digits, or all digits before the point if there are more."""
    return f"{number:.0f}" if abs(number) >= 1000 else f"{number:.4g}"


# --- a derivation -------------------------------------------------------------------------------------------


def _derivation(proof: CaseProof, statement: Statement, book: Mapping[str, Verdict]) -> Derivation:
    symbol, cases = statement.symbol, statement.cases
    where = parse_prose(proof.case.where, book)
    if cases:
        made = Words.join(Formula(*pair) for pair in proof.case.at)
        where = Words("Case: ", where, ", that is ", made) if where else Words("With ", made)
    lines = [Line(words=_step(step, book), formula=Formula(step.name, step.gives)) for step in proof.steps]
    if to_text(proof.steps[-1].gives) != to_text(proof.reached) or len(proof.steps) > 1:
        lines.append(Line(words=Words("Together:"), formula=Formula(symbol, proof.reached)))
    if cases and not any(proof.discrepancies) and to_text(proof.published) != to_text(proof.reached):
        lines.append(Line(words=Words("In the form stated:"), formula=Formula(symbol, proof.published)))
    return Derivation(
        where=where,
        derived=Formula(proof.derived),
        discrepancies=tuple(Formula(sympy.factor(value)) for value in proof.discrepancies),
        lines=tuple(lines),
    )


def _step(step: Step, book: Mapping[str, Verdict]) -> Words:
    """Say from which ground a step comes, and for what it was solved if it does not stand there."""
    solved: tuple[Part, ...] = () if step.as_stated else (", solved for ", Formula(step.name))
    return Words("From ", _ground(step.ground, book), *solved, ":")
