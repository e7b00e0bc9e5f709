"""Instructions of the core in block form over those of the fixed form on a Cortex-M4F, of both signs of command."""

import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path

import on_cortex_m4
from building import Counts, run
from contender import Contender
from scoreboard import Row, say
from tried_inputs import Codes, tried_inputs
from two_forms import TwoForms, block_as_c, two_forms

from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions
from dzdesign.verify.toolchain.machines import CORTEX_M4

#: Goal of the law in block form over the fixed form, for designs with a transition; without one the fixed form leaves
#: out what block form must do for any block.
TIMES_FIXED = 1.35
PRELUDE = "extern const uint16_t dz_block[];\n#define BLOCK dz_block,\n#define BLOCK_TYPE const uint16_t *,\n"
#: Every caller of the drive and of the current loop is the same but for the block.
DRIVE = """\
#include "dz_drive.h"
uint16_t drive_{what}({type}uint16_t u, uint16_t p_a, uint16_t p_b);
uint16_t drive_{what}({type}uint16_t u, uint16_t p_a, uint16_t p_b)
{{
    static struct dz_drive drive;
    static int ready;
    if (ready == 0) {{
        ready = 1;
        dz_drive_init({block}&drive);
    }}
    {call};
    return drive.compare_a;
}}
"""
SAMPLE, TICK = "dz_drive_sample({block}&drive, u, p_a, p_b)", "dz_drive_tick({block}&drive)"
CURRENT = """\
#include "dz_current.h"
uint16_t current_tick({type}uint16_t u, uint16_t p_a, uint16_t p_b);
uint16_t current_tick({type}uint16_t u, uint16_t p_a, uint16_t p_b)
{{
    static struct dz_current loop;
    static int ready;
    if (ready == 0) {{
        ready = 1;
        dz_current_init({block}&loop);
        loop.faults = 0u;
    }}
    dz_current_tick({block}&loop, (uint16_t)(8u * u), (uint16_t)(4u * p_a), p_b);
    return (uint16_t)loop.compare;
}}
"""
BRANCH = re.compile(r"\t(b(?:eq|ne|cs|cc|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)(?:\.[nw])?|cbn?z|bl|blx|tb[bh])\t")


def block_rows(folder: Path) -> list[Row]:
    """Measure and return the rows: of each design and sign the law, of some the drive and the current loop."""
    rows, designs = [], [*two_forms()]
    plain = design(designs[0].compensator.valve, DesignOptions(transition=Fraction(0)))
    for number, forms in enumerate((*designs, TwoForms(f"{designs[0].name}, no transition", plain))):
        say(f"{forms.name} ...")
        rows += law_rows(forms, folder / str(number))
        rows += _around(forms, folder / f"{number}-around")
    return rows


def law_rows(forms: TwoForms, folder: Path) -> list[Row]:
    """Count the law of each sign of command: the ratio, its spread, and branches."""
    inputs = tried_inputs(forms.compensator)
    rows = []
    for sign in forms.compensator.signals.signs:
        called = "dz_comp_negative" if sign < 0 else "dz_comp"
        fixed, block = (_counted(forms, inputs, folder, form, called) for form in ("fixed", "block"))
        what = f"{forms.name}: {called}(), block form over fixed form"
        branches = sum(_branches(called, folder / f"{form}-{called}") for form in ("fixed", "block"))
        note = f"{block.most} and {fixed.most} instructions"
        limit = TIMES_FIXED if forms.compensator.transition_codes else None
        rows.append(Row(what=what, value=block.most / fixed.most, limit=limit, note=note))
        spread = block.most - block.least + fixed.most - fixed.least + (block.compares != fixed.compares)
        note = f"{len(inputs)} inputs, outputs alike; branches and calls in the machine code: {branches}"
        rows.append(Row(what=f"{forms.name}: {called}(), spread over inputs, and branches", value=spread + branches,
                        limit=0, note=note))  # fmt: skip
    return rows


def _around(forms: TwoForms, folder: Path) -> list[Row]:
    """Return what the drive functions and the current loop take, with a caller's few instructions; no goal."""
    texts = {"drive_sample": DRIVE.replace("{what}", "sample").replace("{call}", SAMPLE),
             "drive_tick": DRIVE.replace("{what}", "tick").replace("{call}", TICK)}  # fmt: skip
    if forms.compensator.current_drive is not None:
        texts["current_tick"] = CURRENT
    low, high = forms.compensator.signals.command.valid_codes
    inputs = [each for each in tried_inputs(forms.compensator) if low <= each[0] <= high]
    rows = []
    for called, text in texts.items():
        fixed, block = (_counted(forms, inputs, folder, form, called, text) for form in ("fixed", "block"))
        note = f"{block.least} to {block.most} and {fixed.least} to {fixed.most} instructions, means, with their caller"
        rows.append(Row(what=f"{forms.name}: {called}, block form over fixed form", value=block.most / fixed.most,
                        note=note))  # fmt: skip
    return rows


def _counted(
    forms: TwoForms, inputs: Sequence[Codes], folder: Path, form: str, called: str, caller: str = ""
) -> Counts:
    sources = dict(_sources(forms, form))
    if caller:
        block = form == "block"
        given = {"block": "(const void *)block, " if block else "", "type": "const uint16_t *block, " if block else ""}
        sources["caller.c"] = caller.format(**given)
    prelude = f"#define CALLED {called}\n" + (PRELUDE if form == "block" else "")
    contender = Contender(name=form, made="`dzdesign codegen`", sources=sources, prelude=prelude)
    return on_cortex_m4.count(contender, inputs, folder / f"{form}-{called}", averaged=bool(caller))


def _sources(forms: TwoForms, form: str) -> Mapping[str, str]:
    octets = forms.block_sources if form == "block" else forms.fixed_sources(CORTEX_M4, current=True)
    sources = {name: text.decode() for name, text in octets.items() if "selftest" not in name}
    return {**sources, "dz_block.c": block_as_c(forms.block)} if form == "block" else sources


def _branches(called: str, folder: Path) -> int:
    """Return conditional branches and calls in a function's machine code: without any, every input takes the same."""
    (compiled,) = [path for path in folder.glob("dz_comp*.c.o") if f"<{called}>:" in _disassembled(path)]
    text = _disassembled(compiled).partition(f"<{called}>:")[2].partition("\n\n")[0]
    return len(BRANCH.findall(text))


def _disassembled(path: Path) -> str:
    return run(["arm-none-eabi-objdump", "-d", "--no-show-raw-insn", path], path.parent)
