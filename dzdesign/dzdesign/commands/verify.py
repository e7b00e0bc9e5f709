"""`dzdesign verify DIR`."""

from pathlib import Path

from dzdesign.core.artefact_files import to_json
from dzdesign.core.errors import one_line
from dzdesign.stages.verify import VerifyArguments, verify

Arguments = VerifyArguments
EXAMPLES = (
    "dzdesign verify firmware",
    "dzdesign verify firmware --plant plant.toml --tolerances tolerances.toml",
    "dzdesign verify firmware --machine-code --mutate --proof",
)


def run(arguments: Arguments, json: bool) -> int:
    """Verify a firmware and print every requirement; 1 if one does not hold."""
    verification = verify(arguments)
    if json:
        from dzdesign.core.artefact_types import as_document

        print(to_json(as_document(verification.evidence)), end="")
        return 0 if verification.holds else 1
    from dzdesign.report.valve_report import REPORT_NAME
    from dzdesign.terminal.verification_tables import print_firmware_mutants, print_verification

    print_verification(verification)
    if mutants := verification.evidence.mutants:
        print_firmware_mutants(mutants)
    output = Path(arguments.output or "")
    print(one_line(f"Evidence: {output}, to be read: {output / REPORT_NAME}"))
    return 0 if verification.holds else 1
