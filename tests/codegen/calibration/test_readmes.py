"""What the READMEs of a firmware say to do: the Python beside the host's library, and a place of the block's own."""

import re
import shutil
import subprocess
import sys

import pytest

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from tests.support.golden_firmware import FULL, golden_compensator
from tests.support.synthetic import needs_compiler

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
