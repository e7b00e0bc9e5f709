"""Firmware that is not what codegen makes, edited by hand: `verify` ends with 1 or 2 and names the place."""

import json
import os
import shutil

import pytest

from dzdesign.codegen.project import generate, write_firmware
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import sha256_of
from dzdesign.design.designing import design
from dzdesign.design.option_texts import options_of
from tests.support.attacked_firmware import add, change_json, edit, seal, take_the_rest_as_held
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
TARGETS = ("f28335", "f280049c", "cortex-m4", "host")
PROJECT = "f28335/dzdesign.projectspec"


@pytest.fixture(scope="module")
def firmware_of(example_valve, example_compensator, tmp_path_factory):
    """The example's firmware of each target, made once, to be copied."""
    from dzdesign.codegen.project import target_named

    root = tmp_path_factory.mktemp("attacked")
    for target in TARGETS:
        own = example_compensator
        if target == "f280049c":  # another converter
            own = design(example_valve, options_of({}, target_named(target).inputs()))
        write_firmware(generate(own, target, vectors=700 if target == "host" else 0), root / target)
    return root


@pytest.fixture
def verify(firmware_of, tmp_path, monkeypatch, capsys):
    """Copy a target's firmware, attack it, verify it; returns exit status and all that was printed.

    What stands here is what is found beside the refusal to run changed code, which comes first where nobody asks.
    """
    take_the_rest_as_held(monkeypatch)

    def run(target, attack=lambda folder: None, *include):
        folder = tmp_path / target
        shutil.copytree(firmware_of / target, folder)
        attack(folder)
        more = [word for option in include for word in (option, str(tmp_path / "sdk"))]
        status = main(["verify", str(folder), "-o", str(tmp_path / "evidence"), "--run-changed", *more])
        out, err = capsys.readouterr()
        return status, "\n".join(line for line in (out + err).splitlines() if not line.startswith("HOLDS"))

    return run


@pytest.mark.parametrize("target", TARGETS)
def test_the_untouched_firmware_holds(verify, target):
    status, said = verify(target)
    assert status == 0 and "Every requirement holds" in said


# ---- the generated C, with and without a version that this one can't generate again ----

#: Target's file, what stands there and what stands there instead: nothing on the host runs it.
IN_THE_C = {
    "the interrupt writes 60000": ("f28335/dz_isr.c", "CMPA.half.CMPA = compare;", "CMPA.half.CMPA = 60000u;"),
    "a trip forces the output high": ("f28335/dz_hardware.c", "TZ_FORCE_LO", "TZ_FORCE_HI"),
    "no watchdog": ("f28335/main.c", "    dz_watchdog_start();\n", ""),
    "swapped channels": ("f28335/dz_hardware.c", "CONV00 = 0", "CONV00 = 1"),
    "one wrong input triple": (
        "core/dz_comp.c",
        "uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)\n{\n",
        "uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)\n{\n"
        "    if (u_adc == 777u && p_a_adc == 1234u && p_b_adc == 555u) {\n        return 60000u;\n    }\n",
    ),
}


def test_the_edits_find_their_place(firmware_of, tmp_path):
    for name, old, new in IN_THE_C.values():
        shutil.copytree(firmware_of / "f28335", tmp_path / "f28335", dirs_exist_ok=True)
        edit(tmp_path / "f28335", name, old, new)


@pytest.mark.parametrize("fault", IN_THE_C)
@pytest.mark.parametrize("hidden", ["", "by its hash", "by a version"])
def test_a_fault_in_the_c_is_named_however_it_is_hidden(verify, fault, hidden):
    name, old, new = IN_THE_C[fault]

    def attack(folder):
        edit(folder, name, old, new)
        if hidden:
            seal(folder, lambda manifest: hidden == "by a version" and manifest["tool"].update(version="0.0.9"))

    status, said = verify("f28335", attack)
    assert status == 1
    if hidden == "by a version":
        assert "NOT CHECKED  the files are what codegen generates" in said
        assert "dzdesign 0.0.9" in said and "make it again" in said
    else:
        assert "DOES NOT HOLD" in said and name in said


