"""Headers and linker files of the user's that change what generated C means without a name of it: `verify` says so.

What a search for names does not see is seen by a compiler: every such firmware is compiled with the user's headers and
without them.
"""

import shutil

import pytest

from dzdesign.codegen.project import generate, write_firmware
from dzdesign.regeneration import regenerated
from dzdesign.verify.firmware import compilation
from dzdesign.verify.firmware.generated_meaning import compare_meaning
from dzdesign.verify.firmware.user_code import interference
from tests.support.attacked_firmware import add, edit

pytestmark = pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="apt install gcc-arm-none-eabi")
HEADER, LINKER, TICK = "cortex_m4/dz_tick.h", "cortex_m4/mps2_an386.ld", "#ifndef DZ_TICK_H"
GLUE = "#define MY_GLUE(a, b) a##b\n#define MY_JOIN(a, b) MY_GLUE(a, b)\n"


@pytest.fixture(scope="module")
def generated(example_compensator):
    return generate(example_compensator, "cortex-m4")


@pytest.fixture
def cortex(generated, tmp_path):
    write_firmware(generated, tmp_path / "firmware")
    return tmp_path / "firmware"


def first(text):
    return lambda folder: edit(folder, HEADER, TICK, f"{text}\n{TICK}")


def last(text):
    return lambda folder: (folder / HEADER).write_text((folder / HEADER).read_text() + text + "\n")


def outside(text, name="my_sdk.h"):
    """Put a header into a folder beside the firmware, as --include names it."""

    def attack(folder):
        add(folder.parent, f"sdk/{name}", text + "\n")
        if name == "my_sdk.h":
            first(f'#include "{name}"')(folder)

    return attack


def linker(text):
    return lambda folder: edit(folder, LINKER, "ENTRY(", f"{text}\nENTRY(")


#: What the sentence names: file and line, or the linker file.
BY_COMPILING = {
    "a function by a pasted name": (
        last(f'{GLUE}struct dz_drive;\nstatic void MY_JOIN(dz_dri, ve_tick)(struct dz_drive *d) {{ (void)d; }}'),
        "cortex_m4/dz_tick.c line ",
    ),
    "a universal character name": (first("#define dz_drive_tic\\u006b my_tick"), "does not compile with your headers"),
    "a weak attribute at the end": (last("__attribute__((weak))"), "dz_board_read_command: compiles to other code or"),
    "a section of its own": (
        lambda f: edit(f, HEADER, "void dz_tick(void);", 'void dz_tick(void) __attribute__((section(".noload")));'),
        "dz_tick: compiles to other code or to another symbol with cortex_m4/dz_tick.h",
    ),
    "an enum in place of a number": (
        lambda f: edit(f, HEADER, "#define DZ_TICK_RELOAD UINT32_C(9999)", "enum { DZ_TICK_RELOAD = 9999 };"),
        "has 'DZ_TICK_RELOAD' for DZ_TICK_RELOAD, expected a number",
    ),
    "weak by a pragma in a macro": (first('#define MY_WEAK(n) _Pragma(#n)\nMY_WEAK(weak dz\\\n_tick)'), "line "),
    "names of the assembler": (first('__asm__(".set dz_drive_" "tick, my_tick");'), "dz_drive_tick: compiles to other"),
    "optimised otherwise": (first('#pragma GCC optimize ("O0")'), "compiles to other code"),
    "a header outside": (outside("#define dz_drive_tick(d) ((d)->compare_a = 60000u)"), "line "),
    "a header in place of the compiler's": (
        outside("#include_next <stdint.h>\n#define uint16_t unsigned char", "stdint.h"), "line ",
    ),
    "the guard of a generated header": (outside("#define DZ_BOARD_H"), "cortex_m4/dz_board.h line "),
    "lines that call themselves generated": (
        outside('#line 7 "dz_tick.c"\nint my_count;\n#line 3 "my_sdk.h"'), "reads 'int' in place of",
    ),
    "a value that sets something": (
        lambda folder: edit(folder, HEADER, "UINT32_C(9999)", "(*(volatile uint32_t *)0x40000000u = 1u, 9999u)"),
        "for DZ_TICK_RELOAD, expected a number",
    ),
    "a value read from memory": (
        lambda folder: edit(folder, HEADER, "UINT32_C(9999)", "(*(uint32_t *)0x40000000u)"), "expected a number",
    ),
    "a state without a member": (
        lambda folder: edit(folder, HEADER, "    uint16_t u_adc;\n", ""), "does not compile with your headers",
    ),
    "a narrower member of the state": (
        lambda folder: edit(folder, HEADER, "uint32_t ticks;", "uint8_t ticks;"), "compiles to other code",
    ),
}  # fmt: skip


