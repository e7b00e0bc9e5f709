"""Drive functions and current controller in block form against fixed form, call by call, on three machines.

The controller is also compared with the exact one, state by state: what is the same in every state is so in sequences.
"""

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from block_equality import missing_of, run_program
from random_designs import random_designs
from scoreboard import Row, print_rows, say
from two_forms import AROUND, TwoForms, block_as_c, two_forms

from dzdesign.codegen.calibration.block import block_of, built_for, current_block
from dzdesign.codegen.calibration.files import block_core_files
from dzdesign.codegen.calibration.layout import CalibrationBlock
from dzdesign.codegen.calibration.packing import pack
from dzdesign.design.compensator import Compensator
from dzdesign.design.current.circuit import CurrentLoop
from dzdesign.design.firmware_manifest import BLOCK_FILE
from dzdesign.verify.current.controller_states import check_states, hashes_on
from dzdesign.verify.current.current_checks import read_controller
from dzdesign.verify.exhaustive.drive_check import CompiledDrive, PreparedDrive
from dzdesign.verify.toolchain.machines import AVR, CORTEX_M4, HOST, Machine
from tests.support.block_cores import block_folder
from tests.support.core_texts import texts
from tests.support.current_loops import LOOPS, current_texts, shape_of

PROGRAM = "block_sequences.c"
#: Samples of the drive and ticks of the controller; of the states against the exact controller.
STEPS = {HOST.name: 5_000_000, CORTEX_M4.name: 1_000_000, AVR.name: 200_000}
STATES = {HOST.name: 2_000_000, CORTEX_M4.name: 200_000, AVR.name: 20_000}
QUICKER = 50
#: Random designs whose drive is compared with its model.
MODELLED = 12
#: Beyond it a state on an AVR is none of `int`'s.
LAST = 65535


@dataclass(frozen=True, slots=True, kw_only=True)
class Sequence:
    """What one machine found of one sequence."""

    steps: int
    unlike: int
    first: int
    states_hash: str


