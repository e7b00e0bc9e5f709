"""The targets of benchmarks/fuzz: what was a finding once is refused in time, a short blind run finds nothing more.

A seeded fault is found.
"""

import os
import time

import pytest
from run_fuzz import NAMES, SLOWEST_S, blind
from target import FOUND, Target, found_inputs
from targets import TARGETS

from dzdesign.core.errors import InputError

SECONDS = float(os.environ.get("DZDESIGN_FUZZ_SECONDS", "0.5"))
SEED = int(os.environ.get("DZDESIGN_SEED", "1"))
#: Of one input, s: processes beside this one take their share.
PATIENCE_S = 4 * SLOWEST_S
FOUND_INPUTS = [
    pytest.param(path.parent.name, path, id=f"{path.parent.name}/{path.name}") for path in sorted(FOUND.glob("*/*"))
]


def test_every_target_is_run():
    assert tuple(TARGETS) == NAMES
    assert {path.parent.name for path in FOUND.glob("*/*")} <= set(TARGETS)
    assert len(FOUND_INPUTS) >= 3 and found_inputs("amplifier")


@pytest.mark.parametrize("name", NAMES)
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


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_found(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert blind(name, SECONDS, SEED) > 0


def test_a_seeded_fault_is_found(tmp_path, monkeypatch, capsys):
    def fragile(data: bytes) -> None:
        if b"\xff" in data:
            raise KeyError("seeded")
        raise InputError("a refusal of one line")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(TARGETS, "words", Target(run=fragile, seeds=lambda: [b"0.6 L/min"]))
    with pytest.raises(KeyError):
        blind("words", 30.0, SEED)
    assert f"seed {SEED}" in capsys.readouterr().out and len(list(tmp_path.glob("crash-words-*"))) == 1


def test_an_input_that_takes_too_long_is_found(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("run_fuzz.SLOWEST_S", 0.01)
    monkeypatch.setitem(TARGETS, "words", Target(run=lambda data: time.sleep(0.05), seeds=lambda: [b"x"]))
    with pytest.raises(TimeoutError):
        blind("words", 30.0, SEED)
