"""Renders the account of the paper for a terminal, for machines and for a browser."""

from collections.abc import Callable, Iterator, Sequence

from sympy.core.function import AppliedUndef

from dzdesign.core.artefact_types import THIS_TOOL, to_json_bytes
from dzdesign.core.errors import InputError, RequirementError, nearest
from dzdesign.derivation.account.equations import PAPER_NUMBERS
from dzdesign.derivation.account.proof import Verdict
from dzdesign.derivation.account.published import transcribed
from dzdesign.derivation.account.statement import Outcome, Statement
from dzdesign.derivation.account.units import print_unit
from dzdesign.derivation.presentation.content import DerivationReport, Entry, Term
from dzdesign.derivation.presentation.formulas import to_python
from dzdesign.derivation.presentation.prose import Formula, Words, parse_prose
from dzdesign.derivation.presentation.wording import describe, refer
from dzdesign.derivation.presentation.writers import HtmlWriter, TextWriter, write
from dzdesign.derivation.symbols import QUANTITIES

_FORMATS: dict[str, Callable[[DerivationReport], str]] = {
    "text": lambda report: write(TextWriter, report),
    "json": lambda report: to_json_bytes(report).decode(),
    "html": lambda report: write(HtmlWriter, report),
}
FORMATS = tuple(_FORMATS)
#: Of (6), which is given and yet corrected.
_CHOICE = (
    "the paper's choice. For a stop at every pressure drop it does not meet the target (16); where full command is the "
    "limit, it meets it exactly, and the correction loses flow: T2d, T2e."
)
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
    entries = tuple(describe(book[number], book) for number in numbers)
    partial = len(numbers) < len(book)
    return DerivationReport(
        tool=THIS_TOOL,
        made_from=(),
        title="Derivation of the dead-zone compensation law" + (", in part" if partial else ""),
        source="The paper: Wu et al. 2022, doi 10.11916/j.issn.1005-9113.20063.",
        holds=all(entry.as_expected for entry in entries) and not misprints,
        summary=(*_summary(entries, [book[number] for number in numbers]), *_of_numbers(partial, misprints)),
        wrong=tuple(_fault(entry) for entry in entries if _is_wrong(entry)),
        conditional=tuple(_judged(entry) for entry in entries if entry.outcome is Outcome.FOLLOWS_IF),
        symbols=_symbols([book[number].statement for number in numbers]),
        statements=entries,
    )


def _symbols(statements: Sequence[Statement]) -> tuple[Term, ...]:
    """Explain the symbols that occur."""
    replaced = [pair for one in statements for ground in one.grounds for pair in ground.at]
    replaced += [pair for one in statements for case in one.cases for pair in case.at]
    sides = [side for one in statements for side in (one.symbol, *one.members)] + [value for _, value in replaced]
    used = set().union(*(side.free_symbols | {part.func for part in side.atoms(AppliedUndef)} for side in sides))
    names = sorted((name for name in QUANTITIES if name in used or name.func in used), key=lambda one: str(one).lower())
    return tuple(
        Term(
            name=to_python(name).partition("(")[0],
            symbol=Formula(name),
            meaning=parse_prose(QUANTITIES[name].meaning),
            unit=print_unit(name),
            sign=next((words for sign, words in _SIGNS.items() if getattr(name, f"is_{sign}")), ""),
        )
        for name in names
    )


def _of_numbers(partial: bool, misprints: Sequence[str]) -> Iterator[Words]:
    """Say whether the numbers that the paper prints were transcribed rightly."""
    if misprints:
        yield Words(f"{len(misprints)} of the paper's numbers are not as it prints them:")
        yield from (Words(parse_prose(text), ".") for text in misprints)
    elif not partial:
        yield Words(
            f"The {len(transcribed())} numbers of the paper stand each with its section; --paper looks them up."
        )


def _summary(entries: Sequence[Entry], verdicts: Sequence[Verdict]) -> tuple[Words, ...]:
    paper = [verdict for verdict in verdicts if verdict.number in PAPER_NUMBERS]
    wrong = [verdict for verdict in verdicts if not verdict.as_expected]
    expected = (
        f"{len(verdicts) - len(wrong)} of {len(verdicts)} statements have the verdict expected of them, "
        "those that do not hold included"
    )
    lines = [Words(expected, "; these are not:" if wrong else ".")]
    for verdict in wrong:
        expected = f" should be found to be “{verdict.statement.expected.value}”, but: "
        unit = f"; its units: {verdict.unit_error}" if verdict.unit_error else ""
        lines.append(Words(refer(verdict.statement), expected, parse_prose(verdict.words), unit, "."))
    if paper:
        which = f"the {len(paper)} equations" if len(paper) > 1 else "the one equation"
        counts = "; ".join(
            f"{words}: {sum(verdict.outcome is outcome for verdict in paper)}" for outcome, words in _COUNTED.items()
        )
        lines.append(Words(f"Of {which} of the paper in this report, {counts}."))
    follow = [entry for entry in entries if entry.outcome in (Outcome.FOLLOWS, Outcome.FOLLOWS_IF)]
    rearranged = [entry.reference for entry in follow if entry.rearranges]
    if rearranged:
        derived = f"{len(follow) - len(rearranged)} statements are derived; "
        lines.append(
            Words(
                derived, f"{len(rearranged)} only rearrange a definition or one premise: ", Words.join(rearranged), "."
            )
        )
    return tuple(lines)


def _is_wrong(entry: Entry) -> bool:
    return entry.outcome is Outcome.DOES_NOT_FOLLOW or bool(entry.corrected_by)


def _fault(entry: Entry) -> Words:
    words = _judged(entry, otherwise=_CHOICE)
    for line in entry.corrections:
        words = Words(words, " ", line.words, *((" ", line.formula) if line.formula else ()))
    return words


def _judged(entry: Entry, otherwise: str = "") -> Words:
    return Words(entry.reference, " ", entry.title, ": ", entry.judgement or otherwise)
