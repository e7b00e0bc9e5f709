"""A firmware compiled with the model of its device, and what happens outside when it runs."""

import re
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from dzdesign.core.documents import read_bytes, sha256_of
from dzdesign.core.errors import RequirementError
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import BLOCK_FILE, FirmwareManifest
from dzdesign.verify.folder import USER_FOLDER
from dzdesign.verify.hardware.board_values import Board, project_defines
from dzdesign.verify.toolchain.host_compiler import STRICT, build, build_folder, host_compiler, words_of
from dzdesign.verify.toolchain.machines import run_child

HERE = Path(str(files("dzdesign.verify.hardware")))
#: A self test has a main() of its own.
NOT_LINKED = ("main.c", "dz_selftest.c", "selftest.c")
OPTIONS = ("-O1", "-Wenum-conversion", "-Wno-pedantic")
MAIN_OPTIONS = ("-Dmain=firmware_main", "-finstrument-functions")
#: A run takes some hundredths of a second.
RUN_S = 15.0
LOW, HIGH = 0, 1
#: What a channel converts to that no input is wired to.
NONSENSE = 4000
LINE = re.compile(r"(\d+) ([a-z]+) (\d+) (\d+)", re.ASCII)


@dataclass(frozen=True, slots=True, kw_only=True)
class Device:
    """What is known of a device, from its manual."""

    crystal_Hz: int
    channels: tuple[str, ...]
    #: Clock of the watchdog; None: the crystal. It resets after 2^17 periods, times a factor of the board's.
    watchdog_Hz: int | None
    prescale: str
    #: Whether the counter goes on to the end of its period, where the pin is low, when a debugger halts the processor.
    halts_low: bool


DEVICES = {
    "f28335": Device(
        crystal_Hz=30_000_000, channels=tuple(f"{half}{n}" for half in "AB" for n in range(8)), watchdog_Hz=None,
        prescale="WDPS", halts_low=True,
    ),
    "f280049c": Device(
        crystal_Hz=20_000_000, channels=tuple(f"A{n}" for n in range(16)), watchdog_Hz=10_000_000,
        prescale="WD_PRESCALE", halts_low=False,
    ),
}  # fmt: skip
WATCHDOG_PERIODS = 512 * 256


@dataclass(frozen=True, slots=True)
class Step:
    """What happens from a time on, after the interrupts are enabled; see programs/scenario.c."""

    at_us: float
    word: str
    one: float
    two: float = 0


class Event(NamedTuple):
    """What happened, at a count of the clock; words and numbers as programs/scenario.c prints them."""

    at: int
    word: str
    one: int
    two: int


class Due(NamedTuple):
    """What an interrupt must leave: codes of the last sample, compare values, the drive's side and its status."""

    codes: tuple[int, ...]
    compares: tuple[int, int]
    side: int
    status: int
    released: bool


