"""Integer operations, as they are printed: their values lie in their ranges, and what fits no word is refused."""

from itertools import product

import numpy as np
import pytest

from dzdesign.codegen.integers.form import RADIX, Form, Limbs, truncated
from dzdesign.codegen.integers.law import block_form
from dzdesign.codegen.integers.text import st_body, st_constants
from dzdesign.core.errors import DzdesignError, InputError
from dzdesign.verify.outputs.text_values import TextValues
from tests.codegen.core.test_core_against_law import random_compensators
from tests.support.golden_firmware import FULL, GOLDENS, golden_compensator

#: Operation on x of -9 to 7 and y of 3 to 4, and what it means.
MEANT = {
    "sum": (lambda x, y: x + y, lambda x, y: x + y),
    "difference": (lambda x, y: x - y, lambda x, y: x - y),
    "product": (lambda x, y: x * y, lambda x, y: x * y),
    "negative": (lambda x, y: -x + y * 0, lambda x, y: -x),
    "least": (lambda x, y: x.least(y), min),
    "most": (lambda x, y: x.most(y), max),
    "quotient": (lambda x, y: x.quotient(y), lambda x, y: int(x / y)),
    "quotient by a power": (lambda x, y: x.quotient(4), lambda x, y: int(x / 4)),
    "remainder": (lambda x, y: x.remainder(5), lambda x, y: x - 5 * int(x / 5)),
    "remainder of a power": (lambda x, y: x.remainder(4), lambda x, y: x - 4 * int(x / 4)),
    "choice": (lambda x, y: (x < y).choose(x, -9), lambda x, y: x if x < y else -9),
    "condition": (lambda x, y: ((x > y) | ~(x <= 2)).as_number(), lambda x, y: int(x > y or not x <= 2)),
}


def printed_values(form, given):
    """Return the values of every name of a form of 32 bits: by its text for a PLC, as `verify` evaluates that."""
    lines = ("VAR CONSTANT", *st_constants(form), "END_VAR", *st_body(form), "END_FUNCTION_BLOCK")
    return TextValues("\n".join(lines), "FB.st").run(given)


@pytest.mark.parametrize("name", MEANT)
def test_an_operation_is_what_it_means_and_its_range_is_that_of_its_values(name):
    form = Form(bits=32)
    x, y = form.input("x", -9, 7), form.input("y", 3, 4)
    traced, meant = MEANT[name]
    line = form.let("z", traced(x, y))
    given = {"x": np.arange(-9, 8)[:, None], "y": np.array([3, 4])}
    expected = np.array([[meant(a, b) for b in (3, 4)] for a in range(-9, 8)])
    found = printed_values(form, given)["z"]
    assert np.array_equal(np.broadcast_to(found, expected.shape), expected)
    assert line.low <= expected.min() and expected.max() <= line.high
    if name not in ("negative", "choice"):  # there x decides twice
        assert (line.low, line.high) == (expected.min(), expected.max())


@pytest.mark.parametrize("bits", [32, 64])
def test_what_does_not_fit_its_word_is_refused(bits):
    form = Form(bits=bits)
    x = form.input("x", 0, 2 ** (bits - 1) - 1)
    for operation in (lambda: x + 1, lambda: x * 2, lambda: -x - 2, lambda: x.number(2 ** (bits - 1))):
        with pytest.raises(InputError, match=f"beyond {bits} bits"):
            operation()
    table = form.constant("TABLE", (1, 2, 3), "")
    with pytest.raises(DzdesignError, match="3 elements"):
        table.of(form.input("i", 0, 3))
    with pytest.raises(DzdesignError, match="beyond its step"):
        table.interpolated(form.input("i", 0, 1), form.input("past", 0, 5), 4)


def test_a_sum_in_limbs_is_the_sum_and_every_limb_fits():
    """Products of 31 bits with either sign, weighted: over 2^shift, rounded down."""
    ends = (-(2**30), -32769, -1, 0, 5, 32768, 2**30 - 1)
    for shift in (32, 35, 44):
        form = Form(bits=32)
        x, y, w = form.input("x", -(2**30), 2**30), form.input("y", -(2**28), 2**28), form.input("w", 0, 3)
        limbs = Limbs(form, None)
        limbs.add("first", form.let("p", x), form.let("q", y), w)
        limbs.add_share("own", form.let("r", x.most(0)), limbs.constant("C", (RADIX**2 + 7,), ""), None)
        limbs.add_number(limbs.constant("H", (3 * RADIX**2 + 2**20 + 1,), ""))
        limbs.shifted(shift)
        a, b, c = np.array(list(product(ends, (each >> 2 for each in ends), range(4)))).T
        found = printed_values(form, {"x": a, "y": b, "w": c})["quotient"]
        exact = [int(k) * int(i) * int(j) + max(int(i), 0) * (RADIX**2 + 7) + 3 * RADIX**2 + 2**20 + 1
                 for i, j, k in zip(a, b, c, strict=True)]  # fmt: skip
        assert found.tolist() == [each >> shift for each in exact]


def test_of_sums_with_a_sign_a_quotient_is_rounded_towards_zero():
    assert [truncated(x, 4) for x in (-9, -8, -1, 0, 7)] == [-2, -2, 0, 0, 1]


@pytest.mark.parametrize("root", [GOLDENS, FULL])
def test_the_values_of_the_law_lie_within_their_ranges(root):
    made, random = golden_compensator(root=root), np.random.default_rng(7)
    for form in [block_form(made, name) for name in ("plc", "codes")]:
        given = {each.name: random.integers(max(each.low, -11_000), min(each.high, 11_000) + 1, 3_000).astype(
                     bool if each.boolean else np.int64) for each in form.inputs}  # fmt: skip
        values = printed_values(form, given)
        names = [each.name for each in form.lines]
        assert len(names) == len(set(names)) > 20 and len(form.lines) < 60
        for line in form.lines:
            data = values[line.name]
            assert data.dtype == bool if line.boolean else line.low <= data.min() <= data.max() <= line.high, line.name


def test_random_designs_give_the_exact_law():
    """Laws, tables, zero bands and transitions as they come, in limbs of 15 bits; MATLAB's words are for Octave."""
    made, random = golden_compensator(), np.random.default_rng(11)
    for compensator in random_compensators(made, 30, seed=5):
        u = np.array([0, 1, 4094, 4095, *random.integers(0, 4096, 12), *random.integers(0, 300, 12)])
        drop = np.array([-31, -30, 0, 63, 64, 3325, 3326, *random.integers(-40, 3327, 21)])
        a, b = np.maximum(688 + drop, 688), np.maximum(688 - drop, 688)
        given = {"command": u, "pressure_a": a, "pressure_b": b, "at_rest": np.zeros(u.size, dtype=bool)}
        in_limbs = printed_values(block_form(compensator, "codes"), given)["output_a"]
        band = compensator.zero_band_codes
        resting = [compensator.compare(0 if command <= band else int(command), int(code))
                   for command, code in zip(u, drop, strict=True)]  # fmt: skip
        assert in_limbs.tolist() == resting
