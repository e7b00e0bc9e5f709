"""Instructions of the whole interrupt of the cortex-m4 project on a Cortex-M4F: read, law, drive, current loop, write.

The project's own dz_isr.c and dz_board.c are counted, from the first instruction of dz_isr() to its return, with the
time-outs, the trip and the fault state, without the copies to dz_state that are for people: with a new sample, and
without one.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import on_cortex_m4
from building import Counts
from contender import Contender
from scoreboard import Row
from tried_inputs import Codes, tried_inputs

from dzdesign.codegen.project import generate
from dzdesign.design.compensator import Compensator
from dzdesign.design.current.circuit import CoilCircuit, CurrentSampling, CurrentSensor
from dzdesign.design.current.drive import design_current_drive
from dzdesign.design.current.responses import CurrentRequest
from dzdesign.design.target_inputs import Converter

REQUEST = CurrentRequest(
    circuit=CoilCircuit(resistance_ohm=3.5, inductance_H=0.04, rated_A=1.0, supply_V=(18.0, 32.0)),
    sensor=CurrentSensor(V_per_A=2.0, offset_V=0.15),
    sampling=CurrentSampling(),
    converter=Converter(),
)
#: Goals: with a new sample, and without; a 25 MHz clock has 10 000 in a PWM period.
LIMITS = {True: 300, False: 160}
#: The counter calls dz_comp: the core's own has another name here.
ENTRY = """\
#include "dz_hardware.h"
#include "dz_drive.h"
#include "dz_current.h"
#include "dz_isr.h"
extern uint16_t ticks_to_sample;
extern struct dz_drive drive;
extern struct dz_state state;
extern struct dz_current loop;
extern volatile uint16_t dz_board_u_adc, dz_board_p_a_adc, dz_board_p_b_adc, dz_board_current_sum, dz_board_compare_a;
uint16_t dz_comp(uint16_t u, uint16_t p_a, uint16_t p_b);
uint16_t dz_comp(uint16_t u, uint16_t p_a, uint16_t p_b)
{
    static int ready;
    if (ready == 0) {
        ready = 1;
        dz_isr_init(0u);
        dz_untrip_output();
        loop.faults = 0u;
        state.released = 1u;
    }
    dz_board_u_adc = u;
    dz_board_p_a_adc = p_a;
    dz_board_p_b_adc = p_b;
    dz_board_current_sum = SUM;
    state.ticks_without_sample = 0u;
    ticks_to_sample = FRESH;
    KEPT
    dz_isr();
    return dz_board_compare_a;
}
"""
EMPTY = re.compile(r"void dz_isr\(void\)\n\{.*?\n\}\n", re.DOTALL)


def with_current(compensator: Compensator) -> Compensator:
    """Return a compensator with current control of the example's coil, of two solenoids with one shunt for both."""
    request = replace(REQUEST, solenoids=len(compensator.signals.signs))
    return replace(compensator, current_drive=design_current_drive(request, compensator.signals.compare_max))


def _sources(compensator: Compensator) -> dict[str, str]:
    files = generate(compensator, "cortex-m4").files
    wanted = ("core/", "cortex_m4/dz_isr.", "cortex_m4/dz_board.", "cortex_m4/dz_hardware.")
    found = {path.rpartition("/")[2]: text for path, text in files.items() if path.startswith(wanted)}
    found = {name.replace("dz_comp", "dz_law"): text.replace("dz_comp", "dz_law") for name, text in found.items()}
    for file, shown in (("dz_isr.c", ("struct dz_state state", "struct dz_drive drive", "struct dz_current loop")),
                        ("dz_board.c", ("uint16_t ticks_to_sample",))):  # fmt: skip
        for name in shown:
            found[file] = found[file].replace(f"static {name}", name)
    found["dz_isr.c"] = found["dz_isr.c"].replace("    show();\n", "")
    return found


def _sum(compensator: Compensator) -> int:
    """Return a sum of the current's codes that is no fault, with any output."""
    drive = compensator.current_drive
    if drive is None:
        raise RuntimeError("the interrupt is counted of a drive by current")
    return drive.loop.offset_nominal + drive.loop.over_sum // 4


def count_interrupt(compensator: Compensator, inputs: Sequence[Codes], folder: Path, *, fresh: bool) -> Counts:
    """Count the interrupt of a compensator with current control, with a new sample or without."""

    def counted(sources: Mapping[str, str], name: str) -> Counts:
        # Zero command has been seen; and the sum is the same on both sides, so that the current of neither ends.
        two, samples = len(compensator.signals.signs) == 2, compensator.drive_functions.fault_samples
        kept = f"drive.valid_commands = {samples}u; loop.held_ticks = 0u;" if two else ""
        entry = ENTRY.replace("FRESH", "0u" if fresh else "1u").replace("SUM", f"{_sum(compensator)}u")
        entry = entry.replace("KEPT", kept)
        contender = Contender(name=name, made="", sources={**sources, "entry.c": entry})
        return on_cortex_m4.count(contender, inputs, folder / name)

    sources = _sources(compensator)
    empty = sources | {"dz_isr.c": EMPTY.sub("void dz_isr(void)\n{\n}\n", sources["dz_isr.c"])}
    whole, without = counted(sources, "whole"), counted(empty, "empty")
    counts = (one - other + on_cortex_m4.RETURN for one, other in zip(whole.counts, without.counts, strict=True))
    return Counts(counts=tuple(counts), compares=whole.compares)


def interrupt_goals(compensator: Compensator, folder: Path) -> list[Row]:
    """Return the goals of the whole interrupt, over every sample that the others are counted with."""
    controlled = with_current(compensator)
    inputs = [each for each in tried_inputs(compensator) if max(each) <= compensator.signals.code_max]
    rows = []
    for fresh, limit in LIMITS.items():
        found = count_interrupt(controlled, inputs, folder / f"fresh{fresh}", fresh=fresh)
        what = f"whole interrupt with current loop, {'a new' if fresh else 'no new'} sample: Cortex-M4 instructions"
        rows += [
            Row(what=what, value=found.most, limit=limit, note="12-bit codes; without the copies to dz_state"),
            Row(what=f"{what}, spread over {len(inputs)} inputs", value=found.most - found.least, limit=0),
        ]
    return rows
