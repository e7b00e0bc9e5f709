"""The text's own evaluation: what an operation means in each language, and what it must not overlook."""

import numpy as np
import pytest

from dzdesign.core.errors import RequirementError
from dzdesign.verify.outputs.text_values import FIRST, LAST, Overflow, TextValues

BLOCK = """FUNCTION_BLOCK B
VAR_INPUT
    x, y : DINT; (* two numbers; the
        first is x *)
END_VAR
VAR
    seen : BOOL := TRUE;
    z : DINT;
END_VAR
VAR CONSTANT
    C : DINT := -7; T : ARRAY[0..2] OF DINT := [10, -20,
        30];
END_VAR
{};
END_FUNCTION_BLOCK
"""
CONSTANTS = "C = int64(-7);\n% a table\nT = int64([ ...\n    10; -20; ...\n    30 ...\n    ]);\n"
ENDS = [-(2**31), 2**31 - 1, -65537, -65536, -8, -7, -1, 0, 1, 3, 7, 65535, 65536, 1_000_003]


def block(statements):
    return TextValues(BLOCK.format(statements), "st", "B.st")


def function(*rows):
    return TextValues(FIRST + CONSTANTS + "".join(f"    {row};\n" for row in rows) + LAST, "m", "f.m")


def divided(x, y):
    return abs(x) // y * (1 if x >= 0 else -1)


#: Expression to its meaning for x, and y; None: it is a fault. Of Structured Text, and of MATLAB where it has it.
MEANINGS = {
    "x + y": ("x + y", lambda x, y: x + y),
    "x - y * C": ("x - y .* C", lambda x, y: x + 7 * y if abs(7 * y) < 2**31 else None),
    "x * y": ("x .* y", lambda x, y: x * y),
    "-x": ("-x", lambda x, y: -x),
    "x / 65536": (None, lambda x, y: divided(x, 65536)),
    "x / 7": (None, lambda x, y: divided(x, 7)),
    "x / MAX(y, 3)": (None, lambda x, y: divided(x, max(y, 3))),
    "x MOD 32768": (None, lambda x, y: x - divided(x, 32768) * 32768),
    "x MOD 7 + y - y": (None, lambda x, y: x - divided(x, 7) * 7 if abs(x % 7 + y) < 2**31 - 7 else "either"),
    "x / y": (None, lambda x, y: divided(x, y) if y > 0 else None),
    "MIN(x, MAX(y, C))": ("min(x, max(y, C))", lambda x, y: min(x, max(y, -7))),
    "T[MIN(MAX(x, 0), 2)]": ("T(min(max(x, 0), 2) + 1)", lambda x, y: (10, -20, 30)[min(max(x, 0), 2)]),
    "T[x]": ("T(x + 1)", lambda x, y: {0: 10, 1: -20, 2: 30}.get(x)),
    "SEL(x < y AND NOT (x = 3), C, x)": (None, lambda x, y: x if x < y and x != 3 else -7),
    "BOOL_TO_DINT(x <= y OR x <> 7) * 8": ("int64(x <= y | ~(x == 7)) .* 8", lambda x, y: 8 * (x <= y or x != 7)),
}


@pytest.mark.parametrize(
    ("expression", "language"),
    [(name, "st") for name in MEANINGS] + [(name, "m") for name, (of_matlab, _) in MEANINGS.items() if of_matlab],
)
def test_an_operation_means_what_its_language_says_and_a_fault_is_seen(expression, language):
    of_matlab, means = MEANINGS[expression]
    text = block(f"z := {expression}") if language == "st" else function(f"z = {of_matlab}")
    for x in ENDS:
        for y in ENDS:
            must, kind = means(x, y), np.int32 if language == "st" else np.int64
            if must == "either" or (language == "m" and must is None and expression != "T[x]"):
                continue
            given = {"x": np.array([x], kind), "y": np.array([y], kind)}
            if must is None or (language == "st" and not -(2**31) <= must < 2**31):
                with pytest.raises(Overflow, match=r"(B\.st, line 14|f\.m, line \d+): z: "):
                    text.run(given)
            else:
                assert int(text.run(given)["z"].flat[0]) == must, (x, y)


def test_one_overflow_of_many_inputs_is_seen_and_ends_that_do_not_meet_are_none():
    """The ends of x and y lie at different inputs: only a sum that occurs can overflow."""
    x = np.array([2**31 - 1, -(2**31), 5], np.int32)
    assert block("z := x + y").run({"x": x, "y": -np.sign(x)})["z"].tolist() == [2**31 - 2, 1 - 2**31, 4]
    with pytest.raises(Overflow, match="2147483648"):
        block("z := x + y").run({"x": x, "y": np.array([1, 1, 1], np.int32)})
    long = np.array([2**62, -(2**62)])
    assert function("z = x + y").run({"x": long, "y": -long})["z"].tolist() == [0, 0]
    with pytest.raises(Overflow, match="beyond 64 bits"):
        function("z = x + y").run({"x": long, "y": long})


def test_a_shift_and_a_large_constant_of_matlab():
    text = function("large = int64(3) * int64(2^60)", "z = bitshift(x, -3)", "small = x < 8", "z(small) = C")
    found = text.run({"x": np.array([0, 7, 8, 100])})
    assert found["large"] == 3 * 2**60 and found["z"].tolist() == [-7, -7, 1, 12]
    with pytest.raises(RequirementError, match="bitshift"):
        text.run({"x": np.array([-1, 8])})


def test_what_is_remembered_and_inputs_that_broadcast():
    text = block("seen := x < 0 OR seen AND x < 5;\n(* more *) z := SEL(seen, y, x)")
    assert text.first == {"seen": "TRUE"}
    found = text.run({"x": np.arange(-1, 7, dtype=np.int32)[:, None], "y": np.arange(3, dtype=np.int32),
                      "seen": np.array(True)})  # fmt: skip
    assert found["z"].shape == (8, 3) and found["seen"].shape == (8, 1) and found["seen"].sum() == 6


@pytest.mark.parametrize(
    "statements",
    ["IF x > 0 THEN z := 1; END_IF", "z := x +", "z := EXPT(x, y)", "z := x < y + (x > y)", "z := w",
     "z := x; z(2) := 1",
     "z := 2 ** 3", "z := x // 2", "z := SEL(x, 1, 2)", "z := 1.5", "z := x; }", "seen := NOT x"],
)  # fmt: skip
def test_what_is_no_assignment_of_numbers_is_refused(statements):
    with pytest.raises(RequirementError):
        block(statements).run({"x": np.array([1], np.int32), "y": np.array([2], np.int32)})


@pytest.mark.parametrize(
    "row", ["for k = 1:3", "z = x / 3", "z = system('ls')", "z = x + ~y", "z(1) = 2", "z = x <= y <= x"]
)
def test_what_is_no_assignment_of_matlabs_is_refused(row):
    with pytest.raises(RequirementError):
        function(row).run({"x": np.array([1]), "y": np.array([2])})
    with pytest.raises(RequirementError, match="generated"):
        TextValues("function f\n", "m", "f.m")
