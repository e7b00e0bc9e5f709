"""The account of the paper: verdicts, what they rest on, the paper's numbers, and that a change of meaning shows."""

import ast
from dataclasses import replace
from pathlib import Path

import pytest

from dzdesign.commands import derive
from dzdesign.derivation.account import account, published, solving
from dzdesign.derivation.account.account import SECTIONS, STATEMENTS
from dzdesign.derivation.account.equations import PAPER_NUMBERS
from dzdesign.derivation.account.proof import judge, prove
from dzdesign.derivation.account.published import FIRST, PRINTED, SIMULATION, find_misprints
from dzdesign.derivation.account.statement import Kind, Outcome
from tests.derivation.account.claims import BY_NUMBER, changed
from tests.derivation.account.mutants import WAYS, Tried, score, score_mutations
from tests.support.synthetic import SHARED

DERIVED = [statement for statement in STATEMENTS if not statement.kind.is_given]


GIVEN, FOLLOWS, IF, NOT = Outcome.GIVEN, Outcome.FOLLOWS, Outcome.FOLLOWS_IF, Outcome.DOES_NOT_FOLLOW
#: Read off the paper by hand, not off the account.
PAPER = {
    **dict.fromkeys((1, 4, 5, 6, 7, 11, 19, 20, 21, 22, 23, 24), GIVEN),
    **dict.fromkeys((2, 3, 8, 9, 10, 12, 13, 14, 15, 16, 17, 18, 26), FOLLOWS),
    **dict.fromkeys((25, 27, 28, 32), IF),
    **dict.fromkeys((29, 30, 31), NOT),
}


#: What is taken as given, by kind: anything else has to be derived.
TAKEN = {
    Kind.PREMISE: ("(1)", "(4)", "(5)", "(6)", "(7)", "(19)", "(20)", "(21)", "(22)", "(23)", "(24)", "converter"),
    Kind.ASSUMPTION: (
        "Fig. 3, line", "(11)", "Fig. 3, command", "opening", "full command", "code of u_0", "code of u_no", "valve",
        "constant threshold",
    ),
    Kind.DEFINITION: (
        "K_e", "gamma_0", "gamma_1", "u_O", "1365", "drive left", "jump", "duty", "transfer function", "overlap",
        "exponent", "S", "travel", "fall", "share",
    ),
    Kind.CHOICE: ("attenuator", "scale of u_0", "scale of u_no", "PWM", "L3", "transition", "beyond"),
}  # fmt: skip


@pytest.mark.slow
def test_all_32_equations_have_their_verdict(verdicts):
    assert [int(number.strip("()")) for number in PAPER_NUMBERS] == sorted(PAPER) == list(range(1, 33))
    assert {number: verdicts[f"({number})"].outcome for number in PAPER} == PAPER


def test_only_what_the_paper_or_a_name_gives_is_taken_as_given():
    found = {kind: {one.number for one in STATEMENTS if one.kind is kind} for kind in TAKEN}
    assert found == {kind: set(numbers) for kind, numbers in TAKEN.items()}


def test_every_statement_is_as_expected(verdicts):
    assert [verdict.number for verdict in verdicts.values() if not verdict.as_expected] == []


def test_every_condition_is_proved_necessary(verdicts):
    conditional = [verdict for verdict in verdicts.values() if verdict.statement.condition is not None]
    assert len(conditional) >= 13
    assert all(verdict.necessary for verdict in conditional)


def test_what_does_not_follow_is_corrected_by_what_does(verdicts):
    for verdict in verdicts.values():
        if verdict.outcome is NOT and verdict.statement.kind is Kind.PAPER:
            assert verdicts[verdict.statement.corrected_by].holds
            assert any(value != 0 for proof in verdict.proofs for value in proof.discrepancies)


@pytest.mark.slow
def test_what_rests_on_a_failed_statement_does_not_hold():
    members = BY_NUMBER["(8)"].members
    outcome = {v.number: v for v in prove(changed("(8)", members=(2 * members[0], members[1])))}
    assert outcome["(8)"].words == "does not follow"
    assert solving.agree(outcome["(8)"].proofs[0].discrepancies[0], -members[0])
    assert outcome["(13)"].words == "rests on (8), which does not follow"
    assert not outcome["(18)"].holds and outcome["(15)"].holds
    assert not outcome["(30)"].as_expected  # not even the claim that it does not follow may rest on it


def test_every_reference_between_statements_exists():
    for statement in STATEMENTS:
        assert {*statement.see} <= set(BY_NUMBER), statement.number
        assert statement.corrected_by in {"", *BY_NUMBER}, statement.number
        assert statement.section in SECTIONS


def test_the_conditions_are_handed_on(verdicts):
    assert verdicts["T6b"].inherited == ("(28)", "(27)", "(25)")
    assert verdicts["T6b"].words == "follows on the condition of (28), (27), (25)"


