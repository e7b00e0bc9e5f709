"""The account of the paper as a person reads it: everything is there, in every format, and says what was proved."""

import doctest
import json
import re
from dataclasses import replace

import pytest
import sympy
from sympy.core.function import AppliedUndef

from dzdesign.command_line.cli import main
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.derivation import law, lowering, plant, scaling, symbols
from dzdesign.derivation.account import account, scope, solving
from dzdesign.derivation.account.account import STATEMENTS, verify_statements
from dzdesign.derivation.account.equations import PAPER_NUMBERS
from dzdesign.derivation.account.solving import agree
from dzdesign.derivation.account.statement import Outcome
from dzdesign.derivation.presentation import content, formulas, report, writers
from dzdesign.derivation.presentation.formulas import to_latex, to_mathml, to_text
from dzdesign.derivation.presentation.writers import HtmlWriter, anchor
from tests.derivation.account.claims import BY_NUMBER
from tests.support.html_pages import Page
from tests.support.schema_checks import overlooked, problems

MARKS = {Outcome.FOLLOWS: "follows", Outcome.FOLLOWS_IF: "follows if", Outcome.DOES_NOT_FOLLOW: "does not follow"}


@pytest.fixture(scope="module")
def found(verdicts):
    return tuple(verdicts.values())


@pytest.fixture(scope="module")
def rendered(found):
    return {format: report.render(found, format) for format in report.FORMATS}


@pytest.fixture(scope="module")
def rows(rendered):
    return {row["number"]: row for row in json.loads(rendered["json"])["statements"]}


@pytest.fixture(scope="module")
def expressions(found):
    """Everything that is typeset: the statements, and each step of each derivation."""
    proofs = [proof for verdict in found for proof in verdict.proofs]
    members = [side for statement in STATEMENTS for side in (statement.symbol, *statement.members)]
    steps = [step.gives for proof in proofs for step in proof.steps]
    return {*members, *steps, *(value for proof in proofs for value in proof.discrepancies)}


@pytest.fixture(scope="module")
def wrong(found):
    """The account with Eq. (13) doubled, as its own verdict and those that rest on it come out."""
    numbers = report.closure(STATEMENTS, ["18"])
    doubled = replace(BY_NUMBER["(13)"], members=tuple(2 * member for member in BY_NUMBER["(13)"].members))
    judged = verify_statements([doubled if number == "(13)" else BY_NUMBER[number] for number in numbers])
    changed = {verdict.number: verdict for verdict in judged}
    return tuple(changed.get(verdict.number, verdict) for verdict in found)


@pytest.fixture
def derive(found, monkeypatch, capsys):
    """Run `dzdesign derive` on verdicts that were found before; returns the exit status and what was printed."""

    def run(*arguments, found=found):
        monkeypatch.setattr(account, "verify_statements", lambda: found)
        return main(["derive", *arguments]), capsys.readouterr()

    return run


def entry_of(text, number):
    """The part of a text report that tells of one statement."""
    return text.rsplit(f"\n\n{number}  ", 1)[1].split("\n\n")[0]


# --- formulas -----------------------------------------------------------------------------------------------


def read_back(text):
    """Parse plain text as a formula, by a way of its own."""
    known = vars(symbols).items()
    names = {str(value): value for _, value in known if isinstance(value, sympy.Symbol)}
    names |= {name: value for name, value in known if isinstance(value, sympy.Symbol) and not names.get(name)}
    names |= {f"{value.func.__name__}_of": value.func for _, value in known if isinstance(value, AppliedUndef)}
    for written, name in {"u_i'": "u_i_prime", "Q_O'": "Q_O_prime", "lambda": "scale", "^": "**"}.items():
        text = text.replace(written, name)
    text = re.sub(r"\b(i|x_e|v)\(0\)", lambda found: {"i": "i_init", "x_e": "x_init", "v": "v_init"}[found[1]], text)
    text = re.sub(r"\b(\w+)\((?=s\b|a \+ s|s \+ a)", r"\1_of(", text)
    return sympy.sympify(text, locals=names | {"f": symbols.f})


