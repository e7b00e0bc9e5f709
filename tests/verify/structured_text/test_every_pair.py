"""Function blocks of the golden compensators against the exact law, and wrong ones that must be caught."""

import re
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.codegen.project import target_named
from dzdesign.codegen.structured_text.files import structured_text
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.structured_text.every_pair import ExactTables, TriedBlock
from dzdesign.verify.structured_text.exact_block import ExactBlock
from dzdesign.verify.structured_text.parser import parse
from dzdesign.verify.structured_text.type_check import check_types
from dzdesign.verify.structured_text.zero_output import zero_output_margin
from tests.support.block_mutants import evenly, is_wrong, killer, mutants
from tests.support.paths import GOLDENS, GOLDENS_FULL
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
#: Pressure drops and pressures of a quick check; all of them are tried by `verify` and benchmarks/outputs.
SOME = {"plc": (range(-60, 2400, 61), range(-300, 4300, 230)), "codes": (range(-40, 3300, 97), range(0, 4096, 211))}


def compensator(root):
    return read_artefact((root / "compensator.json").read_bytes(), Compensator, "compensator.json")


def tried(text, tables):
    block = parse(text, "B.st")
    return TriedBlock(block, check_types(block, "B.st"), tables, ["-O1"])


CASES = {
    "one plc": (GOLDENS, "plc"), "one codes": (GOLDENS, "codes"),
    "two plc": (GOLDENS_FULL, "plc"), "two codes": (GOLDENS_FULL, "codes"),
}  # fmt: skip


#: Designs that the goldens are not: without a transition, so that a block remembers no rest.
DESIGNED = {
    "one": (GOLDENS, {"transition": "0 %"}),
    "two": (GOLDENS_FULL, {"transition": "0 %", "command_signal": "-10..10 V x 0.15 + 1.5 V", "polarity": "inverted",
                           "negative_dp": "swapped"}),
}  # fmt: skip


@pytest.mark.parametrize("interface", ["plc", "codes"])
@pytest.mark.parametrize("name", DESIGNED)
def test_a_design_without_transition(name, interface):
    root, options = DESIGNED[name]
    valve = read_artefact((root / "valve.json").read_bytes(), ValveModel, "valve.json")
    made = design(valve, options_of(options, target_named("f28335").inputs()))
    text = structured_text(made, "0" * 64, interface)
    assert "at_rest" not in text and "passed" not in text and ("side" in text) == (name == "two")
    block = tried(text, ExactTables(made, interface))
    drops, pressures = SOME[interface]
    for found in (*block.every_pair(drops), block.every_pressure(pressures), block.extremes()):
        assert found.pairs and not is_wrong(found), found
    assert block.sample_differs() == ""


@pytest.fixture(scope="module", params=CASES.values(), ids=CASES)
def case(request):
    root, interface = request.param
    made = compensator(root)
    return made, interface, tried(structured_text(made, "0" * 64, interface), ExactTables(made, interface))


@pytest.fixture(scope="module")
def one_plc():
    """A compensator, the text of its block, and the exact law in units of a PLC."""
    made = compensator(GOLDENS)
    return made, structured_text(made, "0" * 64, "plc"), ExactTables(made, "plc")


def test_some_pressures_with_every_command(case):
    made, interface, block = case
    drops, pressures = SOME[interface]
    pairs = block.every_pair(drops)
    assert len(pairs) == len(made.signals.signs) and sum(each.pairs for each in pairs) > 100_000
    for found in (*pairs, block.every_pressure(pressures), block.extremes()):
        assert found.pairs and not is_wrong(found), found


def test_two_readings_of_the_text_agree(case):
    assert case[2].sample_differs() == ""


def test_at_zero_command_the_bounds_are_kept_and_barely(case):
    """A block that puts out one unit more, or counts no resolution, would not keep them by much."""
    made, _, block = case
    for exact in block.exact:
        margin = zero_output_margin(block, exact)
        assert margin is not None and margin.exceeded == 0
        assert margin.margin_V >= 0
        if not made.dither_reserve_counts:
            assert margin.margin_V < 2 * made.u_max_V / exact.compare_max


def test_rows_made_by_additions_are_the_exact_law(case):
    """What the check compares with, against the law at single codes, computed each by itself."""
    made, interface, block = case
    random = np.random.default_rng(3)
    for exact in block.exact:
        drops = range(-exact.reverse - 1, -exact.reverse + 700, 100)
        for drop, parts in zip(drops, exact.table(drops), strict=False):
            corners = exact.corners(exact.betas_at(drop))
            for away in [0, exact.zero_band, exact.transition_end, exact.span, *random.integers(0, exact.span, 20)]:
                part = next(each.tolist() for each in parts if away <= each[1])
                first, last, whole, rest, step, step_rest, common = part
                value = Fraction(whole) + Fraction(rest, common) + (away - first) * (step + Fraction(step_rest, common))
                part = next(place for place in range(len(corners) - 1) if away <= corners[place + 1][0])
                (begin, start), (end, stop) = corners[part : part + 2]
                law = start + (stop - start) * Fraction(int(away) - begin, end - begin) if end > begin else start
                assert first <= away <= last and value == law + exact.rounding
                if interface == "codes":
                    code = exact.zero + exact.along * int(away)
                    of_codes = ExactLaw(made, exact.sign).compare_value(code, corners)
                    assert min(max(value.__floor__(), 0), exact.compare_limit) == of_codes


