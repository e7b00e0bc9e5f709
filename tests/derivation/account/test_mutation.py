"""Every change of meaning shows. Here a drawn twentieth of them; `make bench-paper` tries all."""

import pytest

from dzdesign.derivation.account.mutation import scoring
from dzdesign.derivation.account.mutation.scoring import WAYS, score_mutations

SHARE, SEED = 0.05, 20261123


@pytest.mark.slow
def test_changes_of_meaning_are_caught(verdicts):
    found = score_mutations(list(verdicts.values()), SHARE, SEED)
    survivors = {(score.changed, score.number): score.survivors for score in found.statements if score.survivors}
    assert survivors == {}, f"of those drawn with seed {SEED}"
    assert {score.changed for score in found.statements} == set(WAYS)
    assert found.mutants > 250


def test_a_mutant_that_is_not_caught_is_named():
    mutants = [("wrong", "first"), (None, "the same"), ("worse", "second")]
    these = scoring._Tried("(1)", "formulas", mutants, lambda mutant: mutant == "wrong")
    score = scoring._score(these, 1.0, SEED)
    assert (score.mutants, score.caught, score.survivors, score.equivalent) == (2, 1, ("second",), ("the same",))
    assert scoring._score(these, 0.0, SEED).mutants == 0
