"""Says what was found about a statement: its verdict, its derivation, its numbers, in sentences."""

import re
from collections.abc import Iterator, Mapping

import sympy

from dzdesign.derivation.account.proof import CaseProof, Verdict
from dzdesign.derivation.account.statement import Condition, Ground, Kind, Outcome, Replacements, Statement, Value
from dzdesign.derivation.account.steps import Relation, Step
from dzdesign.derivation.presentation.content import SIGNS, Derivation, Entry, Figure, Line
from dzdesign.derivation.presentation.formulas import to_text
from dzdesign.derivation.presentation.prose import Formula, Reference, Words, parse_prose

_NUMBERED = re.compile(r"\(\d+[a-z]?\)|[TL]\d[a-z]?")
_FORMS = ("first", "second", "third", "fourth")


def describe(verdict: Verdict, book: Mapping[str, Verdict]) -> Entry:
    """Say what was found about a statement.

    Parameters
    ----------
    verdict : Verdict
    book : mapping of str to Verdict
        The whole account, by number.

    Returns
    -------
    Entry
    """
    statement = verdict.statement
    return Entry(
        verdict=verdict,
        name=parse_prose(statement.number),
        title=parse_prose(statement.title, book),
        mark=_mark(verdict),
        # Members that differ in the order of their terms only look alike.
        chain=Formula((statement.symbol, *{to_text(member): member for member in statement.members}.values())),
        judgement=_judgement(verdict, book),
        scope=_scope(verdict, book),
        premises=tuple(_premise(ground, book) for ground in statement.grounds),
        derivations=tuple(_derivation(proof, index, book) for index, proof in enumerate(verdict.proofs)),
        differences=tuple(_differences(verdict, book)),
        corrections=tuple(_corrections(statement, book)),
        signs=_signs(verdict, book),
        figures=tuple(_figure(value, statement, book) for value in statement.values),
        note=parse_prose(statement.note, book),
        see=tuple(
            refer(book[number].statement)
            for number in statement.see
            if number in book and number != statement.corrected_by
        ),
    )


def _mark(verdict: Verdict) -> str:
    kind = verdict.statement.kind
    given = "our choice" if kind is Kind.CHOICE else kind.value
    return f"given: {given}" if verdict.outcome is Outcome.GIVEN else verdict.outcome.value


def refer(statement: Statement) -> Reference:
    """Refer to a statement; what has no number of its own is named by what it is.

    Parameters
    ----------
    statement : Statement

    Returns
    -------
    Reference
    """
    number = statement.number
    name = parse_prose(number)
    if _NUMBERED.fullmatch(number):
        return Reference(number, (number,))
    kind = statement.kind.value if statement.kind.is_given else "equation"
    if number == str(statement.symbol):
        return Reference(number, (f"the {kind} of ", *name))
    return Reference(number, (f"the {kind} “", *name, "”"))


def _ground(ground: Ground, book: Mapping[str, Verdict]) -> Words:
    where = parse_prose(ground.where, book)
    return (refer(book[ground.number].statement), *((" ", *where) if where else ()))


def _premise(ground: Ground, book: Mapping[str, Verdict]) -> Words:
    """Refer to a ground, with what replaces its symbols."""
    replaced = tuple((name, value) for name, value in _used(ground, book) if f"{name} = {value}" not in ground.where)
    if not replaced or ground.where.startswith("with "):
        return _ground(ground, book)
    return (*_ground(ground, book), " (", *_replacements(replaced, " for "), ")")


def _used(ground: Ground, book: Mapping[str, Verdict]) -> Replacements:
    """Return the replacements that change something in the ground."""
    statement = book[ground.number].statement
    sides = statement.symbol, statement.members[ground.member]
    return tuple((name, value) for name, value in ground.at if name != value and any(side.has(name) for side in sides))


def _replacements(pairs: Replacements, joint: str) -> Words:
    words: list = []
    for name, value in pairs:
        sides = (Formula((name, value)),) if joint == "=" else (Formula((value,)), joint, Formula((name,)))
        words += [", ", *sides]
    return tuple(words[1:])


