"""The benchmarks of blocks against the fixed form: that they see a wrong number, and that both forms agree."""

from dataclasses import replace

import block_costs
import block_sequences
import on_cortex_m4
import pytest
from block_equality import compared, missing_of
from block_sequences import controller_program, drive_program
from two_forms import TwoForms

from dzdesign.codegen.calibration.packing import pack, unpack
from dzdesign.verify.toolchain.machines import AVR, CORTEX_M4, HOST
from tests.support.current_loops import LOOPS
from tests.support.golden_firmware import FULL, golden_compensator
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
#: Every so many-th difference of pressure codes: nine of all.
STRIDE = 1021


@pytest.fixture(scope="module")
def forms() -> TwoForms:
    return TwoForms("everything", golden_compensator("f28335", FULL))


def altered(forms, edit) -> TwoForms:
    """The same design with another number in its block."""
    other = TwoForms(forms.name, forms.compensator)
    other.__dict__["block"] = pack(edit(unpack(forms.block)))
    return other


def of_side(place, **wrong):
    def edit(block):
        sides = [replace(side, **wrong) if index == place else side for index, side in enumerate(block.sides)]
        return replace(block, sides=tuple(sides))

    return edit


def test_both_forms_agree_on_a_sample_and_a_wrong_number_is_seen(forms):
    found = compared(forms, -1, HOST, STRIDE)
    assert found.unlike == 0 and found.inputs == 9 * 4096 and found.edge_inputs > 20_000
    side = unpack(forms.block).sides[1]
    for wrong, name in (({"offset": side.offset + 2000}, "compare"), ({"tested_to": side.tested_to - 4096}, "status"),
                        ({"beta_factor": side.beta_factor - side.beta_factor // 500}, "beta")):  # fmt: skip
        other = compared(altered(forms, of_side(1, **wrong)), -1, HOST, STRIDE)
        assert getattr(other, f"unlike_{name}") == other.unlike > 0, wrong
        assert other.first != (0, 0, 0) and (name == "status" or other.outputs_hash != found.outputs_hash)


@pytest.mark.slow
@pytest.mark.parametrize("machine", [CORTEX_M4, AVR], ids=lambda machine: machine.name)
def test_other_machines_give_the_outputs_of_the_host(forms, machine):
    if missing := missing_of(machine):
        pytest.skip(missing)
    host = compared(forms, 1, HOST, STRIDE)
    found = compared(forms, 1, machine, STRIDE)
    assert found.unlike == 0 and found.outputs_hash == host.outputs_hash
    program, loop = drive_program(forms, 1, (HOST, machine)), LOOPS["supply"]
    controller = controller_program(forms.compensator, loop, 1, (HOST, machine))
    for each in (program, controller):
        on_host, there = each.run(HOST, 3000), each.run(machine, 3000)
        assert there.unlike == 0 and there == on_host


def test_the_drive_is_the_same_after_every_call_and_a_wrong_number_is_seen(forms):
    found = drive_program(forms, 1, (HOST,)).run(HOST, 60_000)
    assert found.unlike == 0 and found.steps > 100_000
    for wrong in ({"interlock": 14}, {"fault_samples": 4}, {"leave_zero": 20}, {"dither_ticks": 7}):
        other = altered(forms, lambda block, wrong=wrong: replace(block, **wrong))
        assert drive_program(other, 1, (HOST,)).run(HOST, 60_000).unlike, wrong


@pytest.mark.parametrize("controller", ["supply", "two shunts"])
def test_the_controller_is_the_same_after_every_call_and_a_wrong_number_is_seen(forms, controller, monkeypatch):
    compensator, loop = forms.compensator, LOOPS[controller]
    found = controller_program(compensator, loop, 1, (HOST,)).run(HOST, 60_000)
    assert found.unlike == 0 and found.steps > 60_000
    in_block_form = block_sequences.controller_in_block_form
    for name in ("integral", "over_ticks", "open_sum", "offset_high", "supply_low", *["held_ticks"][: loop.two]):

        def wrong(*given, name=name):
            core, block = in_block_form(*given)
            return core, replace(block, current=replace(block.current, **{name: getattr(block.current, name) + 1}))

        monkeypatch.setattr(block_sequences, "controller_in_block_form", wrong)
        assert controller_program(compensator, loop, 1, (HOST,)).run(HOST, 60_000).unlike, name


@pytest.mark.slow
@pytest.mark.skipif(bool(on_cortex_m4.CORTEX_M4.missing()), reason=on_cortex_m4.CORTEX_M4.missing())
def test_the_cost_of_both_signs_is_counted(forms, tmp_path):
    rows = {row.what: row for row in block_costs.law_rows(forms, tmp_path)}
    for called in ("dz_comp", "dz_comp_negative"):
        (ratio,) = [row for what, row in rows.items() if f"{called}(), block form" in what]
        assert 1.0 < ratio.value <= block_costs.TIMES_FIXED and ratio.verdict == "holds"
        (spread,) = [row for what, row in rows.items() if f"{called}(), spread" in what]
        assert spread.value == 0
