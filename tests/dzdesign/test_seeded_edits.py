"""Firmware that is no longer what `codegen` made, by accident: `verify` ends with 1 or 2 and names the place."""

import json
import shutil

import pytest

from dzdesign.codegen.project import generate, write_firmware
from dzdesign.command_line.cli import main
from tests.support.attacked_firmware import add, change_json, edit, take_the_rest_as_held
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
TARGETS = ("f28335", "cortex-m4", "host")
PROJECT = "f28335/dzdesign.projectspec"
NOT_RUN = "neither compiled nor run"


@pytest.fixture(scope="module")
def firmware_of(example_compensator, tmp_path_factory):
    """The example's firmware of each target, made once, to be copied."""
    root = tmp_path_factory.mktemp("seeded")
    for target in TARGETS:
        write_firmware(generate(example_compensator, target, vectors=700 if target == "host" else 0), root / target)
    return root


@pytest.fixture
def verify(firmware_of, tmp_path, monkeypatch, capsys):
    """Copy a target's firmware, edit it, verify it; returns exit status and all that was printed of what is amiss."""
    take_the_rest_as_held(monkeypatch)

    def run(target, change=lambda folder: None, *options):
        folder = tmp_path / target
        shutil.copytree(firmware_of / target, folder)
        change(folder)
        status = main(["verify", str(folder), "-o", str(tmp_path / "evidence"), *options])
        out, err = capsys.readouterr()
        return status, "\n".join(line for line in (out + err).splitlines() if not line.startswith("HOLDS"))

    return run


def less_beta(compensator):
    beta = compensator["sides"]["positive"]["beta"]
    compensator["sides"]["positive"]["beta"] = [max(value - 100, 1) for value in beta]


def lower_threshold(compensator):
    compensator["valve"]["sides"]["positive"]["tests"][0]["u_knee_falling_V"] -= 0.01


def in_json(name, change):
    return lambda folder: change_json(folder / name, change)


def cut_short(name):
    """As a full disk or a power cut leaves a file."""
    return lambda folder: (folder / name).write_bytes((folder / name).read_bytes()[:2000])


def twice(folder):
    """Merge two versions of a file, both lines of a key kept."""
    text = (folder / "compensator.json").read_text(encoding="utf-8")
    add(folder, "compensator.json", text.replace("{", f'{{\n "law": {json.dumps("target")},', 1))


def in_c(name, old, new):
    return lambda folder: edit(folder, name, old, new)


def changed_vector(folder):
    row = next(line for line in (folder / "vectors.csv").read_text().splitlines()[1:] if line.endswith(",0,32768"))
    edit(folder, "vectors.csv", f"{row}\n", f"{row.replace(',0,32768', ',1,32768')}\n")


