"""The account of the paper as a person reads it: everything is there, in every format, and says what was proved."""

import doctest
import json
import re
import shlex
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser

import pytest
import sympy
from sympy.core.function import AppliedUndef

from dzdesign.command_line.cli import main
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.derivation import symbols
from dzdesign.derivation.account import account
from dzdesign.derivation.account.account import STATEMENTS, verify_statements
from dzdesign.derivation.account.equations import PAPER_NUMBERS
from dzdesign.derivation.account.solving import agree
from dzdesign.derivation.account.statement import Outcome
from dzdesign.derivation.presentation import formulas, prose, report, writers
from dzdesign.derivation.presentation.formulas import to_latex, to_mathml, to_text
from dzdesign.derivation.presentation.writers import anchor
from tests.support.paths import ROOT

BY_NUMBER = {statement.number: statement for statement in STATEMENTS}
MARKS = {Outcome.FOLLOWS: "follows", Outcome.FOLLOWS_IF: "follows if", Outcome.DOES_NOT_FOLLOW: "does not follow"}


@pytest.fixture(scope="module")
def verdicts():
    return verify_statements()


@pytest.fixture(scope="module", autouse=True)
def words_made_once():
    """Compose the words for the same verdicts once: a report takes seconds to derive its steps, none to write."""
    made, compose = {}, report.compose

    def compose_once(verdicts, shown, misprints=()):
        key = id(verdicts), tuple(shown), tuple(misprints)
        if key not in made:
            made[key] = verdicts, compose(verdicts, shown, misprints)  # held, so that no other object gets its id
        return made[key][1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "compose", compose_once)
        yield


@pytest.fixture(scope="module")
def rendered(verdicts):
    return {format: report.render(verdicts, format) for format in report.FORMATS}


@pytest.fixture(scope="module")
def entries(verdicts):
    content = report.compose(verdicts, [verdict.number for verdict in verdicts])
    return {entry.number: entry for entry in content.statements}


@pytest.fixture(scope="module")
def expressions(verdicts, entries):
    """Everything that is typeset: the statements, and each step of each derivation."""
    members = [side for statement in STATEMENTS for side in (statement.symbol, *statement.members)]
    steps = [step for verdict in verdicts for proof in verdict.proofs for step in proof.steps]
    differences = [value for verdict in verdicts for proof in verdict.proofs for value in proof.discrepancies]
    return {*members, *(step.gives for step in steps), *differences}


@pytest.fixture(scope="module")
def wrong_verdicts(verdicts):
    """The account with Eq. (13) doubled, as its own verdict and those that rest on it come out."""
    numbers = report.closure(STATEMENTS, ["18"])
    wrong = replace(BY_NUMBER["(13)"], members=tuple(2 * member for member in BY_NUMBER["(13)"].members))
    judged = verify_statements([wrong if number == "(13)" else BY_NUMBER[number] for number in numbers])
    changed = {verdict.number: verdict for verdict in judged}
    return tuple(changed.get(verdict.number, verdict) for verdict in verdicts)


@pytest.fixture
def derive(verdicts, monkeypatch, capsys):
    """Run `dzdesign derive` on verdicts that were found before; returns the exit status and what was printed."""

    def run(*arguments, found=verdicts):
        monkeypatch.setattr(account, "verify_statements", lambda: found)
        status = main(["derive", *arguments])
        return status, capsys.readouterr()

    return run


def entry_of(text, number):
    """The part of a text report that tells of one statement."""
    return text.split(f"\n\n{number}  ")[1].split("\n\n")[0]


def mark_of(verdict):
    return MARKS.get(verdict.outcome, "given: ")


