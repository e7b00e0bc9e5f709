"""A search for designs whose block form differs from their fixed form, or of which the firmware refuses the block.

Options are drawn as the command line takes them; of every design a sample of the inputs and a sequence are compared.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import islice
from time import perf_counter

from block_equality import compared
from block_sequences import controller_program, drive_program
from random_designs import random_designs
from scoreboard import Row, print_rows, say
from two_forms import TwoForms, two_forms

from dzdesign.codegen.calibration.block import built_for
from dzdesign.codegen.calibration.layout import BuiltFor
from dzdesign.codegen.project import generate
from dzdesign.core.errors import DzdesignError
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.toolchain.machines import HOST
from tests.support.block_cores import CompiledCheck

DESIGNS, QUICK_DESIGNS = 600, 30
#: Compiled quickly: there are hundreds.
LIGHT = replace(HOST, core_flags=("-std=c99", "-O1"), check_flags=("-std=c99", "-O1"))
#: Every so many-th difference of pressure codes; samples of the drive, ticks of the controller.
STRIDE, STEPS = 61, 60_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """What was found of one design: outputs unlike, and why a form was refused, if it was."""

    name: str
    inputs: int = 0
    steps: int = 0
    unlike: int = 0
    refused_block: str = ""
    refused_fixed: str = ""

    #: Whether a block has room for it: not where sensor B's span is far above that of A.
    has_room: bool = True

    @property
    def only_block_refused(self) -> bool:
        """Whether the fixed form takes what block form does not, though a block has room for it."""
        return bool(self.refused_block) and not self.refused_fixed and self.has_room


def print_block_designs(quick: bool = False, seed: int = 0) -> list[Row]:
    """Search, print and return the rows."""
    begin, refused = perf_counter(), []
    found = []
    for each in islice(searched(searched_valves(), seed, refused), QUICK_DESIGNS if quick else DESIGNS):
        found.append(each)
        if each.unlike or each.refused_block or each.refused_fixed:
            print(f"{each.name}: {each.unlike} unlike; block: {each.refused_block}; fixed: {each.refused_fixed}")
        if len(found) % 20 == 0:
            say(f"{len(found)} designs, {len(refused)} refused by design; {perf_counter() - begin:.0f} s")
    note = f"{len(found)} designs, {sum(each.inputs for each in found)} inputs, {sum(each.steps for each in found)} "
    note += f"calls; seed {seed}, {perf_counter() - begin:.0f} s; {len(refused)} more were refused by design"
    counts = {
        "designs of which block form and fixed form differ": (sum(bool(each.unlike) for each in found), 0, note),
        "designs whose block is refused and that the fixed form takes": (
            sum(each.only_block_refused for each in found), 0, ""),
        "designs for which a block has no room": (
            sum(not each.has_room for each in found), None, "sensor B of a far larger span than sensor A"),
        "designs that neither form takes": (sum(bool(each.refused_fixed) for each in found), None, ""),
    }  # fmt: skip
    rows = [Row(what=what, value=value, limit=limit, note=text) for what, (value, limit, text) in counts.items()]
    print_rows("Random designs: block form against fixed form", rows)
    return rows


def searched_valves() -> dict[str, ValveModel]:
    """Return the valves of the search: of one side and of two, recorded with a dither and without."""
    valves = {forms.name: forms.compensator.valve for forms in two_forms()}
    both = valves["two-sided, everything"]
    return valves | {"two-sided, no dither": replace(both, dithered=valves["example"].dithered)}


def searched(valves: Mapping[str, ValveModel], seed: int, refused: list[str] | None = None) -> Iterator[Findings]:
    """Yield what is found of one random design after another."""
    for name, target, compensator in random_designs(valves, seed, refused):
        yield examined(name, target, compensator)


def examined(name: str, target: str, compensator: Compensator, stride: int = STRIDE, steps: int = STEPS) -> Findings:
    """Compare the two forms of one design on the host."""
    refused_fixed = ""
    try:
        generate(compensator, target)
    except DzdesignError as error:
        refused_fixed = str(error)
    forms = TwoForms(name, compensator)
    try:
        octets = forms.block
    except DzdesignError as error:
        return Findings(name=name, has_room=forms.has_room, refused_block=str(error), refused_fixed=refused_fixed)
    if bits := _check(built_for(compensator)).findings(octets):
        return Findings(
            name=name, has_room=forms.has_room, refused_block=", ".join(sorted(bits)), refused_fixed=refused_fixed
        )
    if refused_fixed:
        return Findings(name=name, has_room=forms.has_room, refused_fixed=refused_fixed)
    laws = [compared(forms, sign, LIGHT, stride) for sign in compensator.signals.signs]
    programs = [drive_program(forms, len(name), (LIGHT,))]
    if compensator.current_drive is not None:
        programs.append(controller_program(compensator, compensator.current_drive.loop, len(name), (LIGHT,)))
    sequences = [program.run(LIGHT, steps) for program in programs]
    return Findings(
        name=name,
        has_room=forms.has_room,
        inputs=sum(each.inputs + each.edge_inputs for each in laws),
        steps=sum(each.steps for each in sequences),
        unlike=sum(each.unlike for each in (*laws, *sequences)),
    )


@cache
def _check(built: BuiltFor) -> CompiledCheck:
    return CompiledCheck(built)
