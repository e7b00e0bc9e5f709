"""A drive's generated load code in this process, and a line to it that loses, doubles, changes and delays octets."""

import ctypes
import random
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from dzdesign.codegen.loading.session import LoadSession

HERE = Path(__file__).parent
TICK_HZ = 2500
SLOTS, LINKED = 2, 2
OPTIONS = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror")


def build_drive(compiler: str, files: Mapping[str, str], folder: Path, *more: str, program: bool = False) -> Path:
    """Compile the load code, the block's check and the bench around them, as a library or as a program."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    own = folder / "drive.c"
    own.write_text((HERE / "drive.c").read_text("utf-8"), encoding="utf-8")
    objects = []
    for source in (*(folder / name for name in files if name.endswith(".c") and name != "dz_store.c"), own):
        objects.append(str(source.with_suffix(".o")))
        bench = ["-D_GNU_SOURCE", "-Wno-conversion", *(["-DDRIVE_PROGRAM"] if program else [])]
        options = [*OPTIONS, *(bench if source == own else []), *more]
        _compile(compiler, *options, "-fPIC", f"-I{folder}", "-c", str(source), "-o", objects[-1])
    result = folder / ("drive" if program else "drive.so")
    _compile(compiler, *(() if program else ("-shared",)), *more, *objects, "-o", str(result))
    return result


def _compile(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


class Drive:
    """The drive, its memory and its supply."""

    def __init__(self, library: Path, block_octets: int) -> None:
        self.code = ctypes.CDLL(str(library))
        self.code.drive_memory.restype = self.code.drive_block.restype = ctypes.c_void_p
        self.block_octets = block_octets
        self.slot_octets = block_octets + 2 + 2  # the mark, and the struct's end at an even word
        self._taken = ctypes.create_string_buffer(4096)

    def set(self, **values: int) -> None:
        """Set variables of drive.c: `octets_left` is `drive_octets_left`."""
        for name, value in values.items():
            kind = ctypes.c_long if name.endswith("_left") else ctypes.c_int
            kind.in_dll(self.code, f"drive_{name}").value = value

    def get(self, name: str) -> int:
        return ctypes.c_int.in_dll(self.code, f"drive_{name}").value

    @property
    def words(self) -> int:
        return ctypes.c_ulong.in_dll(self.code, "drive_words").value

    def erase(self) -> None:
        for slot in range(SLOTS):
            ctypes.memset(self.code.drive_memory(slot), 0xFF, self.slot_octets)

    def link(self, block: bytes) -> None:
        ctypes.memmove(self.code.drive_memory(LINKED), block, len(block))

    def slot(self, slot: int) -> bytes:
        return ctypes.string_at(self.code.drive_memory(slot), self.slot_octets)

    def write_slot(self, slot: int, octets: bytes) -> None:
        ctypes.memmove(self.code.drive_memory(slot), octets, len(octets))

    def power_on(self, seed: int = 1, busy: int = 0) -> bytes | None:
        """Start from what the memory holds; return the block that is used then."""
        self.code.drive_power_on(seed, busy)
        return self.block()

    def block(self) -> bytes | None:
        at = self.code.drive_block()
        return ctypes.string_at(at, self.block_octets) if at else None

    def take(self) -> bytes:
        count = self.code.drive_take(self._taken, len(self._taken))
        return self._taken.raw[:count]


@dataclass
class Faults:
    """Chances of what happens to an octet, and to a piece that is written at once, on its way in either direction."""

    rng: random.Random
    lost: float = 0.0
    doubled: float = 0.0
    changed: float = 0.0
    piece_lost: float = 0.0
    piece_doubled: float = 0.0
    piece_late: float = 0.0
    late: list[bytes] = field(default_factory=list)

    def through(self, piece: bytes) -> bytes:
        """Return what comes out at the other end, a piece that was held back before it included."""
        rng = self.rng
        octet_faults = self.lost + self.doubled + self.changed
        if octet_faults:
            piece = b"".join(map(self._octet, piece))
        draw = rng.random()
        if draw < self.piece_lost:
            piece = b""
        elif draw < self.piece_lost + self.piece_doubled:
            piece += piece
        elif draw < self.piece_lost + self.piece_doubled + self.piece_late:
            self.late.append(piece)
            piece = b""
        elif self.late and rng.random() < 0.5:
            piece += self.late.pop(0)
        return piece

    def _octet(self, octet: int) -> bytes:
        draw = self.rng.random()
        if draw < self.lost:
            return b""
        if draw < self.lost + self.doubled:
            return bytes((octet, octet))
        if draw < self.lost + self.doubled + self.changed:
            return bytes((octet ^ 1 << self.rng.randrange(8),))
        return bytes((octet,))


class VirtualLine:
    """The line between a session and a drive, with a clock of its own."""

    def __init__(self, drive: Drive, there: Faults | None = None, back: Faults | None = None) -> None:
        self.drive, self.there, self.back = drive, there, back
        self.time_s = 0.0
        self._came = b""

    def now(self) -> float:
        return self.time_s

    def write(self, octets: bytes) -> None:
        octets = self.there.through(octets) if self.there else octets
        self.drive.code.drive_feed(octets, len(octets))
        self._pass(0.002, 4)

    def read(self, limit_s: float) -> bytes:
        if not self._came:
            self._pass(min(limit_s, 0.05), 4)
        else:
            self.time_s += 0.0001
        came, self._came = self._came, b""
        return came

    def _pass(self, time_s: float, passes: int) -> None:
        self.time_s += time_s
        self.drive.code.drive_wait(round(time_s * TICK_HZ), passes)
        came = self.drive.take()
        self._came += self.back.through(came) if self.back and came else came


def session(drive: Drive, there: Faults | None = None, back: Faults | None = None, sequence: int = 0) -> LoadSession:
    return LoadSession(VirtualLine(drive, there, back), sequence)