# --- formulas -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "text"),
    [
        ("(8)", "C_d*W*x_max*sqrt(2*dP0/rho)/u_max"),
        ("(12)", "u_i' + u_min0 - u_i"),
        ("(13)", "u_min0 + u_i*(k*x_max/u_max - 1)"),
        ("(18)", "u_i*(beta*k*x_max/u_max + 1 - beta) + beta*u_min0"),
        ("(25)", "K_a*(U_i(s) - K_fi*I(s))"),
        ("(27)", "(K_et + B_e*s + m_e*s^2)*X_e(s) + F_eL(s)"),
        ("T7b", "K_0*sqrt(dP1/dP0)"),
    ],
)
def test_equations_are_plain_text(number, text):
    assert text in [to_text(member) for member in BY_NUMBER[number].members]


def names_in_text():
    """What the names in plain text stand for."""
    known = vars(symbols).items()
    names = {str(value): value for _, value in known if isinstance(value, sympy.Symbol)}
    names |= {name: value for name, value in known if isinstance(value, sympy.Symbol) and not names.get(name)}
    names |= {f"{value.func.__name__}_of": value.func for _, value in known if isinstance(value, AppliedUndef)}
    return names | {"f": symbols.f}


def read_back(text):
    """Parse plain text as a formula, by a way of its own."""
    for written, name in {"u_i'": "u_i_prime", "Q_O'": "Q_O_prime", "lambda": "scale", "^": "**"}.items():
        text = text.replace(written, name)
    text = re.sub(r"\b(i|x_e|v)\(0\)", lambda found: {"i": "i_init", "x_e": "x_init", "v": "v_init"}[found[1]], text)
    text = re.sub(r"\b(\w+)\((?=s\b|a \+ s|s \+ a)", r"\1_of(", text)
    return sympy.sympify(text, locals=names_in_text())


@pytest.mark.slow
def test_what_is_printed_is_what_was_proved(expressions):
    read = [one for one in expressions if not one.has(sympy.Piecewise)]
    assert len(read) > 150
    assert [one for one in read if not agree(read_back(to_text(one)), one)] == []


def test_reading_back_finds_a_seeded_error():
    text = to_text(BY_NUMBER["(18)"].members[-1])
    assert not agree(read_back(text.replace("1 - beta", "1 + beta")), BY_NUMBER["(18)"].members[-1])


class Elements(HTMLParser):
    """The elements of a page, each with its attributes and the number of elements in it; fails on a mismatch."""

    VOID = ("meta",)

    def __init__(self, page):
        super().__init__()
        self.open, self.elements, self.text = [], [], []
        self.feed(page)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        if self.open:
            self.open[-1][2] += 1
        element = [tag, dict(attrs), 0]
        self.elements.append(element)
        if tag not in self.VOID:
            self.open.append(element)

    def handle_endtag(self, tag):
        assert self.open.pop()[0] == tag

    def handle_data(self, data):
        self.text.append(data)

    def named(self, tag, **attrs):
        return [
            found for found in self.elements if found[0] == tag and all(found[1].get(k) == v for k, v in attrs.items())
        ]


def test_mathml_elements_have_the_parts_that_they_need(expressions):
    needed = {"mfrac": 2, "msub": 2, "msup": 2, "msubsup": 3, "msqrt": 1}
    for expression in expressions:
        page = Elements(f"<math>{to_mathml(to_latex(expression))}</math>")
        assert [e for e in page.elements if e[0] in needed and e[2] != needed[e[0]]] == [], expression


def test_latex_of_every_formula_balances(expressions):
    for expression in expressions:
        text = to_latex(expression)
        assert text.count("{") == text.count("}")
        assert text.count(r"\left") == text.count(r"\right")


# --- every format -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("format", report.FORMATS)
def test_a_report_ends_with_a_line(rendered, format):
    assert rendered[format].endswith("\n") and not rendered[format].endswith("\n\n")


def test_text_has_every_statement_with_its_verdict(verdicts, rendered):
    for verdict in verdicts:
        head = entry_of(rendered["text"], verdict.number).split("\n    ")[0]
        assert f"[{mark_of(verdict)}" in head.replace("\n", " "), verdict.number


