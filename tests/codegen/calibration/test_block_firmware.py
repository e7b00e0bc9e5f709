"""Firmware in block form: its files, what MISRA and every compiler say of them, and its verification."""

import shutil
import subprocess
from dataclasses import replace

import pytest

from dzdesign.codegen.calibration.block import block_of, current_block
from dzdesign.codegen.calibration.built_for import built_for
from dzdesign.codegen.calibration.files import block_core_files, texts
from dzdesign.codegen.calibration.packing import pack, unpack
from dzdesign.codegen.f28335.target import TARGET
from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.errors import RequirementError
from dzdesign.verify.analysis.frama_c import PROGRAM, prove
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs
from dzdesign.verify.toolchain.host_compiler import STRICT
from tests.codegen.core.test_misra import findings
from tests.support.block_cores import block_folder
from tests.support.core_variants import variant
from tests.support.current_loops import PLAIN, SUPPLY
from tests.support.example_coil import SENSORS, with_current
from tests.support.synthetic import needs_compiler

FORMS = ("default", "inverted", "bipolar, all options", "current")


def core_of(name):
    """The files of a core in block form."""
    if name != "current":
        return texts(block_core_files(built_for(variant(name))))
    built = replace(built_for(variant("default")), shape=0b11000, samples=PLAIN.samples)
    return texts(block_core_files(built))


def written(compensator, target, folder):
    firmware = generate(compensator, target, "block")
    write_folder(folder, firmware.contents, firmware.manifest)
    return firmware


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="no cppcheck on the path")
@pytest.mark.parametrize("name", FORMS)
def test_misra_finds_nothing_that_is_not_stated(name, tmp_path):
    for file, text in core_of(name).items():
        (tmp_path / file).write_text(text)
    assert findings(tmp_path) == []


@pytest.mark.parametrize("compiler", ["gcc", "avr-gcc", "arm-none-eabi-gcc"])
def test_every_compiler_takes_the_core_without_a_warning(compiler, tmp_path):
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} not found")
    flags = {"avr-gcc": ["-mmcu=atmega1280"], "arm-none-eabi-gcc": ["-mcpu=cortex-m4", "-mthumb"]}.get(compiler, [])
    core = core_of("bipolar, all options")
    for file, text in core.items():
        (tmp_path / file).write_text(text)
    sources = sorted(name for name in core if name.endswith(".c"))
    command = [compiler, *flags, *STRICT, "-O2", "-c", *sources]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_firmware_holds_its_block_and_the_core_is_of_no_valve(tmp_path):
    compensator = variant("bipolar, all options")
    firmware = written(compensator, "f28335", tmp_path / "fw")
    octets = (tmp_path / "fw" / "calibration.bin").read_bytes()
    digest = firmware.manifest.origin.compensator_json
    assert octets == firmware.block == pack(block_of(compensator, digest))
    assert unpack(octets).crc32 and firmware.manifest.calibration == "block"
    core = [text for name, text in firmware.files.items() if name.startswith("core/")]
    assert len(core) == 6 and not any(digest in text or "Valve identified" in text for text in core)
    assert digest in firmware.files["f28335/dz_block.c"]


@needs_compiler
def test_a_block_firmware_without_its_block_is_not_verified(tmp_path):
    folder = block_folder(variant("default"), tmp_path / "fw")
    (folder / "calibration.bin").unlink()
    with pytest.raises(RequirementError, match="calibration block"):
        check_all_inputs(folder)


@needs_compiler
def test_the_block_as_c_is_the_block_as_octets(tmp_path):
    firmware = written(variant("bipolar, all options"), "host", tmp_path / "fw")
    main = tmp_path / "main.c"
    main.write_text(
        '#include <stdio.h>\n#include "dz_block.h"\n'
        "int main(void) { return fwrite(&dz_block, sizeof dz_block, 1, stdout) != 1; }\n"
    )
    host, core = tmp_path / "fw" / "host", tmp_path / "fw" / "core"
    command = ["cc", f"-I{core}", f"-I{host}", str(main), str(host / "dz_block.c"), "-o", str(tmp_path / "main")]
    subprocess.run(command, check=True)
    printed = subprocess.run([str(tmp_path / "main")], capture_output=True, check=True).stdout
    assert printed == firmware.block


SEEDED = {
    "a mask too wide": ("dz_comp.c", "& DZ_CALIBRATION_NODE_MASK", "& 255u"),
    "a product of signed numbers": ("dz_drive.c", "(uint32_t)asked *", "(uint32_t)asked + (uint32_t)(asked * 65536) *"),
    "a node too many": ("dz_calibration.c", "index < DZ_CALIBRATION_NODES", "index <= DZ_CALIBRATION_NODES"),
}  # fmt: skip
SEEDED_CURRENT = ("(place >> shift) & DZ_CALIBRATION_SUPPLY_MASK", "place >> shift")


@pytest.mark.slow
@pytest.mark.skipif(shutil.which(PROGRAM) is None, reason="no frama-c on the path")
def test_no_octets_of_a_block_make_anything_undefined(tmp_path):
    folder = block_folder(variant("bipolar, all options"), tmp_path / "fw")
    proof = prove(folder)
    assert proof.alarms == () and proof.widths == ("x86_16", "x86_64")
    for file, old, new in SEEDED.values():
        path = folder / "core" / file
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))
        assert prove(folder, ("x86_16",)).alarms, file
        path.write_text(text)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which(PROGRAM) is None, reason="no frama-c on the path")
def test_no_octets_of_a_block_make_the_current_controller_undefined(tmp_path):
    compensator = with_current(variant("default"), TARGET, SENSORS["supply measured"])
    folder = block_folder(compensator, tmp_path / "fw")
    proof = prove(folder)
    assert proof.alarms == () and "dz_current_tick" in proof.functions
    path = folder / "core" / "dz_current.c"
    text = path.read_text()
    assert SEEDED_CURRENT[0] in text
    path.write_text(text.replace(*SEEDED_CURRENT))
    found = prove(folder, ("x86_16",)).alarms
    assert {each.file for each in found} == {"dz_current.c"}


def test_a_current_controller_has_its_block():
    assert {"dz_current.c", "dz_current.h"} <= core_of("current").keys()
    assert current_block(replace(PLAIN, supply=SUPPLY)).supply[0] == SUPPLY.nodes[0]