def _judgement(verdict: Verdict, book: Mapping[str, Verdict]) -> Words:
    sentences = list(_sentences(verdict, book))
    return tuple(part for sentence in sentences for part in (" ", *sentence))[1:]


def _sentences(verdict: Verdict, book: Mapping[str, Verdict]) -> Iterator[Words]:
    statement = verdict.statement
    if verdict.necessary is not None and statement.condition is not None:
        yield tuple(_condition(verdict, statement.condition))
    elif statement.positive_if is not None and verdict.outcome is Outcome.FOLLOWS:
        yield ("Follows, and is positive exactly if ", Formula((statement.positive_if,)), ".")
    elif verdict.words not in (verdict.outcome.value, statement.kind.value) and not verdict.inherited:
        yield (*parse_prose(verdict.words[0].upper() + verdict.words[1:], book), ".")
    if verdict.inherited:
        names = [part for number in verdict.inherited for part in (", ", refer(book[number].statement))]
        yield ("Rests on the condition of ", *names[1:], ".")
    if verdict.unit_error:
        yield (f"Its units do not agree: {verdict.unit_error}.",)
    if not verdict.as_expected:
        yield (f"A correct account finds otherwise: {statement.expected.value}.",)


def _scope(verdict: Verdict, book: Mapping[str, Verdict]) -> Words:
    """Say where a statement is proved, if not everywhere."""
    statement = verdict.statement
    limits = [parse_prose(statement.scope, book)] if statement.scope else []
    limits += [(Formula((one,)),) for one in statement.provided]
    words = [part for limit in limits for part in (" and ", *limit)]
    if words:
        words = ["Proved for", " ", *words[1:], "."]
    if verdict.limited_by:
        names = [part for number in verdict.limited_by for part in (", ", refer(book[number].statement))]
        words += [" " if words else "", "As far as is proved of ", *names[1:], "."]
    return tuple(words)


def _condition(verdict: Verdict, condition: Condition) -> Iterator:
    ruled_out = verdict.outcome is Outcome.DOES_NOT_FOLLOW
    yield ("It would follow only if " if verdict.necessary else "It would follow if ") if ruled_out else "Follows if "
    for index, alternative in enumerate(condition.any_of):
        yield " or " if index else ""
        for position, equation in enumerate(alternative):
            yield from (" and " if position else "", Formula((equation.lhs, equation.rhs)))
    if condition.words:
        yield from (" ", *parse_prose(condition.words))
    if ruled_out:
        published = tuple((name, _decimal(value)) for name, value in condition.ruled_out_by)
        yield from ("; the published numbers give ", *_replacements(published, "="), ".")
    else:
        yield ", and only then (proved)." if verdict.necessary else ". Whether only then is not proved."


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
            where = (", ", *parse_prose(proof.where, book)) if proof.where else ()
            shown = sympy.factor(value) if stated is None else stated
            yield Line(words=("Derived minus published", which, *where, ":"), display=Formula((shown,)))
            stated = None


def _corrections(statement: Statement, book: Mapping[str, Verdict]) -> Iterator[Line]:
    """Say what a statement should read, if something else than it does."""
    if statement.corrected_by not in book:
        return
    corrected = book[statement.corrected_by].statement
    if corrected.published == statement.published:  # the same claim, of something else
        yield Line(words=("What holds is ", refer(corrected), ": ", *parse_prose(corrected.title, book), "."))
    else:
        formula = Formula((corrected.symbol, corrected.members[-1]))
        yield Line(words=("It should read, by ", refer(corrected), ":"), display=formula)


def _signs(verdict: Verdict, book: Mapping[str, Verdict]) -> dict[str, tuple[sympy.Symbol, ...]]:
    sides = [verdict.statement.symbol, *verdict.statement.members]
    sides += [side for proof in verdict.proofs for one in proof.relations for side in (one.left, one.right)]
    replaced = [pair for ground in verdict.statement.grounds for pair in _used(ground, book)]
    sides += [value for _, value in (*replaced, *(pair for case in verdict.statement.cases for pair in case.at))]
    names = sorted(set().union(*(side.free_symbols for side in sides)), key=lambda name: (name.name.lower(), name.name))
    found: dict[str, list[sympy.Symbol]] = {}
    for name in names:
        found.setdefault(next(sign for sign in SIGNS if getattr(name, f"is_{sign}")), []).append(name)
    return {sign: tuple(found[sign]) for sign in SIGNS if sign in found}