@pytest.mark.slow
def test_what_is_printed_is_what_was_proved(expressions):
    read = [one for one in expressions if not one.has(sympy.Piecewise)]
    assert len(read) > 150
    assert [one for one in read if not agree(read_back(to_text(one)), one)] == []
    law = BY_NUMBER["(18)"].members[-1]
    assert not agree(read_back(to_text(law).replace("1 - beta", "1 + beta")), law)


class Elements(Page):
    """A page whose elements end where they must, each with the number of elements in it."""

    def __init__(self, page):
        self.open, self.elements = [], []
        super().__init__(page)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        super().handle_starttag(tag, attrs)
        assert (tag, "a") != ("a", *(one[0] for one in self.open if one[0] == "a")), "a link within a link"
        if self.open:
            self.open[-1][1] += 1
        if tag != "meta":
            self.open.append([tag, 0])
            self.elements.append(self.open[-1])

    def handle_endtag(self, tag):
        assert self.open.pop()[0] == tag


def test_mathml_elements_have_the_parts_that_they_need(expressions):
    needed = {"mfrac": 2, "msub": 2, "msup": 2, "msubsup": 3, "msqrt": 1}
    for expression in expressions:
        latex = to_latex(expression)
        page = Elements(f"<math>{to_mathml(latex)}</math>")
        assert [e for e in page.elements if e[0] in needed and e[1] != needed[e[0]]] == [], expression
        assert latex.count("{") == latex.count("}") and latex.count(r"\left") == latex.count(r"\right")


# --- every format -------------------------------------------------------------------------------------------


def test_every_format_has_every_statement_with_its_verdict(found, rendered, rows):
    articles = dict(re.findall(r'<article id="([^"]+)"(.*?)</article>', rendered["html"], re.DOTALL))
    assert list(articles) == [anchor(verdict.number) for verdict in found]
    assert list(rows) == [verdict.number for verdict in found]
    for verdict in found:
        mark = MARKS.get(verdict.outcome, "given: ")
        head = entry_of(rendered["text"], verdict.number).split("\n    ")[0]
        assert f"[{mark}" in head.replace("\n", " "), verdict.number
        assert mark in re.search(r'class="mark.*?</span>\s*(.*?)</span>', articles[anchor(verdict.number)])[1]
        row = rows[verdict.number]
        assert (row["outcome"], row["as_expected"]) == (verdict.outcome, True)
        for key, parts in (
            ("derivations", verdict.proofs),
            ("figures", verdict.statement.values),
            ("premises", verdict.statement.grounds),
        ):
            assert len(row[key]) == len(parts), (verdict.number, key)
        assert all(derivation["lines"] for derivation in row["derivations"])


def test_the_table_has_all_32_equations(rendered, rows):
    text = rendered["text"].split("The paper's equations\n")[1].split("\n\n")[0]
    html = rendered["html"].split('<table class="equations">')[1].split("</table>")[0]
    in_html = re.findall(r'<th scope="row"><a href="#eq-\d+">(\(\d+\))</a>', html)
    in_json = [number for number in rows if number in PAPER_NUMBERS]
    assert re.findall(r"^\(\d+\)", text, re.MULTILINE) == in_html == in_json == list(PAPER_NUMBERS)
    assert len(PAPER_NUMBERS) == 32


@pytest.mark.parametrize(
    ("number", "said"),
    [
        ("(30)", "It would follow only if n_V = 1; the published numbers give n_V = 1365."),
        ("(30)", "Its units do not agree:"),
        ("(30)", "Derived minus published:\n        u_min0*(n_V - 1)"),
        ("(30)", "It should read, by (30b):\n        n_0 = n_V*(u_min0 + u_i*(k*x_max/u_max - 1))"),
        ("(30)", "5.39 counts"),
        ("(6)", "For a stop at every pressure drop it should read, by (6c):"),
        ("(25)", "Follows if i(0) = 0 (Assumption 4), and only then (proved)."),
        ("(13)", "From (12):\n        u_0 = u_i' + u_min0 - u_i"),
        ("(13)", "From the definition of gamma_0:\n        gamma_0 = C_d*W*sqrt(2*dP0/rho)"),
        ("(13)", "Together:\n        u_0 = u_min0 + u_i*(k*x_max/u_max - 1)"),
        ("(32)", "Case: dP <= dP0, that is dP1 = dP0 - below:"),
        ("T8d", "Proved for u_1 != u_2."),
        ("T6b", "Rests on the condition of (28), (27), (25)."),
    ],
)
def test_an_entry_says_what_was_found(rendered, number, said):
    assert said in entry_of(rendered["text"], number)


