"""`dzdesign report DIR`: the report of whatever artefacts a folder has."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME, parse_document, read_bytes, to_json, write_file, write_folder
from dzdesign.core.errors import InputError
from dzdesign.terminal.progress import say

if TYPE_CHECKING:
    from dzdesign.report.valve_report import Report


def run_report(args: argparse.Namespace) -> int:
    """Make report.html; 1 if a requirement does not hold or was not checked, or the files do not belong together."""
    folder = Path(args.folder)
    output = Path(args.output) if args.output else _beside_evidence(folder)
    report = report_of(folder)
    for line in report.missing:
        say(f"missing: {line}")
    for line in report.faults:
        say(f"does not fit: {line}")
    write_report(output, report.html)
    if args.json:
        print(
            to_json(
                {
                    "report": str(output),
                    "holds": report.holds,
                    "verdict": report.verdict,
                    "faults": list(report.faults),
                    "missing": list(report.missing),
                }
            ),
            end="",
        )
    else:
        print(report.verdict)
        print(f"Written: {output}")
    return 0 if report.kind == "good" else 1


def report_of(folder: Path) -> "Report":
    """Return the report of a batch, or of one valve's artefacts."""
    from dzdesign.report.lot.folder import is_lot, refuse_uncalibrated

    if is_lot(folder):
        from dzdesign.report.lot.report import report_of_lot

        return report_of_lot(folder)
    from dzdesign.report.valve_report import report_of_folder

    refuse_uncalibrated(folder)
    return report_of_folder(folder)


def _beside_evidence(folder: Path) -> Path:
    """Return where `verify` leaves its report, or a place in the folder where there is no evidence."""
    from dzdesign.report.artefact_folder import VERIFICATION_NAME
    from dzdesign.report.valve_report import REPORT_NAME

    if not folder.is_dir():
        raise InputError(f"'{folder}' is no folder, expected one with artefacts of dzdesign; check the name")
    for place in (folder, folder / "evidence"):
        if (place / VERIFICATION_NAME).is_file():
            return place / REPORT_NAME
    return folder / REPORT_NAME


def write_report(output: Path, html: str) -> None:
    """Write the report; in a folder whose manifest lists it the manifest follows, both or neither."""
    manifest_path = output.parent / MANIFEST_NAME
    if not manifest_path.is_file():
        write_file(output, html)
        return
    try:
        manifest = parse_document(
            read_bytes(manifest_path, "manifest"), str(manifest_path), ("dzdesign.evidence/1",)
        )
        listed = manifest["files"] if isinstance(manifest.get("files"), dict) else {}
    except InputError:
        listed = {}
    if output.name not in listed:
        write_file(output, html)
        return
    files: dict[str, str | bytes] = {name: read_bytes(output.parent / name, "evidence") for name in listed}
    write_folder(output.parent, {**files, output.name: html}, manifest)
