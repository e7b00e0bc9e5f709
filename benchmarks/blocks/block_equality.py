"""Block form against fixed form on every input: host, Cortex-M4 and AVR, each a count and a hash of all outputs."""

import os
import selectors
import shutil
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic, perf_counter

from scoreboard import Row, print_rows, say
from two_forms import TwoForms, block_as_c, two_forms

from dzdesign.verify.toolchain.machines import AVR, CHIP, CORTEX_M4, HOST, Machine

PROGRAM = "block_equality.c"
#: Of the differences of pressure codes, every so many-th: on an AVR in simavr, and everywhere of a quick run.
SIMULATED, QUICK = 1021, 512
RUN_TIMEOUT_S = 6 * 3600.0
#: It translates to the host's code, some ten times as fast as simavr; its programs have no end.
QEMU_AVR = ("qemu-system-avr", "-M", "mega", "-nographic", "-monitor", "none", "-serial", "stdio", "-bios")


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """What one machine found of one side of a design."""

    inputs: int
    edge_inputs: int
    unlike_compare: int
    unlike_status: int
    unlike_beta: int
    first: tuple[int, int, int]
    outputs_hash: str
    seconds: float

    @property
    def unlike(self) -> int:
        """Outputs in which the forms differ."""
        return self.unlike_compare + self.unlike_status + self.unlike_beta


def print_block_equality(quick: bool = False, seed: int = 0) -> list[Row]:
    """Compare, print and return the rows."""
    del seed
    rows = []
    for forms in two_forms():
        for sign in forms.compensator.signals.signs:
            rows += _side(forms, sign, QUICK if quick else 1)
    print_rows("Block form against fixed form: every input", rows)
    return rows


def _side(forms: TwoForms, sign: int, stride: int) -> list[Row]:
    name = f"{forms.name}, {'negative' if sign < 0 else 'positive'}"
    rows, hashes = [], []
    for machine in (HOST, CORTEX_M4, AVR):
        if missing := missing_of(machine):
            rows.append(Row(what=f"{name}: {machine.name}", value=float("nan"), limit=0, note=f"not run: {missing}"))
            continue
        found = compared(forms, sign, machine, stride)
        hashes.append(found.outputs_hash)
        first = f"; first {found.first}" if found.unlike else ""
        note = f"{found.inputs} inputs and {found.edge_inputs} of codes beyond, hash {found.outputs_hash}, "
        note += f"{found.seconds:.0f} s{first}"
        rows.append(Row(what=f"{name}: outputs unlike, {machine.name}", value=found.unlike, limit=0, note=note))
        say(f"{rows[-1].what}: {found.unlike}; {note}")
    rows.append(Row(what=f"{name}: hashes of outputs beyond the first", value=len(set(hashes)) - 1, limit=0))
    if not missing_of(AVR) and not AVR.missing():
        by_simulator = [compared(forms, sign, AVR, SIMULATED, runner).outputs_hash for runner in (None, AVR.runner)]
        note = f"every {SIMULATED}th difference, {by_simulator[1]}"
        rows.append(
            Row(what=f"{name}: simavr unlike QEMU", value=float(len(set(by_simulator)) - 1), limit=0, note=note)
        )
    return rows


def compared(
    forms: TwoForms, sign: int, machine: Machine, stride: int, runner: tuple[str, ...] | None = None
) -> Compared:
    """Compile both forms for a machine and run them there beside each other, on every `stride`th difference."""
    edges = "".join(f"{code}u, " for code in forms.edges)
    header = f"#include <stdint.h>\nstatic const uint16_t edges[] = {{{edges}}};\n"
    sources = {PROGRAM: (Path(__file__).parent / PROGRAM).read_bytes(), "edges.h": header.encode(), **machine.headers}
    sources["dz_calibration.h"] = forms.block_sources["dz_calibration.h"]
    rows = (("DZ_FIRST", 0), ("DZ_STRIDE", stride), ("DZ_END", 2**30))
    flags = (*machine.check_flags, *(f"-D{name}=INT32_C({value})" for name, value in rows))
    objects = [*forms.objects(machine, sign), machine.compile(PROGRAM, sources, flags, "the comparison")]
    block = {"dz_block.c": block_as_c(forms.block).encode()}
    objects.append(machine.compile("dz_block.c", block, machine.check_flags, "the block"))
    program = machine.link(objects, "the comparison")
    begin = perf_counter()
    printed = run_program(machine, program, runner)
    inputs, edge_inputs, *unlike, u, a, b, high, low = printed
    return Compared(
        inputs=inputs,
        edge_inputs=edge_inputs,
        unlike_compare=unlike[0],
        unlike_status=unlike[1],
        unlike_beta=unlike[2],
        first=(u, a, b),
        outputs_hash=f"{high:08x}{low:08x}",
        seconds=perf_counter() - begin,
    )


def run_program(machine: Machine, program: Path, runner: tuple[str, ...] | None = None) -> list[int]:
    """Return the numbers that a program prints; an AVR's runs in QEMU unless another runner is named."""
    if machine.small and runner is None:
        return _first_line([*QEMU_AVR, str(program)])
    return replace(machine, run_timeout_s=RUN_TIMEOUT_S).run(program, [], "the comparison")[0]


def _first_line(command: list[str]) -> list[int]:
    """Return the numbers that a program without an end prints, and end it."""
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE) as process:
        printed, end = b"", monotonic() + RUN_TIMEOUT_S
        with selectors.DefaultSelector() as ready:
            ready.register(process.stdout, selectors.EVENT_READ)
            while b"\n" not in printed and monotonic() < end and ready.select(end - monotonic()):
                chunk = os.read(process.stdout.fileno(), 4096)
                if not chunk:
                    break
                printed += chunk
        process.kill()
    return [int(word) for word in printed.split()]


def missing_of(machine: Machine) -> str:
    """Return what was not found, with what to install, or an empty text."""
    if not machine.small:
        return machine.missing()
    needs = {"avr-gcc": "gcc-avr avr-libc", QEMU_AVR[0]: "qemu-system-misc"}
    absent = [program for program in needs if not shutil.which(program)]
    packages = " ".join(needs[each] for each in absent)
    return f"{CHIP}: {' and '.join(absent)} not found; apt install {packages}" if absent else ""
