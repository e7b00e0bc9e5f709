"""`dzdesign monitor`: what a firmware sends over its serial line becomes a ramp file, line by line as it comes."""

import contextlib
import os
import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from dzdesign.core.artefact_files import check_file_may_be_written
from dzdesign.core.errors import InputError
from dzdesign.core.option_readers import number
from dzdesign.core.options import AnyPath, Option, Text, read_options
from dzdesign.serial_port import open_port
from dzdesign.terminal.page import print_json, say_results
from dzdesign.terminal.progress import say

if TYPE_CHECKING:
    import serial

    from dzdesign.codegen.telemetry.frame import Frame, FrameReader
    from dzdesign.codegen.telemetry.recording import Recording, RecordingFile

#: What ends a recording: Ctrl-C, a request to end, a terminal that goes away.
ENDING = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
#: A line with a firmware on it shows a frame within this time.
FIRST_FRAME_S = 3.0
#: The longest that a look at the line takes: Ctrl-C is noticed after it.
LOOK_S = 0.1
POSITIVE = (0.0, 1e9)
EXAMPLES = ("dzdesign monitor COM5 --firmware firmware --seconds 100 -o ramp.csv",)


@dataclass(frozen=True)
class Arguments:
    """Arguments of `monitor`."""

    port: Annotated[str, Option("PORT")]
    """Serial port, such as COM5 or /dev/ttyUSB0."""
    _: KW_ONLY
    output: Annotated[AnyPath, Option("FILE", short="-o")] = "ramp.csv"
    """File to write."""
    firmware: Annotated[AnyPath, Option("DIR")] = "firmware"
    """Folder made by `dzdesign codegen`, with the scalings."""
    compensator: Annotated[AnyPath | None, Option("FILE")] = None
    """The compensator.json of a calibration block that was loaded later (default: the firmware's own)."""
    baud: Annotated[Text, Option("N", read=number("a positive number such as 115200", between=POSITIVE))] = None
    """Bit rate in bits per second (default: that of the firmware)."""
    seconds: Annotated[Text, Option("S", read=number("a positive number such as 60", between=POSITIVE))] = None
    """Recording time, from the first frame on (default: until Ctrl-C)."""


def run(arguments: Arguments, json: bool) -> int:
    """Record the telemetry of a firmware; 1 if the line broke before the time that was asked for."""
    from dzdesign.codegen.telemetry.frame import FrameReader
    from dzdesign.codegen.telemetry.recording import Recording, recording_file, scalings_of

    output, read = Path(arguments.output), read_options(arguments, ["seconds", "baud"])
    check_file_may_be_written(output)
    given = arguments.compensator
    scalings = scalings_of(Path(arguments.firmware), None if given is None else Path(given))
    baud = read["baud"] or scalings.link.baud
    recording, reader = Recording(scalings), FrameReader()
    with (
        recording_file(output) as file,
        open_port(arguments.port, baud, LOOK_S) as port,
        _until_stopped() as stop,
    ):
        say(f"listening to {arguments.port} at {baud:g} bit/s; Ctrl-C ends the recording")
        try:
            broken = _record(port, recording, reader, stop, read["seconds"], file)
            if recording.frames:
                file.write(recording.foot(reader))
        except InputError as error:
            if not recording.frames:
                raise
            raise InputError(f"{error}; the {recording.frames} frames that came before are kept there") from error
    if not recording.frames:
        raise _nothing(arguments.port, baud, reader)
    if json:
        print_json(_document(arguments, recording, reader))
    else:
        _print(arguments, recording, reader)
    if broken:
        say(f"the recording ended because {broken}; what came until then is written")
    return 1 if broken else 0


@contextlib.contextmanager
def _until_stopped() -> Iterator[threading.Event]:
    """Turn what ends a process (Ctrl-C, TERM, a closed terminal) into an event; then put back what it did before."""
    stop = threading.Event()
    signals = [getattr(signal, name) for name in ENDING if hasattr(signal, name)]
    before = {each: signal.signal(each, lambda *_: stop.set()) for each in signals}
    try:
        yield stop
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