def test_in_units_of_a_plc_the_law_is_that_of_the_share_of_full_command(one_plc):
    """By hand: full command at no pressure drop, beta of the next code outside, rounded down."""
    made = one_plc[0]
    exact, signals = ExactBlock(made, 1, "plc"), made.signals
    code = -(-Fraction(1, 100) // signals.pressure_a.per_code_MPa)
    beta = made.law_beta(int(code))
    side = made.side(1)
    full = beta * side.u_min0_over_u_max + beta * (side.drive_range_over_u_max - 1) + 1  # Eq. (18) at full command
    (_, value) = exact.corners(exact.betas_at(0))[-1]
    assert value == 10_000 * full
    assert exact.betas_at(-exact.reverse - 1) == exact.least_betas()


@pytest.mark.slow
@pytest.mark.parametrize(("root", "interface"), [(GOLDENS, "plc"), (GOLDENS_FULL, "codes")])
def test_wrong_blocks_are_caught(root, interface):
    """Some here; benchmarks/outputs/block_mutants.py judges sixty of each on every input."""
    made = compensator(root)
    text, tables = structured_text(made, "0" * 64, interface), ExactTables(made, interface)
    found = {mutant: killer(mutant, tables, *SOME[interface]) for mutant in evenly(mutants(text), 8)}
    assert len(mutants(text)) > 200
    assert sum(map(bool, found.values())) >= 6, [(one.line, one.change) for one, by in found.items() if not by]


@pytest.mark.parametrize(
    ("old", "new", "count"),
    [
        ("+ 1) * CODES", "+ 0) * CODES", "wrong"),  # the resolution of a pressure is not counted
        ("status := status + 16", "status := status + 32", "wrong_status"),
        ("THEN at_rest := FALSE", "THEN at_rest := TRUE", "wrong_state"),
        ("weights[0] := -passed", "weights[0] := passed", "wrong"),  # at full command alone
        ("dp := pressure_a - pressure_b", "dp := (pressure_a - pressure_b) * 2000000 / 2000000", "faults"),
    ],
)
def test_a_seeded_fault_is_counted(one_plc, old, new, count):
    _, text, tables = one_plc
    assert text.count(old) == 1
    block = tried(text.replace(old, new), tables)
    found = [*block.every_pair(range(0, 2000, 77)), block.every_pressure(range(-300, 4300, 460))]
    assert sum(getattr(each, count) for each in found) > 0
    if count == "faults":
        line = next(number for number, row in enumerate(text.splitlines(), 1) if old in row)
        assert {each.first_fault.line for each in found if each.first_fault} == {line}


@pytest.mark.parametrize(
    ("before", "change"),
    [
        ("IF valid THEN towards", "IF side > 0 THEN side := 0; END_IF"),
        ("IF valid THEN towards", "IF side < 0 THEN side := 0; END_IF"),
        ("drive := MIN(drive, O", "IF last > 0 AND command > 5000 THEN drive := 0; END_IF"),
        ("drive := MIN(drive, O", "IF last < 0 AND command > 5000 THEN drive := 0; END_IF"),
    ],
)
def test_a_block_that_remembers_a_side_wrongly_is_caught(before, change):
    """Each state is one that calls begin from: a change seen from one of them alone counts."""
    made = compensator(GOLDENS_FULL)
    text = structured_text(made, "0" * 64, "plc")
    text = text.replace("w0, w1,", "last, w0, w1,").replace("status := 0;", "status := 0; last := side;", 1)
    assert text.count(before) == 1
    block = tried(text.replace(before, f"{change} {before}"), ExactTables(made, "plc"))
    assert any(map(is_wrong, block.every_pair(range(500, 540, 20))))


def test_a_lower_bound_that_is_exceeded_is_seen(one_plc):
    _, text, tables = one_plc
    nodes = text[text.index("ZERO_NODES") : text.index("ZERO_LEAST")]
    raised = re.sub(r"\b\d{5}\b", lambda found: str(int(found[0]) + 40), nodes)
    block = tried(text.replace(nodes, raised), tables)
    margin = zero_output_margin(block, block.exact[0])
    assert margin is not None and margin.exceeded > 100 and margin.margin_V < 0