class Pin:
    """The levels of a pin over a run: low, high, or neither (2)."""

    def __init__(self, events: Sequence[Event], before: int) -> None:
        self.times, self.levels = [0, *(each.at for each in events)], [before, *(each.two for each in events)]

    def level_at(self, at: int) -> int:
        """Return the level from a count on."""
        return self.levels[bisect_right(self.times, at) - 1]

    def rises(self) -> list[int]:
        """Return when it became high."""
        return [at for at, level in zip(self.times[1:], self.levels[1:], strict=True) if level == HIGH]

    def not_low_from(self, begin: int, end: int) -> int | None:
        """Return when the pin is not low first, from a count to another."""
        if self.level_at(begin) != LOW and begin < end:
            return begin
        later = range(bisect_right(self.times, begin), bisect_right(self.times, end - 1))
        return next((self.times[place] for place in later if self.levels[place] != LOW), None)

    def high_counts(self, begin: int, end: int) -> int:
        """Return for how many counts it is not low, from a count to another."""
        inner = range(bisect_right(self.times, begin), bisect_right(self.times, end - 1))
        times = [begin, *(self.times[place] for place in inner), end]
        return sum(later - at for at, later in pairwise(times) if self.level_at(at) != LOW)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trace:
    """What happened in a run: since the clock was last set, and before."""

    clock_Hz: int
    events: tuple[Event, ...]
    early: tuple[Event, ...]
    _pins: dict[int, Pin] = field(default_factory=dict)

    def times(self, word: str, one: int | None = None) -> list[int]:
        """Return when something happened."""
        return [each.at for each in self.events if each.word == word and one in (None, each.one)]

    @property
    def start(self) -> int:
        """When interrupts were enabled."""
        return next(iter(self.times("start")), self.end)

    @property
    def end(self) -> int:
        """When the run ended."""
        return self.events[-1].at if self.events else 0

    def count_at(self, at_us: float) -> int:
        """Return the count at a time after the start."""
        return self.start + round(at_us * 1e-6 * self.clock_Hz)

    def ms_of(self, at: int) -> float:
        """Return when a count was, in ms after the start."""
        return 1e3 * (at - self.start) / self.clock_Hz

    def pin(self, gpio: int) -> Pin:
        """Return the levels of a pin; kept, because they are asked for in each period."""
        if gpio not in self._pins:
            early = [each.two for each in self.early if (each.word, each.one) == ("pin", gpio)]
            own = [each for each in self.events if (each.word, each.one) == ("pin", gpio)]
            self._pins[gpio] = Pin(own, early[-1] if early else LOW)
        return self._pins[gpio]

    @property
    def faults(self) -> int:
        """The faults that the firmware has found, a bit each."""
        return next((each.one for each in reversed(self.events) if each.word == "fault"), 0)

    def pins_that_switch(self) -> list[int]:
        """Return the pins that change after the start."""
        found = {each.one for each in self.events if each.word == "pin" and each.at > self.start}
        return sorted(found)


def trace_of(printed: str) -> Trace:
    """Read what a run printed; anything else that is printed is the firmware's."""
    found = [match for line in printed.splitlines() if (match := LINE.fullmatch(line))]
    events = [Event(int(each[1]), each[2], int(each[3]), int(each[4])) for each in found]
    clocks = [place for place, each in enumerate(events) if each.word == "clock"]
    if not clocks:
        raise RequirementError("the firmware ended before its clock was set")
    last = clocks[-1]
    return Trace(clock_Hz=events[last].one, events=tuple(events[last:]), early=tuple(events[:last]))


