"""`report`: a folder of artefacts, of a valve or of a lot -> one HTML page."""

from contextlib import suppress
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.artefact_files import MANIFEST_NAME, write_file, write_folder
from dzdesign.core.documents import parse_document, read_bytes
from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath, Option

if TYPE_CHECKING:
    from dzdesign.report.page import Report


@dataclass(frozen=True)
class ReportArguments:
    """Arguments of `report`."""

    folder: Annotated[AnyPath, Option("DIR")]
    """Folder of verify, demo or batch, or a folder with valve.json or compensator.json."""
    _: KW_ONLY
    firmware: Annotated[AnyPath | None, Option("DIR")] = None
    """Firmware that the evidence is of (default: the folder beside the evidence, of the name that this states)."""
    output: Annotated[AnyPath | None, Option("FILE", short="-o")] = None
    """File to write (default of the command: report.html with the evidence, or in the folder)."""
    logo: Annotated[AnyPath | None, Option("IMAGE")] = None
    """Logo beside the title. The page embeds a PNG, JPEG or GIF."""
    full: Annotated[bool, Option()] = False
    """Unfold evidence, constants and hashes, on the screen and in print."""


def report(arguments: ReportArguments) -> "Report":
    """Make the report of a folder of artefacts, or of a lot.

    Returns
    -------
    Report
        The page in ``html``, and its verdict in ``holds``: None if something was not checked.

    Raises
    ------
    InputError
        If there is nothing to report, a file is not an artefact, or one was changed. A requirement that does not hold
        is not an error.
    """
    from dzdesign.report.lot.folder import is_lot, refuse_uncalibrated
    from dzdesign.report.lot.page import report_of_lot
    from dzdesign.report.page import logo_uri
    from dzdesign.report.valve_report import report_of_folder

    folder = Path(arguments.folder)
    logo = "" if arguments.logo is None else logo_uri(Path(arguments.logo))
    if is_lot(folder):
        made = report_of_lot(folder, logo)
    else:
        refuse_uncalibrated(folder)
        firmware = None if arguments.firmware is None else Path(arguments.firmware)
        made = report_of_folder(folder, logo, firmware, full=arguments.full)
    if arguments.output is not None:
        _write_report(Path(arguments.output), made.html)
    return made


def _write_report(output: Path, html: str) -> None:
    """Write the report; in a folder whose manifest lists it the manifest follows, both or neither."""
    place, manifest = output.parent / MANIFEST_NAME, {}
    with suppress(InputError):  # none, or none of an evidence
        manifest = parse_document(read_bytes(place, "manifest"), str(place), ("dzdesign.evidence/1",))
    listed = manifest.get("files")
    if not isinstance(listed, dict) or output.name not in listed:
        write_file(output, html)
        return
    files: dict[str, str | bytes] = {name: read_bytes(output.parent / name, "evidence") for name in listed}
    write_folder(output.parent, {**files, output.name: html}, manifest)