def test_html_has_every_statement_with_its_verdict(verdicts, rendered):
    articles = dict(re.findall(r'<article id="([^"]+)"(.*?)</article>', rendered["html"], re.DOTALL))
    assert list(articles) == [anchor(verdict.number) for verdict in verdicts]
    for verdict in verdicts:
        assert (
            f"{mark_of(verdict)}"
            in re.search(r'class="mark.*?</span>\s*(.*?)</span>', articles[anchor(verdict.number)])[1]
        )


def test_json_has_every_statement_with_its_verdict(verdicts, rendered):
    rows = json.loads(rendered["json"])["statements"]
    assert [(row["number"], row["verdict"], row["as_expected"]) for row in rows] == [
        (verdict.number, verdict.words, verdict.as_expected) for verdict in verdicts
    ]


def test_the_table_has_all_32_equations(rendered):
    assert len(PAPER_NUMBERS) == 32
    text = rendered["text"].split("The paper's equations\n")[1].split("\n\n")[0]
    assert re.findall(r"^\(\d+\)", text, re.MULTILINE) == list(PAPER_NUMBERS)
    html = rendered["html"].split('<table class="equations">')[1].split("</table>")[0]
    assert re.findall(r'<th scope="row"><a href="#eq-\d+">(\(\d+\))</a>', html) == list(PAPER_NUMBERS)
    numbers = [row["number"] for row in json.loads(rendered["json"])["statements"]]
    assert [number for number in numbers if number in PAPER_NUMBERS] == list(PAPER_NUMBERS)


@pytest.mark.parametrize("format", report.FORMATS)
def test_a_missing_equation_is_refused(verdicts, format, wording):
    with pytest.raises(RequirementError) as caught:
        report.render([verdict for verdict in verdicts if verdict.number != "(20)"], format)
    wording("the account: a missing equation", str(caught.value))


def test_a_wrong_equation_comes_with_its_difference_and_what_it_should_read(rendered):
    entry = entry_of(rendered["text"], "(30)")
    assert "It would follow only if n_V = 1; the published numbers give n_V = 1365." in entry
    assert "Derived minus published:\n        u_min0*(n_V - 1)" in entry
    assert "It should read, by (30b):\n        n_0 = n_V*(u_min0 + u_i*(k*x_max/u_max - 1))" in entry
    box = entry_of(rendered["text"], "(6)")
    assert "For a stop at every pressure drop it should read, by (6c):" in box
    assert "Its units do not agree:" in entry
    assert "5.39 counts" in entry


def test_a_condition_is_stated_and_proved_necessary(rendered):
    entry = entry_of(rendered["text"], "(25)")
    assert "Follows if i(0) = 0 (Assumption 4), and only then (proved)." in entry


def test_a_derivation_can_be_read_step_by_step(rendered):
    entry = entry_of(rendered["text"], "(13)")
    steps = (
        "From (12):\n        u_0 = u_i' + u_min0 - u_i",
        "From (11):\n        u_i' = k*x",
        "From the definition of gamma_0:\n        gamma_0 = C_d*W*sqrt(2*dP0/rho)",
        "Together:\n        u_0 = u_min0 + u_i*(k*x_max/u_max - 1)",
    )
    positions = [entry.index(step) for step in steps]
    assert positions == sorted(positions)
    assert "area gradient of the edge [m], positive" in " ".join(rendered["text"].split())


def test_every_case_and_every_number_is_told(verdicts, entries):
    for verdict in verdicts:
        entry = entries[verdict.number]
        assert len(entry.derivations) == len(verdict.proofs)
        assert all(derivation.lines for derivation in entry.derivations)
        assert len(entry.figures) == len(verdict.statement.values)
        assert len(entry.premises) == len(verdict.statement.grounds)
        differences = [value for proof in verdict.proofs for value in proof.discrepancies if value != 0]
        assert len(entry.differences) == len(differences)
    simulation, first, second = entries["T3b"].figures
    assert (simulation.ours, simulation.paper) == ("0.9391 L/min", "0.95 L/min (ours −1.1 %)")
    assert (first.ours, second.paper) == ("1.12 L/min", "")


def test_text_is_ascii_and_100_columns_wide(rendered):
    assert rendered["text"].isascii()
    assert max(map(len, rendered["text"].splitlines())) <= 100


