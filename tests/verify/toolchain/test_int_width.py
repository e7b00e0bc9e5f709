"""A 16-bit int, without a compiler that has one: every seeded use of a wider one is found, and nothing else is."""

import random

import pytest

from dzdesign.codegen import project
from dzdesign.codegen.project import generate
from dzdesign.codegen.writing import write_generated
from dzdesign.core.errors import RequirementError
from dzdesign.verify.compilation import fits_target_int
from dzdesign.verify.folder import read_firmware_manifest
from dzdesign.verify.toolchain import int_width
from dzdesign.verify.toolchain.int_width import typed
from dzdesign.verify.toolchain.machines import AVR, HOST
from tests.support.core_variants import NAMES, variant
from tests.support.designs import CURRENT, MEASURED, designed
from tests.support.golden_firmware import golden_valve
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
HEAD = """#include <stdint.h>
struct numbers { uint16_t step; int16_t away; uint32_t wide; };
uint32_t taken(uint32_t x);
uint32_t f(uint16_t a, uint16_t b, int16_t s, uint32_t w, const struct numbers *n)
{
    uint16_t low; uint32_t high;
"""
#: Statements that are right on a PC and wrong with an int of 16 bits.
WRONG = (
    "high = (uint32_t)((int)w << 5);",
    "high = (uint32_t)a + (b << 1);",
    "high = a * b;",
    "high = (uint32_t)(a * 3);",
    "high = n->step + a;",
    "high = taken(a - b);",
    "if (a - b < 0) { high = 1u; }",
    "if (s < a) { high = 1u; }",
    "if (n->away + 1 > s) { high = 1u; }",
    "high = w & ~a;",
    "high = w + (a - 1u);",
    "high = (a + b) >> 1;",
    "high = 1 << 16;",
    "high = w + 60 * 1000;",
    "low = (uint16_t)((a + b) / 2);",
    "low = (uint16_t)(a * 101 / 101);",
    "for (int i = 0; i < 40000; i++) { high = taken(1u); }",
    "unsigned many = 70000u;",
    "low = (a + b) ? 1u : 0u;",
    "low = (uint16_t)(s * n->away);",
    "high = (a != 0u) ? (a + 1u) : 0u;",
    "high += a << 4;",
    "switch (a + b) { case 0: high = 1u; break; default: break; }",
    "high = !(a + b);",
    "return a + b;",
)
#: Statements that are right on both: the low bits alone are used, or the range fits.
RIGHT = (
    "high = (w & 0xFFu) << 5;",
    "high = (uint32_t)a * b;",
    "low = (uint16_t)(a + b);",
    "low = a; low++; low += b; low = (uint16_t)~low;",
    "low = (uint16_t)((a & 15u) * 3u) ; high = (a & 15u) * 3u;",
    "const uint16_t few = a & 7u; high = few + 1u;",
    "if ((int32_t)s < (int32_t)a) { high = 1u; }",
    "if (a > b) { high = (a > b) << 3; }",
    "low = (uint16_t)((a << 8) | (b & 255u));",
    "high = UINT32_C(1) << 16;",
    "high = w + 60000u;",
    "high = 60L * 1000L;",
    "low = (s < 0) ? 1u : 0u;",
    "low = (uint16_t)((a & 255u) / 3u);",
    "high = (a + b) & 0xFFu;",
    "high = (uint32_t)-1;",
    "high = w * a;",
    "high = n->wide - n->step;",
)


def findings(statement: str) -> list[str]:
    return typed({"f.c": f"{HEAD}    {statement}\n    return 0;\n}}\n".encode()}, "f.c").findings


@pytest.mark.parametrize("statement", WRONG)
def test_what_needs_a_wider_int_is_found(statement):
    found = findings(statement)
    assert len(found) >= 1 and all(each.startswith("f.c:7: ") for each in found)


@pytest.mark.parametrize("statement", RIGHT)
def test_what_does_not_is_not(statement):
    assert findings(statement) == []


