"""Every reader that is fuzzed takes its seeds, and refuses in time what was a finding once."""

import time

import pytest
from run_fuzz import NAMES, SLOWEST_S
from target import FOUND, Target, found_inputs
from targets import TARGETS

from dzdesign.core.errors import InputError

#: Of one input, s: processes beside this one take their share.
PATIENCE_S = 4 * SLOWEST_S
FOUND_INPUTS = [
    pytest.param(path.parent.name, path, id=f"{path.parent.name}/{path.name}") for path in sorted(FOUND.glob("*/*"))
]


def test_the_targets_are_those_that_are_run():
    assert sorted(NAMES) == sorted(TARGETS)
    assert {path.parent.name for path in FOUND.glob("*/*")} <= set(TARGETS) and len(FOUND_INPUTS) > 20
    assert found_inputs("amplifier")


@pytest.mark.parametrize("name", sorted(TARGETS))
def test_a_seed_is_an_input_like_others(name):
    seeds = [*TARGETS[name].seeds()]
    assert seeds
    for seed in seeds:
        TARGETS[name](seed)
        TARGETS[name](seed[: len(seed) // 2])


@pytest.mark.parametrize(("name", "path"), FOUND_INPUTS)
def test_a_finding_of_once_is_refused(name, path):
    begin = time.monotonic()
    TARGETS[name](path.read_bytes())
    assert time.monotonic() - begin < PATIENCE_S


def test_what_is_no_refusal_is_a_finding():
    def run(data: bytes) -> None:
        raise (ValueError if data else InputError)("a sentence of some length")

    target = Target(run=run, seeds=lambda: [b""])
    target(b"")
    with pytest.raises(ValueError, match="sentence"):
        target(b"x")