def test_text_is_ascii_and_100_columns_wide(rendered):
    assert rendered["text"].isascii()
    assert max(map(len, rendered["text"].splitlines())) <= 100
    assert all(text.endswith("\n") and not text.endswith("\n\n") for text in rendered.values())


def test_json_fits_its_schema_and_can_be_read_back(rendered, rows):
    document = json.loads(rendered["json"])
    assert problems("derivation", document) == overlooked("derivation", document) == []
    assert document["holds"] is True
    known = vars(symbols).items()
    assert len(document["symbols"]) > 90 and all(row["meaning"] for row in document["symbols"])
    listed = {row["name"] for row in document["symbols"]}
    names = {str(value): value for _, value in known if isinstance(value, sympy.Symbol)}
    names |= {name: value for name, value in known if isinstance(value, sympy.Symbol) and name in listed}
    names |= {name: value.func for name, value in known if isinstance(value, AppliedUndef)} | {"f": symbols.f}
    for number, row in rows.items():
        sides = [sympy.sympify(side, locals=names) for side in row["statement"].split(" = ")]
        members = [BY_NUMBER[number].symbol, *BY_NUMBER[number].members]
        assert set(sides) <= set(members) and sides[0] == members[0]
        assert set(map(to_text, sides)) == set(map(to_text, members))  # of two that look alike there is one
        assert set(re.findall(r"[A-Za-z]\w*", row["statement"])) - listed <= {"sqrt", "log", "Piecewise", "True"}


def test_html_is_one_page_without_scripts_or_network(rendered):
    page = Elements(rendered["html"])
    assert not {tag for tag, _ in page.tags} & {"script", "link", "img", "iframe", "object", "base"}
    assert not re.search(r"https?:|url\(|@import|\son\w+=", rendered["html"])
    assert len(page.ids()) == len(set(page.ids()))
    assert {"#eq-18", "#T3b"} <= {*page.links()} <= {f"#{identifier}" for identifier in page.ids()}
    marks = re.findall(r'<span class="mark [^"]*"><span aria-hidden="true">(.)</span> ([a-z: ]+)', rendered["html"])
    words = {"▫": "given", "✓": "follows", "◐": "follows if", "✗": "does not follow"}
    assert len(marks) > len(STATEMENTS)  # a sign and a word, not only a colour
    assert all(word.startswith(words[sign]) for sign, word in marks)


def test_text_is_escaped(found):
    hostile = "<b>50 % & more_</b> </p><script> $y$ #1 ~^"
    first = replace(found[0], statement=replace(found[0].statement, title=hostile, note=hostile, number="<i>"))
    page = report.render([first], "html", only=["<i>"])
    assert "<script>" not in page and "<b>50" not in page and "<i>" not in page
    assert page.count("&lt;b&gt;50 % &amp; more_&lt;/b&gt;") >= 2


# --- one equation, and what is refused ----------------------------------------------------------------------


@pytest.mark.parametrize("wanted", ["18", "(18)"])
def test_one_equation_comes_with_all_that_it_rests_on_and_nothing_else(derive, wanted):
    status, printed = derive("--equation", wanted, "--json")
    numbers = [row["number"] for row in json.loads(printed.out)["statements"]]
    grounds = {ground.number for number in numbers for ground in BY_NUMBER[number].grounds}
    assert status == 0
    assert {"(18)", "(17)", "(13)", "(6)", "(1)"} <= set(numbers) == grounds | {"(18)"}
    assert numbers == [number for number in BY_NUMBER if number in numbers]  # in the order of the account


@pytest.mark.parametrize("format", report.FORMATS)
def test_a_part_of_the_account_reads_like_the_whole(found, format):
    part = report.render(found, format, report.closure(STATEMENTS, ["29"]))
    assert "code of the command" in part and "law off the reference" not in part
    assert "29c" in part  # what it should read, without a link to what is not shown
    if format == "html":
        page = Elements(part)
        assert {*page.links()} <= {f"#{identifier}" for identifier in page.ids()}


