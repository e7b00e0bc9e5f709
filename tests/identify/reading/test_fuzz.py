"""The targets of benchmarks/fuzz: a short blind run finds nothing in any of them, a seeded fault is found."""

import os

import pytest
from run_fuzz import NAMES, blind
from targets import TARGETS, Target

from dzdesign.core.errors import InputError

SECONDS = float(os.environ.get("DZDESIGN_FUZZ_SECONDS", "0.5"))
SEED = int(os.environ.get("DZDESIGN_SEED", "1"))


def test_every_target_is_run():
    assert tuple(TARGETS) == NAMES


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_found(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for content in TARGETS[name].seeds:
        TARGETS[name](content)
    assert blind(name, SECONDS, SEED) > 0


def test_a_seeded_fault_is_found(tmp_path, monkeypatch, capsys):
    def fragile(data: bytes) -> None:
        if b"\xff" in data:
            raise KeyError("seeded")
        raise InputError("a refusal of one line")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(TARGETS, "words", Target(run=fragile, seeds=(b"0.6 L/min",)))
    with pytest.raises(KeyError):
        blind("words", 30.0, SEED)
    assert f"seed {SEED}" in capsys.readouterr().out and len(list(tmp_path.glob("crash-words-*"))) == 1
