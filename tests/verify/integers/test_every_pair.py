"""Blocks of many designs against the exact law, and wrong ones that must be caught. On few inputs."""

import re
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.codegen.integers.plc import structured_text
from dzdesign.core.errors import RequirementError
from dzdesign.verify.exhaustive.exact_law import ExactLaw
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


def test_rows_made_by_additions_are_the_exact_law(case):
    """What the check compares with, against the law at single codes, computed each by itself."""
    made, every, interface = case
    random = np.random.default_rng(3)
    for law in every.laws:
        exact = law.exact
        rows = np.array([0, 1, exact.reverse, exact.reverse + 300, len(law.table) - 1])
        outputs = law.outputs(rows)
        for row, column in zip(rows, outputs.T, strict=True):
            last = row == len(law.table) - 1
            corners = exact.corners(exact.least_betas() if last else exact.betas_at(int(row) - exact.reverse))
            for away in [0, exact.zero_band, exact.transition_end, exact.span, *random.integers(0, exact.span, 20)]:
                part = next(place for place in range(len(corners) - 1) if away <= corners[place + 1][0])
                (begin, start), (end, stop) = corners[part : part + 2]
                value = start + (stop - start) * Fraction(int(away) - begin, end - begin) if end > begin else start
                assert column[away] == min(max((value + exact.rounding).__floor__(), 0), exact.compare_limit)
                if interface == "codes":
                    code = exact.zero + exact.along * int(away)
                    assert column[away] == ExactLaw(made, exact.sign).compare_value(code, corners)


def test_in_units_of_a_plc_the_law_is_that_of_the_share_of_full_command():
    """By hand: full command at no pressure drop, beta of the next code outside, rounded down."""
    made = golden_compensator()
    exact, side = ExactBlock(made, 1, "plc"), made.side(1)
    beta = made.law_beta(int(-(-Fraction(1, 100) // made.signals.pressure_a.per_code_MPa)))
    full = beta * side.u_min0_over_u_max + beta * (side.drive_range_over_u_max - 1) + 1  # Eq. (18) at full command
    (_, value) = exact.corners(exact.betas_at(0))[-1]
    assert value == 10_000 * full
    assert exact.betas_at(-exact.reverse - 1) == exact.least_betas()


@pytest.fixture(scope="module")
def one_plc():
    made = golden_compensator()
    return structured_text(made, "0" * 64, "plc"), EveryPair(made, "plc", (1,), remembers=True)


@pytest.fixture(scope="module")
def two_plc():
    made = golden_compensator(root=FULL)
    return structured_text(made, "0" * 64, "plc"), EveryPair(made, "plc", (1, -1), remembers=True)


@pytest.mark.parametrize(
    ("old", "new", "count"),
    [
        ("(MAX(difference, 0) + 1)", "(MAX(difference, 0) + 0)", "wrong"),  # the resolution of a pressure
        ("* 16;", "* 32;", "wrong_status"),
        ("at_rest AND towards <= LEAVE_ZERO", "at_rest AND towards < LEAVE_ZERO", "wrong_state"),
        ("BOOL_TO_DINT(b_failed) * 4", "BOOL_TO_DINT(a_failed) * 4", "wrong_status"),
        ("failed := NOT sound OR below", "failed := NOT sound", "wrong"),
        ("quotient := ", "quotient := 80 + ", "wrong"),
        ("SEL(valid, 0, drive)", "SEL(valid, drive, drive)", "wrong"),
    ],
)
def test_a_seeded_fault_is_counted(one_plc, old, new, count):
    text, every = one_plc
    assert old in text
    assert found_of(every, of_block(text.replace(old, new, 1)))[count] > 0


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("SEL(away > LEAVE_ZERO, SEL(away < -LEAVE_ZERO, side, -1), 1)", "SEL(away > 0, SEL(away < 0, side, -1), 1)"),
        ("SEL(valid, 0, SEL(away", "SEL(valid, side, SEL(away"),
        ("SEL(negative, difference, -difference)", "difference"),
        ("output_b := SEL(negative, 0, drive)", "output_b := SEL(negative, 0, output_a)"),
        ("negative := side < 0", "negative := away < 0"),
    ],
)
def test_a_block_that_mistakes_its_side_is_caught(two_plc, old, new):
    text, every = two_plc
    assert old in text
    assert not is_right(found_of(every, of_block(text.replace(old, new, 1))))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("difference := MIN", "difference := 2000000 * MIN"),
        ("ahead * SLOPE", "(ahead * 2000) * SLOPE"),
        ("LAW_NODES[row + 1]", "LAW_NODES[row + 2]"),
        ("/ UNITS", "/ (UNITS - 1000)"),
    ],
)
def test_a_seeded_overflow_is_an_error_that_names_its_line(one_plc, old, new):
    text, every = one_plc
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


@pytest.mark.slow
def test_wrong_blocks_are_caught(one_plc):
    """A change that no input tells apart is one of a clamp that the law never reaches: few are."""
    text, every = one_plc
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
