"""The longest path through a Cortex-M's machine code: by hand, and what has no bound."""

import pytest

from dzdesign.core.errors import RequirementError
from dzdesign.verify.analysis.longest_path import Bound, bounds


def listing(**functions):
    """Lines as objdump prints them: two octets an instruction, "name: text" a call of that name."""
    lines = []
    for name, texts in functions.items():
        lines.append(f"00000000 <{name}>:")
        for number, text in enumerate(texts):
            called, _, text = text.rpartition(": ")
            lines.append(f"   {2 * number:x}:\t{text.replace(' ', chr(9), 1)}")
            lines += [f"\t\t\t{2 * number:x}: R_ARM_THM_CALL\t{called}"] if called else []
    return "\n".join(lines) + "\n"


def bound(*texts, **more):
    return bounds(listing(f=texts, **more), ["f"])["f"]


def test_the_longer_of_two_ways_counts():
    assert bound("cbz r0, 8 <f+0x8>", "nop", "nop", "b.n a <f+0xa>", "nop", "bx lr") == Bound(5, 0)
    assert bound("cbz r0, 4 <f+0x4>", "bx lr", "nop", "nop", "nop", "bx lr") == Bound(5, 0)


def test_the_stack_is_the_deepest_place_of_a_path():
    push = ("push {r4-r7, lr}", "sub sp, #12", "add sp, #12", "pop {r4-r7, pc}")
    assert bound(*push) == Bound(4, 32)
    assert bound("str.w r4, [sp, #-4]!", "ldr.w r4, [sp], #4", "push {r0}", "pop {r0}", "bx lr") == Bound(5, 4)
    assert bound("stmdb sp!, {r4, sl, lr}", "g: bl 0 <f>", "ldmia.w sp!, {r4, sl, pc}", g=push) == Bound(7, 12 + 32)
    assert bound("sub.w sp, sp, #1024", "add.w sp, sp, #1024", "g: b.w 0 <f>", g=push) == Bound(7, 1024)
    assert bound("str r0, [sp, #8]", "ldr r0, [sp, #8]", "strd r3, r3, [r1]", "bx lr") == Bound(4, 0)


def test_a_return_that_may_be_left_out_is_not_the_end():
    assert bound("it eq", "bxeq lr", "nop", "bx lr") == Bound(4, 0)
    assert bound("itt eq", "moveq r0, r1", "popeq {r4, pc}", "nop", "bx lr", "nop") == Bound(5, 0)


def test_what_is_behind_the_last_return_does_not_count():
    assert bound("bx lr", "nop", ".word 0x00000000") == Bound(1, 0)


@pytest.mark.parametrize(
    ("texts", "more", "why"),
    [
        (("nop", "bne.n 0 <f>", "bx lr"), {}, "loop"),
        (("b.n 2 <f+0x2>", "b.n 0 <f>"), {}, "loop"),
        (("f: bl 0 <f>", "bx lr"), {}, "calls itself"),
        (("g: bl 0 <f>", "bx lr"), {"g": ("f: b.w 0 <g>",)}, "calls itself"),
        (("memcpy: bl 0 <f>", "bx lr"), {}, "memcpy.* not there"),
        (("tbb [pc, r0]", "bx lr"), {}, "address of its data"),
        (("blx r3", "bx lr"), {}, "address of its data"),
        (("bx r3",), {}, "address of its data"),
        (("mov pc, r3", "bx lr"), {}, "address of its data"),
        (("b.n 60 <f+0x60>",), {}, "none of its instructions"),
        (("nop", "nop"), {}, "none of its instructions"),
        (("sub.w sp, sp, r3", "bx lr"), {}, "stack"),
        (("mov sp, r7", "bx lr"), {}, "stack"),
    ],
)
def test_what_has_no_bound_is_said(texts, more, why):
    with pytest.raises(RequirementError, match=why):
        bound(*texts, **more)


def test_two_functions_of_a_name_have_none():
    with pytest.raises(RequirementError, match="two functions"):
        bounds(listing(f=("bx lr",)) * 2, ["f"])