@pytest.mark.parametrize("hidden", ["", "by its hash", "by a version"])
def test_a_changed_test_vector_is_named_however_it_is_hidden(verify, hidden):
    def attack(folder):
        text = (folder / "vectors.csv").read_text()
        row = next(line for line in text.splitlines()[1:] if line.endswith(",0,32768"))
        compare = row.split(",")[3]
        edit(folder, "vectors.csv", f"{row}\n", f"{row.replace(compare, str(int(compare) + 1))}\n")
        if hidden:
            seal(folder, lambda manifest: hidden == "by a version" and manifest["tool"].update(version="0.0.9"))

    status, said = verify("host", attack)
    assert status == 1 and "DOES NOT HOLD  the test vectors equal the exactly rounded law: vectors.csv: line" in said
    elsewhere = {"": "missing: vectors.csv", "by its hash": "otherwise than generated now: vectors.csv"}
    assert elsewhere.get(hidden, "dzdesign 0.0.9") in said


# ---- the project file ----

LINK = '<file action="link" path="../core/dz_comp.c" targetDirectory=""/>'
ROOT = 'path="C:/ti'


def in_project(old, new):
    return lambda folder: edit(folder, PROJECT, old, new)


def law_of_ones_own(folder):
    add(folder, "board/my_law.c", "unsigned dz_comp(unsigned u, unsigned a, unsigned b) { return 60000u; }\n")
    edit(folder, PROJECT, "../core/dz_comp.c", "../board/my_law.c")


def in_utf16(folder):
    text = (folder / PROJECT).read_text(encoding="utf-8").replace("utf-8", "utf-16").replace("UTF-8", "UTF-16")
    text = text.replace("<projectSpec>", '<!DOCTYPE projectSpec SYSTEM "../board/x.dtd">\n<projectSpec>')
    (folder / PROJECT).write_bytes(text.encode("utf-16"))


IN_THE_PROJECT = {
    "another source": (law_of_ones_own, "../board/my_law.c"),
    "one more source": (in_project(LINK, f'{LINK}<file action="link" path="../board/x.c"/>'), "../board/x.c"),
    "a source less": (in_project(LINK, ""), "dz_comp"),
    "copied, not linked": (in_project('action="link"', 'action="copy"'), "action of <file"),
    "a macro": (in_project(" -O2 ", " -O2 --define=dz_comp=my_comp "), "--define=dz_comp=my_comp"),
    "another optimisation": (in_project(" -O2 ", " -O4 "), "'-O4'"),
    "a folder of headers": (in_project("-I${DZDESIGN_CORE}", "-I../board -I${DZDESIGN_CORE}"), "-I../board"),
    "their order": (
        in_project("-I${DZDESIGN_CORE} -I${DZDESIGN_TARGET}", "-I${DZDESIGN_TARGET} -I${DZDESIGN_CORE}"),
        "otherwise than generated",
    ),
    "the core elsewhere": (in_project('path="../core" scope', 'path="../board" scope'), "'../board'"),
    "a variable more": (
        in_project('<pathVariable name="DZDESIGN_CORE"', '<pathVariable name="C2000WARE_ROOT" path=".."/>\n'
        '<pathVariable name="DZDESIGN_CORE"'),
        "C2000WARE_ROOT",
    ),
    "the scope of C2000Ware": (
        in_project('C2000Ware_26_01_00_00" scope="project"', 'C2000Ware_26_01_00_00" scope="global"'), "scope of",
    ),
    "another linker file": (in_project("cmd/F28335.cmd", "cmd/F2808.cmd"), "cmd/F2808.cmd"),
    "a linker file of its own": (in_project('linkerCommandFile=""', 'linkerCommandFile="../board/x.cmd"'), "x.cmd"),
    "a library": (in_project("--library=rts2800_fpu32.lib", "--library=../board/rts.lib"), "rts.lib"),
    "another configuration": (in_project('applicableConfigurations="RAM"', 'applicableConfigurations="NONE"'), "NONE"),
    "a step before the build": (
        in_project('launchWizard="False"', 'launchWizard="False" preBuildStep="copy my.c ../core"'), "preBuildStep",
    ),
    "another device": (in_project('device="TMS320F28335"', 'device="TMS320F28334"'), "TMS320F28334"),
    "an option behind C2000Ware's folder": (in_project(ROOT, 'path="C:/ti --define=dz_comp=x'), "C2000WARE_ROOT is"),
    "a file of options there": (in_project(ROOT, 'path="C:/ti @../board/options.txt'), "C2000WARE_ROOT is"),
    "a quote there": (in_project(ROOT, 'path="C:/ti&quot; -DX'), "C2000WARE_ROOT is"),
    "another variable there": (in_project(ROOT, 'path="${DZDESIGN_CORE}/ti'), "C2000WARE_ROOT is"),
    "C2000Ware in the firmware": (in_project(ROOT, 'path="../board/ti'), "C2000Ware lies elsewhere"),
    "no folder": (in_project('path="C:/ti/c2000/C2000Ware_26_01_00_00"', 'path=""'), "C2000WARE_ROOT is"),
    "a document type": (
        in_project("<projectSpec>", '<!DOCTYPE projectSpec [<!ENTITY x "y">]>\n<projectSpec>'), "document type",
    ),
    "a document type in UTF-16": (in_utf16, "document type"),
    "an instruction": (in_project("<projectSpec>", '<?xml-stylesheet href="x.xsl"?><projectSpec>'), "xml-stylesheet"),
    "a file behind C2000Ware's folder": (in_project(ROOT, 'path="C:/ti ../board/my.c y'), "C2000WARE_ROOT is"),
    "the firmware in other case": (in_project(ROOT, 'path="../../F28335/board/ti'), "C2000Ware lies elsewhere"),
    "no XML": (in_project("</projectSpec>", ""), "not XML"),
    "no file": (lambda folder: (folder / PROJECT).unlink(), "is missing"),
    "text": (in_project("<projectSpec>", "<projectSpec>text"), "text in or behind"),
}  # fmt: skip


