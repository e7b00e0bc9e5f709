"""Firmware in block form: its files, what MISRA and compilers say of them, its drive and current controller, proof."""

import re
import shutil
import subprocess
import sys
from dataclasses import replace

import pytest

from dzdesign.codegen.calibration.block import block_of, built_for, current_block
from dzdesign.codegen.calibration.files import block_core_files
from dzdesign.codegen.calibration.packing import pack, unpack
from dzdesign.codegen.f28335.target import TARGET
from dzdesign.codegen.loading.protocol import LOAD_FILES, STORE
from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.verify.current.controller_states import check_states
from dzdesign.verify.current.current_checks import read_controller
from dzdesign.verify.toolchain.host_compiler import STRICT
from tests.codegen.core.test_misra import findings
from tests.support.block_cores import block_folder
from tests.support.core_texts import texts
from tests.support.core_variants import variant
from tests.support.current_loops import PLAIN, SUPPLY
from tests.support.example_coil import SENSORS, with_current
from tests.support.frama_c import PROGRAM, prove
from tests.support.golden_firmware import FULL, golden_compensator
from tests.support.synthetic import needs_compiler


def core_of_everything():
    """The files of a core in block form for two solenoids, swapped pressures, current control and a measured supply."""
    built = replace(built_for(variant("bipolar, all options")), shape=0b11010101, samples=PLAIN.samples)
    return texts(block_core_files(built))


def written(compensator, target, folder):
    firmware = generate(compensator, target, "block")
    write_folder(folder, firmware.contents, firmware.manifest)
    return firmware


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="no cppcheck on the path")
def test_misra_finds_nothing_that_is_not_stated(tmp_path):
    """With all that it may have; tests/codegen/core/test_misra.py has the other forms of the same text."""
    for file, text in core_of_everything().items():
        (tmp_path / file).write_text(text)
    assert findings(tmp_path) == []


@pytest.mark.parametrize("compiler", ["gcc", "avr-gcc", "arm-none-eabi-gcc"])
def test_every_compiler_takes_the_core_without_a_warning(compiler, tmp_path):
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} not found")
    flags = {"avr-gcc": ["-mmcu=atmega1280"], "arm-none-eabi-gcc": ["-mcpu=cortex-m4", "-mthumb"]}.get(compiler, [])
    core = core_of_everything()
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
    # The memory's functions are the user's to fill in; what else takes a block is generated as it is.
    fixed = generate(compensator, "f28335", "fixed").manifest.board
    assert set(firmware.manifest.board) - set(fixed) == {f"f28335/{name}" for name in STORE}
    assert {f"f28335/{name}" for name in LOAD_FILES} <= firmware.files.keys()
    for target, form in (("f28335", "fixed"), ("host", "block")):
        others = generate(compensator, target, form).files
        assert not {path for path in others if path.rpartition("/")[2] in LOAD_FILES}
    core = [text for name, text in firmware.files.items() if name.startswith("core/")]
    assert len(core) == 6 and not any(digest in text or "Valve identified" in text for text in core)
    assert digest in firmware.files["f28335/dz_block.c"]


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


@needs_compiler
@pytest.mark.parametrize("loop", [PLAIN, replace(PLAIN, supply=SUPPLY)], ids=["supply unknown", "supply measured"])
def test_the_current_controller_is_the_exact_one_in_every_state(loop, tmp_path):
    compensator = variant("default")
    built = replace(built_for(compensator), shape=64 + 128 * bool(loop.supply), samples=loop.samples)
    block = replace(block_of(compensator, "0" * 64), shape=built.shape, current=current_block(loop))
    (tmp_path / "core").mkdir()
    for name, text in texts(block_core_files(built)).items():
        (tmp_path / "core" / name).write_text(text, encoding="utf-8")
    (tmp_path / "calibration.bin").write_bytes(pack(block))
    found, _ = check_states(loop, read_controller(tmp_path), 60_000)
    assert found.wrong == 0 and found.states > 60_000, found.first_wrong
    gain = replace(block, current=replace(block.current, integral=block.current.integral + 1))
    (tmp_path / "calibration.bin").write_bytes(pack(gain))
    assert check_states(loop, read_controller(tmp_path), 2_000)[0].wrong


#: File of the core, and a fault in it that makes some block's octets do what C leaves undefined.
SEEDED = {
    "dz_comp.c": ("& DZ_CALIBRATION_NODE_MASK", "& 255u"),
    "dz_drive.c": ("(uint32_t)asked *", "(uint32_t)asked + (uint32_t)(asked * 65536) *"),
    "dz_calibration.c": ("index < DZ_CALIBRATION_NODES", "index <= DZ_CALIBRATION_NODES"),
    "dz_current.c": ("(place >> shift) & DZ_CALIBRATION_SUPPLY_MASK", "place >> shift"),
}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which(PROGRAM) is None, reason="no frama-c on the path")
@pytest.mark.parametrize("current", [False, True], ids=["two solenoids", "current control"])
def test_no_octets_of_a_block_make_anything_undefined(current, tmp_path):
    """And each of the faults is seen, in its file."""
    compensator = variant("bipolar, all options")
    if current:
        compensator = with_current(variant("default"), TARGET, SENSORS["supply measured"])
    folder = block_folder(compensator, tmp_path / "fw")
    proof = prove(folder)
    assert proof.alarms == () and proof.widths == ("x86_16", "x86_64")
    assert ("dz_current_tick" in proof.functions) == current
    names = ["dz_current.c"] if current else [name for name in SEEDED if name != "dz_current.c"]
    for path in (folder / "core" / name for name in names):
        old, new = SEEDED[path.name]
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))
    assert {each.file for each in prove(folder, ("x86_16",)).alarms} == set(names)


