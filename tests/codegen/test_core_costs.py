"""The figures in the READMEs are what the compiler and the simulator give, and the measuring sees what is added."""

import shutil
from functools import cache
from types import SimpleNamespace

import pytest

from dzdesign.codegen.calibration.packing import OCTETS
from dzdesign.codegen.core_costs import MEASURED
from dzdesign.core.errors import RequirementError
from dzdesign.verify.analysis import machine_code
from dzdesign.verify.analysis.core_cost import core_cost
from dzdesign.verify.toolchain.machines import AVR, CORTEX_M4
from tests.support.attacked_firmware import edit
from tests.support.block_cores import block_folder
from tests.support.golden_firmware import FULL, GOLDENS, INPUT, generated, golden_compensator, write

pytestmark = pytest.mark.slow  # simulators


def of_machine(target, machine):
    return pytest.param(
        target, machine, id=target,
        marks=pytest.mark.skipif(bool(machine.missing()), reason=f"{machine.name}: {machine.missing()}"),
    )  # fmt: skip


on_cortex_m4 = pytest.mark.skipif(bool(CORTEX_M4.missing()), reason=CORTEX_M4.missing())
#: The AVR, which is no target, measures the same C.
MACHINES = {"cortex-m4": CORTEX_M4, "avr": AVR}
on_both = pytest.mark.parametrize(("target", "machine"), [of_machine("cortex-m4", CORTEX_M4), of_machine("avr", AVR)])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folder of a golden compensator's firmware for the Cortex-M4, made once."""
    return cache(lambda root: write(tmp_path_factory.mktemp("made") / "fw", generated("cortex-m4", root)))


@pytest.fixture(scope="module")
def measured(made):
    """Figures of such a firmware, measured once."""
    return cache(lambda root, target: core_cost(made(root), MACHINES[target]))


@on_cortex_m4
@pytest.mark.parametrize("root", [GOLDENS, FULL], ids=["default", "everything"])
def test_the_figures_of_the_readme_are_measured(root, measured):
    found, stated = measured(root, "cortex-m4"), MEASURED["cortex-m4"]
    if found.compiler != stated.compiler:
        pytest.skip(f"the READMEs' figures are of {stated.compiler}, this is {found.compiler}")
    figures = (stated.default if root == GOLDENS else stated.everything)["fixed"]
    assert found.machine == stated.processor and f" {stated.unit} a call" in found.words
    for name in ("flash_bytes", "ram_bytes", "valve_bytes", "stack_bytes"):
        assert getattr(found, name) == getattr(figures, name), name
    assert tuple(most for _, most in found.counts) == figures.most


@pytest.fixture(scope="module")
def in_block_form(tmp_path_factory):
    """Folder and figures of a golden compensator's core in block form, made and measured once."""

    @cache
    def measure(root, target):
        folder = block_folder(golden_compensator(target, root), tmp_path_factory.mktemp("block") / "fw")
        return folder, core_cost(folder, MACHINES[target])

    return measure


@on_cortex_m4
@pytest.mark.parametrize("root", [GOLDENS, FULL], ids=["default", "everything"])
def test_the_figures_of_the_readme_in_block_form_are_measured(root, in_block_form):
    (_, found), stated = in_block_form(root, "cortex-m4"), MEASURED["cortex-m4"]
    if found.compiler != stated.compiler:
        pytest.skip(f"the READMEs' figures are of {stated.compiler}, this is {found.compiler}")
    figures = (stated.default if root == GOLDENS else stated.everything)["block"]
    for name in ("flash_bytes", "ram_bytes", "valve_bytes", "stack_bytes"):
        assert getattr(found, name) == getattr(figures, name), name
    assert tuple(most for _, most in found.counts) == figures.most
    block = found.block
    for name in ("check_flash_bytes", "check_ram_bytes", "check_stack_bytes", "hardest"):
        assert getattr(block, name) == getattr(figures, name), name
    assert block.check_count == figures.check_most and block.block_bytes == OCTETS
    assert tuple(each.instructions for each in block.bounds) == figures.bounds


