"""The generated f28335 firmware of block form on the model of the device, and a line to it with the device's clock."""

import subprocess
from pathlib import Path

from dzdesign.codegen.banner import Banner
from dzdesign.codegen.calibration.block import block_of, built_for
from dzdesign.codegen.calibration.files import block_core_files
from dzdesign.codegen.f28335.target import TARGET
from dzdesign.codegen.project import target_files
from tests.support.c2000_devices import model_of, model_options
from tests.support.core_texts import texts
from tests.support.loading.bench import HERE
from tests.support.loading.files import COMPILER, DIGEST, compensator, drive_files

PERIOD_S = 1 / TARGET.tick_Hz
SOURCES = ("dz_hardware.c", "dz_isr.c", "dz_telemetry.c", "dz_frame.c", "dz_active.c", "dz_calibration.c", "dz_store.c",
           "dz_user.c")  # fmt: skip
LOADING = ("dz_load.c", "dz_load_frame.c", "dz_slots.c")


def firmware_files(*, real_core: bool = False) -> dict[str, str]:
    """Return the target's files in block form, by name, with stand-ins of law and drive or with the generated ones."""
    rendered = target_files(compensator(), TARGET, Banner(digest=DIGEST), block_of(compensator(), DIGEST))
    files = {path.rpartition("/")[2]: text for path, text in rendered.items()} | drive_files()
    if real_core:
        files |= texts(block_core_files(built_for(compensator())))
    else:
        files |= {name: (HERE / name).read_text("utf-8") for name in ("dz_comp.h", "dz_drive.h")}
    return files | {"dz_block.h": '#include "dz_calibration.h"\nextern struct dz_calibration dz_block;\n'}


def build_device(files: dict[str, str], folder: Path) -> Path:
    """Compile the firmware with the model of the device; the warnings are errors."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    program = folder / "on_device"
    sources = [folder / name for name in (*SOURCES, *LOADING)]
    core = [folder / name for name in ("dz_comp.c", "dz_drive.c") if name in files]
    sources += [*core, *model_of("f28335"), HERE / "on_device.c"]
    command = [COMPILER, "-std=c99", "-Wall", "-Wextra", "-Werror", *(["-DREAL_CORE"] if core else [])]
    command += [*model_options("f28335", folder), *map(str, sources), "-lm", "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


class Device:
    """The running firmware; each call lets time go by, or tells it what happens."""

    def __init__(self, program: Path, linked: bytes) -> None:
        self._process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.sent = bytearray()
        self.tell(f"linked {linked.hex()}")
        self.tell("start")

    def tell(self, line: str) -> dict[str, int]:
        """Send a line, and return the state after it."""
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
        while not (answer := self._process.stdout.readline()).startswith("answer "):
            assert answer, "the program has ended"
        *facts, octets = (word.partition("=")[2] for word in answer.split()[1:])
        self.sent += bytes.fromhex(octets)
        names = (word.partition("=")[0] for word in answer.split()[1:-1])
        return dict(zip(names, map(int, facts), strict=True))

    def run(self, periods: int) -> dict[str, int]:
        return self.tell(f"run {periods}")

    def take(self) -> bytes:
        taken = bytes(self.sent)
        self.sent.clear()
        return taken

    def end(self) -> None:
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait(20)


class DeviceLine:
    """The line of a `LoadSession`; it keeps what the device sent, telemetry and all, and what it looked like."""

    def __init__(self, device: Device) -> None:
        self.device, self.time_s = device, 0.0
        self.all = bytearray()
        self.seen: list[dict[str, int]] = []

    def now(self) -> float:
        return self.time_s

    def write(self, octets: bytes) -> None:
        self.device.tell(f"send {octets.hex()}")

    def read(self, limit_s: float) -> bytes:
        self.seen.append(self.device.run(10))
        self.time_s += 10 * PERIOD_S
        came = self.device.take()
        self.all += came
        return came