def test_several_equations_and_names_with_commas():
    both = set(report.closure(STATEMENTS, ["2"])) | set(report.closure(STATEMENTS, ["T3b"]))
    assert set(report.closure(STATEMENTS, ["2", "t3b"])) == set(report.closure(STATEMENTS, ["2, T3b"])) == both
    assert report.closure(STATEMENTS, ["Fig. 3, line"]) == ("Fig. 3, line",)


@pytest.mark.parametrize(("wanted", "near"), [("99", r"\(9\)"), ("T3z", "T3"), ("(18", r"\(18\)")])
def test_an_unknown_equation_names_the_nearest(derive, wanted, near):
    status, printed = derive("--equation", wanted)
    start = rf"dzdesign: no statement '{re.escape(wanted)}' \(did you mean '{near}\w*'\?\); .*\n"
    assert status == 2 and re.fullmatch(start, printed.err)


def test_an_unknown_format_and_a_missing_equation_are_refused(found, wording):
    with wording.refusal(InputError, "the account: an unknown format"):
        report.render(found, "htm")
    with wording.refusal(RequirementError, "the account: a missing equation"):
        report.render([verdict for verdict in found if verdict.number != "(20)"], "json")


# --- exit status and files ----------------------------------------------------------------------------------


def test_derive_prints_the_account_and_holds(derive, found, rendered):
    status, printed = derive()
    assert (status, printed.out) == (0, rendered["text"])
    assert f"{len(found)} of {len(found)} statements have the verdict expected of them" in printed.out


@pytest.mark.slow
def test_a_wrong_equation_makes_derive_fail_and_is_named(derive, wrong):
    status, printed = derive(found=wrong)
    assert status == 1
    assert '(13) should be found to be "follows", but: does not follow.' in printed.out
    assert '(18) should be found to be "follows", but: rests on (17), which does not follow.' in printed.out
    entry = " ".join(entry_of(printed.out, "(13)").split())
    assert "A correct account finds otherwise: follows." in entry and "Derived minus published" in entry
    status, printed = derive("--format", "html", found=wrong)
    assert status == 1 and printed.out.count("⚠ not as expected") >= 3
    status, printed = derive("--json", found=wrong)
    assert status == 1 and json.loads(printed.out)["holds"] is False
    # The status is that of what is shown.
    assert [derive("--equation", number, found=wrong)[0] for number in ("18", "12")] == [1, 0]


def test_a_unit_error_is_named(derive, verdicts):
    mixed = replace(verdicts["(9)"], as_expected=False, unit_error="a sum of m and V")
    status, printed = derive("--equation", "9", found=[*{**verdicts, "(9)": mixed}.values()])
    assert status == 1
    assert "but: follows; its units: a sum of m and V." in printed.out


# --- prose --------------------------------------------------------------------------------------------------


def test_a_sentence_has_symbols_code_and_references():
    words = content.Words("`a` step $u_i' - k*x_max <= 1$ by Eqs. (18) and (19), 8-8.5 V; [[S|the definition of $S$]]")
    assert str(words) == "`a` step u_i' - k*x_max <= 1 by Eqs. (18) and (19), 8-8.5 V; the definition of S"
    html = HtmlWriter({"(18)", "S"}).words(words)
    for part in ("<code>a</code>", "8–8.5 V", '<a href="#eq-18">(18)</a> and (19)', '<a href="#S">the definition of'):
        assert part in html
    assert html.count("<math>") == 4 and "≤ 1" in html and " − " in html and "*" not in html


def test_every_symbol_in_prose_is_declared():
    known = {str(name).removesuffix("(s)") for name in symbols.QUANTITIES} | {"f", "gamma"}
    texts = [text for one in STATEMENTS for text in (one.title, one.note)]
    for text in [*texts, *(one.meaning for one in symbols.QUANTITIES.values())]:
        for formula in re.findall(r"\$([^$]+)\$", text):
            assert set(re.findall(r"[A-Za-z]\w*'?", formula)) <= known, text


@pytest.mark.parametrize(
    "module",
    [content, report, writers, formulas, law, lowering, plant, scaling, scope, solving, symbols],
    ids=lambda one: one.__name__,
)
def test_examples_in_the_docstrings_run(module):
    outcome = doctest.testmod(module)
    assert outcome.attempted > 0 and outcome.failed == 0
