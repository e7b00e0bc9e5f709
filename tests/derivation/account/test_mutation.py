"""Every change of meaning shows. Here a drawn twentieth of them; `make bench-paper` tries all."""

import pytest

from tests.derivation.account.mutants import WAYS, Tried, score, score_mutations

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