def test_what_is_no_c_is_not_passed_over():
    with pytest.raises(RequirementError, match="can't be read"):
        typed({"f.c": b"int f(void) { return uint8; } uint24_t x;\n"}, "f.c")


# ---- against a compiler whose int has 16 bits ----

#: Expressions, inputs of each, and expressions whose results stand in one line.
DRAWN, INPUTS, A_LINE, SEED = 300, 12, 10, 5
PARAMETERS = "uint16_t a, uint16_t b, int16_t s, int16_t t, uint32_t w"
OPERATIONS = ("+", "-", "*", "&", "|", "^", "/", "%", "<<", ">>", "<", ">", "==", ">=")
BEFORE = ("~", "-", "!", "(uint16_t)", "(int16_t)", "(uint32_t)")
LEAVES = ("a", "b", "s", "t", "w", "1", "3u", "40000", "0x8000", "7", "5L", "60000u", "(uint32_t)a", "(int16_t)w",
          "(a & 31u)", "(int32_t)s")  # fmt: skip


def drawn_expression(draw, depth: int) -> str:
    if depth == 0 or draw.random() < 0.15:
        return draw.choice(LEAVES)
    kind = draw.random()
    if kind < 0.12:
        return f"({draw.choice(BEFORE)}{drawn_expression(draw, depth - 1)})"
    left, right = drawn_expression(draw, depth - 1), drawn_expression(draw, depth - 1)
    operation = draw.choice(OPERATIONS)
    if kind < 0.2:
        return f"(({left}) ? ({right}) : ({drawn_expression(draw, depth - 1)}))"
    if operation in ("<<", ">>"):
        right = str(draw.randrange(9))
    return f"({left} {operation} {f'({right} | 1u)' if operation in '/%' else right})"


def results(machine, text: str) -> list[int]:
    flags = (*machine.check_flags, "-fwrapv", "-w")
    main = machine.compile("main.c", {**machine.headers, "main.c": text.encode()}, flags, "expressions")
    return machine.run(machine.link([main], "expressions"), [], "expressions")[0]


@pytest.mark.slow
@pytest.mark.skipif(bool(AVR.missing()), reason=AVR.missing())
def test_whatever_an_avr_computes_otherwise_is_found():
    draw = random.Random(SEED)
    expressions = [drawn_expression(draw, 3) for _ in range(DRAWN)]
    inputs = [[draw.choice((0, 1, 5, 255, 32767, 32768, 40000, 65535)) for _ in range(5)] for _ in range(INPUTS)]
    silent, differ = 0, 0
    for first in range(0, DRAWN, A_LINE):
        drawn = expressions[first : first + A_LINE]
        functions = [f"static uint32_t f{k}({PARAMETERS}) {{ return {each}; }}\n" for k, each in enumerate(drawn)]
        calls = [
            f"    found = found * 31uL + f{k}({a}u, {b}u, (int16_t){s}u, (int16_t){t}u, {w}uL * 65537uL);\n"
            + ("    put(found);\n    found = 0;\n" if last else "")
            for k in range(len(drawn))
            for (a, b, s, t, w), last in zip(inputs, [*[False] * (INPUTS - 1), True], strict=True)
        ]
        text = '#include "machine.h"\n' + "".join(functions)
        text += f"static void program(void)\n{{\n    uint32_t found = 0;\n\n{''.join(calls)}}}\n"
        here, there = (results(machine, text) for machine in (HOST, AVR))
        for each, function, mine, other in zip(drawn, functions, here, there, strict=True):
            found = typed({"f.c": f"#include <stdint.h>\n{function}".encode()}, "f.c").findings
            assert mine == other or found, f"{each}: another result on the AVR, and no finding"
            silent, differ = silent + (not found), differ + (mine != other)
    assert silent > DRAWN // 10 and differ > DRAWN // 20


# ---- the firmware ----


def firmware(name: str, target: str, form: str, folder):
    """A variant's firmware; or one with a current controller, with and without its supply measured."""
    options = {"current": CURRENT, "current, supply": MEASURED}.get(name)
    compensator = variant(name) if options is None else designed(golden_valve(), target, **options)
    write_generated(generate(compensator, target, form), folder)
    return fits_target_int(folder, read_firmware_manifest(folder))