#: Target, edit, exit status, and what is printed of it.
SEEDED = {
    "a number": ("f28335", in_c("core/dz_comp.c", "UINT32_C(", "1u + UINT32_C("), 1, "core/dz_comp.c is not"),
    "a macro": ("f28335", in_c("core/dz_drive.h", "#endif", "#define if while\n#endif"), 1, "core/dz_drive.h is not"),
    "another version of the core": ("host", in_c("core/dz_drive.c", ";\n", "; \n"), 1, "core/dz_drive.c is not"),
    "half a file": ("host", cut_short("core/dz_comp.c"), 1, "core/dz_comp.c is not"),
    "no file": ("cortex-m4", lambda folder: (folder / "core/dz_comp.h").unlink(), 1, "core/dz_comp.h is not"),
    "a file more in the core": ("cortex-m4", lambda f: add(f, "core/dz_old.c", "int x;\n"), 1, "core/dz_old.c is not"),
    "a value in the interrupt": (
        "f28335", in_c("f28335/dz_isr.c", "CMPA.half.CMPA = compare;", "CMPA.half.CMPA = 60000u;"), 1,
        "changed or missing: f28335/dz_isr.c",
    ),
    "swapped channels": ("f28335", in_c("f28335/dz_hardware.c", "CONV00 = 0", "CONV00 = 1"), 1, "f28335/dz_hardware.c"),
    "no watchdog": ("f28335", in_c("f28335/main.c", "    dz_watchdog_start();\n", ""), 1, "f28335/main.c"),
    "an option of the compiler": ("f28335", in_c("f28335/Makefile", "-O2", "-O3"), 1, "f28335/Makefile"),
    "a resistor in the README": ("f28335", in_c("f28335/README.md", "4.7 kOhm", "47 kOhm"), 1, "f28335/README.md"),
    "an expected output": ("host", changed_vector, 1, "vectors.csv: line"),
    "a coefficient": ("f28335", in_json("compensator.json", less_beta), 1, "core/dz_drive.c and 1 more are not"),
    "a threshold": ("f28335", in_json("compensator.json", lower_threshold), 2, "'valve_sha256' is"),
    "a key twice": ("f28335", twice, 2, "'law' is there twice"),
    "a word in the manifest": (
        "f28335", in_json("manifest.json", lambda m: m["constants"][0].update(engineering="u_min0 = 9 V")), 1,
        "constants of manifest.json",
    ),
    "a line less in the manifest": (
        "f28335", in_json("manifest.json", lambda m: m["files"].pop("f28335/dz_isr.c")), 1, "f28335/dz_isr.c",
    ),
    "another version's": (
        "f28335", in_json("manifest.json", lambda m: m["tool"].update(version="0.0.9")), 1, "dzdesign 0.0.9",
    ),
    "C beside the target's": ("f28335", lambda f: add(f, "f28335/my.c", "int x;\n"), 1, "not name f28335/my.c"),
    "a header of the compiler's": ("cortex-m4", lambda f: add(f, "cortex_m4/stdint.h"), 1, "cortex_m4/stdint.h"),
    "a makefile that goes first": ("host", lambda f: add(f, "host/GNUmakefile"), 1, "host/GNUmakefile"),
    "a copy of ours in board": ("cortex-m4", lambda f: add(f, "board/DZ_DRIVE.H"), 1, "board/DZ_DRIVE.H"),
    "in a folder like board": ("cortex-m4", lambda f: add(f, "src/my.c"), 1, "src/my.c"),
}  # fmt: skip


@pytest.mark.parametrize("fault", SEEDED)
def test_an_accidental_edit_is_named(verify, fault):
    target, change, expected, named = SEEDED[fault]
    status, said = verify(target, change)
    assert status == expected and named in said, said
    assert (NOT_RUN in said) is named.endswith(" not")


#: Target, what its user fills in there, and whose names the verdict lists as not checked.
FILLED_IN = {
    "f28335": {PROJECT: ("C:/ti/c2000/C2000Ware_26_01_00_00", "D:/ti/C2000Ware_5_04")},
    "cortex-m4": {
        "cortex_m4/dz_tick.h": ("UINT32_C(9999)", "6399u"),
        "cortex_m4/mps2_an386.ld": ("LENGTH = 4M", "LENGTH = 512K"),
    },
    "host": {},
}


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("filled_in", [False, True])
def test_the_untouched_firmware_holds_and_what_is_the_users_is_listed(verify, target, filled_in):
    theirs = [*FILLED_IN[target], "board/my.c"] if filled_in else []

    def fill_in(folder):
        for name in theirs[:-1]:
            edit(folder, name, *FILLED_IN[target][name])
        for name in ("notes.txt", "board/README.md", "board/my.c", "build_RAM/dz_comp.obj", "measured.csv"):
            add(folder, name if filled_in else "notes.txt")

    status, said = verify(target, fill_in)
    assert status == 0 and "Every requirement holds" in said
    assert all(f"{name}, which is yours" in said for name in theirs) and ("which is yours" in said) is filled_in
