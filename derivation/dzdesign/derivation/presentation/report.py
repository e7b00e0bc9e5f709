"""Renders the account of the paper for a terminal, for machines and for a browser."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence

import sympy
from sympy.core.function import AppliedUndef

from dzdesign.core.artefact_types import THIS_TOOL, to_json_bytes
from dzdesign.core.errors import InputError, RequirementError, nearest
from dzdesign.derivation.account.equations import PAPER_NUMBERS
from dzdesign.derivation.account.proof import CaseProof, Verdict
from dzdesign.derivation.account.published import PRINTED
from dzdesign.derivation.account.statement import Condition, Ground, Outcome, Statement, Value
from dzdesign.derivation.presentation.content import (
    Derivation,
    DerivationReport,
    Entry,
    Figure,
    Formula,
    Line,
    Premise,
    Term,
    Words,
    inline,
)
from dzdesign.derivation.presentation.formulas import to_python, to_text
from dzdesign.derivation.presentation.writers import write_html, write_text
from dzdesign.derivation.symbols import QUANTITIES, print_unit

_FORMATS: dict[str, Callable[[DerivationReport], str]] = {
    "text": write_text,
    "json": lambda report: to_json_bytes(report).decode(),
    "html": write_html,
}
FORMATS = tuple(_FORMATS)
#: What is known of the sign of a symbol, as SymPy calls it and as the report does; the first that holds.
_SIGNS = {"positive": "positive", "nonnegative": "zero or positive", "real": "of either sign"}
_COUNTED = {
    Outcome.GIVEN: "taken as given",
    Outcome.FOLLOWS: "follow",
    Outcome.FOLLOWS_IF: "follow on a condition",
    Outcome.DOES_NOT_FOLLOW: "do not follow",
}


def check_format(format: str) -> None:
    """Refuse a format that is none of `FORMATS`."""
    if format not in FORMATS:
        known = ", ".join(FORMATS)
        raise InputError(f"unknown format {format!r}{nearest(format, FORMATS)}: choose one of {known}")


def render(
    verdicts: Sequence[Verdict], format: str, only: Sequence[str] | None = None, misprints: Sequence[str] = ()
) -> str:
    """Render an account, or the statements `only`, as one document in one of `FORMATS`, with a newline at its end.

    ``json`` has the schema ``dzdesign.derivation/2``, ``html`` is one page without scripts that needs no network. The
    whole account may leave out no equation of the paper. `misprints` say which numbers are not the paper's.
    """
    check_format(format)
    numbers = [verdict.number for verdict in verdicts]
    missing = [number for number in PAPER_NUMBERS if number not in numbers]
    if only is None and missing:
        raise RequirementError(f"the account leaves out {', '.join(missing)} of the paper's equations")
    return _FORMATS[format](compose(verdicts, numbers if only is None else only, misprints))


def closure(statements: Sequence[Statement], wanted: Sequence[str]) -> tuple[str, ...]:
    """Return the numbers of some statements and of all that they rest on, in the order of the account.

    They are `wanted` as a person writes them: ``(18)``, ``18``, ``T3b``, ``t3b``; several in one, with commas between.

    Examples
    --------
    >>> from dzdesign.derivation.account.account import STATEMENTS
    >>> closure(STATEMENTS, ["2"])
    ('Fig. 3, line', 'K_e', '(2)')
    """
    names = {name: one.number for one in statements for name in (one.number.lower(), one.number.lower().strip("()"))}
    needed: set[str] = set()
    for text in wanted:
        # A comma may also be part of a name: Fig. 3, line.
        parts = [text] if text.strip().lower() in names else text.split(",")
        needed.update(_number(part.strip(), names) for part in parts)
    for statement in reversed(statements):
        if statement.number in needed:
            needed.update(ground.number for ground in statement.grounds)
    return tuple(statement.number for statement in statements if statement.number in needed)


def _number(text: str, names: dict[str, str]) -> str:
    if text.lower() not in names:
        near = nearest(text.lower(), names)
        for name, number in names.items():
            near = near.replace(f"'{name}'", f"'{number}'")
        raise InputError(f"no statement '{text}'{near}; give one such as 18, 6c or T3b")
    return names[text.lower()]


# --- what the report says of the whole ------------------------------------------------------------------------


def compose(verdicts: Sequence[Verdict], numbers: Sequence[str], misprints: Sequence[str] = ()) -> DerivationReport:
    """Say what the account found, of the statements to show."""
    book = {verdict.number: verdict for verdict in verdicts}
    shown = [book[number] for number in numbers]
    entries = tuple(describe(verdict, book) for verdict in shown)
    partial = len(numbers) < len(book)
    return DerivationReport(
        tool=THIS_TOOL,
        made_from=(),
        title="Derivation of the dead-zone compensation law" + (", in part" if partial else ""),
        source="The paper: Wu et al. 2022, doi 10.11916/j.issn.1005-9113.20063.",
        holds=all(entry.as_expected for entry in entries) and not misprints,
        summary=tuple(map(Words, _summary(shown, book, misprints))),
        wrong=tuple(_fault(one) for one in entries if one.outcome is Outcome.DOES_NOT_FOLLOW or one.corrected_by),
        conditional=tuple(_judged(entry) for entry in entries if entry.outcome is Outcome.FOLLOWS_IF),
        symbols=_symbols([verdict.statement for verdict in shown]),
        statements=entries,
    )


def _symbols(statements: Sequence[Statement]) -> tuple[Term, ...]:
    """Explain the symbols that occur."""
    replacements = [part.at for one in statements for parts in (one.grounds, one.cases) for part in parts]
    sides = [side for one in statements for side in (one.symbol, *one.members)]
    sides += [value for pairs in replacements for _, value in pairs]
    used = set().union(*(side.free_symbols | {part.func for part in side.atoms(AppliedUndef)} for side in sides))
    names = sorted((name for name in QUANTITIES if name in used or name.func in used), key=lambda one: str(one).lower())
    return tuple(
        Term(
            name=to_python(name).partition("(")[0],
            symbol=Formula(name),
            meaning=Words(QUANTITIES[name].meaning),
            unit=print_unit(name),
            sign=next((words for sign, words in _SIGNS.items() if getattr(name, f"is_{sign}")), ""),
        )
        for name in names
    )


def _summary(shown: Sequence[Verdict], book: Mapping[str, Verdict], misprints: Sequence[str]) -> Iterator[str]:
    wrong = [verdict for verdict in shown if not verdict.as_expected]
    yield (
        f"{len(shown) - len(wrong)} of {len(shown)} statements have the verdict expected of them, those that do not "
        f"hold included{'; these are not:' if wrong else '.'}"
    )
    for verdict in wrong:
        unit = f"; its units: {verdict.unit_error}" if verdict.unit_error else ""
        expected = verdict.statement.expected.value
        yield f'{refer(verdict.number, book)} should be found to be "{expected}", but: {verdict.words}{unit}.'
    outcomes = [verdict.outcome for verdict in shown if verdict.number in PAPER_NUMBERS]
    if outcomes:
        which = f"the {len(outcomes)} equations" if len(outcomes) > 1 else "the one equation"
        counts = "; ".join(f"{words}: {outcomes.count(outcome)}" for outcome, words in _COUNTED.items())
        yield f"Of {which} of the paper in this report, {counts}."
    follow = [one for one in shown if one.outcome in (Outcome.FOLLOWS, Outcome.FOLLOWS_IF)]
    rearranged = [one.number for one in follow if one.statement.rearranges]
    if rearranged:
        yield (
            f"{len(follow) - len(rearranged)} statements are derived; {len(rearranged)} only rearrange a definition or "
            f"one premise: {', '.join(rearranged)}."
        )
    if misprints:
        yield f"{len(misprints)} of the paper's numbers are not as it prints them: {'; '.join(misprints)}."
    elif len(shown) == len(book):
        yield f"The {len(PRINTED)} numbers of the paper stand each with its section; --paper looks them up."


def _fault(entry: Entry) -> Words:
    """Say what is wrong with a statement and what it should read; of a premise that is corrected, its note does."""
    judged = _judged(entry, otherwise=entry.note.text).text
    if not entry.corrected_by or not entry.differences:
        return Words(judged)
    line = entry.differences[-1]
    return Words(f"{judged} {line.words.text}" + (f" {inline(*line.formula.sides)}" if line.formula else ""))


def _judged(entry: Entry, otherwise: str = "") -> Words:
    return Words(f"{entry.number} {entry.title.text}: {entry.judgement.text or otherwise}")


# --- what it says of a statement ------------------------------------------------------------------------------

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
