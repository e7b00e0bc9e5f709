"""A core that keeps something between calls is found in its object, whichever compiler made it."""

import shutil
import subprocess

import pytest

from dzdesign.verify.analysis import core_state
from dzdesign.verify.analysis.core_state import keeps_no_state, object_data
from dzdesign.verify.toolchain.host_compiler import find_zig, words_of
from tests.support.synthetic import needs_compiler

COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)] + ([find_zig()] if find_zig() else [])
#: Of Zig, which compiles for every system: objects of all three formats, of 32 and 64 bits.
SYSTEMS = ("x86_64-linux-gnu", "x86-linux-gnu", "arm-linux-gnueabihf", "s390x-linux-gnu", "x86_64-windows-gnu",
           "x86-windows-gnu", "aarch64-windows-gnu", "x86_64-macos", "aarch64-macos")  # fmt: skip
PLAIN = "static const int table[3] = {1, 2, 3};\nint plain(int i) { return table[i]; }\n"
STATES = {
    "static": "static int kept = 3;\nint f(void) { return ++kept; }\n",
    "zeroed": "static int kept;\nint f(void) { return ++kept; }\n",
    "in the function": "int f(void) { static unsigned short kept; return kept++; }\n",
    "global": "int kept;\nint f(void) { return ++kept; }\n",
}
OUTSIDE = "int rand(void);\nint f(void) { return rand(); }\n"


def compiled(compiler, text, folder, *options):
    (folder / "one.c").write_text(text)
    command = [*words_of(compiler), "-std=c99", "-O2", *options, "-c", "one.c", "-o", "one.o"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return object_data((folder / "one.o").read_bytes())


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("options", [(), ("-fPIC",), ("-fcommon",), ("-g",), ("-fdata-sections",)])
def test_state_is_found_and_constants_are_none(compiler, options, tmp_path):
    plain = compiled(compiler, PLAIN, tmp_path, *options)
    assert plain.writable == () and "plain" in plain.defined and not plain.outside - {"_GLOBAL_OFFSET_TABLE_"}
    for name, text in STATES.items():
        found = compiled(compiler, text, tmp_path, *options)
        assert any("kept" in one for one in found.writable), (name, found)
    assert "rand" in compiled(compiler, OUTSIDE, tmp_path, *options).outside


@pytest.mark.skipif(find_zig() is None, reason="no Zig")
@pytest.mark.parametrize("system", SYSTEMS)
def test_of_every_format(system, tmp_path):
    options = ("-target", system)
    plain = compiled(find_zig(), PLAIN, tmp_path, *options)
    assert plain.writable == () and any(one.endswith("plain") for one in plain.defined)
    for name, text in STATES.items():
        found = compiled(find_zig(), text, tmp_path, *options)
        assert any("kept" in one for one in found.writable), (name, found)
    assert any(one.endswith("rand") for one in compiled(find_zig(), OUTSIDE, tmp_path, *options).outside)


def seed(folder, name, old, new):
    path = folder / "core" / name
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


@needs_compiler
def test_the_generated_core_keeps_none(firmware_folder):
    check = keeps_no_state(firmware_folder)
    assert check.holds and "dz_comp.c, dz_drive.c" in check.text


@needs_compiler
def test_a_core_that_counts_its_calls_does_not_pass(firmware_folder):
    """It answers as the law does, 40 million times: long enough for every input to be tried."""
    old = "uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)\n{\n"
    counts = old + "    static uint32_t calls;\n    if (++calls > UINT32_C(2000000000)) {\n        return 0u;\n    }\n"
    seed(firmware_folder, "dz_comp.c", old, counts)
    check = keeps_no_state(firmware_folder)
    assert check.holds is False and "dz_comp.c has writable data: calls" in check.text


@needs_compiler
def test_a_core_that_asks_elsewhere_does_not_pass(firmware_folder):
    old = "void dz_drive_tick(struct dz_drive *drive)\n{\n    uint32_t compare = drive->law"
    seed(firmware_folder, "dz_drive.c", old, "extern uint32_t elsewhere;\n" + old + " + elsewhere")
    check = keeps_no_state(firmware_folder)
    assert check.holds is False and "dz_drive.c uses what is not in the core: elsewhere" in check.text


@needs_compiler
def test_an_object_of_another_format_is_not_checked(firmware_folder, monkeypatch):
    monkeypatch.setattr(core_state, "object_data", lambda content: object_data(b"BC\xc0\xde" + content))
    check = keeps_no_state(firmware_folder)
    assert check.holds is None and "none of ELF, COFF or Mach-O" in check.text


def test_an_object_that_is_cut_short_is_not_read(tmp_path):
    if not COMPILERS:
        pytest.skip("no C compiler")
    compiled(COMPILERS[0], PLAIN, tmp_path)
    content = (tmp_path / "one.o").read_bytes()
    for end in range(0, len(content), 7):
        object_data(content[:end])  # whatever it says, no other exception