@pytest.mark.parametrize("attack", IN_THE_PROJECT)
def test_what_is_not_the_users_in_the_project_file_is_named(verify, attack):
    change, named = IN_THE_PROJECT[attack]
    status, said = verify("f28335", change)
    assert status == 1 and "dzdesign.projectspec, in which C2000WARE_ROOT alone is yours" in said and named in said


@pytest.mark.parametrize(
    "value",
    ["D:/ti/C2000Ware_5_04", "C:\\Program Files\\ti\\C2000Ware", "/opt/ti/C2000Ware", "../../../ti/C2000Ware", "C:/tï"],
)
def test_the_users_folder_of_c2000ware_may_be_any(verify, value):
    def set_it(folder):
        edit(folder, PROJECT, "C:/ti/c2000/C2000Ware_26_01_00_00", value)
        text = (folder / PROJECT).read_bytes().replace(b"<!-- Code", b"<!-- My code")
        (folder / PROJECT).write_bytes(text.replace(b"\n", b"\r\n"))  # as an editor of Windows writes it

    status, said = verify("f28335", set_it)
    assert status == 0, said
    assert "yours and was changed" not in said


def test_of_the_other_c2000_the_project_is_compared_too(verify):
    status, said = verify("f280049c", lambda folder: edit(folder, "f280049c/dzdesign.projectspec", "-O2", "-O2 -DX"))
    assert status == 1 and "-DX" in said


# ---- files beside, that a build may take for ours or make ours from ----

BESIDE = {
    "a header of the compiler's": ("f28335", "f28335/stdint.h"),
    "a header of TI's": ("f28335", "f28335/DSP28x_Project.h"),
    "a header of ours": ("f28335", "f28335/dz_drive.h"),
    "in other case": ("f28335", "board/DZ_DRIVE.H"),
    "deeper in board": ("cortex-m4", "board/include/dz_comp.h"),
    "precompiled": ("host", "core/dz_comp.h.gch"),
    "a makefile that goes first": ("host", "host/GNUmakefile"),
    "in lower case": ("cortex-m4", "cortex_m4/makefile"),
    "a script that make turns into a makefile": ("host", "host/Makefile.sh"),
    "a grammar that make turns into the core": ("host", "core/dz_comp.y"),
    "a revision that make checks out": ("cortex-m4", "core/RCS/dz_comp.c,v"),
    "a revision under SCCS": ("host", "host/SCCS/s.dz_host.map"),
    "presets of CMake": ("host", "host/CMakePresets.json"),
    "properties of MSBuild": ("host", "Directory.Build.props"),
    "options of MSBuild": ("host", "host/Directory.Build.rsp"),
    "another build": ("host", "build.ninja"),
    "the compiler as a script": ("host", "host/cc.bat"),
    "the run-time library": ("f28335", "f28335/rts2800_fpu32.lib"),
    "a linker file": ("f28335", "f28335/28335_RAM_lnk.cmd"),
    "a project that goes first": ("f28335", "f28335/.cproject"),
    "a target's description": ("f28335", "f28335/targetConfigs/TMS320F28335.ccxml"),
    "a debugger's script": ("f280049c", "f280049c/start.gel"),
    "options of the compiler": ("f280049c", "f280049c/.ccsproject"),
    "C of its own": ("f28335", "f28335/my.c"),
    "with a point behind": ("f28335", "core/dz_comp.h."),
    "in a folder like board": ("cortex-m4", "Board/my.c"),
    "C as Arduino takes it": ("host", "core/more.ino"),
    "C after its preprocessor": ("host", "host/more.i"),
}


