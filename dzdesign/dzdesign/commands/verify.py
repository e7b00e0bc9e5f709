"""`dzdesign verify DIR`."""

from pathlib import Path

from dzdesign.core.errors import one_line
from dzdesign.stages.verify import VerifyArguments, verify
from dzdesign.terminal.page import print_json

Arguments = VerifyArguments
EXAMPLES = (
    "dzdesign verify firmware",
    "dzdesign verify firmware --plant plant.toml --tolerances tolerances.toml",
    'dzdesign verify calibrated/lot/firmware --blocks "calibrated/valves/*/calibration.bin"',
    "dzdesign verify firmware --machine-code --mutate --proof",
)


def run(arguments: Arguments, json: bool) -> int:
    """Verify a firmware and print every requirement; 1 if one does not hold."""
    from dzdesign.report.valve_report import REPORT_NAME
    from dzdesign.terminal.verification_tables import print_verification

    verification = verify(arguments)
    if json:
        print_json(verification.evidence)
    else:
        print_verification(verification)
        output = Path(arguments.output or "")
        print(one_line(f"Evidence: {output}, to be read: {output / REPORT_NAME}"))
    return 0 if verification.holds else 1