# --- json ---------------------------------------------------------------------------------------------------


def test_json_statements_can_be_read_back(rendered):
    document = json.loads(rendered["json"])
    assert document["schema"] == "dzdesign.derivation/2"
    assert document["holds"] is True
    known = vars(symbols).items()
    listed = {row["name"] for row in document["symbols"]}
    names = {str(value): value for _, value in known if isinstance(value, sympy.Symbol)}
    names |= {name: value for name, value in known if isinstance(value, sympy.Symbol) and name in listed}
    names |= {name: value.func for name, value in known if isinstance(value, AppliedUndef)} | {"f": symbols.f}
    for row in document["statements"]:
        sides = [sympy.sympify(side, locals=names) for side in row["statement"].split(" = ")]
        statement = BY_NUMBER[row["number"]]
        members = [statement.symbol, *statement.members]
        assert set(sides) <= set(members) and sides[0] == statement.symbol
        assert set(map(to_text, sides)) == set(map(to_text, members))  # of two that look alike there is one
        used = re.findall(r"[A-Za-z]\w*", row["statement"])
        assert set(used) - listed <= {"sqrt", "log", "Piecewise", "True"}


def test_json_says_all_that_the_text_says(rendered):
    rows = {row["number"]: row for row in json.loads(rendered["json"])["statements"]}
    wrong, law, condition = rows["(29)"], rows["(18)"], rows["(27)"]
    assert (wrong["outcome"], wrong["corrected_by"], wrong["holds"]) == ("does not follow", ["(29c)"], False)
    assert wrong["any_of"] == [["u_max = V_adc"]]
    assert wrong["ruled_out_by"] == ["u_max = 10", "V_adc = 3"]
    assert wrong["derivations"][0]["discrepancies"] != ["0"] and wrong["figures"][0]["value"] == 13650
    assert [premise["number"] for premise in law["premises"]] == ["u_O", "(17)"]
    last = law["derivations"][-1]["lines"][-1]
    assert last["words"] == "Together:" and last["formula"].removeprefix("u_O = ") in law["statement"]
    assert law["section"].startswith("1.2") and "T1c" in law["see"]
    assert (condition["necessary"], rows["T6b"]["inherited"]) == (True, ["(28)", "(27)", "(25)"])
    assert [case["where"].partition(",")[0] for case in rows["(32)"]["derivations"]] == [
        "Case: dP <= dP0",
        "Case: dP > dP0",
    ]


# --- html ---------------------------------------------------------------------------------------------------


def test_html_is_one_page_without_scripts_or_network(rendered):
    page = Elements(rendered["html"])
    assert not {tag for tag, _, _ in page.elements} & {"script", "link", "img", "iframe", "object", "base"}
    assert not re.search(r"https?:|url\(|@import|\son\w+=", rendered["html"])
    identifiers = [attrs["id"] for _, attrs, _ in page.elements if "id" in attrs]
    assert len(identifiers) == len(set(identifiers))
    targets = {attrs["href"] for _, attrs, _ in page.named("a")}
    assert targets <= {f"#{identifier}" for identifier in identifiers}
    assert {"#eq-18", "#T3b"} <= targets


def test_a_verdict_is_a_sign_and_a_word_not_only_a_colour(rendered):
    marks = re.findall(r'<span class="mark [^"]*"><span aria-hidden="true">(.)</span> ([a-z: ]+)', rendered["html"])
    words = {"▫": "given", "✓": "follows", "◐": "follows if", "✗": "does not follow"}
    assert len(marks) > len(STATEMENTS)
    assert all(word.startswith(words[sign]) for sign, word in marks)


def test_text_is_escaped(verdicts):
    hostile = "<b>50 % & more_</b> </p><script> $y$ #1 ~^"
    first = replace(verdicts[0], statement=replace(verdicts[0].statement, title=hostile, note=hostile, number="<i>"))
    page = report.render([first], "html", only=["<i>"])
    assert "<script>" not in page and "<b>50" not in page
    assert page.count("&lt;b&gt;50 % &amp; more_&lt;/b&gt;") >= 2