@pytest.mark.slow
@pytest.mark.parametrize("name", [*NAMES, "current", "current, supply"])
def test_no_generated_firmware_needs_more(name, tmp_path):
    targets = ("f28335", "cortex-m4", "host") if name in NAMES else ("f28335", "cortex-m4")
    for target in targets:
        for form in ("fixed", "block"):
            check = firmware(name, target, form, tmp_path / f"{target} {form}")
            assert check.holds, check.text


def test_nor_does_that_of_the_f280049c(tmp_path):
    for form in ("fixed", "block"):
        write_generated(generate(designed(golden_valve(), "f280049c"), "f280049c", form), tmp_path / form)
        assert fits_target_int(tmp_path / form, read_firmware_manifest(tmp_path / form)).holds


def test_every_name_of_the_core_is_known(tmp_path, monkeypatch):
    """What is not known is not typed: in the core there must be nothing of the kind."""
    lost, value = [], int_width.Widths._value

    def watched(self, node):
        found = value(self, node)
        if found is None and isinstance(node, int_width.c_ast.ID):
            lost.append(node.name)
        return found

    monkeypatch.setattr(int_width.Widths, "_value", watched)
    check = firmware("current, supply", "cortex-m4", "block", tmp_path / "fw")
    assert check.holds and "dz_current.c" in check.text and lost == []


#: Template, what stands there, and what somebody wrote instead; the form whose C has it.
BUGS = {
    "shift of a code": ("dz_comp.h", "(ahead << DZ_WEIGHT", "((uint16_t)ahead << DZ_WEIGHT", "bipolar"),
    "int cast, shifted": ("dz_comp.c", "node[0].law * left", "(uint32_t)((int)left << 10)", "bipolar"),
    "product of codes": ("dz_comp.c", "const uint32_t u = u_adc;", "const uint32_t u = u_adc * 3 / 3;", "bipolar"),
    "sum of a law and a dither": (
        "dz_drive.c", "compare += block->dither_counts", "compare = drive->law + block->dither_counts", "bipolar",
    ),
    "twice the ticks": ("dz_drive.c", "(2u * (uint32_t)block->dither_ticks)", "(2 * block->dither_ticks)", "bipolar"),
    "signed below unsigned": (
        "dz_drive.c", "drive->side < 0) ? -command", "drive->side < drive->at_rest) ? -command", "bipolar",
    ),
    "a constant of more than an int": (
        "dz_drive.c", "(uint32_t)asked * RAMP_UNIT", "(uint32_t)asked * (1 << 16)", "bipolar",
    ),
    "a difference that is widened": ("dz_drive.c", "& (at_rest - 1u)", "& ((uint16_t)at_rest - 1u)", "bipolar"),
    "an int that counts": ("dz_calibration.c", "for (uint16_t place = 0u; place < count",
                           "for (int place = 0; place < (int)count", "bipolar"),
    "difference of sums": (
        "dz_current.c", "reached((uint32_t)sum - numbers->short_sum)", "reached(sum - numbers->short_sum)", "current",
    ),
    "in the interrupt": ("dz_isr.c", "(ticks_without_current < DZ", "((ticks_without_current + 1u) < DZ", "current"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("bug", BUGS)
def test_a_bug_in_a_template_is_found(bug, tmp_path, monkeypatch):
    name, old, new, form = BUGS[bug]
    render, found = project._render, []

    def rendered(package, template, banner, values):
        text = render(package, template, banner, values)
        if template.endswith(f"{name}.jinja"):
            found.append(text.count(old))
            text = text.replace(old, new)
        return text

    monkeypatch.setattr(project, "_render", rendered)
    check = firmware("bipolar, all options" if form == "bipolar" else form, "f28335", "block", tmp_path / "fw")
    assert sum(found) >= 1 and not check.holds and check.id == "int-width" and check.text.startswith(f"{name}:")
