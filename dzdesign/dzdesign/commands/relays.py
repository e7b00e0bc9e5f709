"""The commands that hand their arguments to one stage and print its result, one row each in `RELAYS`.

What a stage needs is imported when its command is asked for: the help of one imports no other.
"""

import os
import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from dzdesign.core.display import verdict_words
from dzdesign.core.errors import RequirementError, one_line
from dzdesign.terminal.page import print_json, say_results

NOT_LOOKED_AT = (
    "Until that is settled, full command, sides and meter are not looked at. Init with that option and another -o "
    "does so."
)
#: Lines of what is open that `init` prints; the file has all.
MOST_OPEN = 4
#: A name or a pattern in which no shell finds anything but a name or a pattern.
PLAIN = re.compile(r"[\w ./*?:\[\],+@%=-]*")


@dataclass
class Relay:
    """A command: where its arguments and its stage are, lines for the help, and how the result is shown and judged.

    `show` is where the function is that prints the result, if it has more to print than the lines of `then`.
    """

    arguments: str
    stage: str
    EXAMPLES: tuple[str, ...]
    show: str
    then: Callable[[Any, Any], Iterable[str]]
    _: KW_ONLY
    holds: Callable[[Any, Any], bool] = lambda result, arguments: True
    document: Callable[[Any, Any], Any] = lambda result, arguments: result

    @cached_property
    def Arguments(self) -> Any:
        """The class of the command's arguments."""
        return resolve_name(f"dzdesign.{self.arguments}")

    def run(self, arguments: Any, json: bool) -> int:
        """Run the stage and print its result; 1 if that does not hold."""
        result = resolve_name(f"dzdesign.{self.stage}")(arguments)
        if json:
            print_json(self.document(result, arguments))
        else:
            if self.show:
                resolve_name(f"dzdesign.{self.show}")(result)
            say_results(*self.then(result, arguments))
        return 0 if self.holds(result, arguments) else 1


def _written(result: Any, arguments: Any) -> tuple[str, ...]:
    plots = f", plots in {arguments.plots}" if getattr(arguments, "plots", None) else ""
    return (f"Written: {arguments.output}{plots}",)


def _after_identify(valve: Any, arguments: Any) -> tuple[str, ...]:
    return (*_written(valve, arguments), f"Next: dzdesign design {_word(os.fspath(arguments.output))}")


def _after_design(compensator: Any, arguments: Any) -> tuple[str, ...]:
    return (*_written(compensator, arguments), f"Next: dzdesign codegen {_word(os.fspath(arguments.output))}")


def _after_verify(verification: Any, arguments: Any) -> tuple[str, ...]:
    from dzdesign.report.valve_report import REPORT_NAME
    from dzdesign.verify.evidence import OutputEvidence
    from dzdesign.verify.verification import Verification

    output = Path(arguments.output or "")
    to_read = REPORT_NAME if isinstance(verification, Verification) else OutputEvidence.FILE_NAME
    return (f"Evidence written to {output}; start with {output / to_read}",)


def _after_simulate(made: Any, arguments: Any) -> tuple[str, ...]:
    tests = "test" if len(made.files) == 1 else "tests"
    return (f"Written: {len(made.files)} simulated ramp {tests} in folder '{arguments.output}'",)


def _lines_of_lot(summary: Any, arguments: Any) -> Iterable[str]:
    from dzdesign.batch.printing import lines_of_lot

    return lines_of_lot(summary, Path(arguments.output))


def _document_of_lot(summary: Any, arguments: Any) -> dict[str, Any]:
    from dzdesign.core.artefact_types import as_document
    from dzdesign.report.valve_report import REPORT_NAME

    return {**as_document(summary), "report": os.fspath(Path(arguments.output) / REPORT_NAME)}


def _holds(result: Any, arguments: Any) -> bool:
    return bool(result.holds)


def _after_run(made: Any, arguments: Any) -> Iterator[str]:
    for each in made.stages:
        yield f"{each.stage:10}{'unchanged' if each.unchanged else 'done':11}{each.path}"
    if made.warnings:
        codes = (code + (f" ({count})" if count > 1 else "") for code, count in made.warnings.items())
        yield f"warnings about the recordings: {', '.join(codes)}"
    yield from (f"warning: {each}" for each in made.notes)
    for check in made.evidence.checks:
        if check.holds is not True:
            yield f"{verdict_words(check.holds)}  {check.name}: {check.text}"
    yield made.verdict
    yield f"Open first: {made.report}"


def _whole_lot(summary: Any, arguments: Any) -> bool:
    """Return True; raise if any valve could not be calibrated."""
    if summary.failed:
        raise RequirementError(
            f"{len(summary.failed)} of {summary.valves} valves are not calibrated; their reasons are in "
            f"'{Path(arguments.output) / 'valves.csv'}'"
        )
    return True