def _figure(value: Value, statement: Statement, book: Mapping[str, Verdict]) -> Figure:
    ours = value.exact(statement)
    unit = "" if value.unit == "1" else f" {value.unit}"
    paper = ""
    if value.published:
        deviation = float(ours / sympy.Rational(value.published) - 1)
        remark = "agrees" if value.agrees(statement) else f"ours {100 * deviation:+.1f} %".replace("-", "−")
        paper = f"{value.published}{unit} ({remark})"
    return Figure(
        label=parse_prose(value.label, book),
        ours=f"{significant(float(ours))}{unit}",
        paper=paper,
        remark=parse_prose(value.remark, book),
    )


def significant(number: float) -> str:
    """Write a number with four digits, or all digits before the point if there are more.

    Parameters
    ----------
    number : float

    Returns
    -------
    str

    Examples
    --------
    >>> significant(0.939130), significant(13650.0)
    ('0.9391', '13650')
    """
    return f"{number:.0f}" if abs(number) >= 1000 else f"{number:.4g}"


# --- a derivation -------------------------------------------------------------------------------------------


def _derivation(proof: CaseProof, index: int, book: Mapping[str, Verdict]) -> Derivation:
    cases = proof.statement.cases
    where = parse_prose(proof.where, book)
    if cases:
        made = _replacements(cases[index].at, "=")
        where = ("Case: ", *where, ", that is ", *made) if where else ("With ", *made)
    steps = tuple(_visible(proof))
    symbol = proof.statement.symbol
    lines = tuple(
        Line(words=tuple(_step(step, before, proof, book)), display=Formula((symbol, step.result)))
        for before, step in steps
    )
    if lines and cases and not any(proof.discrepancies) and to_text(proof.published) != to_text(steps[-1][1].result):
        lines += (Line(words=("In the form stated:",), display=Formula((symbol, proof.published))),)
    at_once = Line(words=("The premises, solved together, give:",), display=Formula((symbol, proof.derived)))
    return Derivation(where=where, proof=proof, steps=tuple(step for _, step in steps), lines=lines or (at_once,))


def _visible(proof: CaseProof) -> Iterator[tuple[Step | None, Step]]:
    """Yield each step with the one before, but for rearrangements that look as before."""
    before: Step | None = None
    for step in proof.steps:
        if step.used or before is None or to_text(step.result) != to_text(before.result):
            yield before, step
        before = step


def _step(step: Step, before: Step | None, proof: CaseProof, book: Mapping[str, Verdict]) -> Iterator:
    symbol = proof.statement.symbol
    if not step.used:
        if before is not None and before.result.has(symbol):
            yield from ("Solve for ", Formula((symbol,)), ", which stands on both sides:")
        else:
            yield "Rearranged:"
        return
    relations = [next(one for one in proof.relations if one.ground == ground) for ground in step.used]
    if before is None:
        yield from ("Start from ", *_ground(step.used[0], book), *_solved(relations[0], step), ":")
    elif step.name == symbol:
        relations = [relation for relation in relations if relation.left != relation.right]
        for index, relation in enumerate(relations):
            joint = "With " if index == 0 else " and " if index == len(relations) - 1 else ", "
            yield from (joint, Formula((relation.left, relation.right)), " from ", *_ground(relation.ground, book))
        yield ", this is:"
    else:
        yield from ("Put in ", Formula((step.name, step.gives)), " from ", *_ground(step.used[0], book))
        yield from (*_solved(relations[0], step), ":")


def _solved(relation: Relation, step: Step) -> Words:
    if relation.left == step.name and relation.right == step.gives:
        return ()
    return (", solved for ", Formula((step.name,)))
