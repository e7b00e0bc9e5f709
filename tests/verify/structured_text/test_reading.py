"""The subset of Structured Text: what is read, what is refused and where, and what its operations mean."""

import ctypes

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.verify.structured_text.evaluator import Evaluator
from dzdesign.verify.structured_text.parser import DEEPEST, MOST_HELD, MOST_OPERATIONS, parse
from dzdesign.verify.structured_text.to_c import block_in_c, place_of
from dzdesign.verify.structured_text.type_check import check_types
from tests.support.c_library import load_library
from tests.support.synthetic import needs_compiler

HEAD = """FUNCTION_BLOCK B
VAR_INPUT x, y : DINT; END_VAR
VAR_OUTPUT z, w : DINT; END_VAR
VAR seen : BOOL := TRUE; END_VAR
VAR CONSTANT C : DINT := -7; T : ARRAY[1..3] OF DINT := [10, -20, 30]; END_VAR
VAR_TEMP u : UDINT; a : ARRAY[0..1] OF DINT; i, k : DINT; END_VAR
"""
END = "END_FUNCTION_BLOCK\n"
GOOD = "z := x; w := y;"


def read(body, head=HEAD):
    block = parse(f"{head}{body} {END}", "B.st")
    return block, check_types(block, "B.st")


def test_what_is_written_is_read():
    block, _ = read("(* a comment *) IF x > 1 AND NOT seen THEN z := T[2]; ELSE z := C; END_IF; w := 0;")
    assert [each.name for each in block.of_section("VAR_INPUT")] == ["x", "y"]
    assert block.variables["t"].initial == (10, -20, 30) and block.variables["t"].bounds == (1, 3)


def test_variables_that_take_all_memory_are_refused():
    held = f"VAR_TEMP more : ARRAY[1..{MOST_HELD}] OF DINT; END_VAR"
    with pytest.raises(InputError, match=f"more than {MOST_HELD} numbers"):
        read(GOOD, HEAD + held)


@pytest.mark.parametrize(
    ("body", "place", "word"),
    [
        ("z := x +;", "line 7, column 9", "';'"),
        ("z := 1.5;", "line 7, column 7", "subset"),
        ("z := 16#FF;", "line 7, column 6", "subset"),
        ("z := 12345678901;", "line 7, column 6", "32 bits"),
        ("z := 2147483648;", "line 7, column 6", "DINT"),
        ("WHILE x > 0 DO z := 1; END_WHILE", "line 7, column 1", "'WHILE'"),
        ("z := EXPT(x, y);", "line 7, column 6", "reserve"),
        ("z := POWER(x, y);", "line 7, column 11", "'('"),
        ("z := x; // a comment", "line 7, column 9", "'/'"),
        ("z := (* (* nested *) x;", "line 7, column 6", "subset"),
        ("z := x; (* open", "line 7, column 9", "subset"),
        ("z := MIN(x);", "line 7, column 6", "operands"),
        ("z := r_;", "line 7, column 6", "reserve"),
        ("z := o;", "line 7, column 6", "not declared"),
        ("z := seen;", "line 7, column 6", "BOOL"),
        ("z := x + DINT_TO_UDINT(y);", "line 7, column 10", "UDINT"),
        ("u := -1;", "line 7, column 6", "DINT"),
        ("u := x;", "line 7, column 6", "DINT"),
        ("IF x THEN z := 1; END_IF", "line 7, column 4", "BOOL"),
        ("C := 1;", "line 7, column 1", "assigned"),
        ("x := 1;", "line 7, column 1", "assigned"),
        ("FOR i := 0 TO 3 DO i := 2; END_FOR", "line 7, column 20", "assigned"),
        ("FOR z := 0 TO 3 DO w := 2; END_FOR", "line 7, column 1", "loop"),
        ("z := k;", "line 7, column 6", "before"),
        ("IF x > 0 THEN k := 1; END_IF z := k;", "line 7, column 35", "before"),
        ("a[0] := 1; z := a[1];", "line 7, column 17", "before"),
        ("FOR i := 0 TO 3 DO k := i; END_FOR z := i;", "line 7, column 41", "before"),
        ("z := T;", "line 7, column 6", "array"),
        ("z := x[1];", "line 7, column 6", "array"),
        ("z := " + "(" * (DEEPEST + 1) + "x" + ")" * (DEEPEST + 1) + ";", "line 7, column", "inside of each other"),
        ("z := x" + " + x" * (MOST_OPERATIONS + 1) + ";", "line 7, column", "operations"),
        ("FOR i := 1 TO 4096 DO z := x; z := x; z := x; z := x; z := x; END_FOR", "line 7, column 55", "a call has"),
        (END + "z := 1;", "line 8, column 1", "behind"),
        ("z := 30000 * 2;", "line 7, column 12", "alone"),
        ("z := x + (1 + 2) * y;", "line 7, column 13", "alone"),
        ("IF 1 < 2 THEN z := 1; END_IF", "line 7, column 6", "alone"),
        ("z := ABS(-3);", "line 7, column 6", "alone"),
        ("z := MAX(3, -(4));", "line 7, column 6", "alone"),
        ("FOR i := 0 TO 2147483647 DO z := 1; END_FOR", "line 7, column 1", "rounds"),
        ("FOR i := 2147483647 TO 2147483647 DO z := 1; END_FOR", "line 7, column 1", "never ends"),
        ("FOR i := 0 TO 99 DO FOR k := 0 TO 99 DO z := 1; END_FOR END_FOR", "line 7, column 21", "rounds"),
        ("FOR i := 0 TO x DO z := 1; END_FOR", "line 7, column 15", "whole number"),
        ("FOR i := 0 TO 3 DO FOR i := 0 TO 2 DO z := 1; END_FOR END_FOR", "line 7, column 20", "loop"),
        ("z := x;", "line 3, column 15", "w is not assigned"),
        ("z := x; IF x > 0 THEN w := 1; END_IF", "line 3, column 15", "w is not assigned"),
        ("(*) z := x; *)", "line 7, column 1", "subset"),
        ("z := x;\x0b", "line 7, column 8", "subset"),
    ],
)
def test_what_is_not_of_the_subset_is_refused_where_it_stands(body, place, word):
    with pytest.raises(InputError) as refused:
        read(body)
    assert place in str(refused.value) and word in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("x, y : DINT", "x, X : DINT", "twice"),
        ("x, y : DINT", "x, y : REAL", "'REAL'"),
        ("C : DINT := -7", "C : DINT", "no value"),
        ("C : DINT := -7", "C : UDINT := -7", "no UDINT"),
        ("[10, -20, 30]", "[10, -20]", "2 values"),
        ("ARRAY[1..3]", "ARRAY[3..1]", "elements"),
        ("z, w : DINT", "z, w : DINT := 3", "first value"),
        ("z, w : DINT", "z, t : DINT", "twice"),
        *((" k : DINT", f" k, {name} : DINT", "reserve") for name in
          ("TRANSITION", "Step", "s1", "n", "limit", "DINT_TO_REAL", "to_string", "a__b", "a_", "sizeof")),
    ],
)
def test_a_wrong_declaration_is_refused(old, new, word):
    assert old in HEAD
    with pytest.raises(InputError, match=word):
        read(GOOD, HEAD.replace(old, new))