@pytest.mark.parametrize("attack", BY_COMPILING)
def test_what_only_a_compiler_sees_is_named_with_file_and_line(generated, cortex, attack):
    change, named = BY_COMPILING[attack]
    change(cortex)
    sdk, board = cortex.parent / "sdk", frozenset(generated.manifest.board)
    assert not [*interference(cortex, [HEADER], generated.files, board)]  # nothing that a search for names would find
    found = compare_meaning(cortex, "cortex-m4", generated.files, board, [sdk] if sdk.exists() else [])
    assert any(named in fault for fault in found.faults), found


BY_THE_LINKER = {
    "a function discarded": ("SECTIONS { /DISCARD/ : { *(.text.dz_tick) } }", "discards .text.dz_tick"),
    "all of them": ("SECTIONS { /DISCARD/ : { KEEP(*(SORT(.tex[t]*))) } }", "discards .tex[t]*"),
    "the vectors": ('SECTIONS { /DISCARD/ : { *(EXCLUDE_FILE(*x.o) ".vectors") } }', "discards .vectors"),
    "a table": ("SECTIONS { /DISCARD/ : { *crtbegin?.o(.eh_frame) *(.data.* .rodata.*) } }", "discards .data.*"),
    "code that is not loaded": ("SECTIONS { .code (NOLOAD) : { *(.text*) } }", "does not load .text*"),
    "entry at the interrupt": ("ENTRY(dz_tick)", "enters at dz_tick"),
    "entry somewhere": ("ENTRY(elsewhere)", "enters at elsewhere"),
}


@pytest.mark.parametrize("attack", BY_THE_LINKER)
def test_what_a_linker_file_leaves_out_and_where_it_enters_is_named(generated, cortex, attack):
    text, named = BY_THE_LINKER[attack]
    linker(text)(cortex)
    board = generated.manifest.board
    (fault,) = interference(cortex, [*board], generated.files, frozenset(board))
    assert fault.startswith(f"{LINKER} {named}")


def test_an_honest_users_board_holds(cortex):
    """His pins, functions, macros, a vendor's header in --include, another clock, linker file and start-up."""
    edit(cortex, "cortex_m4/dz_board.c", "return dz_board_u_adc;", "return MY_ADC->DR;")
    edit(cortex, HEADER, "UINT32_C(9999)", "((uint32_t)(MY_CLOCK_HZ / 2500u) - 1u)")
    edit(cortex, HEADER, TICK, '#define MY_CLOCK_HZ 16000000u\n#include "my_chip.h"\n' + TICK)
    edit(cortex, HEADER, "    uint16_t compare_b;\n", "    uint16_t compare_b;\n    uint32_t my_count;\n")
    edit(cortex, LINKER, "/DISCARD/ :\n    {", "/DISCARD/ :\n    {\n        libc.a ( * ) libm.a(*) libgcc.a(*)")
    edit(cortex, LINKER, "ENTRY(dz_reset)", "ENTRY(Reset_Handler)")
    add(cortex, "board/startup_my_chip.s", "  .global Reset_Handler\nReset_Handler:\n  bl main\n")
    add(
        cortex, "board/my_chip.h",
        '#ifndef MY_CHIP_H\n#define MY_CHIP_H\n#include <stdint.h>\n#include "core_cm4.h"\n'
        "#define MY_PIN(port, pin) ((port)->BSRR = 1u << (pin))\n#define MY_ADC ((struct my_adc *)0x40012000u)\n"
        "static inline uint16_t my_adc(void) { return (uint16_t)MY_ADC->DR; }\n"
        "static const uint16_t my_table[2] = {1u, 2u};\nextern volatile uint32_t my_ms;\nvoid my_start(void);\n"
        "enum my_state { MY_IDLE, MY_RUN };\n#endif\n",
    )  # fmt: skip
    sdk = cortex.parent / "sdk"
    add(
        cortex.parent, "sdk/core_cm4.h",
        "struct my_adc { volatile unsigned DR; };\n#pragma pack(push, 1)\nstruct frame { char a; int b; };\n"
        "#pragma pack(pop)\nstatic inline void my_wait(void) { __asm volatile (\"wfi\"); }\n",
    )  # fmt: skip
    check = regenerated(cortex, [sdk])
    assert check.holds, check.text
    assert "with your headers core/dz_comp.c, " in check.text and "cortex_m4/dz_tick.c" in check.text


@pytest.mark.parametrize("reason", ["no compiler", "no header"])
def test_what_can_not_be_compiled_is_not_checked(cortex, monkeypatch, reason):
    """Nothing green without a reason: a header of a vendor's may hold anything."""
    first('#include "my_vendor.h"')(cortex)
    if reason == "no compiler":
        monkeypatch.setitem(compilation.COMPILERS, "cortex-m4", ("no-such-gcc",))
    check = regenerated(cortex)
    named = "no-such-gcc is not on the path" if reason == "no compiler" else "my_vendor.h, which your headers"
    assert check.holds is None and named in check.text, check.text