def _record(
    port: "serial.Serial",
    recording: "Recording",
    reader: "FrameReader",
    stop: threading.Event,
    seconds: float | None,
    file: "RecordingFile",
) -> str:
    """Record until told to stop or the time is over; return why it ended before that, or nothing."""
    begin, first = time.monotonic(), None
    hint = False
    while not stop.is_set():
        now = time.monotonic()
        if seconds is not None and now - (first or begin) >= (seconds if first else max(seconds, FIRST_FRAME_S)):
            break
        if first is None and not hint and now - begin > FIRST_FRAME_S:
            hint = True
            say("no frame yet; is the firmware running, and GPIO29 on the adapter's input?")
        try:
            octets = port.read(max(port.in_waiting, 1))
        except OSError as error:  # the adapter was pulled out
            return f"the port broke ({error})"
        lines, broken = "", ""
        for frame in reader.feed(octets):
            if frame.origin != recording.scalings.origin:
                broken = _other_firmware(frame, recording)
                break
            first = first or time.monotonic()
            lines += recording.add(frame) if recording.frames else recording.head() + recording.add(frame)
        file.write(lines)
        if broken:
            return broken
    return ""


def _other_firmware(frame: "Frame", recording: "Recording") -> str:
    """Refuse frames whose scalings are not known; what came before them, if anything did, is worth keeping."""
    from dzdesign.codegen.telemetry.frame import STATUS_BITS, STATUS_CALIBRATION

    if frame.status & STATUS_CALIBRATION:  # such a drive names no compensator, whatever is given
        bit = STATUS_BITS[STATUS_CALIBRATION]
        text = f"the amplifier reports '{bit}' (status {STATUS_CALIBRATION}): its output is off"
        if recording.frames:
            return text
        raise InputError(f"{text}; load its valve's block, `dzdesign load BLOCK --port ...`, and record then")
    own = recording.scalings.origin
    text = f"the frames are of the compensator whose SHA-256 begins with {frame.origin:04x}, not {own:04x}"
    if recording.frames:
        return text
    raise InputError(
        f"{text} as given; give the folder that the device was built from, or --compensator of the block loaded since"
    )


def _nothing(port: str, baud: float, reader: "FrameReader") -> InputError:
    seen = f"{reader.skipped} octets" if reader.skipped else "nothing"
    why = "check the wiring of GPIO29"
    if reader.skipped:
        why = "check --baud"
    if reader.other_version:
        why = "check --baud, and that firmware and dzdesign are of one version"
    return InputError(f"no frame came from '{port}' at {baud:g} bit/s, but {seen}; nothing was written; {why}")


def _document(arguments: Arguments, recording: "Recording", reader: "FrameReader") -> dict[str, Any]:
    return {
        "file": os.fspath(arguments.output),
        "frames": recording.frames,
        "seconds": recording.duration_s,
        "lost": recording.lost,
        "bad_crc": reader.bad_crc,
        "octets_skipped": reader.skipped,
        "restarts": recording.restarts,
        "doubled": recording.doubled,
        "faults": recording.faults,
    }


def _print(arguments: Arguments, recording: "Recording", reader: "FrameReader") -> None:
    doubled = f", {recording.doubled} came twice" if recording.doubled else ""
    say_results(
        f"{recording.frames} frames in {recording.duration_s:.2f} s: {recording.lost} lost, {reader.bad_crc} with a "
        f"wrong CRC, {reader.skipped} octets skipped, {recording.restarts} restarts of the firmware{doubled}"
    )
    say_results(f"Faults: {', '.join(recording.faults) or 'none'}")
    say_results(f"Written: {arguments.output}; add a column Q_Lmin from your flow meter for `dzdesign identify`")