@on_cortex_m4
@pytest.mark.parametrize("root", [GOLDENS, FULL], ids=["default", "everything"])
def test_no_count_is_above_the_bound_of_all_blocks_and_the_laws_is_the_bound(root, in_block_form):
    _, found = in_block_form(root, "cortex-m4")
    law, sample, tick = found.block.bounds
    assert [each.instructions for each in (law, tick)] == [found.block.hardest[0], found.block.hardest[2]]
    assert 0 <= sample.instructions - found.block.hardest[1] <= 4  # paths that exclude one another
    assert max(each.stack_bytes for each in found.block.bounds) == found.stack_bytes


@on_cortex_m4
def test_what_another_block_does_is_in_the_bound_and_a_loop_of_its_numbers_has_none(in_block_form, tmp_path):
    folder, before = in_block_form(GOLDENS, "cortex-m4")
    copy = shutil.copytree(folder, tmp_path / "fw")
    tick = "    uint32_t compare = drive->law;\n"
    ten = r"nop\n\t" * 10
    seldom = f'{tick}    if (block->serial[0] == 77u) {{ __asm volatile("{ten}"); }}\n'
    edit(copy, "core/dz_drive.c", tick, seldom)
    after = core_cost(copy, CORTEX_M4)
    assert after.block.hardest[2] < before.block.hardest[2] + 10 <= after.block.bounds[2].instructions
    loop = 'for (uint16_t k = block->serial[0]; k != 0u; k--) { __asm volatile("nop"); }'
    edit(copy, "core/dz_drive.c", seldom, f"{tick}    {loop}\n")
    looped = core_cost(copy, CORTEX_M4)
    assert looped.block.bounds.startswith("dz_drive_tick() has a loop") and looped.block.bounds in looped.words


@on_cortex_m4
def test_a_block_that_its_core_refuses_is_not_measured(in_block_form, tmp_path):
    copy = shutil.copytree(in_block_form(GOLDENS, "cortex-m4")[0], tmp_path / "fw")
    octets = bytearray((copy / "calibration.bin").read_bytes())
    octets[200] ^= 1
    (copy / "calibration.bin").write_bytes(octets)
    with pytest.raises(RequirementError, match="not accepted"):
        core_cost(copy, CORTEX_M4)


@on_both
def test_what_is_added_to_the_core_is_counted(target, machine, made, measured, tmp_path):
    before = measured(GOLDENS, target)
    shutil.copytree(made(GOLDENS), tmp_path / "fw")
    tick = "void dz_drive_tick(struct dz_drive *drive)\n{\n"
    law = "uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)\n{\n"
    ten = r"nop\n" * 10
    added = f'volatile uint32_t seen = 5u;\n{tick}    __asm volatile("{ten}");\n'
    edit(tmp_path / "fw", "core/dz_drive.c", tick, added)
    edit(tmp_path / "fw", "core/dz_comp.c", law, f"{law}    volatile uint8_t kept[200] = {{1u}};\n")
    after = core_cost(tmp_path / "fw", machine)
    assert after.counts[2][1] == before.counts[2][1] + 10 and after.counts[1] == before.counts[1]
    assert after.ram_bytes == before.ram_bytes + 4 and after.flash_bytes >= before.flash_bytes + 24
    assert after.stack_bytes >= 200 and after.counts[0][0] > before.counts[0][1]


@pytest.mark.parametrize("form", ["fixed", "block"])
def test_the_check_of_machine_code_says_what_the_core_takes(form, made, measured, in_block_form, tmp_path, monkeypatch):
    if missing := CORTEX_M4.missing():
        pytest.skip(missing)
    folder, cost = made(GOLDENS), measured(GOLDENS, "cortex-m4")
    if form == "block":
        folder, cost = in_block_form(GOLDENS, "cortex-m4")
    shutil.copytree(folder, tmp_path / "fw")
    shutil.copy(GOLDENS / INPUT, tmp_path / "fw")
    monkeypatch.setattr(machine_code, "MACHINES", (CORTEX_M4,))
    monkeypatch.setattr(machine_code, "_words", lambda _: "all inputs")
    monkeypatch.setattr(machine_code, "check_on_machine", lambda *_: SimpleNamespace(holds=True))
    (check,) = machine_code.machine_code_checks(tmp_path / "fw", (None,))
    assert check.holds and check.text == f"all inputs; {cost.words}"
    (tmp_path / "fw" / "core" / "dz_drive.c").unlink()
    (check,) = machine_code.machine_code_checks(tmp_path / "fw", (None,))
    assert check.holds and "memory and time were not measured: the measuring program" in check.text
