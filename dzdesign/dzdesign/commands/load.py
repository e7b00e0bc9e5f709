"""`dzdesign load`: a calibration block into a running drive over its serial line, or what the drive holds."""

import contextlib
import secrets
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from dzdesign.core.errors import DzdesignError, InputError, RequirementError, one_line, quoted
from dzdesign.core.option_readers import number
from dzdesign.core.options import AnyPath, Option, Text, read_options
from dzdesign.serial_port import PortLine, open_port
from dzdesign.terminal.page import print_json, say_results
from dzdesign.terminal.progress import say, with_bar

if TYPE_CHECKING:
    from dzdesign.codegen.calibration.layout import CalibrationBlock
    from dzdesign.codegen.loading.protocol import DriveState
    from dzdesign.codegen.loading.session import LoadSession

#: The longest that a look at the line takes: shorter than an answer is waited for.
LOOK_S = 0.02
#: Numbers that a drive's firmware is compiled for, by their names in a block and in what the drive says of itself.
COMPILED_FOR = {
    "code_max": "the largest converter code",
    "compare_max": "the largest compare value",
    "sample_Hz": "samples a second of",
    "tick_Hz": "PWM periods per second of",
    "beta_step": "codes between two nodes of beta of",
}
EXAMPLES = (
    "dzdesign load valve.hex --port COM5",
    "dzdesign load valve.hex --port COM5 --serial 4711",
    "dzdesign load --port COM5",
)


@dataclass(frozen=True)
class Arguments:
    """Arguments of `load`."""

    block: Annotated[AnyPath | None, Option("BLOCK")] = None
    """Calibration block to load, a .hex or .bin file of `dzdesign calibration` (default: none, the drive's block is
    printed)."""
    _: KW_ONLY
    port: Annotated[str, Option("PORT")]
    """Serial port, such as COM5 or /dev/ttyUSB0."""
    baud: Annotated[Text, Option("N", read=number("a number such as 115200, up to 1e9", between=(0.0, 1e9)))] = None
    """Bit rate in bits per second (default: that of the f28335 firmware)."""
    serial: Annotated[Text, Option("TEXT")] = None
    """Serial number on the valve. A block of another valve is not loaded, and a drive that holds one ends with exit
    status 1."""


def run(arguments: Arguments, json: bool) -> int:
    """Load a block and read back what the drive holds; what the drive refuses is a `RequirementError`."""
    from dzdesign.codegen.calibration.packing import read_block_file, text_of, unpack
    from dzdesign.codegen.loading.session import LoadSession
    from dzdesign.codegen.project import DEFAULT_TARGET, target_named

    path = None if arguments.block is None else Path(arguments.block)
    octets = b"" if path is None else read_block_file(path)[0]
    block = None if path is None else unpack(octets, f"'{path}'")
    if block is not None and arguments.serial not in (None, text_of(block.serial)):
        raise InputError(
            f"{path} is the block of serial number {quoted(text_of(block.serial))}, and --serial says that the valve "
            f"has {quoted(arguments.serial)}; nothing was sent: take the block of this valve"
        )
    link = target_named(DEFAULT_TARGET).link
    baud = read_options(arguments, ["baud"])["baud"] or (link.baud if link else 0)
    with open_port(arguments.port, baud, LOOK_S) as port:
        session = LoadSession(PortLine(port), secrets.randbelow(256))
        drive = before = _asked(session, arguments.port, baud)
        if block is not None:
            _check_fit(path, block, before)
            drive = _load(session, path, octets, block, arguments.port)
    if json:
        print_json({**_document(drive, session), "serial_before": before.serial})
    else:
        _print(path, drive, session)
        if drive.serial != before.serial:
            say_results(f"Replaced: the block of serial number {one_line(before.serial) or 'none'}")
    if arguments.serial not in (None, drive.serial):
        raise RequirementError(
            f"the amplifier on {arguments.port} holds the block of serial number {quoted(drive.serial)}, expected "
            f"{quoted(arguments.serial)} of --serial; load the block of this valve"
        )
    return 0


def _asked(session: "LoadSession", port: str, baud: float) -> "DriveState":
    from dzdesign.codegen.loading.session import NoReplyError

    try:
        return session.query()
    except NoReplyError as error:
        raise InputError(
            f"'{port}' at {baud:g} bit/s: {error}; check the wiring of GPIO28 and GPIO29, --baud, and that the "
            "amplifier runs a firmware of `codegen --calibration block`"
        ) from error