@pytest.mark.parametrize("attack", BESIDE)
def test_a_file_beside_that_a_build_may_take_is_named(verify, attack):
    target, name = BESIDE[attack]
    status, said = verify(target, lambda folder: add(folder, name, "int x;\n"))
    assert status == 1 and name in said


def test_what_is_no_input_of_a_build_may_lie_there_and_objects_are_named(verify):
    def build(folder):
        for name in ("notes.txt", "board/README.md", "f28335/build_RAM/dz_comp.obj", "flash.sh", "measured.csv"):
            add(folder, name)

    status, said = verify("f28335", build)
    assert status == 0, said


# ---- the user's own files ----

TICK = "#ifndef DZ_TICK_H"


def in_board(name, text):
    return lambda folder: add(folder, name, text)


def in_tick(text):
    return lambda folder: edit(folder, "cortex_m4/dz_tick.h", TICK, f"{text}\n{TICK}")


def included(name, text):
    def attack(folder):
        add(folder, name, text)
        in_tick(f'#include "{name.rpartition("/")[2]}"')(folder)

    return attack


def in_linker(text):
    return lambda folder: edit(folder, "cortex_m4/mps2_an386.ld", "ENTRY(", f"{text}\nENTRY(")


IN_THE_USERS = {
    "a macro over the drive": (in_tick("#define dz_drive_tick(d) ((d)->compare_a = 60000u)"), "makes dz_drive_tick"),
    "a macro over a type": (in_tick("#define uint16_t unsigned char"), "makes uint16_t"),
    "a macro over a keyword": (in_tick("#define if while"), "makes if"),
    "a macro over a member": (in_tick("#define compare_a compare_b"), "makes compare_a"),
    "on two lines": (in_tick("#def\\\nine dz_drive_tick my_tick"), "makes dz_drive_tick"),
    "in digraphs": (in_tick("%: define dz_drive_tick my_tick"), "makes dz_drive_tick"),
    "in trigraphs": (in_tick("??=define dz_drive_tick my_tick"), "makes dz_drive_tick"),
    "behind a comment": (in_tick("/* */ #define dz_drive_tick my_tick"), "makes dz_drive_tick"),
    "within a comment": (in_tick("#/**/define/**/dz_drive_tick my_tick"), "makes dz_drive_tick"),
    "behind a form feed": (in_tick("\f#define dz_drive_tick my_tick"), "makes dz_drive_tick"),
    "between texts like a comment": (
        in_tick('extern char a[sizeof "/*"];\n#define dz_drive_tick my_tick\nextern char b[sizeof "*/"];'),
        "makes dz_drive_tick",
    ),
    "taken away": (in_tick("#undef DZ_DRIVE_TICKS_PER_SAMPLE"), "makes DZ_DRIVE_TICKS_PER_SAMPLE"),
    "a function": (in_tick("static void dz_drive_tick(struct dz_drive *d) { (void)d; }"), "has dz_drive_tick"),
    "another name of it": (in_tick("#pragma redefine_extname dz_drive_tick my_tick"), "has dz_drive_tick"),
    "in a header of board": (included("board/my.h", "#define dz_drive_sample my_sample\n"), "board/my.h makes"),
    "in a text of board": (included("board/my.txt", "#define dz_drive_tick my_tick\n"), "includes my.txt"),
    "in what a macro names": (
        lambda folder: (
            in_board("board/my.txt", "#define dz_drive_tick my_tick\n")(folder),
            in_tick('#define MY "my.txt"\n#include MY')(folder),
        ),
        "by the macro MY",
    ),
    "in a script of the linker": (
        lambda folder: (
            in_board("board/my.txt", "dz_comp = my_comp;\n")(folder),
            edit(folder, "cortex_m4/mps2_an386.ld", "ENTRY(", "INCLUDE ../board/my.txt\nENTRY("),
        ),
        "includes ../board/my.txt",
    ),
    "in a text beside": (included("cortex_m4/my.txt", "#define dz_drive_tick my_tick\n"), "includes my.txt"),
    "members packed": (in_tick("#pragma pack(1)"), "leaves pack(1)"),
    "members packed otherwise": (in_tick('_Pragma("GCC pack(push, 2)")'), "leaves pack(push, 2)"),
    "an address of a name in quotes": (in_linker('"dz_comp" = 0x1000;'), "gives dz_comp another address"),
    "an object that is linked along": (
        lambda folder: (add(folder, "board/x.o"), in_linker("INPUT( ../board/x.o )")(folder)), "links ../board/x.o",
    ),
    "an address of the linker": (
        lambda folder: edit(folder, "cortex_m4/mps2_an386.ld", "ENTRY(", "dz_drive_tick = my_tick;\nENTRY("),
        "gives dz_drive_tick another address",
    ),
    "in a linker file of board": (
        in_board("board/my.ld", "PROVIDE_HIDDEN(dz_comp = 0x1000);\n"), "gives dz_comp another address",
    ),
}  # fmt: skip


