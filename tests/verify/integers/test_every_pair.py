"""Blocks of many designs against the exact law, wrong ones, and what their text means. On few inputs."""

import re
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.codegen.integers.plc import structured_text
from dzdesign.core.errors import RequirementError
from dzdesign.verify.outputs.every_pair import EveryPair
from dzdesign.verify.outputs.exact_block import ExactBlock
from dzdesign.verify.outputs.text_values import Overflow, TextValues
from tests.support.core_variants import variant
from tests.support.golden_firmware import FULL, GOLDENS, golden_compensator

#: Pressure drops of a quick check, and of pressures at zero command every which; `verify` tries all.
SOME, STEP = {"plc": range(-60, 2400, 211), "codes": range(-40, 3300, 97)}, 701
ROOTS = {"one": GOLDENS, "two": FULL}
DESIGNS = ("no transition", "target law, no transition", "live zero", "inverted", "bipolar, no transition",
           "bipolar, all options")  # fmt: skip
COUNTS = ("wrong", "wrong_status", "wrong_state")


def of_block(text):
    return TextValues(text, "FB.st").run


def found_of(every, program):
    """Return the counts of everything that is tried, added up."""
    pairs = [every.every_command(program, place, SOME["codes" if every.of_codes else "plc"])
             for place in range(len(every.laws))]  # fmt: skip
    tried = [*pairs, *every.every_pressure(program, STEP), every.extremes(program)]
    return {name: sum(getattr(each, name) for each in tried) for name in ("pairs", *COUNTS)}


def is_right(found):
    return found["pairs"] > 1000 and not any(found[name] for name in COUNTS)


@pytest.fixture(scope="module", params=[(root, kind) for root in ROOTS for kind in SOME], ids=" ".join)
def case(request):
    root, interface = request.param
    made = golden_compensator(root=ROOTS[root])
    return made, EveryPair(made, interface, made.signals.signs, remembers=True), interface


def test_the_text_of_a_block_is_the_exact_law(case):
    made, every, interface = case
    found = found_of(every, of_block(structured_text(made, "0" * 64, interface)))
    assert is_right(found) and found["pairs"] > 200_000, found


@pytest.mark.slow
@pytest.mark.parametrize("interface", SOME)
@pytest.mark.parametrize("name", DESIGNS)
def test_the_block_of_another_design(name, interface):
    made = variant(name)
    text = structured_text(made, "0" * 64, interface)
    assert ("at_rest" in text) == ("no transition" not in name) and ("side" in text.partition("VAR C")[0]) == (
        "bipolar" in name
    )
    assert is_right(found_of(EveryPair(made, interface, made.signals.signs, remembers=True), of_block(text)))


