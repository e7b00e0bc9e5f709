"""`dzdesign verify DIR`."""

from pathlib import Path

from dzdesign.core.errors import one_line
from dzdesign.stages.verify import VerifyArguments, verify
from dzdesign.terminal.page import print_json

Arguments = VerifyArguments
EXAMPLES = (
    "dzdesign verify firmware",
    "dzdesign verify plc -o plc_evidence",
    'dzdesign verify calibrated/lot/firmware --blocks "calibrated/valves/*/calibration.bin"',
    "dzdesign verify firmware --machine-code",
)


def run(arguments: Arguments, json: bool) -> int:
    """Verify a firmware or another output and print every requirement; 1 if one does not hold."""
    from dzdesign.report.valve_report import REPORT_NAME
    from dzdesign.terminal.verification_tables import print_output_verification, print_verification
    from dzdesign.verify.evidence import OutputEvidence
    from dzdesign.verify.verification import Verification

    verification = verify(arguments)
    if json:
        print_json(verification.evidence)
        return 0 if verification.holds else 1
    output, to_read = Path(arguments.output or ""), REPORT_NAME
    if isinstance(verification, Verification):
        print_verification(verification)
    else:
        print_output_verification(verification)
        to_read = OutputEvidence.FILE_NAME
    print(one_line(f"Evidence written to {output}; start with {output / to_read}"))
    return 0 if verification.holds else 1