@pytest.mark.slow
@pytest.mark.parametrize("statement", DERIVED, ids=lambda one: one.number)
def test_a_derivation_can_be_read_to_its_end_and_needs_every_premise(statement, verdicts):
    for proof in verdicts[statement.number].proofs:
        assert proof.steps
        for step in proof.steps:
            assert solving.agree(step.gives.xreplace(dict(proof.solution)), proof.solution[step.name])
            assert step.ground in statement.grounds
    for index in range(len(statement.grounds) if len(statement.grounds) > 1 else 0):
        fewer = statement.grounds[:index] + statement.grounds[index + 1 :]
        verdict = judge(replace(statement, grounds=fewer), BY_NUMBER, verdicts)
        assert not verdict.as_expected, f"{statement.grounds[index]} is not needed"


#: The paper's text, for who has it.
PAPER_TEXT = SHARED.parent / "paper.txt"
ACCOUNT = Path(published.__file__).parent


def figure(number, label):
    statement = BY_NUMBER[number]
    return float(next(value for value in statement.values if label in value.label).exact(statement))


@pytest.mark.parametrize(
    ("number", "label", "expected", "digits"),
    [
        ("T1b", "first valve", 1.048, 3),
        ("T1b", "second valve", 1.018, 3),
        ("T2e", "first valve", 4.55, 2),
        ("T2e", "simulation", 3.7, 1),
        ("T2e", "second valve", 1.7, 1),
        ("T3b", "simulation", 0.94, 2),
        ("T3b", "first valve", 1.12, 2),
        ("T5c", "without", 20, 1),
        ("T5c", "second valve", 54.6, 1),
        ("T5c", "first valve", 63.1, 1),
        ("T7a", "first valve", 0.30, 2),
        ("T9d", "first valve", 1.69, 2),  # 1.6 was measured
    ],
)
def test_the_papers_numbers(number, label, expected, digits):
    assert round(figure(number, label), digits) == expected


def test_numbers_are_looked_up_in_their_sections(verdicts, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(account, "verify_statements", lambda: tuple(verdicts.values()))
    text = "1 Approach\nA dead zone of 41.5%.\n2 Tests 2.1 Model\nAt 2 MPa.\n2.2 Analysis\nIts flow was 27.9 L/min.\n"
    monkeypatch.setattr(published, "PRINTED", [("41.5", "1"), ("27.9", "2.2")])
    assert find_misprints(text) == []
    misprint = "27.9 does not stand in section 2.2 of the text given"
    assert find_misprints(text.replace("27.9", "29.7")) == [misprint]
    paper = tmp_path / "paper.txt"
    paper.write_text(text.replace("2.2 Analysis", "2.3 Analysis"), encoding="utf-8")
    assert derive.run(derive.Arguments(equation=("2",), paper=paper), json=False) == 1
    assert misprint in " ".join(capsys.readouterr().out.split())


@pytest.mark.skipif(not PAPER_TEXT.is_file(), reason=f"the paper's text is not at {PAPER_TEXT}")
def test_the_paper_has_every_number():
    assert find_misprints(PAPER_TEXT.read_text(encoding="utf-8")) == []


def test_what_is_printed_as_a_change_is_taken_from_the_reference():
    """Section 2.2: the displacement decreased, its dead zone increased."""
    assert (SIMULATION.stroke1_mm, SIMULATION.displacement_dead_zone1_percent) == ("1.7", "55")
    assert (FIRST.stroke1_mm, FIRST.displacement_dead_zone1_percent) == ("", "")


def test_a_number_beside_a_statement_is_printed_and_a_difference_is_explained():
    printed = {number for number, _ in PRINTED}
    for statement in STATEMENTS:
        for value in statement.values:
            assert value.exact(statement).is_number
            assert value.published in {"", *printed}, f"{statement.number}, {value.label}"
            assert not value.published or value.agrees(statement) or value.remark, f"{statement.number}, {value.label}"


def test_the_account_takes_published_numbers_from_one_place():
    """A digit typed beside a formula would have no section."""
    typed = {
        (path.name, node.args[0].value)
        for path in ACCOUNT.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "Rational"
        if isinstance(node.args[0], ast.Constant) and isinstance(node.args[0].value, str)
    }
    # Of our own: 1 % of u_max above the first valve's threshold.
    assert typed == {("law_theorems.py", "5.49")}


SHARE, SEED = 0.05, 20261123


@pytest.mark.slow
def test_changes_of_meaning_are_caught(verdicts):
    found = score_mutations(list(verdicts.values()), SHARE, SEED)
    survivors = {(one.changed, one.number): one.survivors for one in found if one.survivors}
    assert survivors == {}, f"of those drawn with seed {SEED}"
    assert {one.changed for one in found} == set(WAYS)
    assert sum(one.mutants for one in found) > 150


def test_a_mutant_that_is_not_caught_is_named():
    mutants = [("wrong", "first"), ("worse", "second")]
    these = Tried("(1)", "formulas", mutants, lambda mutant: mutant == "wrong")
    found = score(these, 1.0, SEED)
    assert (found.mutants, found.survivors) == (2, ("second",))
    assert score(these, 0.0, SEED).mutants == 0
