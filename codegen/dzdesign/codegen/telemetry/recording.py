"""Recorded telemetry: frames of a firmware in, a ramp file out, scaled by the compensator of that firmware.

The file is written as the frames come: whatever ends it, what was recorded until a second before is there.
"""

import contextlib
import os
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from dzdesign.codegen.project import target_named
from dzdesign.codegen.telemetry.frame import (
    BETA_BITS,
    STATUS_BITS,
    STATUS_RELEASED,
    TICKS_MODULUS,
    Frame,
    FrameReader,
    Link,
)
from dzdesign.core.artefact_files import MANIFEST_NAME, TOOL, note_written
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.documents import read_bytes, reason_of, sha256_of
from dzdesign.core.errors import InputError
from dzdesign.core.placing import sync_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest

#: What is older than this is on the disk, if the power goes.
SYNC_S = 1.0
#: Windows writes CR before each line feed otherwise.
BINARY = getattr(os, "O_BINARY", 0)
OUTPUT_COLUMNS = ("uO_V", "beta", "compare_a", "compare_b", "status")
#: Ports that pressures A, B and C are of, where there are three, by the inputs of negative commands; two are of any.
PORTS: Mapping[str, tuple[str, ...]] = {
    "AC": ("pP", "pA", "pB"), "CB": ("pB", "pT", "pA"), "BC": ("pP", "pA", "pT"), "CA": ("pB", "pT", "pP")
}  # fmt: skip
TWO_PORTS = ("pA", "pB")


@dataclass(frozen=True, slots=True, kw_only=True)
class Scalings:
    """What says how the frames of one firmware are read: its serial line, and the scalings of its compensator."""

    link: Link
    compensator: Compensator
    #: Of compensator.json.
    sha256: str

    @property
    def origin(self) -> int:
        """What the frames of this firmware carry as theirs."""
        return int(self.sha256[:4], 16)


def scalings_of(folder: Path, compensator_file: Path | None = None) -> Scalings:
    """Return the scalings of a firmware folder; one that is not a firmware or sends no telemetry is an `InputError`.

    A firmware into which another calibration block was loaded has the scalings of that block's `compensator_file`.
    """
    path = folder / MANIFEST_NAME
    manifest = read_artefact(read_bytes(path, "firmware manifest"), FirmwareManifest, str(path))
    target = target_named(manifest.target)
    if target.link is None:
        raise InputError(f"the target {target.name} of '{folder}' sends no telemetry; f28335 does")
    source = compensator_file or folder / "compensator.json"
    content = read_bytes(source, "compensator file")
    compensator = read_artefact(content, Compensator, str(source))
    return Scalings(link=target.link, compensator=compensator, sha256=sha256_of(content))


def columns_of(compensator: Compensator) -> tuple[str, ...]:
    """Return the columns of a recording, the pressures by the ports that they are of."""
    ports = PORTS.get(compensator.signals.negative_pair, TWO_PORTS)
    return ("time_s", "u_V", *(f"{port}_MPa" for port in ports), *OUTPUT_COLUMNS)