def print_block_sequences(quick: bool = False, seed: int = 0) -> list[Row]:
    """Compare, print and return the rows."""
    rows, designs = [], [*two_forms()]
    valves = {forms.name: forms.compensator.valve for forms in designs}
    random = islice(random_designs(valves, seed), MODELLED // (QUICKER if quick else 1))
    drawn = [TwoForms(f"design {number}", compensator) for number, (_, _, compensator) in enumerate(random)]
    with tempfile.TemporaryDirectory(prefix="bench-verify-") as folder:
        rows += model_rows([*designs, *(forms for forms in drawn if forms.has_room)], Path(folder))
    for forms in designs:
        rows += _on_machines(f"{forms.name}: drive", drive_program(forms, seed), quick)
        drive = forms.compensator.current_drive
        if drive is not None:
            for name, loop in {"its own": drive.loop, **LOOPS}.items():
                rows += _controller(f"controller, {name}", forms.compensator, loop, quick, seed)
    print_rows("Drive functions and current controller, block form against fixed form", rows)
    return rows


def model_rows(designs: list[TwoForms], folder: Path) -> list[Row]:
    """Compare the drive with its model in rational numbers: one firmware, and the block of each design that fits it."""
    rows, firmware = [], {}
    for forms in designs:
        built = built_for(forms.compensator)
        if built not in firmware:
            firmware[built] = (forms.name, block_folder(forms.compensator, folder / str(len(firmware))))
        name, path = firmware[built]
        (path / BLOCK_FILE).write_bytes(forms.block)
        found = CompiledDrive(path).check(PreparedDrive(forms.compensator))
        what = f"{forms.name}: drive unlike its model, firmware of {name}"
        rows.append(
            Row(what=what, value=found.faults, limit=0, note=f"{found.ticks} PWM periods {found.first_wrong or ''}")
        )
        say(f"{what}: {found.faults}")
    return rows


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """A comparison of sequences: its objects for a machine, and what it is told."""

    block: bytes
    #: Headers that the program includes.
    headers: Mapping[str, bytes]
    #: Objects of both forms, by machine.
    objects: Mapping[str, tuple[Path, ...]]
    #: Which of the two lengths it has, and its seed.
    length: str
    seed: int

    def run(self, machine: Machine, steps: int) -> Sequence:
        """Run it for so many samples or ticks."""
        lengths = {"SAMPLES": 0, "TICKS": 0, "SEED": 2 * self.seed + 1, self.length: steps}
        flags = (*machine.check_flags, *(f"-D{name}=UINT32_C({value})" for name, value in lengths.items()))
        flags = tuple(flag.replace("UINT32_C(0)", "0") for flag in flags)
        main = (Path(__file__).parent / PROGRAM).read_bytes()
        sources = {**self.headers, **machine.headers, PROGRAM: main}
        objects = [*self.objects[machine.name], machine.compile(PROGRAM, sources, flags, "the comparison")]
        printed = run_program(machine, machine.link(objects, "the comparison"))
        count, unlike, first, high, low = printed
        return Sequence(steps=count, unlike=unlike, first=first, states_hash=f"{high:08x}{low:08x}")


def drive_program(forms: TwoForms, seed: int, machines: tuple[Machine, ...] = (HOST, CORTEX_M4, AVR)) -> Program:
    """Return the comparison of a design's drive functions."""
    swapped = f"#define SWAPPED {int(built_for(forms.compensator).pair(-1) == 'BA')}\n"
    return Program(
        block=forms.block,
        headers={
            **_headers(forms.block_sources),
            "edges.h": _arrays(drive_edges(forms.compensator)) + swapped.encode(),
        },
        objects={
            machine.name: (*forms.core_objects(machine), _compiled_block(machine, block_as_c(forms.block)))
            for machine in machines
            if not missing_of(machine)
        },
        length="SAMPLES",
        seed=seed,
    )


def drive_edges(compensator: Compensator) -> dict[str, list[int]]:
    """Return the codes at which the drive functions turn, of command and pressures."""
    signals, functions = compensator.signals, compensator.drive_functions
    command, band = signals.command, compensator.zero_band_codes
    places = {0, band, functions.leave_zero_codes, functions.interlock_codes or 0, compensator.transition_end}
    places |= {functions.play_noise_codes, band + functions.play_codes} if functions.has_play else set()
    found = {"command": {*command.valid_codes, signals.code_max}}
    for sign in (1, -1):
        found["command"] |= {command.zero_code + sign * place + near for place in places for near in (-1, 0, 1)}
        if sign in signals.signs:
            found["command"] |= {command.zero_code + command.direction(sign) * command.span(sign)}
    for name, each in (("a", signals.pressure_a), ("b", signals.pressure_b)):
        low, high = each.valid_codes
        found[name] = {low, high, each.zero_code, (low + high) // 2, low + (high - low) // 8, signals.code_max}
    return {name: sorted(code for code in codes if 0 <= code <= LAST) for name, codes in found.items()}


def controller_program(
    compensator: Compensator, loop: CurrentLoop, seed: int, machines: tuple[Machine, ...]
) -> Program:
    """Return the comparison of a current controller; of the compensator are the other numbers of the block."""
    core, block = controller_in_block_form(compensator, loop)
    supply = ", supply" * (loop.supply is not None)
    asked = "(asked)[0], (asked)[1]" if loop.two else "(asked)[0]"
    forms = {"block": f"dz_current_tick(&dz_block, &by_block, {asked}, sum{supply})",
             "fixed": f"dz_current_tick_fixed(&by_fixed, {asked}, sum{supply})"}  # fmt: skip
    words = ["set_point", *(["other"] if loop.two else []), "sum", *(["supply"] if loop.supply else [])]
    types = ", ".join(f"uint16_t {word}" for word in words)
    tick = f"void dz_current_tick_fixed(struct dz_current *loop, {types});\n"
    tick += f"#define TICK_BOTH(asked, sum, supply) ((void)(supply), {forms['block']}, {forms['fixed']})\n"
    tick += f"#define SOLENOIDS {1 + loop.two}u\n"
    tick += f"#define OFFSET_SUMS {loop.offset_ticks}u\n#define OFFSET_NOMINAL {loop.offset_nominal}u\n"
    full = min((loop.full_counts << loop.current_shift) // loop.current_gain, LAST - loop.offset_nominal)
    # Full drive's current, sum of codes over 2^16 a PWM count.
    tick += f"#define FULL_SUM UINT32_C({min((full << 16) // max(loop.compare_limit, 1), 2**16)})\n"
    fixed = {name: text.encode() for name, text in current_texts(loop).items()}
    renamed = [f"-Ddz_{name}=dz_{name}_fixed" for name in AROUND]
    c = block_as_c(pack(block))

    def objects(machine: Machine) -> tuple[Path, ...]:
        return (
            machine.compile("dz_current.c", fixed, (*machine.core_flags, *renamed), "the controller in fixed form"),
            machine.compile("dz_current.c", core, machine.core_flags, "the controller in block form"),
            _compiled_block(machine, c),
        )

    return Program(
        block=pack(block),
        headers={**_headers(core), "edges.h": _arrays(controller_edges(loop)), "tick.h": tick.encode()},
        objects={machine.name: objects(machine) for machine in machines if not missing_of(machine)},
        length="TICKS",
        seed=seed,
    )


def controller_in_block_form(compensator: Compensator, loop: CurrentLoop) -> tuple[dict[str, bytes], CalibrationBlock]:
    """Return the core in block form of a firmware with that controller, and its block."""
    built = replace(built_for(compensator), shape=shape_of(loop), samples=loop.samples)
    block = replace(block_of(compensator, "0" * 64), shape=built.shape, current=current_block(loop))
    return {name: text.encode() for name, text in texts(block_core_files(built)).items()}, block


def controller_edges(loop: CurrentLoop) -> dict[str, list[int]]:
    """Return the inputs at which the controller turns."""
    low, high = loop.supply.valid_codes if loop.supply else (0, 4095)
    sums = (loop.short_sum, *(loop.offset_nominal + each for each in (0, loop.over_sum, loop.open_sum)))
    ends = (loop.offset_nominal - loop.offset_tolerance, loop.offset_nominal + loop.offset_tolerance)
    found = {
        "offset": [loop.offset_nominal] * 4 + [end + near for end in ends for near in (-1, 0)],
        "sum": [1, 2, LAST - 1, *sums],
        "set_point": [0, 1, loop.full_counts, loop.full_counts // 2, loop.full_counts // 50, loop.rate, LAST - 1],
        "supply": [1, LAST - 1, low, high, (low + high) // 2],
    }
    return {name: [min(max(value, 0), LAST) for value in values] for name, values in found.items()}


def _controller(name: str, compensator: Compensator, loop: CurrentLoop, quick: bool, seed: int) -> list[Row]:
    """Compare a controller along a sequence, and in any state with the exact one."""
    rows = _on_machines(name, controller_program(compensator, loop, seed, (HOST, CORTEX_M4, AVR)), quick)
    states = {machine: count // (QUICKER if quick else 1) for machine, count in STATES.items()}
    with tempfile.TemporaryDirectory(prefix="bench-verify-") as folder:
        core = _written_controller(compensator, loop, Path(folder))
        found, _ = check_states(loop, core, states[HOST.name])
        note = "; ".join(filter(None, [f"{found.states} states", found.first_wrong]))
        rows.append(Row(what=f"{name}: unlike the exact controller", value=found.wrong, limit=0, note=note))
        for machine in (HOST, CORTEX_M4, AVR):
            if missing_of(machine) or machine.missing():
                continue
            by_form = [hashes_on(machine, loop, each, states[machine.name]) for each in (core, current_texts(loop))]
            value = sum(a != b for a, b in zip(*by_form, strict=True))
            note = f"{states[machine.name]} states in {len(by_form[0])} blocks"
            rows.append(Row(what=f"{name}: blocks of states unlike, {machine.name}", value=value, limit=0, note=note))
    return rows


def _written_controller(compensator: Compensator, loop: CurrentLoop, folder: Path) -> dict[str, str]:
    core, block = controller_in_block_form(compensator, loop)
    (folder / "core").mkdir()
    for name, text in core.items():
        (folder / "core" / name).write_bytes(text)
    (folder / "calibration.bin").write_bytes(pack(block))
    return read_controller(folder)


def _on_machines(name: str, program: Program, quick: bool) -> list[Row]:
    rows = []
    for machine in (HOST, CORTEX_M4, AVR):
        if machine.name not in program.objects:
            note = f"not run: {missing_of(machine)}"
            rows.append(Row(what=f"{name}, {machine.name}", value=float("nan"), limit=0, note=note))
            continue
        steps = STEPS[machine.name] // (QUICKER if quick else 1)
        found, host = program.run(machine, steps), program.run(HOST, steps)
        first = f"; first at call {found.first}" if found.unlike else ""
        same = "as on the host" if found.states_hash == host.states_hash else f"on the host {host.states_hash}"
        note = f"{found.steps} calls, hash {found.states_hash}, {same}{first}"
        unlike = found.unlike + (found.states_hash != host.states_hash)
        rows.append(Row(what=f"{name}: states unlike, {machine.name}", value=unlike, limit=0, note=note))
        say(f"{rows[-1].what}: {unlike}; {note}")
    return rows


def _compiled_block(machine: Machine, text: str) -> Path:
    return machine.compile("dz_block.c", {"dz_block.c": text.encode()}, machine.check_flags, "the block")


def _headers(sources: Mapping[str, bytes]) -> dict[str, bytes]:
    return {name: text for name, text in sources.items() if name.endswith(".h")}


def _arrays(edges: Mapping[str, list[int]]) -> bytes:
    lines = [
        f"static const uint16_t {name}_edges[] = {{{', '.join(f'{value}u' for value in values)}}};"
        for name, values in edges.items()
    ]
    return "\n".join(["#include <stdint.h>", *lines, ""]).encode()
