"""The figures in the READMEs are what the compiler and the simulator give, and the measuring sees what is added."""

import re
import shutil
from functools import cache

import pytest

from dzdesign.codegen.calibration.packing import OCTETS
from dzdesign.codegen.project import generate
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


def stated(readme: str, root, compiler: str) -> list[int]:
    """The numbers of a README's tables, of one design, in their order; of another compiler none can be held to."""
    (said,) = re.findall(r"^Measured with (.+) in a simulator", readme, re.MULTILINE)
    if compiler != said:
        pytest.skip(f"the READMEs' figures are of {said}, this is {compiler}")
    tables = readme[readme.index("| law and drive |") : readme.index("*Everything* is")]
    rows = re.findall(r"\| (\d+)(?: bytes)? \| (\d+)(?: bytes)? \|$", tables, re.MULTILINE)
    return [int(row[root == FULL]) for row in rows]


@on_cortex_m4
@pytest.mark.parametrize("root", [GOLDENS, FULL], ids=["default", "everything"])
def test_the_figures_of_the_readme_are_measured(root, measured):
    found = measured(root, "cortex-m4")
    assert found.machine == "Cortex-M4"
    figures = [found.flash_bytes, found.ram_bytes, found.valve_bytes, found.stack_bytes]
    figures += [most for _, most in found.counts]
    readme = generated("cortex-m4", root)["cortex_m4/README.md"]
    assert stated(readme, root, found.compiler) == figures


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
    _, found = in_block_form(root, "cortex-m4")
    block, figures = found.block, [found.flash_bytes, found.ram_bytes, found.valve_bytes, found.stack_bytes]
    for (_, most), hardest in zip(found.counts, found.block.hardest, strict=True):
        figures += [most, hardest]
    figures += [block.block_bytes, block.check_flash_bytes, block.check_ram_bytes, block.check_stack_bytes]
    readme = generate(golden_compensator("cortex-m4", root), "cortex-m4", "block").files["cortex_m4/README.md"]
    assert stated(readme, root, found.compiler) == [*figures, block.check_count] and block.block_bytes == OCTETS


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
