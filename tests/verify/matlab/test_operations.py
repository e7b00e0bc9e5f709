"""Each operation of the function in the range of its class: what is generated, and what the check must not overlook."""

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.matlab import operations
from dzdesign.verify.matlab.evaluator import Evaluator, Value
from dzdesign.verify.matlab.operations import corner_inputs, evaluated, operations_check
from dzdesign.verify.matlab.parser import parse_body
from dzdesign.verify.matlab.subset import ReadFunction, _tokens, read_functions
from tests.support.octave import compensator_of, output_of
from tests.support.paths import GOLDENS, GOLDENS_FULL

CASES = {"dz_comp": (GOLDENS, 1), "both dz_comp": (GOLDENS_FULL, 1), "both dz_comp_negative": (GOLDENS_FULL, -1)}


@pytest.fixture(scope="module")
def text():
    return output_of(compensator_of(GOLDENS)).files["dz_comp.m"].decode()


@pytest.fixture(scope="module")
def prepared():
    return PreparedInputs(ExactLaw(compensator_of(GOLDENS)))


@pytest.fixture
def some(prepared, codes, monkeypatch):
    """Let the inputs be some of them, and be made once."""
    monkeypatch.setattr(operations, "corner_inputs", lambda _: tuple(each[::37] for each in codes))


@pytest.fixture(scope="module")
def codes(prepared):
    return corner_inputs(prepared)


@pytest.mark.parametrize("case", CASES)
def test_what_is_generated_stays_in_range_and_is_the_exact_law(case):
    root, sign = CASES[case]
    made, name = compensator_of(root), case.split()[-1]
    function = read_functions(output_of(made).files[f"{name}.m"].decode(), f"{name}.m")[0]
    check = operations_check(function, PreparedInputs(ExactLaw(made, sign)))
    assert check.holds, check.text
    assert " 0 beyond" in check.text and "; 0 compare values" in check.text


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("int64(law_beta) .* factor", "int64(law_beta .* int32(factor))", "beyond its int32"),
        ("HALF = int64(", "HALF = int64(2^62) + int64(2^62) + int64(", "beyond its int64"),
        ("    quotient(let_go) = 0;", "    quotient = quotient .* RECIPROCAL;", "beyond its uint16"),
        ("+ COMMAND_TERM .* command", "- COMMAND_TERM .* command", "negative"),
        ("FACTOR_OFFSET = int64(", "FACTOR_OFFSET = int32(", "of a int64 and a int32"),
        ("command = int64(past", "command = (past", "of a int64 and a int32"),
        ("LAW_NODES(row + 2)", "LAW_NODES(row + 9)", "no element"),
        ("a_failed | b_failed | reversed", "a_failed | b_failed | b", "| of a logical"),
        ("row .* STEP_CODES", "row * row", "* of two arrays"),
        ("law_beta(failed) = LAW_LEAST", "law_beta(failed) = HALF", "get a int64"),
        ("dp(failed) = 0", "dp(failed) = 2147483648", "beyond its int32"),
        ("bitshift(dp, -STEP_SHIFT)", "bitshift(dp, STEP_SHIFT)", "bitshift"),
        ("RECIPROCAL = int64(", "RECIPROCAL = int64(1", "compare values"),
        ("left = LAW_NODES", "right = LAW_NODES", "left has no value"),
        ("compare = reshape", "status = reshape", "can't be evaluated"),
    ],
)
def test_what_leaves_its_class_is_seen(text, prepared, some, old, new, words):
    assert old in text
    function = read_functions(text.replace(old, new, 1), "dz_comp.m")[0]
    check = operations_check(function, prepared)
    assert not check.holds and words in check.text


def test_every_difference_is_tried_with_every_corner(prepared, codes):
    codes, expected = codes
    exact = prepared.exact
    sound = (codes[:, 1] >= exact.a.valid_codes[0]) & (codes[:, 1] <= exact.a.valid_codes[1])
    made = {int(each) for each in exact.difference(codes[sound, 1], codes[sound, 2])}
    assert set(prepared.differences.values[prepared.differences.made].tolist()) <= made
    assert {0, exact.span, exact.zero_band, exact.transition_end, 65535} <= set(codes[:, 0].tolist())
    rng = np.random.default_rng(25)
    for place in rng.integers(0, len(codes), 200):
        u, a, b = (int(code) for code in codes[place])
        valid = all(low <= code <= high for code, (low, high) in ((a, exact.a.valid_codes), (b, exact.b.valid_codes)))
        dp = int(exact.difference(a, b)) if valid else -exact.reverse - 1
        value = exact.compare_value(u, exact.corners(exact.betas(dp))) if u in exact.sound_commands else 0
        assert value == expected[place]


def body(text):
    words = tuple(_tokens(f"{text}\nend\n", "f.m"))
    return parse_body(ReadFunction(name="f", outputs=(), inputs=(), body=words), "f.m")


@pytest.mark.parametrize(
    ("text", "result"),
    [
        ("2 + 3 * 4 - 5", 9),
        ("-2^2", -4),
        ("(2 + 3) * -4", -20),
        ("1 < 2 & 3 < 2 | 1 == 1", 1),
        ("~(1 < 2) | 2 ~= 2", 0),
        ("max(1 + 1, 5) - min(3, 2)", 3),
        ("10 - 2 - 3", 5),
    ],
)
def test_operators_bind_as_in_matlab(text, result):
    evaluator = Evaluator(source="f.m", values={})
    evaluator.run(body(f"x = {text};"))
    assert int(evaluator.values["x"].data.item()) == result


@pytest.mark.parametrize(
    "text", ["x = ;", "x = (1", "x = 1 +", "x = y;", "3 = x", "f(1, 2) = 3", "x = [1; 2", "if 1", "x = fix(2)",
     "x = 2 ^ (1 - 3)", "x = 2 ^ 65", "x = bitshift(1, -65)", "x = int32()", "x = max(1)", "x = [1; 2] + [1; 2; 3]",
     "x = 1" + " + 1" * 51, "x = " + "(" * 31 + "1" + ")" * 31, "x = " + "~" * 31 + "1", "x = " + "9" * 21]
)  # fmt: skip
def test_what_is_no_statement_is_refused(text):
    with pytest.raises(InputError, match=r"f\.m"):
        Evaluator(source="f.m", values={}).run(body(text))


def test_a_branch_runs_where_its_condition_holds():
    evaluator = Evaluator(source="f.m", values={"n": Value("double", np.array([3], dtype=object))})
    evaluator.run(body("x = 1;\nif n > 5\n x = 2;\nend\nif n > 2\n x = x + 10;\nend"))
    assert evaluator.values["x"].data.item() == 11


def test_the_inputs_are_columns(text):
    function = read_functions(text, "dz_comp.m")[0]
    evaluator = evaluated(function, np.array([[2048, 1400, 1000], [0, 1400, 1000]]))
    assert evaluator.faults == [] and evaluator.values["compare"].data.shape == (2,)