CASES = [-(2**31), 2**31 - 1, -65537, -65536, -8, -7, -1, 0, 1, 3, 7, 65535, 65536, 1_000_003]
#: Expression for z to what IEC 61131-3 says, and whether all is in range.
MEANINGS = {
    "x + y": lambda x, y: x + y,
    "x - y": lambda x, y: x - y,
    "x * y": lambda x, y: x * y,
    "x / y": lambda x, y: None if y == 0 else int(abs(x) // abs(y)) * (1 if (x < 0) == (y < 0) else -1),
    "x MOD y": lambda x, y: None if y == 0 or (x, y) == (-(2**31), -1) else abs(x) % abs(y) * (-1 if x < 0 else 1),
    "-x": lambda x, y: -x,
    "ABS(y)": lambda x, y: abs(y),
    "MIN(x, y) + 0 * MAX(y, C)": lambda x, y: min(x, y),
    "T[y]": lambda x, y: {1: 10, 2: -20, 3: 30}.get(y),
    "UDINT_TO_DINT(DINT_TO_UDINT(x) * DINT_TO_UDINT(y) / 65536)": lambda x, y: (
        None if x < 0 or y < 0 or x * y >= 2**32 else x * y // 65536
    ),
    "UDINT_TO_DINT(DINT_TO_UDINT(x) - DINT_TO_UDINT(y))": lambda x, y: None if min(x, y) < 0 or x < y else x - y,
}


@needs_compiler
@pytest.mark.parametrize("expression", MEANINGS)
def test_an_operation_means_what_the_standard_says_and_a_fault_is_seen(expression):
    text = f"seen := x < y; z := {expression}; IF seen THEN w := 1; ELSIF x = y THEN w := 2; ELSE w := 3; END_IF "
    block, kinds = read(text)
    call = compiled(block, kinds)
    for x in CASES:
        for y in CASES:
            must = MEANINGS[expression](x, y)
            sound = must is not None and -(2**31) <= must < 2**31
            outputs, state, faults = call(x, y)
            evaluator = Evaluator(block, kinds, 1)
            given = evaluator.run({"x": np.array([x]), "y": np.array([y])})
            assert (faults[0] == 0) == sound == (evaluator.faults == 0), (x, y)
            assert outputs[1] == given["w"][0] == (1 if x < y else 2 if x == y else 3)
            assert state == given["seen"][0] == (x < y)
            if sound:
                assert outputs[0] == given["z"][0] == must, (x, y)
            else:
                assert place_of(faults[1]).line == 7


def compiled(block, kinds):
    """Return a block as a function of its inputs: outputs, state, and faults with the first one's place."""
    source = '#include "block.h"\nvoid call(const int64_t *i, int64_t *s, int64_t *o, struct faults *f);\n'
    source += "void call(const int64_t *i, int64_t *s, int64_t *o, struct faults *f) { block(i, s, o, f); }\n"
    library = load_library({"block.h": block_in_c(block, kinds), "call.c": source}, "a block")

    def call(x, y):
        inputs, state, outputs, faults = ((ctypes.c_int64 * 2)(*values) for values in ((x, y), (1, 0), (0, 0), (0, 0)))
        library.call(inputs, state, outputs, faults)
        return list(outputs), state[0], list(faults)

    return call


@needs_compiler
def test_a_loop_and_an_array_of_variables():
    text = "a[0] := 1; a[1] := 2; z := 0; FOR i := 0 TO 1 DO a[i] := a[i] * x; z := z + a[i]; END_FOR w := a[1]; "
    block, kinds = read(text)
    given = Evaluator(block, kinds, 2).run({"x": np.array([3, 5]), "y": np.zeros(2, dtype=int)})
    assert given["z"].tolist() == [9, 15] and given["w"].tolist() == [6, 10]
    assert compiled(block, kinds)(5, 0)[0] == [15, 10]
