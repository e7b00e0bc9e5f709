"""`dzdesign batch FOLDER`."""

from pathlib import Path

from dzdesign.batch.arguments import BatchArguments
from dzdesign.core.errors import RequirementError
from dzdesign.stages.batch import batch
from dzdesign.terminal.page import print_json

Arguments = BatchArguments
EXAMPLES = (
    'dzdesign batch lot -o calibrated --jobs 4 --meter-lag "0.1 s"',
    'dzdesign batch lot -o calibrated --meter-lag "0.1 s" --calibration block',
    "dzdesign batch lot.csv -o calibrated --verify --dask tcp://10.0.0.5:8786",
)
#: Options of `identify` that a batch does not take: without them a valve would be another one.
ONE_VALVE = ("low_flow",)


def run(arguments: Arguments, json: bool) -> int:
    """Calibrate the valves of a folder or a list; raise at the end if any could not be."""
    from dzdesign.batch.printing import print_lot
    from dzdesign.core.artefact_types import as_document
    from dzdesign.report.valve_report import REPORT_NAME

    output, summary = Path(arguments.output), batch(arguments)
    if json:
        print_json({**as_document(summary), "report": str(output / REPORT_NAME)})
    else:
        print_lot(summary, output)
    if summary.failed:
        raise RequirementError(
            f"{len(summary.failed)} of {summary.valves} valves are not calibrated; their reasons are in "
            f"'{output / 'valves.csv'}'"
        )
    return 0
