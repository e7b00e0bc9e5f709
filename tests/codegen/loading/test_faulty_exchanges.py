"""A block goes to a drive over a line that fails, from senders that fail or lie, with a supply that fails."""

import random

import pytest

from dzdesign.codegen.loading.protocol import Reason
from tests.support.loading.bench import session
from tests.support.loading.exchanges import KINDS, load
from tests.support.loading.files import blocks

#: An exchange has some 3000 octets, and erases and writes some 4000 words; the benchmark tries each.
OCTETS_APART, WORDS_APART = 37, 29


def check(bench) -> None:
    assert bench.invalid_accepted == bench.old_lost == bench.wrongly_done == bench.stuck == bench.used_unheld == 0


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_after_a_faulty_exchange_the_old_or_the_new_block_is_whole_and_the_next_load_works(bench, kind):
    rng = random.Random(kind.__name__)
    for _ in range(30):
        bench.exchange(kind, rng)
    check(bench)
    ends = {end for _, end in bench.ends}
    if kind.__name__ == "bad_block":
        wanted = (Reason.LENGTH, Reason.CRC, Reason.CHECK, Reason.ORIGIN)
        assert ends == {f"refused {reason}" for reason in wanted}
    elif kind.__name__ in ("noisy_line", "hostile_frames"):
        assert ends == {"done"}, "the sender sends again what was not answered"
    elif kind.__name__ == "drive_in_use":
        assert {f"refused {Reason.COMMAND}", f"refused {Reason.DRIVING}", f"refused {Reason.STORE}"} <= ends


def start(bench) -> None:
    """Have the old block in a slot, and nothing of a load before."""
    bench.drive.erase()
    bench.drive.power_on()
    assert load(session(bench.drive), blocks()[1]) == "done"


def test_the_supply_may_go_at_any_octet(bench):
    old, new = blocks()[1:3]
    start(bench)
    for octets in range(0, 3 * len(new) // 2, OCTETS_APART):
        bench.drive.power_on(seed=octets)
        bench.drive.set(octets_left=octets)
        ended = load(session(bench.drive), new)
        dead = bench.drive.get("dead")
        assert (ended == "done") == (not dead)
        assert bench.drive.power_on() == (old if dead else new)
    assert not dead, "the last one came through"


def test_the_supply_may_go_at_any_word_that_is_erased_or_written(bench):
    old, new = blocks()[1:3]
    start(bench)
    words = bench.words_of_a_load
    for cut in (*range(0, words, WORDS_APART), *range(words - 4, words)):
        bench.drive.power_on(seed=cut)
        bench.drive.set(words_left=cut)
        assert load(session(bench.drive), new) == "no reply" and bench.drive.get("dead")
        assert bench.drive.power_on(seed=cut) == old or cut == words - 1
        start(bench)
    bench.drive.power_on()
    assert load(session(bench.drive), new) == "done"
    assert bench.drive.words == words, "the count of the test is the drive's"