# --- one equation -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wanted", ["18", "(18)"])
def test_one_equation_comes_with_all_that_it_rests_on_and_nothing_else(derive, wanted):
    status, printed = derive("--equation", wanted, "--json")
    numbers = [row["number"] for row in json.loads(printed.out)["statements"]]
    grounds = {ground.number for number in numbers for ground in BY_NUMBER[number].grounds}
    assert status == 0
    assert {"(18)", "(17)", "(13)", "(6)", "(1)"} <= set(numbers)
    assert grounds | {"(18)"} == set(numbers)
    assert numbers == [number for number in BY_NUMBER if number in numbers]  # in the order of the account


@pytest.mark.parametrize("format", report.FORMATS)
def test_a_part_of_the_account_reads_like_the_whole(verdicts, format):
    part = report.render(verdicts, format, report.closure(STATEMENTS, ["29"]))
    assert "code of the command" in part and "law off the reference" not in part
    assert "29c" in part  # what it should read, without a link to what is not shown
    if format == "html":
        page = Elements(part)
        identifiers = {f"#{attrs['id']}" for _, attrs, _ in page.elements if "id" in attrs}
        assert {attrs["href"] for _, attrs, _ in page.named("a")} <= identifiers


def test_several_equations_and_names_with_commas():
    both = set(report.closure(STATEMENTS, ["2"])) | set(report.closure(STATEMENTS, ["T3b"]))
    assert set(report.closure(STATEMENTS, ["2", "t3b"])) == set(report.closure(STATEMENTS, ["2, T3b"])) == both
    assert report.closure(STATEMENTS, ["Fig. 3, line"]) == ("Fig. 3, line",)


@pytest.mark.parametrize(("wanted", "near"), [("99", r"\(9\)"), ("T3z", "T3"), ("(18", r"\(18\)")])
def test_an_unknown_equation_names_the_nearest(derive, wanted, near):
    status, printed = derive("--equation", wanted)
    assert status == 2
    assert re.fullmatch(
        rf"dzdesign: no statement '{re.escape(wanted)}' \(did you mean '{near}\w*'\?\); .*\n", printed.err
    )


def test_unknown_format_names_the_nearest(verdicts, wording):
    with pytest.raises(InputError) as caught:
        report.render(verdicts, "htm")
    wording("the account: an unknown format", str(caught.value))


# --- exit status --------------------------------------------------------------------------------------------


def test_derive_prints_the_account_and_holds(derive, verdicts, rendered):
    status, printed = derive()
    assert (status, printed.out) == (0, rendered["text"])
    assert f"{len(verdicts)} of {len(verdicts)} statements have the verdict expected of them" in printed.out


@pytest.mark.slow
def test_a_wrong_equation_makes_derive_fail_and_is_named(derive, wrong_verdicts):
    status, printed = derive(found=wrong_verdicts)
    assert status == 1
    assert '(13) should be found to be "follows", but: does not follow.' in printed.out
    assert '(18) should be found to be "follows", but: rests on (17), which does not follow.' in printed.out
    assert "these are not:" in " ".join(printed.out.split())
    entry = " ".join(entry_of(printed.out, "(13)").split())
    assert "A correct account finds otherwise: follows." in entry
    assert "Derived minus published" in entry
    status, printed = derive("--format", "html", found=wrong_verdicts)
    assert status == 1 and printed.out.count("⚠ not as expected") >= 3
    status, printed = derive("--json", found=wrong_verdicts)
    assert status == 1 and json.loads(printed.out)["holds"] is False


def test_the_exit_status_refers_to_what_is_shown(derive, wrong_verdicts):
    assert derive("--equation", "18", found=wrong_verdicts)[0] == 1
    assert derive("--equation", "12", found=wrong_verdicts)[0] == 0