class Recording:
    """What frames say, a line of the ramp file each, and what was missed between them."""

    def __init__(self, scalings: Scalings) -> None:
        self.scalings = scalings
        #: Frames that came; those missing between others; how often the count of PWM periods went back, as by a reset.
        self.frames = self.lost = self.restarts = 0
        #: Frames that came twice, octet for octet; the second one has no line.
        self.doubled = 0
        self._last_frame: Frame | None = None
        self._status = 0  # every bit that any frame has
        self._periods = 0  # since the first frame, and going on over a restart
        self._last = 0

    @property
    def duration_s(self) -> float:
        """Time from the first frame to the last, in s."""
        return self._periods / self.scalings.link.tick_Hz

    @property
    def faults(self) -> list[str]:
        """Faults that any frame reports, in words."""
        return [text for bit, text in STATUS_BITS.items() if self._status & bit]

    def add(self, frame: Frame) -> str:
        """Count a frame and return its line, nothing of one that came twice.

        One whose time lies before the last one's begins anew, one frame later.
        """
        if frame == self._last_frame:  # as a whole: a firmware that resets itself over and over counts alike too
            self.doubled += 1
            return ""
        self._last_frame = frame
        due = self.scalings.link.frame_ticks
        step = (frame.ticks - self._last) % TICKS_MODULUS
        if self.frames and 0 < step < TICKS_MODULUS // 2:
            self._periods += step
            self.lost += max(round(step / due) - 1, 0)
        elif self.frames:
            self._periods += due
            self.restarts += 1
        self.frames += 1
        self._last = frame.ticks
        self._status |= frame.status
        return self._line(frame)

    def _line(self, frame: Frame) -> str:
        u_max_V, signals = self.scalings.compensator.u_max_V, self.scalings.compensator.signals
        command = signals.command
        volts, volts_out = float(command.direction(1) * u_max_V / command.span(1)), float(u_max_V / signals.compare_max)
        out = (frame.compare_a - frame.compare_b) * volts_out if frame.status & STATUS_RELEASED else 0.0
        volts_in = (frame.u_adc - command.zero_code) * volts
        codes = (frame.p_a_adc, frame.p_b_adc, frame.p_c_adc)
        pressures = ",".join(
            f"{(code - sensor.zero_code) * float(sensor.per_code_MPa):.5f}"
            for code, sensor in zip(codes, signals.pressures.values(), strict=False)
        )
        return (
            f"{self.duration_s:.4f},{volts_in:.5f},{pressures},{out:.5f},"
            f"{frame.beta / (1 << BETA_BITS):.5f},{frame.compare_a},{frame.compare_b},{frame.status}\n"
        )

    def head(self) -> str:
        """Return what stands before the first line: comments and the names of the columns."""
        comments = (
            f"recorded by dzdesign {TOOL['version']} monitor, firmware of compensator SHA-256 {self.scalings.sha256}",
            "u_V: command u_i. uO_V: output u_O, negative of solenoid B, 0 while the output is held low; "
            "to look at the valve without its "
            'compensator: --columns "u=uO_V"',
            "compare_a, compare_b: PWM compare values of the solenoids. status: bits, 128: output in use, "
            + ", ".join(f"{bit}: {text}" for bit, text in STATUS_BITS.items()),
            "The firmware does not measure the flow: add a column Q_Lmin, your flow meter's reading at each time_s. "
            "The ramp of u_V, recorded by both, tells the shift between the two clocks",
        )
        columns = ",".join(columns_of(self.scalings.compensator))
        return "".join(f"# {comment}\n" for comment in comments) + f"{columns}\n"

    def foot(self, reader: FrameReader) -> str:
        """Return what stands after the last line: what was recorded, and what `reader` missed."""
        return (
            f"# {self.frames} frames, {self.lost} lost, {reader.bad_crc} with a wrong CRC, {self.restarts} restarts\n"
        )


class RecordingFile:
    """Whole lines, handed to the system at once and to the disk every second.

    The file is made at once, and none that exists is taken: another recording may be under way into it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        #: Octets of the whole lines in the file.
        self.octets = 0
        self._synced = 0.0
        try:
            self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | BINARY, 0o666)
        except FileExistsError as error:
            raise InputError(
                f"'{path}' exists, and a recording is not to be had again; choose another name with -o"
            ) from error
        except OSError as error:
            raise InputError(f"'{path}' can't be written: {reason_of(error)}") from error

    def write(self, lines: str) -> None:
        """Append whole lines, or none; what came a second before reaches the disk.

        Raises
        ------
        InputError
            If they can't be written, as on a full disk; the file then ends with the last line that was whole.
        """
        data, done = lines.encode(), 0
        try:
            if data and not self.octets:
                note_written(self.path)
                sync_folder(self.path.parent)
            while done < len(data):
                done += os.write(self._descriptor, data[done:])
            self.octets += len(data)
            if (now := time.monotonic()) - self._synced >= SYNC_S:
                os.fsync(self._descriptor)
                self._synced = now
        except OSError as error:
            self.octets += data[:done].rfind(b"\n") + 1
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, self.octets)
            raise InputError(f"'{self.path}' can't be written: {reason_of(error)}") from error

    def close(self) -> None:
        """Sync and close the file; one into which nothing came goes again."""
        with contextlib.suppress(OSError):  # a full disk, which was said
            os.fsync(self._descriptor)
        os.close(self._descriptor)
        if not self.octets:
            self.path.unlink(missing_ok=True)


@contextlib.contextmanager
def recording_file(path: Path) -> Iterator[RecordingFile]:
    """Give the file of a recording, which is closed at the end of the context."""
    file = RecordingFile(path)
    try:
        yield file
    finally:
        file.close()
