"""Instructions of the whole interrupt of the cortex-m4 project on a Cortex-M4F: read, law, drive, current loop, write.

The project's own dz_tick.c and dz_board.c are counted, from the first instruction of dz_tick() to its return, without
the copies to dz_state that are for people: with a new sample, and without one.
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
#: Goals: with a new sample, and without.
LIMITS = {True: 260, False: 160}
#: The counter calls dz_comp: the core's own has another name here.
ENTRY = """\
#include "dz_board.h"
#include "dz_drive.h"
#include "dz_current.h"
#include "dz_tick.h"
extern uint16_t ticks_to_sample;
extern struct dz_drive drive;
extern struct dz_current loop;
extern volatile uint16_t dz_board_u_adc, dz_board_p_a_adc, dz_board_p_b_adc, dz_board_current_sum, dz_board_compare_a;
uint16_t dz_comp(uint16_t u, uint16_t p_a, uint16_t p_b);
uint16_t dz_comp(uint16_t u, uint16_t p_a, uint16_t p_b)
{
    static int ready;
    if (ready == 0) {
        ready = 1;
        dz_drive_init(&drive);
        dz_current_init(&loop);
        loop.faults = 0u;
    }
    dz_board_u_adc = u;
    dz_board_p_a_adc = p_a;
    dz_board_p_b_adc = p_b;
    dz_board_current_sum = (uint16_t)(4u * p_a);
    ticks_to_sample = FRESH;
    dz_tick();
    return dz_board_compare_a;
}
"""
EMPTY_TICK = re.compile(r"void dz_tick\(void\)\n\{.*?\n\}\n", re.DOTALL)


def with_current(compensator: Compensator) -> Compensator:
    """Return a compensator with current control of the example's coil."""
    drive = design_current_drive(REQUEST, compensator.signals.compare_max)
    return replace(compensator, current_drive=drive)


def _sources(compensator: Compensator) -> dict[str, str]:
    files = generate(compensator, "cortex-m4").files
    wanted = ("core/", "cortex_m4/dz_tick.", "cortex_m4/dz_board.")
    found = {path.rpartition("/")[2]: text for path, text in files.items() if path.startswith(wanted)}
    found = {name.replace("dz_comp", "dz_law"): text.replace("dz_comp", "dz_law") for name, text in found.items()}
    tick = re.sub(r"^ +dz_state\..*\n", "", found["dz_tick.c"], flags=re.MULTILINE)
    for name in ("struct dz_drive drive", "struct dz_current loop", "uint16_t ticks_to_sample"):
        tick = tick.replace(f"static {name};", f"{name};")
    return found | {"dz_tick.c": tick}


def count_interrupt(compensator: Compensator, inputs: Sequence[Codes], folder: Path, *, fresh: bool) -> Counts:
    """Count the interrupt of a compensator with current control, with a new sample or without."""

    def counted(sources: Mapping[str, str], name: str) -> Counts:
        entry = ENTRY.replace("FRESH", "0u" if fresh else "1u")
        contender = Contender(name=name, made="", sources={**sources, "entry.c": entry})
        return on_cortex_m4.count(contender, inputs, folder / name)

    sources = _sources(compensator)
    empty = sources | {"dz_tick.c": EMPTY_TICK.sub("void dz_tick(void)\n{\n}\n", sources["dz_tick.c"])}
    whole, without = counted(sources, "whole"), counted(empty, "empty")
    counts = (one - other + on_cortex_m4.RETURN for one, other in zip(whole.counts, without.counts, strict=True))
    return Counts(counts=tuple(counts), compares=whole.compares)


def interrupt_goals(compensator: Compensator, folder: Path) -> list[Row]:
    """Return the goals of the whole interrupt, over every valid command that the others are counted with."""
    controlled = with_current(compensator)
    low, high = compensator.signals.command.valid_codes
    inputs = [each for each in tried_inputs(compensator) if low <= each[0] <= high]
    rows = []
    for fresh, limit in LIMITS.items():
        found = count_interrupt(controlled, inputs, folder / f"fresh{fresh}", fresh=fresh)
        what = f"whole interrupt with current loop, {'a new' if fresh else 'no new'} sample: Cortex-M4 instructions"
        rows += [
            Row(what=what, value=found.most, limit=limit, note="valid commands; without the copies to dz_state"),
            Row(what=f"{what}, spread over {len(inputs)} inputs", value=found.most - found.least, limit=0),
        ]
    return rows