def _load(
    session: "LoadSession", path: "Path | None", octets: bytes, block: "CalibrationBlock", port: str
) -> "DriveState":
    """Load the block of a file and return what the drive says then, which must be that it holds the block."""
    from dzdesign.codegen.calibration.packing import octets_of
    from dzdesign.codegen.loading.session import NoReplyError, RefusedError

    say(f"loading {path} into the amplifier on {port}")
    origin = int.from_bytes(octets_of(block.compensator_sha256)[:4], "big")
    requests = session.loading(octets, block.crc32, origin)
    try:
        for _ in with_bar(requests, f"loading {path}", session.requests_of(octets)):
            pass
        drive = session.query()
        if (drive.crc, drive.origin) != (block.crc32, origin) or drive.block > 1:
            raise RequirementError(
                f"after loading the amplifier uses a block of CRC-32 {drive.crc:08x}, expected {block.crc32:08x} of "
                f"{path}; load it again"
            )
        return drive
    except RefusedError as error:
        raise RequirementError(f"the amplifier refuses {path}: {error}{_advice(error)}") from error
    except NoReplyError as error:
        raise RequirementError(
            f"the amplifier on {port} stopped answering ({error}); it holds its old block, or all of the new one if "
            f"only the last answer was lost: `dzdesign load --port {port}` asks"
        ) from error
    except KeyboardInterrupt:
        with contextlib.suppress(DzdesignError):
            session.abort()
        raise


def _check_fit(path: "Path | None", ours: "CalibrationBlock", drive: "DriveState") -> None:
    """Refuse what the drive's firmware is not compiled for, before anything is erased."""
    from dzdesign.codegen.calibration.layout import SHAPE_BITS

    if (ours.layout, ours.length) != (drive.layout, drive.length):
        raise InputError(
            f"{path} has layout {ours.layout} in {ours.length} words, the amplifier's firmware takes layout "
            f"{drive.layout} in {drive.length}; firmware and dzdesign must be of one version"
        )
    if ours.shape != drive.shape:
        differs = [text for place, text in enumerate(SHAPE_BITS.values()) if (ours.shape ^ drive.shape) >> place & 1]
        raise InputError(
            f"{path} is for another kind of drive than the firmware was generated for: they differ in "
            f"'{', '.join(differs)}'; generate firmware and block from designs with the same wiring and outputs"
        )
    for name, what in COMPILED_FOR.items():
        if (block_has := getattr(ours, name)) != (drive_has := getattr(drive, name)):
            raise InputError(
                f"{path} is for firmware with {what} {block_has}, the amplifier's has {drive_has}; design it "
                "again for the amplifier's target with `dzdesign design --target`"
            )


def _advice(error: Any) -> str:
    """Return what to do about a refusal, after its reason."""
    from dzdesign.codegen.calibration.files import FINDINGS
    from dzdesign.codegen.loading.protocol import Reason

    if error.reason == Reason.DRIVING:
        return "; a block is loaded at rest only: wait until the ramp has run out, or hold the trip input low"
    if error.reason == Reason.COMMAND:
        return "; bring it to zero, as this block and the amplifier's count zero, and load again"
    if error.reason == Reason.CHECK:
        found = [text for place, text in enumerate(FINDINGS.values()) if error.detail >> place & 1]
        return f" ({'; '.join(found) or 'for no reason that this dzdesign knows'}); the amplifier keeps its old block"
    if error.reason == Reason.STORE:
        return "; the amplifier keeps its old block; see the functions of dz_store.c in its firmware"
    return "; the amplifier keeps its old block; load it again"


def _place(drive: "DriveState") -> str:
    from dzdesign.codegen.loading.protocol import LINKED, NO_BLOCK

    places = {LINKED: "linked with the firmware", NO_BLOCK: "none: the output stays off"}
    return places.get(drive.block, f"loaded, copy {drive.block}")


def _document(drive: "DriveState", session: "LoadSession") -> dict[str, Any]:
    from dzdesign.codegen.loading.protocol import NO_BLOCK, VOLATILE

    return {
        "block": None if drive.block == NO_BLOCK else _place(drive),
        "serial": drive.serial,
        "crc32": f"{drive.crc:08x}",
        "compensator_sha256_begins": f"{drive.origin:08x}",
        "layout": drive.layout,
        "kept_without_supply": not drive.flags & VOLATILE,
        "refuses_now": _reason(drive.refusal),
        "last_load": _reason(drive.ended),
        "bad_frames": drive.bad_frames,
        "repeated_requests": session.repeats,
    }


def _reason(reason: int) -> str | None:
    from dzdesign.codegen.loading.protocol import reason_text

    return reason_text(reason) if reason else None


def _print(path: "Path | None", drive: "DriveState", session: "LoadSession") -> None:
    from dzdesign.codegen.loading.protocol import NO_BLOCK, VOLATILE

    if path is not None:
        again = f"; {session.repeats} requests were sent again" if session.repeats else ""
        say_results(f"Loaded and read back: {path}{again}")
    say_results(f"Block in use: {_place(drive)}")
    if drive.block != NO_BLOCK:
        say_results(f"Serial number: {one_line(drive.serial) or 'none'}")
        say_results(f"CRC-32 {drive.crc:08x}; SHA-256 of its compensator.json begins with {drive.origin:08x}")
    if drive.refusal:
        say_results(f"A block would be refused now: {_reason(drive.refusal)}")
    if drive.ended:
        say_results(f"The last load ended early: {_reason(drive.ended)}")
    if drive.flags & VOLATILE:
        lost = "without supply they are lost (dz_store.h says what to add)"
        say_results(f"This firmware keeps loaded blocks in RAM: {lost}")
