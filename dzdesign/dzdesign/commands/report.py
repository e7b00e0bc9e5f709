"""`dzdesign report DIR`."""

from dataclasses import asdict, replace
from pathlib import Path

from dzdesign.core.errors import InputError
from dzdesign.stages.report import ReportArguments, report
from dzdesign.terminal.output_tables import print_outputs
from dzdesign.terminal.page import print_json, say_results
from dzdesign.terminal.progress import say

Arguments = ReportArguments
EXAMPLES = (
    "dzdesign report evidence",
    "dzdesign report evidence --firmware firmware -o for_review.html",
    "dzdesign report evidence --full -o report_in_full.html",
    "dzdesign report calibrated",
)


def run(arguments: Arguments, json: bool) -> int:
    """Make report.html; 1 if a requirement does not hold or was not checked."""
    output = arguments.output or _beside_evidence(Path(arguments.folder))
    made = report(replace(arguments, output=output))
    for line in made.missing:
        say(f"missing: {line}")
    if json:
        verdict = {"holds": made.holds, "verdict": made.verdict}
        outputs = {"outputs": [asdict(each) for each in made.outputs.listed], "other_outputs": made.outputs.others}
        print_json({"report": str(output), **verdict, "missing": made.missing, **outputs})
    else:
        say_results(made.verdict)
        print_outputs(made.outputs)
        say_results(f"Written: {output}")
    return 0 if made.kind == "good" else 1


def _beside_evidence(folder: Path) -> Path:
    """Return where `verify` leaves its report, or a place in the folder where there is no evidence.

    Of firmware and another output it is a place beside it: what its manifest does not name would be a change of it.
    """
    from dzdesign.report.artefacts import EVIDENCE, root_of
    from dzdesign.report.valve_report import REPORT_NAME
    from dzdesign.verify.evidence import Evidence

    if not folder.is_dir():
        raise InputError(f"'{folder}' is not a folder, expected one with artefacts of dzdesign; check the name")
    for place in (folder, folder / EVIDENCE):
        if (place / Evidence.FILE_NAME).is_file():
            return place / REPORT_NAME
    return root_of(folder.resolve()) / REPORT_NAME