def test_a_unit_error_is_named(derive, verdicts):
    wrong = [
        replace(verdict, as_expected=False, unit_error="a sum of m and V") if verdict.number == "(9)" else verdict
        for verdict in verdicts
    ]
    status, printed = derive("--equation", "9", found=wrong)
    assert status == 1
    assert "but: follows; its units: a sum of m and V." in printed.out


# --- files --------------------------------------------------------------------------------------------------


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_make_docs_builds_the_page_with_the_products_own_command(derive, rendered, tmp_path):
    command = ["make", "-n", "docs", f"DOCS={tmp_path}"]
    recipe = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    lines = [shlex.split(line) for line in recipe.splitlines() if "bin/dzdesign derive" in line]
    for _, derived, *arguments in lines:
        assert (derived, derive(*arguments)[0]) == ("derive", 0)
    built = {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()}
    assert built == {
        "index.html": rendered["html"],
        "derivation.json": rendered["json"],
    }


def test_what_make_docs_builds_is_ignored_by_git_and_removed_by_clean():
    assert "/docs/derivation/" in (ROOT / ".gitignore").read_text().splitlines()
    assert re.search(r"^clean:\n\t.*\$\(DOCS\)", (ROOT / "Makefile").read_text(), re.MULTILINE)


# --- prose --------------------------------------------------------------------------------------------------


def test_prose_has_symbols_between_dollars_and_references():
    words = prose.parse_prose("a step of $u_i' - k x_max$ by Eqs. (18)-(20), L1, 8-8.5 V; `target`", ["(18)", "L1"])
    named = [(type(word).__name__, str(word)) for word in words.parts if not isinstance(word, str)]
    assert named == [
        ("Formula", "u_i'"),
        ("Formula", "k"),
        ("Formula", "x_max"),
        ("Reference", "(18)"),
        ("Reference", "L1"),
        ("Code", "`target`"),
    ]
    assert "8–8.5 V" in "".join(word for word in words.parts if isinstance(word, str))


def test_prose_survives_the_way_to_plain_text():
    for statement in STATEMENTS:
        for sentence in (statement.title, statement.note, *(setting.words for setting in statement.scope.settings)):
            assert str(prose.parse_prose(sentence, BY_NUMBER)) == sentence.replace("$", "")


def test_every_symbol_in_prose_is_declared():
    known = {str(name).removesuffix("(s)") for name in symbols.QUANTITIES} | {"f", "gamma", "u_min"}
    sentences = [sentence for one in STATEMENTS for sentence in (one.title, one.note)]
    for sentence in [*sentences, *(one.meaning for one in symbols.QUANTITIES.values())]:
        found = [str(part) for part in prose.parse_prose(sentence).parts if isinstance(part, prose.Formula)]
        assert {*found} <= known, sentence


@pytest.mark.parametrize("module", [prose, report, writers, formulas], ids=lambda one: one.__name__)
def test_examples_in_the_docstrings_run(module):
    outcome = doctest.testmod(module)
    assert outcome.attempted > 0
    assert outcome.failed == 0


def test_the_json_fits_its_schema(rendered):
    from tests.support.schema_checks import overlooked, problems

    document = json.loads(rendered["json"])
    assert problems("derivation", document) == []
    assert overlooked("derivation", document) == []


def test_every_symbol_is_explained(rendered):
    table = json.loads(rendered["json"])["symbols"]
    assert len(table) > 90 and [row["name"] for row in table if not row["meaning"]] == []
    for words in ("headroom", "K_et", "transform of i", "m^3/s/V"):
        assert words in rendered["text"].split("\nSymbols\n")[1].split("\n\n\n")[0]
    assert "\0" not in rendered["text"] and "\\u0000" not in rendered["json"]


def test_where_a_statement_is_proved_is_said_in_every_format(rendered):
    assert "Proved for u_1 != u_2." in entry_of(rendered["text"], "T8d")
    row = next(row for row in json.loads(rendered["json"])["statements"] if row["number"] == "T8d")
    assert (row["provided"], row["limited_by"]) == (["u_1 != u_2"], ["straight part"])
    assert rendered["html"].count('class="scope"') > 20
