"""`dzdesign derive`: the paper's equations, re-derived."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from dzdesign.core.artefact_files import check_file_may_be_written, write_file
from dzdesign.core.documents import read_bytes
from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath, Option, Texts, texts_of
from dzdesign.terminal.progress import stage_progress

EXAMPLES = ("dzdesign derive --equation 18", "dzdesign derive --format html -o derivation.html")


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Arguments of `derive`."""

    format: Annotated[str, Option("F")] = "text"
    """Output format: text, json or html."""
    equation: Annotated[Texts, Option("N")] = ()
    """Number of an equation to print with its premises, such as 18 or T3b. Repeatable."""
    paper: Annotated[AnyPath | None, Option("FILE")] = None
    """The paper as plain text, to look up each of its numbers in its section."""
    output: Annotated[AnyPath | None, Option("FILE", short="-o")] = None
    """File to write (default: standard output)."""


def run(arguments: Arguments, json: bool) -> int:
    """Re-derive the paper's equations; 1 if one of those printed is not found as a correct account finds it."""
    from dzdesign.derivation.account.account import STATEMENTS, verify_statements
    from dzdesign.derivation.account.published import find_misprints
    from dzdesign.derivation.presentation.report import check_format, closure, render

    check_format(arguments.format)
    if arguments.output:
        check_file_may_be_written(Path(arguments.output))
    chosen = closure(STATEMENTS, texts_of(arguments.equation)) if arguments.equation else None
    with stage_progress("re-deriving the paper's equations"):
        verdicts = verify_statements()
        misprints = find_misprints(_text_of(arguments.paper)) if arguments.paper else []
    text = render(verdicts, "json" if json else arguments.format, chosen, misprints)
    if arguments.output:
        write_file(Path(arguments.output), text)
    else:
        print(text, end="")
    wrong = (verdict for verdict in verdicts if not verdict.as_expected)
    return 1 if misprints or any(chosen is None or verdict.number in chosen for verdict in wrong) else 0


def _text_of(paper: AnyPath) -> str:
    try:
        return read_bytes(Path(paper), "the paper").decode()
    except UnicodeDecodeError as error:
        raise InputError(
            f"{paper}: the paper is expected as plain text in UTF-8 ({error}); export it as text"
        ) from error
