"""The figures in the READMEs are what the compiler and the simulator give, and the measuring sees what is added."""

import re
import shutil
from functools import cache

import pytest

from dzdesign.codegen.calibration.packing import OCTETS
from dzdesign.codegen.core_costs import MEASURED
from dzdesign.core.errors import RequirementError
from dzdesign.verify.toolchain.machines import AVR, CORTEX_M4
from tests.support.attacked_firmware import edit
from tests.support.block_cores import block_folder
from tests.support.core_cost import core_cost
from tests.support.golden_firmware import FULL, GOLDENS, generated, golden_compensator, write

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
    assert found.machine == stated.processor
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


@pytest.mark.parametrize("name", ["dz_comp.c", "dz_drive.c"])
def test_law_and_drive_have_no_loop_whose_time_a_block_sets(name):
    code = re.sub(r"/\*.*?\*/", "", generated("cortex-m4", FULL)[f"core/{name}"], flags=re.DOTALL)
    assert "DZ_" in code and not re.search(r"\b(?:for|while|do|goto)\b", code)


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
