"""Readers of what comes from a device: frames on a serial line, and calibration blocks in their three formats."""

import tempfile
import zlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from output_targets import compensator
from target import Target

from dzdesign.codegen.calibration.block import block_of
from dzdesign.codegen.calibration.packing import CRC_OCTETS, FORMATS, OCTETS, image_of, pack, read_block_file, unpack
from dzdesign.codegen.calibration.reading import reading_of
from dzdesign.codegen.loading.protocol import HEADER_OCTETS, MOST_PAYLOAD, REPLY, Frame, FrameReader, reason_text
from dzdesign.codegen.loading.session import LoadSession
from dzdesign.codegen.project import target_named, targets
from dzdesign.codegen.telemetry.frame import FRAME_OCTETS
from dzdesign.codegen.telemetry.frame import FrameReader as TelemetryReader
from dzdesign.core.errors import InputError, RequirementError

#: Target whose block has every address that a file may have.
OF = "f28335"
#: What a line that says nothing more takes of the time, s.
SILENCE_S = 0.25


def _telemetry(data: bytes) -> None:
    reader = TelemetryReader()
    for start in range(0, len(data), 7):
        list(reader.feed(data[start : start + 7]))
    held = len(data) - reader.skipped - reader.frames * FRAME_OCTETS
    if not 0 <= held < FRAME_OCTETS:
        raise ValueError(f"{held} octets are neither skipped, nor in a frame, nor held")


def _frames(data: bytes) -> None:
    reader = FrameReader()
    for start in range(0, len(data), 5):
        for frame in reader.feed(data[start : start + 5]):
            frame.drive_state()
            if reply := frame.reply():
                reason_text(reply.reason)


class DrivenLine:
    """A line whose other end answers with the data, piece by piece; an even first octet makes a whole reply of one."""

    def __init__(self, data: bytes) -> None:
        self.left, self.time, self.answers, self.asked = data, 0.0, b"", b"\0" * HEADER_OCTETS

    def write(self, octets: bytes) -> None:
        self.asked = octets
        head, size = self.left[:1] or b"\1", min(self.left[1] if len(self.left) > 1 else 0, MOST_PAYLOAD)
        piece, self.left = self.left[2 : 2 + size], self.left[2 + size :]
        if head[0] % 2 == 0:
            piece = Frame(type=self.asked[2] | REPLY, sequence=self.asked[3], payload=piece).octets()
        self.answers += piece

    def read(self, limit_s: float) -> bytes:
        self.time += min(limit_s, SILENCE_S)
        answers, self.answers = self.answers, b""
        return answers

    def now(self) -> float:
        return self.time


def _loading(data: bytes) -> None:
    for act in (
        lambda session: session.query(),
        lambda session: list(session.loading(_block(), 1, 2)),
        lambda session: session.abort(),
    ):
        try:
            act(LoadSession(DrivenLine(data)))
        except (InputError, RequirementError) as error:  # of both says its class: no reply, and a refusal
            if not str(error):
                raise ValueError("a refusal without a word") from error


@cache
def _block() -> bytes:
    return pack(block_of(compensator(), "0123456789abcdef" * 4, serial="V-7", record="lot 12"))


def _calibration_file(data: bytes) -> None:
    path = Path(_folder()) / "block"
    path.write_bytes(data)
    sectors = {target.name: target.block_place for target in targets() if target.sector}
    for form in FORMATS:
        try:
            octets, place = read_block_file(path, form)
            if place is not None:
                place.in_words(sectors)
            unpack(octets)
        except InputError:
            continue


def _calibration_block(data: bytes) -> None:
    octets = data[: OCTETS - CRC_OCTETS].ljust(OCTETS - CRC_OCTETS, b"\0")
    block = unpack(octets + zlib.crc32(octets).to_bytes(CRC_OCTETS, "little"))
    reading_of(block, "the block")


def _calibration_seeds() -> Iterator[bytes]:
    for form in FORMATS:
        yield image_of(_block(), form, target_named(OF).block_place)
        yield image_of(_block(), form, target_named("cortex-m4").block_place)


@cache
def _folder() -> str:
    return tempfile.mkdtemp(prefix="dzdesign-fuzz-")


FRAMES = Frame(type=5 | REPLY, sequence=1, payload=bytes(60)).octets(), Frame(type=1, sequence=0, payload=b"").octets()
TARGETS = {
    "telemetry": Target(run=_telemetry, seeds=lambda: [b"\xa5\x5a\x02\x14" + bytes(24), b"\x5a\xa5" * 20]),
    "loading-frames": Target(run=_frames, seeds=lambda: [*FRAMES, b"".join(FRAMES) * 3]),
    "loading": Target(run=_loading, seeds=lambda: [b"\0\x06" + bytes(6), (b"\0\x06" + bytes(6)) * 99, bytes(70)]),
    "calibration-file": Target(run=_calibration_file, seeds=lambda: list(_calibration_seeds())),
    "calibration-block": Target(run=_calibration_block, seeds=lambda: [_block()]),
}
