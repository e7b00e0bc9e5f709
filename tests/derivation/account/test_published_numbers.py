"""Every number of the paper is the one that stands in its passage; a wrong one fails without the paper."""

import ast
from pathlib import Path

import pytest

from dzdesign.commands import derive
from dzdesign.derivation.account import published
from dzdesign.derivation.account.account import STATEMENTS
from dzdesign.derivation.account.passages import transcription as passages
from dzdesign.derivation.account.passages.digests import PASSAGES
from dzdesign.derivation.account.passages.transcription import (
    Passage,
    digest_of,
    find_transcription_faults,
    passages_of,
)
from dzdesign.derivation.account.published import transcribed
from tests.support.synthetic import SHARED

#: The paper's text, for who has it.
PAPER = SHARED.parent / "paper.txt"
ACCOUNT = Path(published.__file__).parent


def test_every_number_has_its_passage():
    assert find_transcription_faults() == []
    assert set(transcribed()) == set(PASSAGES)
    printed = set(transcribed().values())
    for number in ("53.9", "24.6", "1.6", "0.6", "55", "4095", "1365", "51.7", "43.2", "0.95"):
        assert number in printed


@pytest.mark.parametrize("name", PASSAGES)
def test_a_wrong_transcription_fails(name):
    number = transcribed()[name]
    for wrong in (number + "1", "9" + number, *({*transcribed().values()} - {number})):
        faults = find_transcription_faults({**transcribed(), name: wrong})
        assert faults == [f"{name}: {wrong} is not the number that stands in its passage of the paper"]


def test_a_number_more_or_less_is_seen():
    fewer = {name: number for name, number in transcribed().items() if name != "dP1"}
    assert find_transcription_faults(fewer)[0].startswith("dP1: the passage has a digest")
    assert find_transcription_faults({**transcribed(), "new": "7"})[0].startswith("new: 7 is transcribed")


def test_numbers_are_looked_up_in_a_text():
    text = "The valve was closed, and its dead-zone was 41.5% of full command at this pressure drop of 2 MPa."
    (found,) = passages_of(text, "41.5")
    assert digest_of(found.place, "41.5") == found.digest
    row = {"dead zone": found}
    assert find_transcription_faults({"dead zone": "41.5"}, row, paper=text.replace("41.5%", " 41.5 %").upper()) == []
    # Number and digest changed alike: only the text tells.
    forged = {"dead zone": Passage(found.place, digest_of(found.place, "40.5"))}
    assert find_transcription_faults({"dead zone": "40.5"}, forged) == []
    assert find_transcription_faults({"dead zone": "40.5"}, forged, paper=text) == [
        "dead zone: the text given has no 40.5 in the passage recorded"
    ]
    moved = text.replace("its dead-zone", "its flow")
    assert find_transcription_faults({"dead zone": "41.5"}, row, paper=moved)


@pytest.mark.skipif(not PAPER.is_file(), reason=f"the paper's text is not at {PAPER}")
def test_the_paper_has_every_number():
    text = PAPER.read_text(encoding="utf-8")
    assert find_transcription_faults(paper=text) == []


def test_a_misprint_makes_derive_fail_and_is_named(monkeypatch, capsys):
    wrong = {**transcribed(), "first valve, flow1": "26.4"}
    monkeypatch.setattr(passages, "transcribed", lambda: wrong)
    assert derive.run(derive.Arguments(equation=("2",)), json=False) == 1
    printed = capsys.readouterr().out
    assert "first valve, flow1: 26.4 is not the number" in " ".join(printed.split())


def test_the_account_takes_published_numbers_from_one_place():
    """A digit typed beside a formula would have no passage."""
    typed = []
    for path in ACCOUNT.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            called = (
                isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "Rational"
            )
            if called and isinstance(node.args[0], ast.Constant) and isinstance(node.args[0].value, str):
                typed.append((path.name, node.args[0].value))
    # Of our own: 1 % of u_max above the first valve's threshold. The other is the module of the numbers.
    assert set(typed) <= {("published.py", "0.6"), ("zero_command.py", "5.49")}
    printed = {value.published for statement in STATEMENTS for value in statement.values if value.published}
    assert printed <= set(transcribed().values())
