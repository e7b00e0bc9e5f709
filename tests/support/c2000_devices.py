"""The generated firmware of both C2000 boards on the device models of `verify`, with a core that tells more.

A form of it is compiled once in a session; of a seeded fault only the file that it is in.
"""

import re
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from functools import cache, partial
from pathlib import Path

from dzdesign.codegen.banner import Banner
from dzdesign.codegen.project import target_files, target_named
from dzdesign.verify.hardware.model import HERE as MODELS
from dzdesign.verify.toolchain.host_compiler import STRICT, host_compiler
from tests.support.current_loops import current_texts
from tests.support.example_coil import SENSORS, with_current
from tests.support.golden_firmware import FULL, GOLDENS, golden_compensator
from tests.support.paths import TESTS

BOARDS = ("f28335", "f280049c")
ONE, TWO = "one solenoid", "two solenoids"
DIGEST = "1234567890abcdef"
#: What of the model is compiled with the firmware; driver.c includes main.c, core.c stands in for the core.
DRIVERS = TESTS / "support" / "devices"
HEADERS = {"f28335": "DSP28x_Project.h", "f280049c": "driverlib.h"}
PROTOTYPE = re.compile(r"^(?:void|bool|uint\w+_t) (\w+)\((.*?)\);", re.MULTILINE | re.DOTALL)
#: Runs periods, an event each; then what the start is like (W: after a watchdog reset, C: without crystal).
Run = Callable[..., list[dict]]
#: File, what stands in it, and what stands there with the fault.
Edit = tuple[str, str, str]
_SCRATCH = tempfile.TemporaryDirectory(prefix="dzdesign-devices-")


@cache
def texts_of(board: str, form: str = ONE) -> Mapping[str, str]:
    """Return the files around the core by name, with `form` a sensor of `SENSORS` the current controller too."""
    compensator, core = golden_compensator(board, FULL if form == TWO else GOLDENS), {}
    if sensor := SENSORS.get(form):
        compensator = with_current(compensator, target_named(board), sensor)
        core = current_texts(compensator.current_drive.loop)
    made = target_files(compensator, target_named(board), Banner(digest=DIGEST))
    return {path.rpartition("/")[2]: text for path, text in made.items()} | core


def write(texts: Mapping[str, str], folder: Path) -> None:
    """Write texts into a folder."""
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")


def seeded(texts: Mapping[str, str], edit: Edit) -> dict[str, str]:
    """Return texts with a fault at the first place where it can be; there must be one."""
    file, old, new = edit
    before, found, after = texts[file].partition(old)
    assert found, f"{old!r} is not in {file}"
    return {**texts, file: before + new + after}


def model_of(board: str, *drivers: str) -> list[Path]:
    """Return the C files of a device's model, with some of the drivers."""
    model = sorted((MODELS / board).glob("*.c"))
    return [*model, MODELS / "programs" / "engine.c", DRIVERS / "periods.c", *(DRIVERS / name for name in drivers)]


def model_options(board: str, *folders: Path) -> list[str]:
    """Return the options to compile the model of a device with the files of some folders."""
    places = (*folders, MODELS / board, MODELS / "programs", DRIVERS)
    return [f"-D{board.upper()}", *(f"-I{place}" for place in dict.fromkeys(places))]


@cache
def program(board: str, form: str = ONE, edit: Edit | None = None, options: tuple[str, ...] = ()) -> Path:
    """Return the compiled firmware; a call that does not fit the types of TI's stand-ins is an error."""
    folder = Path(tempfile.mkdtemp(dir=_SCRATCH.name))
    texts = texts_of(board, form)
    base = program(board, form, None, options).parent if edit and edit[0].endswith(".c") else folder
    write({edit[0]: seeded(texts, edit)[edit[0]]} if base != folder else seeded(texts, edit) if edit else texts, folder)
    units = [base / name for name in texts if name.endswith(".c") and name != "main.c"]
    units += model_of(board, "core.c", "driver.c")
    changed = {edit[0].replace("main.c", "driver.c")} if base != folder else {unit.name for unit in units}
    include = ["-DSTAND_IN_CORE", *model_options(board, folder, base)]
    for unit in (unit for unit in units if unit.name in changed):
        source = folder / unit.name if unit.parent == base else unit
        own = options if unit.parent == base or unit.name == "driver.c" else ()
        compiled(*own, *include, "-c", source, "-o", folder / f"{unit.stem}.o")
    objects = [(folder if unit.name in changed else base) / f"{unit.stem}.o" for unit in units]
    compiled(*objects, "-lm", "-o", folder / "program")
    return folder / "program"


@cache
def calls_of(board: str, form: str = ONE, edit: Edit | None = None, *options: str) -> list[str]:
    """Return what a firmware calls of TI's functions, as written there: up to the interrupts, and in two of them."""
    header = Path(_SCRATCH.name) / f"calls_of_{board}.h"
    text = (MODELS / board / HEADERS[board]).read_text("utf-8") + (MODELS / board / "device.h").read_text("utf-8")
    names = [name for name, _ in PROTOTYPE.findall(text) if not re.match("device_(sci|octet|eallow|edis)", name)]
    lines = [
        "#include <stdio.h>",
        f'#include "{HEADERS[board]}"',
        '#include "device.h"',
        "#define TEXT(...) #__VA_ARGS__",
    ]
    lines += ['#define CALLED(name, ...) (puts(#name " " TEXT(__VA_ARGS__)), (name)(__VA_ARGS__))']
    lines += [f"#define {name}(...) CALLED({name}, __VA_ARGS__)" for name in names]
    header.write_text("\n".join([*lines, ""]), encoding="utf-8")
    made = program(board, form, edit, ("-include", str(header), "-Wno-pedantic", "-Wno-unused-value", *options))
    plain = (re.sub(r"\b(\d+)u\b", r"\1", line.replace(", ", " ").strip()) for line in run(made, "main"))
    return [line.replace("&", "") for line in plain]


def compiled(*words: str | Path) -> None:
    """Compile with all warnings as errors; a seeded fault may leave something unused."""
    command = [host_compiler(), *STRICT, "-Wenum-conversion", "-Wno-unused-function", "-Wno-pedantic", *words]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def run(program: Path, *words: str) -> list[str]:
    done = subprocess.run([program, *words], capture_output=True, text=True, check=True, timeout=20)
    return done.stdout.splitlines()


def periods(program: Path, events: str, *start: str) -> list[dict]:
    """One dictionary a PWM period, numbers as integers."""
    lines = [line.split()[1:] for line in run(program, "run", events, *start) if line.startswith("tick ")]
    assert len(lines) == len(events)
    ticks = (dict(word.split("=", 1) for word in words) for words in lines)
    return [{key: int(value) if value.isdigit() else value for key, value in tick.items()} for tick in ticks]


def running(board: str, form: str = ONE, edit: Edit | None = None) -> Run:
    """Return the function that runs a firmware through periods; `.args[0]` is its program."""
    run = partial(periods, program(board, form, edit))
    run.of = (board, form, edit)
    return run


def column(ticks: list[dict], key: str) -> list:
    """Return one fact of every period."""
    return [tick[key] for tick in ticks]
