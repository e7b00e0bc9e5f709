"""Every number of the paper stands once, with its section; one that was added, mistyped or moved is named."""

import ast
from dataclasses import replace
from pathlib import Path

import pytest
import sympy

from dzdesign.commands import derive
from dzdesign.derivation.account import published
from dzdesign.derivation.account.account import STATEMENTS
from dzdesign.derivation.account.published import FIRST, SECTION_OF, SIMULATION, find_number_faults, transcribed
from tests.support.synthetic import SHARED

#: The paper's text, for who has it.
PAPER = SHARED.parent / "paper.txt"
ACCOUNT = Path(published.__file__).parent


def test_every_number_has_its_section():
    assert find_number_faults(STATEMENTS) == []
    assert transcribed() == set(SECTION_OF)


@pytest.mark.parametrize("value", ["7.5", 7, sympy.Rational("7.5"), ("1", "7.5"), replace(FIRST, flow1="26.4")])
def test_a_new_or_mistyped_number_makes_derive_fail_and_is_named(value, monkeypatch, capsys):
    monkeypatch.setattr(published, "NEW_MPA", value, raising=False)
    (fault,) = find_number_faults(STATEMENTS)
    assert fault.endswith("is transcribed, and no section is stated for it")
    assert derive.run(derive.Arguments(equation=("2",)), json=False) == 1
    assert fault in " ".join(capsys.readouterr().out.split())


def test_numbers_are_looked_up_in_their_sections(monkeypatch):
    text = "1 Approach\nA dead zone of 41.5%.\n2 Tests 2.1 Model\nAt 2 MPa.\n2.2 Analysis\nIts flow was 27.9 L/min.\n"
    monkeypatch.setattr(published, "transcribed", lambda: {"41.5", "27.9"})
    monkeypatch.setattr(published, "SECTION_OF", {"41.5": "1", "27.9": "2.2"})
    assert find_number_faults((), text) == []
    assert find_number_faults((), text.replace("27.9", "29.7")) == [
        "27.9 does not stand in section 2.2 of the text given"
    ]
    monkeypatch.setattr(published, "SECTION_OF", {"41.5": "1", "27.9": "2.1"})
    assert len(find_number_faults((), text)) == 1


@pytest.mark.skipif(not PAPER.is_file(), reason=f"the paper's text is not at {PAPER}")
def test_the_paper_has_every_number():
    assert find_number_faults(STATEMENTS, PAPER.read_text(encoding="utf-8")) == []


def test_what_is_printed_as_a_change_is_taken_from_the_reference():
    """Section 2.2: the displacement decreased, its dead zone increased."""
    assert (SIMULATION.stroke1_mm, SIMULATION.displacement_dead_zone1_percent) == ("1.7", "55")
    assert (FIRST.stroke1_mm, FIRST.displacement_dead_zone1_percent) == ("", "")


@pytest.mark.parametrize(
    ("changes", "named"),
    [({"published": "1.12"}, "the paper has no such number"), ({"remark": ""}, "no remark says why")],
)
def test_a_number_beside_a_statement_is_printed_and_explained(changes, named):
    first = next(statement for statement in STATEMENTS if statement.number == "T3b")
    values = tuple(replace(one, **changes) if one.label == "first valve" else one for one in first.values)
    (fault,) = find_number_faults([replace(first, values=values)])
    assert fault.startswith("T3b, first valve: ") and named in fault


def test_the_account_takes_published_numbers_from_one_place():
    """A digit typed beside a formula would have no section."""
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