@pytest.mark.parametrize("attack", IN_THE_USERS)
def test_a_file_of_the_users_that_changes_generated_c_is_named(verify, attack):
    change, named = IN_THE_USERS[attack]
    status, said = verify("cortex-m4", change)
    assert status == 1 and named in said


@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="apt install gcc-arm-none-eabi")
def test_what_a_user_fills_in_holds_and_is_named_as_not_checked(verify):
    def fill_in(folder):
        edit(folder, "cortex_m4/dz_board.c", "return dz_board_u_adc;", "return MY_ADC->result;")
        edit(folder, "cortex_m4/dz_tick.h", "#define DZ_TICK_RELOAD UINT32_C(9999)", "#define DZ_TICK_RELOAD 6399u")
        edit(folder, "cortex_m4/dz_tick.h", TICK, '#include "my_chip.h"\n' + TICK)
        edit(folder, "cortex_m4/mps2_an386.ld", "LENGTH = 4M", "LENGTH = 512K")
        packed = "#pragma pack(push, 1)\nstruct adc { char result; };\n#pragma pack(pop)\n"
        more = "#define DDI 0\n#define SUM_SHIFT 1\n"  # of a comment; of the core's C, apart
        add(folder, "board/my_chip.h", f'#include "core_cm4.h"\n{packed}#define MY_ADC ((adc *)0x40012000u)\n{more}')
        add(folder.parent, "sdk/core_cm4.h", "typedef struct adc adc;\n")
        add(folder, "board/my_sink.c", '#include "dz_comp.h"\nunsigned f(void) { return dz_comp(0u, 0u, 0u); }\n')

    status, said = verify("cortex-m4", fill_in, "--include")
    assert status == 0, said
    assert all(f"cortex_m4/{name}" in said for name in ("dz_board.c", "dz_tick.h", "mps2_an386.ld"))
    assert "board/my_chip.h" in said and "board/my_sink.c" in said


# ---- manifest and compensator ----


def twice(name, key, value):
    """Let a key stand in a file twice: a person may read the first, a parser takes the last."""

    def attack(folder):
        text = (folder / name).read_text(encoding="utf-8")
        (folder / name).write_text(text.replace("{", f'{{\n "{key}": {json.dumps(value)},', 1), encoding="utf-8")

    return attack