class Bench:
    """A firmware in its folder, on the model of its device with the user's board."""

    def __init__(self, code: Path, manifest: FirmwareManifest, compensator: Compensator, board: Board) -> None:
        self.compensator, self.board, self.device = compensator, board.values, DEVICES[manifest.target]
        self._target, self._user, self._failure = manifest.target, board.code, ""
        #: Start of the compensator's hash; octets of the block that the firmware takes another for over its line.
        self.origin = int(manifest.origin.compensator_json[:4], 16)
        takes = manifest.calibration == "block" and "SCI_RX_GPIO" in self.board
        self.block = read_bytes(code / BLOCK_FILE, "calibration block of the firmware") if takes else b""
        target = compensator.target
        drive = compensator.current_drive
        shunts = ("CURRENT", "CURRENT_B")[: drive.loop.shunts if drive else 1]
        roles = ["COMMAND", *(f"PRESSURE_{name}" for name in compensator.signals.pressures), *shunts, "SUPPLY"]
        usual = {"COMMAND": "A0", "PRESSURE_A": "A1", "PRESSURE_B": "A2", "PRESSURE_C": "A6"}
        usual |= {"CURRENT": "A3", "CURRENT_B": "A5", "SUPPLY": "A4"}
        declared = target.channels if target else ()
        self.names = dict(zip(roles, declared or [usual[role] for role in roles], strict=False))
        self.crystal_Hz = (target.crystal_Hz if target else None) or self.device.crystal_Hz
        #: Numbers of the declared channels, by what they carry.
        self.channels = {role: self.device.channels.index(name) for role, name in self.names.items()}
        #: Those of the shunts, that of solenoid A first; of one solenoid, or one shunt, one.
        self.shunts = [self.channels[role] for role in shunts if drive]
        self.two = len(compensator.signals.signs) == 2
        if board.lacking:
            raise RequirementError(f"dz_board.h has no DZ_BOARD_{board.lacking[0]}, which the firmware needs")
        self._build(code, project_defines(*board.projects))

    @property
    def runs_user_code(self) -> bool:
        """Whether code of the user's is compiled in."""
        return bool(self._user)

    @property
    def pins(self) -> list[int]:
        """GPIO of each output."""
        return [self.board["PWM_GPIO"], *([self.board["PWM_B_GPIO"]] if self.two else [])]

    @property
    def undeclared(self) -> str:
        """In what the board's file is not what was declared to `design`, as the end of a sentence."""
        board, declared = {role: self.board.get(role) for role in self.channels}, self.channels
        said = [
            f"{role} {self.board[role]}, and declared is {self.names[role]}"
            for role in declared
            if board[role] not in (None, declared[role])
        ]
        if self.board.get("OSC_HZ", self.crystal_Hz) != self.crystal_Hz:
            said.append(f"OSC_HZ {self.board['OSC_HZ']}, and declared are {self.crystal_Hz} Hz")
        return f"; dz_board.h has {'; '.join(said)}" if said else ""

    @property
    def watchdog_s(self) -> float:
        """Time after which the watchdog of this board resets."""
        setting = self.board[self.device.prescale]
        factor = setting if self.device.prescale == "WD_PRESCALE" else 2 ** max(setting - 1, 0)
        return WATCHDOG_PERIODS * factor / (self.device.watchdog_Hz or self.crystal_Hz)

    def _build(self, code: Path, project: Mapping[str, str]) -> None:
        """Compile the firmware with the model; a file that does not compile is a `RequirementError`."""
        units = [path.relative_to(code) for path in sorted(code.rglob("*.c"))]
        units = [path for path in units if path.name not in NOT_LINKED and code / path not in self._user]
        units += [path for path in self._user.values() if path.suffix == ".c"]
        model = [*sorted((HERE / self._target).glob("*.c")), *sorted((HERE / "programs").glob("*.c"))]
        folders = ["core", self._target, USER_FOLDER, str(HERE / self._target), str(HERE / "programs")]
        folders = [*dict.fromkeys(str(path.parent) for path in self._user.values()), *folders]
        flags = [*(["-std=gnu99", "-w"] if self._user else STRICT), *OPTIONS, *(f"-I{folder}" for folder in folders)]
        defines = {f"DZ_BOARD_{name}": str(value) for name, value in self.board.items()} | dict(project)
        flags += [f"-D{name}={value}" for name, value in defines.items()]
        flags += ["-DDEVICE_FROM_FLASH", "-D__interrupt="]  # a word of TI's compiler, which dz_isr.h has by itself
        flags += ["-DTWO_SOLENOIDS"] if self.two else []
        digest = sha256_of("\n".join([str(code), *map(str, units), *flags]).encode())[:16]
        made = build_folder() / f"hardware-{digest}"
        made.mkdir(exist_ok=True)
        command, what = [*words_of(host_compiler()), *flags], "the firmware, with stand-ins for its device's headers,"
        build([*command, *MAIN_OPTIONS, "-c", f"{self._target}/main.c", "-o", str(made / "main.o")], what, code)
        self._program = made / "firmware"
        whole = [str(path) for path in (*units, *model, made / "main.o")]
        build([*command, *whole, "-lm", "-o", str(self._program)], what, code)

    def run(
        self, steps: Sequence[Step], end_us: float, *, after_watchdog: bool = False, no_crystal: bool = False
    ) -> Trace:
        """Run main() from reset until a time after its start, or until the watchdog bites."""
        unwired = [Step(-1, "code", channel, NONSENSE) for channel in range(len(self.device.channels))]
        command = [
            str(self._program),
            str(self.crystal_Hz),
            str(int(after_watchdog)),
            str(int(no_crystal)),
            f"{end_us:.3f}",
        ]
        for step in (*unwired, *sorted(steps, key=lambda step: step.at_us)):
            command += [f"{step.at_us:.3f}", step.word, f"{step.one:.9g}", f"{step.two:.9g}"]
        if self._failure:
            raise RequirementError(self._failure)
        try:
            ended = run_child(command, "the firmware on the device's model", RUN_S)
        except RequirementError as error:  # what hangs once would hang in each run
            self._failure = str(error)
            raise
        if ended.reason:
            raise RequirementError(f"the firmware on the device's model ended with {ended.reason}")
        return trace_of(ended.printed)
