"""The text's own evaluation: what an operation means in Structured Text, and what it must not overlook."""

import numpy as np
import pytest

from dzdesign.core.errors import RequirementError
from dzdesign.verify.outputs.text_values import Overflow, TextValues

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
ENDS = [-(2**31), 2**31 - 1, -65537, -65536, -8, -7, -1, 0, 1, 3, 7, 65535, 65536, 1_000_003]


def block(statements):
    return TextValues(BLOCK.format(statements), "B.st")


def divided(x, y):
    return abs(x) // y * (1 if x >= 0 else -1)


#: Expression to its meaning for x, and y; None: it is a fault.
MEANINGS = {
    "x + y": lambda x, y: x + y,
    "x - y * C": lambda x, y: x + 7 * y if abs(7 * y) < 2**31 else None,
    "x * y": lambda x, y: x * y,
    "-x": lambda x, y: -x,
    "x / 65536": lambda x, y: divided(x, 65536),
    "x / 7": lambda x, y: divided(x, 7),
    "x / MAX(y, 3)": lambda x, y: divided(x, max(y, 3)),
    "x MOD 32768": lambda x, y: x - divided(x, 32768) * 32768,
    "x MOD 7 + C": lambda x, y: x - divided(x, 7) * 7 - 7,
    "x / y": lambda x, y: divided(x, y) if y > 0 else None,
    "MIN(x, MAX(y, C))": lambda x, y: min(x, max(y, -7)),
    "T[MIN(MAX(x, 0), 2)]": lambda x, y: (10, -20, 30)[min(max(x, 0), 2)],
    "T[x]": lambda x, y: {0: 10, 1: -20, 2: 30}.get(x),
    "SEL(x < y AND NOT (x = 3), C, x)": lambda x, y: x if x < y and x != 3 else -7,
    "BOOL_TO_DINT(x <= y OR x <> 7) * 8": lambda x, y: 8 * (x <= y or x != 7),
}


@pytest.mark.parametrize("expression", MEANINGS)
def test_an_operation_means_what_the_language_says_and_a_fault_is_seen(expression):
    text = block(f"z := {expression}")
    for x in ENDS:
        for y in ENDS:
            must, given = MEANINGS[expression](x, y), {"x": np.array([x]), "y": np.array([y])}
            if must is None or not -(2**31) <= must < 2**31:
                with pytest.raises(Overflow, match=r"B\.st, line 14: z: "):
                    text.run(given)
            else:
                assert int(text.run(given)["z"].flat[0]) == must, (x, y)


def test_one_overflow_of_many_inputs_is_seen_and_ends_that_do_not_meet_are_none():
    """The ends of x and y lie at different inputs: only a sum that occurs can overflow."""
    x = np.array([2**31 - 1, -(2**31), 5])
    assert block("z := x + y").run({"x": x, "y": -np.sign(x)})["z"].tolist() == [2**31 - 2, 1 - 2**31, 4]
    with pytest.raises(Overflow, match="2147483648"):
        block("z := x + y").run({"x": x, "y": np.array([1, 1, 1])})


def test_what_is_remembered_and_inputs_that_broadcast():
    text = block("seen := x < 0 OR seen AND x < 5;\n(* more *) z := SEL(seen, y, x)")
    assert text.first == {"seen": "TRUE"}
    found = text.run({"x": np.arange(-1, 7)[:, None], "y": np.arange(3),
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
        block(statements).run({"x": np.array([1]), "y": np.array([2])})
