"""Every number of the paper stands once, with its section; a mistyped one is named; the theorems give the paper's."""

import ast
from pathlib import Path

import pytest

from dzdesign.commands import derive
from dzdesign.derivation.account import account, published
from dzdesign.derivation.account.account import STATEMENTS
from dzdesign.derivation.account.published import FIRST, PRINTED, SIMULATION, find_misprints
from tests.derivation.account.claims import BY_NUMBER
from tests.support.synthetic import SHARED

#: The paper's text, for who has it.
PAPER = SHARED.parent / "paper.txt"
ACCOUNT = Path(published.__file__).parent


def figure(number, label):
    statement = BY_NUMBER[number]
    return float(next(value for value in statement.values if label in value.label).exact(statement))


@pytest.mark.parametrize(
    ("number", "label", "expected", "digits"),
    [
        ("T1b", "first valve", 1.048, 3),
        ("T1b", "second valve", 1.018, 3),
        ("T2e", "first valve", 4.55, 2),
        ("T2e", "simulation", 3.7, 1),
        ("T2e", "second valve", 1.7, 1),
        ("T3b", "simulation", 0.94, 2),
        ("T3b", "first valve", 1.12, 2),
        ("T5c", "without", 20, 1),
        ("T5c", "second valve", 54.6, 1),
        ("T5c", "first valve", 63.1, 1),
        ("T7a", "first valve", 0.30, 2),
        ("T9d", "first valve", 1.69, 2),  # 1.6 was measured
    ],
)
def test_the_papers_numbers(number, label, expected, digits):
    assert round(figure(number, label), digits) == expected


def test_numbers_are_looked_up_in_their_sections(verdicts, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(account, "verify_statements", lambda: tuple(verdicts.values()))
    text = "1 Approach\nA dead zone of 41.5%.\n2 Tests 2.1 Model\nAt 2 MPa.\n2.2 Analysis\nIts flow was 27.9 L/min.\n"
    monkeypatch.setattr(published, "PRINTED", [("41.5", "1"), ("27.9", "2.2")])
    assert find_misprints(text) == []
    misprint = "27.9 does not stand in section 2.2 of the text given"
    assert find_misprints(text.replace("27.9", "29.7")) == [misprint]
    paper = tmp_path / "paper.txt"
    paper.write_text(text.replace("2.2 Analysis", "2.3 Analysis"), encoding="utf-8")
    assert derive.run(derive.Arguments(equation=("2",), paper=paper), json=False) == 1
    assert misprint in " ".join(capsys.readouterr().out.split())


@pytest.mark.skipif(not PAPER.is_file(), reason=f"the paper's text is not at {PAPER}")
def test_the_paper_has_every_number():
    assert find_misprints(PAPER.read_text(encoding="utf-8")) == []


def test_what_is_printed_as_a_change_is_taken_from_the_reference():
    """Section 2.2: the displacement decreased, its dead zone increased."""
    assert (SIMULATION.stroke1_mm, SIMULATION.displacement_dead_zone1_percent) == ("1.7", "55")
    assert (FIRST.stroke1_mm, FIRST.displacement_dead_zone1_percent) == ("", "")


def test_a_number_beside_a_statement_is_printed_and_a_difference_is_explained():
    printed = {number for number, _ in PRINTED}
    for statement in STATEMENTS:
        for value in statement.values:
            assert value.exact(statement).is_number
            assert value.published in {"", *printed}, f"{statement.number}, {value.label}"
            assert not value.published or value.agrees(statement) or value.remark, f"{statement.number}, {value.label}"


def test_the_account_takes_published_numbers_from_one_place():
    """A digit typed beside a formula would have no section."""
    typed = {
        (path.name, node.args[0].value)
        for path in ACCOUNT.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "Rational"
        if isinstance(node.args[0], ast.Constant) and isinstance(node.args[0].value, str)
    }
    # Of our own: 1 % of u_max above the first valve's threshold.
    assert typed == {("law_theorems.py", "5.49")}