def test_in_units_of_a_plc_the_law_is_that_of_the_share_of_full_command():
    """By hand: full command at no pressure drop, beta of the next code outside, rounded down."""
    made = golden_compensator()
    exact, side = ExactBlock(made, 1, "plc"), made.side(1)
    beta = made.law_beta(int(-(-Fraction(1, 100) // made.signals.pressure_a.per_code_MPa)))
    full = beta * side.u_min0_over_u_max + beta * (side.drive_range_over_u_max - 1) + 1  # Eq. (18) at full command
    (_, value) = exact.corners(exact.betas_at(0))[-1]
    assert value == 10_000 * full
    assert exact.betas_at(-exact.reverse - 1) == exact.least_betas()


@pytest.fixture(scope="module", params=(*ROOTS, "three"))
def plc(request):
    """The text of a block in units of a PLC, and what tries it."""
    three = request.param == "three"
    made = variant("three pressures") if three else golden_compensator(root=ROOTS[request.param])
    return structured_text(made, "0" * 64, "plc"), EveryPair(made, "plc", made.signals.signs, remembers=True)


of_one = pytest.mark.parametrize("plc", ["one"], indirect=True)


@pytest.mark.parametrize(
    ("plc", "old", "new", "counts"),
    [
        # The resolution of a pressure.
        ("one", "(MAX(difference, 0) + 1)", "(MAX(difference, 0) + 0)", ["wrong"]),
        ("one", "* 16;", "* 32;", ["wrong_status"]),
        ("one", "at_rest AND towards <= LEAVE_ZERO", "at_rest AND towards < LEAVE_ZERO", ["wrong_state"]),
        ("one", "BOOL_TO_DINT(b_failed) * 4", "BOOL_TO_DINT(a_failed) * 4", ["wrong_status"]),
        ("one", "failed := NOT sound OR below", "failed := NOT sound", ["wrong"]),
        ("one", "quotient := ", "quotient := 80 + ", ["wrong"]),
        ("one", "SEL(valid, 0, drive)", "SEL(valid, drive, drive)", ["wrong"]),
        # A block that mistakes its side.
        ("two", "SEL(away > LEAVE_ZERO, SEL(away < -LEAVE_ZERO, side, -1), 1)",
         "SEL(away > 0, SEL(away < 0, side, -1), 1)", COUNTS),
        ("two", "SEL(valid, 0, SEL(away", "SEL(valid, side, SEL(away", COUNTS),
        ("two", "pressure_ahead - pressure_behind", "pressure_behind - pressure_ahead", COUNTS),
        # Pressures of the other side.
        ("three", "failure_behind := SEL(negative, b_failed, c_failed)", "failure_behind := b_failed", COUNTS),
        ("three", "MAX(pressure_c,", "MAX(pressure_b,", COUNTS),
        ("three", "BOOL_TO_DINT(c_failed) * 512", "BOOL_TO_DINT(b_failed) * 512", ["wrong_status"]),
        ("two", "output_b := SEL(negative, 0, drive)", "output_b := SEL(negative, 0, output_a)", COUNTS),
        ("two", "negative := side < 0", "negative := away < 0", COUNTS),
    ],
    indirect=["plc"],
)  # fmt: skip
def test_a_seeded_fault_is_counted(plc, old, new, counts):
    text, every = plc
    assert old in text
    found = found_of(every, of_block(text.replace(old, new, 1)))
    assert any(found[count] > 0 for count in counts)


@of_one
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("difference := MIN", "difference := 2000000 * MIN"),
        ("ahead * SLOPE", "(ahead * 2000) * SLOPE"),
        ("LAW_NODES[row + 1]", "LAW_NODES[row + 2]"),
        ("/ UNITS", "/ (UNITS - 1000)"),
    ],
)
def test_a_seeded_overflow_is_an_error_that_names_its_line(plc, old, new):
    text, every = plc
    assert text.count(old) >= 1
    line = next(number for number, row in enumerate(text.splitlines(), 1) if old in row)
    with pytest.raises(Overflow, match=rf"FB\.st, line ({line}|{line - 1}): "):
        found_of(every, of_block(text.replace(old, new, 1)))


def mutants(text):
    """Return wrong versions of the assignments, one change each."""
    others = {"+": "-", "-": "+", "*": "+", "<": "<=", ">": ">=", "OR": "AND", "AND": "OR", "MIN": "MAX", "MAX": "MIN",
              "MOD": "/", "<=": "<"}  # fmt: skip
    begins, found = text.rindex("END_VAR"), []
    hidden = re.sub(r"\(\*.*?\*\)", lambda comment: " " * len(comment[0]), text, flags=re.DOTALL)
    for match in re.compile(r"\b(?:AND|OR|MIN|MAX|MOD)\b|<=|[-+*<>]|\b\d+\b").finditer(hidden, begins):
        new = others.get(match[0]) or str(int(match[0]) + 1)
        found.append((match[0], new, text[: match.start()] + new + text[match.end() :]))
    return found


@of_one
@pytest.mark.slow
def test_wrong_blocks_are_caught(plc):
    """A change that no input tells apart is one of a clamp that the law never reaches: few are."""
    text, every = plc
    changed = mutants(text)
    assert len(changed) > 150
    left = []
    for old, new, wrong in changed[::14]:
        try:
            if is_right(found_of(every, of_block(wrong))):
                left.append(
                    (old, new, next(a for a, b in zip(wrong.splitlines(), text.splitlines(), strict=True) if a != b))
                )
        except RequirementError:
            continue
    assert len(left) <= 0.25 * len(changed[::14]), left


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