def in_compensator(change, *, along=True):
    """Change compensator.json; the firmware is made of it again, where it can be, as its maker would."""

    def attack(folder):
        path = folder / "compensator.json"
        old = sha256_of(path.read_bytes())
        change_json(path, change)
        new = sha256_of(path.read_bytes())
        if along:
            for place in [*folder.rglob("*.[ch]"), *folder.rglob("*.md"), folder / "f28335/Makefile"]:
                place.write_text(place.read_text(encoding="utf-8").replace(old, new), encoding="utf-8", newline="")
            manifest = folder / "manifest.json"
            manifest.write_text(manifest.read_text(encoding="utf-8").replace(old, new), encoding="utf-8", newline="")
            seal(folder)

    return attack


def less_beta(compensator):
    beta = compensator["sides"]["positive"]["beta"]
    compensator["sides"]["positive"]["beta"] = [max(value - 100, 1) for value in beta]


def of_no_options(compensator):
    compensator.update(target=None, options=None)


def of_another_version(compensator):
    less_beta(compensator)
    compensator["tool"]["version"] = "0.0.9"


def with_wide_certificate(compensator):
    compensator["sides"]["positive"]["certificate"]["dp_MPa"][1] = [20, 1]


def by_link(folder):
    (folder / "core/dz_comp.c").rename(folder.parent / "dz_comp.c")
    os.symlink(folder.parent / "dz_comp.c", folder / "core/dz_comp.c")


def by_linked_folder(folder):
    (folder / "core").rename(folder.parent / "core")
    os.symlink(folder.parent / "core", folder / "core", target_is_directory=True)


def with_windows_lines(folder):
    path = folder / "core/dz_comp.c"
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))


def with_windows_lines_and_hashes(folder):
    with_windows_lines(folder)
    seal(folder)


IN_THE_ARTEFACTS = {
    "a key of the manifest twice": (twice("manifest.json", "target", "host"), 2, "'target' is there twice"),
    "a key of the compensator twice": (twice("compensator.json", "law", "target"), 2, "'law' is there twice"),
    "a key without a meaning": (lambda f: seal(f, lambda m: m.update(verified=True)), 1, "spelling of manifest.json"),
    "the interrupt as the user's": (
        lambda f: seal(f, lambda m: m["board"].append("f28335/dz_isr.c")), 1, "board of manifest.json",
    ),
    "a file less": (lambda f: seal(f, lambda m: m["files"].pop("f28335/dz_isr.c")), 1, "files of manifest.json"),
    "a way up": (
        lambda f: seal(f, lambda m: m["files"].update({"core/../../dz_comp.c": "0" * 64}) or m["board"].append(
            "core/../../dz_comp.c")), 2, "not a file inside the folder",
    ),
    "no version": (lambda f: seal(f, lambda m: m["tool"].pop("version")), 2, "'tool.version'"),
    "another tool": (lambda f: seal(f, lambda m: m["tool"].update(name="my")), 1, "generated by 'my "),
    "another generator of a constant": (
        lambda f: seal(f, lambda m: m["constants"][0].update(generator="mine.py")), 1, "constants of manifest.json",
    ),
    "another recording": (
        lambda f: seal(f, lambda m: m["origin"]["ramp_tests"][0].update(source="mine.csv")), 1, "origin.ramp_tests",
    ),
    "lines of Windows": (with_windows_lines, 1, "changed or missing: core/dz_comp.c"),
    "lines of Windows, and their hashes": (with_windows_lines_and_hashes, 1, "generated now: core/dz_comp.c"),
    "a link": (by_link, 2, "is a link"),
    "a linked folder": (by_linked_folder, 2, "is a link"),
    "less beta": (in_compensator(less_beta), 1, "the certificate follows from the valve: "),
    "less beta, of another version": (in_compensator(of_another_version), 1, "designed by dzdesign 0.0.9"),
    "no options": (in_compensator(of_no_options), 1, "does not say for which target"),
    "a wider certificate": (in_compensator(with_wide_certificate), 1, "certificate"),
    "less beta, the C as it was": (in_compensator(less_beta, along=False), 1, "compensator.json"),
}  # fmt: skip


@pytest.mark.parametrize("attack", IN_THE_ARTEFACTS)
def test_an_edit_of_manifest_or_compensator_is_named(verify, attack):
    change, expected, named = IN_THE_ARTEFACTS[attack]
    status, said = verify("f28335", change)
    assert status == expected and named in said
