"""The account of the paper: every equation has its verdict, and every statement what it rests on."""

from dataclasses import replace

import pytest

from dzdesign.derivation.account import solving
from dzdesign.derivation.account.account import SECTIONS, STATEMENTS
from dzdesign.derivation.account.equations import PAPER_NUMBERS
from dzdesign.derivation.account.proof import judge, prove
from dzdesign.derivation.account.statement import Kind, Outcome
from tests.derivation.account.claims import BY_NUMBER, changed

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