#: Type and name of each member of `struct dz_drive`, as its header has them.
MEMBERS = re.compile(r"^    (u?int\d+_t) (\w+);", re.MULTILINE)


def firmware(target, form, folder):
    compensator = golden_compensator(target, FULL)
    made = generate(compensator, target, form)
    write_folder(folder, made.contents, made.manifest)
    return folder


def printed(folder):
    """Run the README's Python, all of it in order; return what it prints, then the structure's members and octets."""
    text = (folder / "host" / "README.md").read_text("utf-8")
    section = re.search(r"^## Python\n(.*?)^## ", text, re.DOTALL | re.MULTILINE)[1]
    lines = [line[4:] for line in section.splitlines() if line.startswith("    ")]
    arrays = "four = [numpy.full(3, code, numpy.uint16) for code in (2048, 1500, 1000, 0)]\n"
    given = "block, " if "block =" in section else ""
    shown = (
        f"{arrays}library.dz_comp_many({given}*four, 3)\nprint(*four[3])\n"
        "print([[kind.__name__, name] for name, kind in Drive._fields_])\n"
    )
    script = "\n".join((*lines, shown)).replace("./libdz_comp.so", str(folder / "library.so"))
    done = subprocess.run([sys.executable, "-c", script], cwd=folder / "host", capture_output=True, text=True)
    assert done.returncode == 0, done.stderr  # a segmentation fault too
    return done.stdout.splitlines()


@needs_compiler
@pytest.mark.skipif(sys.platform != "linux", reason="the README's name of the library is that of Linux")
def test_the_python_of_the_hosts_readme_runs_and_both_forms_answer_alike(tmp_path):
    said = {}
    for form in ("fixed", "block"):
        folder = firmware("host", form, tmp_path / form)
        sources = [*folder.glob("core/*.c"), folder / "host" / "dz_host.c", *folder.glob("host/dz_block.c")]
        includes = [f"-I{folder / each}" for each in ("core", "host")]
        subprocess.run(["cc", "-fPIC", "-shared", *includes, *sources, "-o", folder / "library.so"], check=True)
        said[form] = printed(folder)
        members = MEMBERS.findall((folder / "core" / "dz_drive.h").read_text("utf-8").split("struct dz_drive\n")[1])
        kinds = {"uint16_t": "c_ushort", "int16_t": "c_short", "int32_t": "c_int"}
        assert said[form][-1] == str([[kinds[kind], name] for kind, name in members])
    assert said["fixed"] == said["block"] and int(said["fixed"][0]) > 0
    assert said["fixed"][2].split() == 3 * [said["fixed"][0]]


@pytest.mark.skipif(not (shutil.which("arm-none-eabi-gcc") and shutil.which("make")), reason="no arm-none-eabi-gcc")
def test_the_linker_lines_of_the_cortex_m4s_readme_give_the_block_its_place(tmp_path):
    project = firmware("cortex-m4", "block", tmp_path) / "cortex_m4"
    text = (project / "README.md").read_text("utf-8")
    memory, section = re.findall(r"^    (?=VALVE|\.calibration)(.*)$", text, re.MULTILINE)
    script = (project / "mps2_an386.ld").read_text("utf-8")
    script = script.replace("LENGTH = 4M\n", f"LENGTH = 2M\n    {memory}\n", 1)
    script = script.replace("SECTIONS\n{\n", f"SECTIONS\n{{\n    {section}\n", 1)
    (project / "mps2_an386.ld").write_text(script)
    subprocess.run(["make", "-s", "dz_comp.elf"], cwd=project, check=True, capture_output=True)
    (address,) = re.findall(r"--address (0x\w+)", text)
    dumped = tmp_path / "dumped.bin"
    copy = ["arm-none-eabi-objcopy", "-O", "binary", "-j", ".calibration", project / "dz_comp.elf", dumped]
    subprocess.run(copy, check=True)
    assert dumped.read_bytes() == (tmp_path / "calibration.bin").read_bytes()
    heads = subprocess.run(
        ["arm-none-eabi-objdump", "-h", project / "dz_comp.elf"], check=True, capture_output=True, text=True
    ).stdout
    assert re.search(rf"\.calibration +\w+ +{int(address, 16):08x} ", heads)