def _lines_of_proposal(proposal: Any, arguments: Any) -> Iterator[str]:
    from dzdesign.terminal.brief import warning_lines
    from dzdesign.terminal.progress import is_verbose

    yield from proposal.seen
    if proposal.valve:
        yield from proposal.warnings if is_verbose() else warning_lines(proposal.valve.warnings)
    shown = len(proposal.opens) if is_verbose() else MOST_OPEN
    yield from (f"open: {line}" for line in proposal.opens[:shown])
    if more := len(proposal.opens[shown:]):
        yield f"open: {more} more, see OPEN in the file"
    if proposal.opens and proposal.u_seen_V is None:
        yield NOT_LOOKED_AT
    yield f"Written: {arguments.output}" + ("; fill in what is open, then" if proposal.opens else "; read it, then")
    yield f"  dzdesign run {_word(os.fspath(arguments.output))}"


def _document_of_proposal(proposal: Any, arguments: Any) -> dict[str, Any]:
    keys = ("labels", "columns", "dp", "u_max_V", "u_seen_V", "valve")
    return {
        "file": os.fspath(arguments.output),
        "recordings": [path.as_posix() for path in proposal.recordings],
        **{key: getattr(proposal, key) for key in keys},
        "open": proposal.opens,
    }


def _word(name: str) -> str:
    """Return a name as one word of any shell; a pattern stays one, and what a shell would run is in quotes."""
    name = one_line(name)
    if os.name != "nt" and not PLAIN.fullmatch(name):
        return shlex.quote(name)
    return f'"{name}"' if " " in name else name


RELAYS: Mapping[str, Relay] = {
    "init": Relay(
        "stages.init:InitArguments", "stages.init:init",
        ("dzdesign init ramps/*.csv", "dzdesign init ramps/*.tdms -o bench2.toml"),
        "", _lines_of_proposal, document=_document_of_proposal, holds=lambda proposal, arguments: not proposal.opens,
    ),
    "run": Relay(
        "stages.run:RunArguments", "stages.run:run",
        ("dzdesign run dzdesign.toml", "dzdesign run dzdesign.toml -o valve_4711"),
        "", _after_run, holds=_holds, document=lambda made, arguments: made.evidence,
    ),
    "identify": Relay(
        "stages.identify:IdentifyArguments", "stages.identify:identify",
        (
            'dzdesign identify ramps/*.csv --meter-lag "0.1 s"',
            "dzdesign identify ramps/*.csv --config dzdesign.toml --plots plots",
            'dzdesign identify ramp.csv --dp "1 MPa" --columns "u=AO0:V, Q=Flow (L/min)"',
        ),
        "terminal.brief:print_valve", _after_identify,
    ),
    "design": Relay(
        "stages.design:DesignArguments", "stages.design:design",
        ("dzdesign design valve.json", "dzdesign design valve.json --hysteresis play --target cortex-m4"),
        "terminal.brief:print_design", _after_design,
    ),
    "verify": Relay(
        "stages.verify:VerifyArguments", "stages.verify:verify",
        (
            "dzdesign verify firmware",
            "dzdesign verify plc -o plc_evidence",
            'dzdesign verify calibrated/lot/firmware --blocks "calibrated/valves/*/calibration.bin"',
            "dzdesign verify firmware --machine-code",
        ),
        "terminal.brief:print_result", _after_verify, holds=_holds,
        document=lambda made, arguments: made.evidence,
    ),
    "assess": Relay(
        "stages.assess:AssessArguments", "stages.assess:assess",
        (
            'dzdesign assess before/*.csv --after after/*.csv --limits "dead_zone_opening = 5 %"',
            "dzdesign assess before/*.csv --after after/*.csv --config dzdesign.toml",
        ),
        "terminal.brief:print_assessment", _written, holds=_holds,
    ),
    "simulate": Relay(
        "stages.simulate:SimulateArguments", "stages.simulate:simulate",
        (
            'dzdesign simulate --dp "1 MPa" --dp "5 MPa" -o ramps',
            "dzdesign simulate --firmware firmware -o after",
        ),
        "", _after_simulate, document=lambda made, arguments: made.manifest,
    ),
    "batch": Relay(
        "batch.arguments:BatchArguments", "stages.batch:batch",
        (
            "dzdesign batch lot -o calibrated --config dzdesign.toml --jobs 4",
            "dzdesign batch lot -o calibrated --config dzdesign.toml --calibration block",
            "dzdesign batch lot.csv -o calibrated --config dzdesign.toml --verify --dask tcp://10.0.0.5:8786",
        ),
        "batch.printing:print_quantiles", _lines_of_lot, holds=_whole_lot, document=_document_of_lot,
    ),
    "reproduce": Relay(
        "stages.reproduce:ReproduceArguments", "stages.reproduce:reproduce",
        ("dzdesign reproduce -o reproduction",), "terminal.evidence_tables:print_reproduction",
        lambda made, arguments: (f"Figures, parameters and artefacts: {arguments.output}",), holds=_holds,
    ),
}  # fmt: skip
