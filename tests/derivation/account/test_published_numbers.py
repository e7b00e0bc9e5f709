"""Every number of the paper is the one that stands in its passage; a wrong one fails without the paper."""

import ast
from dataclasses import replace
from pathlib import Path

import pytest
import sympy

from dzdesign.commands import derive
from dzdesign.derivation.account import published
from dzdesign.derivation.account.account import STATEMENTS
from dzdesign.derivation.account.passages import transcription as passages
from dzdesign.derivation.account.passages.digests import PASSAGES
from dzdesign.derivation.account.passages.transcription import (
    Passage,
    digest_of,
    find_transcription_faults,
    find_value_faults,
    passages_of,
)
from dzdesign.derivation.account.published import FIRST, SECOND, SIMULATION, transcribed
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
    fewer = {name: number for name, number in transcribed().items() if name != "DP1_MPA"}
    assert find_transcription_faults(fewer)[0].startswith("DP1_MPA: the passage has a digest")
    assert find_transcription_faults({**transcribed(), "new": "7"})[0].startswith("new: 7 is transcribed")


@pytest.mark.parametrize("value", ["7.5", 7, sympy.Rational("7.5"), ("1", "2"), "7.5 MPa", replace(FIRST, name="x")])
def test_a_new_constant_needs_a_passage(value, monkeypatch):
    """Seeded once: five constants were added, and no list knew of them."""
    monkeypatch.setattr(published, "NEW_MPA", value, raising=False)
    faults = find_transcription_faults()
    assert faults and all("but its passage has no digest" in fault for fault in faults)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("METER_FLOOR_L_MIN", sympy.Rational("0.604")),  # once read to two digits
        ("LOAD_COMMANDS_V", ("1.5", "3.6")),
        ("DP0_MPA", 2),
        ("VALVES", (replace(SIMULATION, stroke_falls_mm="-0.1"), FIRST, SECOND)),  # once read without its sign
        ("VALVES", (replace(SIMULATION, flow0="15.0"), FIRST, SECOND)),
    ],
)
def test_a_constant_that_was_changed_is_seen(name, value, monkeypatch):
    monkeypatch.setattr(published, name, value)
    if name == "VALVES":
        monkeypatch.setattr(published, "SIMULATION", value[0])
    (fault,) = find_transcription_faults()
    assert "is not the number that stands in its passage" in fault


def test_what_is_printed_as_a_change_is_taken_from_the_reference():
    """Section 2.2: the displacement decreased, its dead zone increased."""
    assert (SIMULATION.stroke1_mm, SIMULATION.displacement_dead_zone1_percent) == ("1.7", "55")
    assert (FIRST.stroke1_mm, FIRST.displacement_dead_zone1_percent) == ("", "")


@pytest.mark.parametrize(
    ("changes", "named"),
    [({"published": "1.12"}, "the paper has no such number"), ({"remark": ""}, "no remark says why")],
)
def test_a_number_beside_a_statement_is_printed_and_explained(changes, named):
    assert find_value_faults(STATEMENTS) == []
    first = next(statement for statement in STATEMENTS if statement.number == "T3b")
    values = tuple(replace(one, **changes) if one.label == "first valve" else one for one in first.values)
    (fault,) = find_value_faults([replace(first, values=values)])
    assert fault.startswith("T3b, first valve: ") and named in fault


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
