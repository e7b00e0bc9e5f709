"""The command line as people expect it: help, how much is said, near misses, tables that fit, the start."""

import contextlib
import inspect
import io
import json
import re
import shlex
import shutil
import subprocess
import sys
import time
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

from dzdesign import stages
from dzdesign.command_line.cli import main
from dzdesign.command_line.invocation import parse
from dzdesign.command_line.parser import COMMANDS, EXAMPLES, arguments_of_command, command_module
from dzdesign.core.errors import InputError, nearest, neighbour
from dzdesign.core.options import GROUPS, Option
from dzdesign.core.units import si_factor
from dzdesign.stages.recordings import distinct_names
from dzdesign.terminal import progress
from dzdesign.terminal.page import FILE_WIDTH, Table, new_console, put_line, put_table
from tests.support.synthetic import L_MIN, MPA, Truth, synthetic_ramp


def help_of(*words, columns=80):
    """Return what --help prints, in this process."""
    out = io.StringIO()
    with pytest.MonkeyPatch.context() as patched, contextlib.redirect_stdout(out):
        patched.setenv("COLUMNS", str(columns))
        try:
            status = main([*words, "--help"])
        except SystemExit as ended:  # argparse's way
            status = ended.code
    assert status == 0
    return out.getvalue()


@pytest.fixture(scope="module")
def ramp_file(tmp_path_factory):
    """A short recording, as a file."""
    test = synthetic_ramp(1.0, Truth(noise=0.02), ramp_s=20)
    rows = zip(test.time, test.u, test.dp / MPA, test.q / L_MIN, strict=True)
    path = tmp_path_factory.mktemp("ramp") / "ramp.csv"
    path.write_text("time_s,u_V,dP_MPa,Q_Lmin\n" + "".join(",".join(f"{x:.4f}" for x in row) + "\n" for row in rows))
    return path


# help


@pytest.mark.parametrize("columns", [64, 80, 140])
def test_the_front_page_fits(columns):
    assert max(map(len, help_of(columns=columns).partition("examples:")[0].splitlines())) <= min(columns, 100)
    assert help_of(columns=columns) == help_of("--quiet", columns=columns)


def test_help_groups_every_command_once():
    page = help_of()
    for name, command in COMMANDS.items():
        assert f"\n{command.group}:\n" in page
        assert len(re.findall(rf"^  {name} ", page, re.MULTILINE)) == 1, name
    before = page.index("from ramps to firmware")
    assert before < page.index("  identify") < page.index("  verify") < page.index("evidence:") < page.index("  assess")
    assert "exit status:" in page and "130  interrupted" in page and "examples:" in page


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("columns", [64, 80, 140])
def test_help_of_a_command_fits_and_names_every_option(name, columns):
    page = help_of(name, columns=columns)
    options = page[: page.index("\nexample")]
    assert max(map(len, options.splitlines())) <= min(columns, 100)
    for argument in arguments_of_command(name):
        word = argument.option.metavar if argument.is_positional else argument.flag
        assert re.search(rf"^  (-\w, )?{re.escape(word)}\b", page, re.MULTILINE), word
    assert "options of every command:" in page and "--quiet" in page and "--verbose" in page


def test_every_declaration_has_a_sentence_and_a_known_group():
    declared = [argument for name in COMMANDS for argument in arguments_of_command(name)]
    assert len(declared) > 100
    for argument in declared:
        assert argument.help[0].isupper(), argument
        assert argument.help.endswith("."), argument
        assert argument.option.group in ("", *GROUPS), argument
        assert argument.option.metavar or bool in argument.kinds, argument


def test_one_declaration_is_seen_everywhere(monkeypatch, tmp_path, capsys):
    """An option that is added to a stage's class is on the command line, in the file, in the help and in the API."""
    from dzdesign.keywords import with_keywords
    from dzdesign.stages import design

    @dataclass(frozen=True)
    class Arguments(design.DesignArguments):
        _: KW_ONLY
        fluid: Annotated[str, Option("GRADE", "law", choices=("HLP 32", "HLP 46"))] = "HLP 46"
        """Grade of the oil."""

    def stage(arguments: Arguments) -> str:
        """Tell the oil.

        Parameters
        ----------
        arguments : Arguments
            Of the stage.
        """
        return arguments.fluid

    monkeypatch.setattr(command_module("design"), "Arguments", Arguments)
    (tmp_path / "dz.toml").write_text("fluid = 'HLP 32'\n")
    assert parse(["design", "v.json"]).arguments.fluid == "HLP 46"
    assert parse(["design", "v.json", "--config", str(tmp_path / "dz.toml")]).arguments.fluid == "HLP 32"
    assert parse(["design", "v.json", "--fluid", "HLP 68"]).arguments.fluid == "HLP 68"
    assert re.search(r"--fluid GRADE +Grade of the oil \(HLP 32, HLP 46; default: HLP 46\)\.", help_of("design"))
    told = with_keywords(Arguments, stage)
    assert told("v.json", fluid="HLP 32") == "HLP 32" and "Grade of the oil (" in told.__doc__
    assert "fluid" in inspect.signature(told).parameters
    with pytest.raises(InputError, match="did you mean 'fluid'"):
        told("v.json", fluidd="HLP 32")


def test_every_command_has_examples_and_they_can_be_said(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("dzdesign.toml").write_text("")
    for name in ("", *COMMANDS):
        for line in command_module(name).EXAMPLES if name else EXAMPLES:
            words = shlex.split(re.split(r" > | \| |   ", line)[0])
            assert words[0] == "dzdesign", line
            assert parse(words[1:]).command == words[1]


# how much is said


@pytest.mark.parametrize("words", [("-q", "identify"), ("identify", "--quiet")])
def test_quiet_says_results_and_errors_only(ramp_file, tmp_path, capsys, words):
    output = str(tmp_path / "valve.json")
    assert main([*words, str(ramp_file), "-o", output]) == 0
    said = capsys.readouterr()
    assert said.err == "" and "Written:" in said.out
    assert main([*words, "nowhere.csv", "-o", output]) == 2
    assert "does not exist" in capsys.readouterr().err


@pytest.mark.parametrize("words", [("--verbose", "identify"), ("identify", "-v")])
def test_verbose_says_what_is_done_with_times_files_and_the_solver(ramp_file, tmp_path, capsys, words):
    output = str(tmp_path / "valve.json")
    assert main([*words, str(ramp_file), "-o", output]) == 0
    said = capsys.readouterr()
    assert re.search(r"^dzdesign: +\d+\.\d{3} s +reading ramp file '.*ramp\.csv'$", said.err, re.MULTILINE)
    assert re.search(r"curves: SOLVER_RET_SUCCESS, \d+\.\d{3} s", said.err)
    assert f"wrote '{output}'" in said.err and re.search(r"s  end$", said.err, re.MULTILINE)
    assert main(["identify", str(ramp_file), "-o", output]) == 0
    after = capsys.readouterr()
    assert after.err == "dzdesign: fitting 1 recording\n"
    # All details in place of one screen.
    assert "trend with dP" in said.out and "trend with dP" not in after.out


def test_quiet_and_verbose_together_are_refused(capsys):
    assert main(["-q", "derive", "-v"]) == 2
    assert "contradict each other" in capsys.readouterr().err


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("stream", "quiet", "term", "shown"),
    [
        (Terminal, False, "xterm", True),
        (Terminal, True, "xterm", False),
        (Terminal, False, "dumb", False),
        (io.StringIO, False, "xterm", False),
    ],
)
def test_a_long_stage_moves_a_bar_for_a_person(monkeypatch, stream, quiet, term, shown):
    page = stream()
    monkeypatch.setattr(sys, "stderr", page)
    monkeypatch.setenv("TERM", term)
    with progress.reporting(quiet=quiet, verbose=False), progress.stage_progress() as stage:
        stage("fitting")
        stage("drawing")
        until = time.monotonic() + 5
        while shown and "━" not in page.getvalue() and time.monotonic() < until:
            time.sleep(0.01)
    assert ("━" in page.getvalue()) == shown
    assert not shown or page.getvalue().endswith("\x1b[1A\x1b[2K")  # the line of the bar is gone
    assert ("dzdesign: fitting\n" in page.getvalue()) == (not quiet)


def test_a_stage_of_known_pieces_shows_how_far_it_is(monkeypatch):
    page = Terminal()
    monkeypatch.setattr(sys, "stderr", page)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)

    def half_is_done():
        """A bar of known end is two stretches of one colour each; one of unknown end changes it at every step."""
        until = time.monotonic() + 5
        while "━" * 20 not in page.getvalue() and time.monotonic() < until:
            time.sleep(0.01)
        return "━" * 20 in page.getvalue()

    with progress.reporting(quiet=False, verbose=False), progress.stage_progress() as stage:
        stage("running the closed loop")
        for piece in stage.each(iter(range(4)), 4):
            if piece == 2:
                assert half_is_done()
    assert list(stage.each("abc", 3)) == ["a", "b", "c"]


def test_colour_is_for_terminals_and_for_who_asks(monkeypatch):
    def printed(**environment):
        page = io.StringIO()
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(sys, "stdout", page)
            for name in ("NO_COLOR", "FORCE_COLOR"):
                patched.delenv(name, raising=False)
            for name, value in environment.items():
                patched.setenv(name, value)
            table = Table("title", "a", "b")
            table.add_row("1", "2")
            new_console().print(table)
        return page.getvalue()

    assert "\x1b[" not in printed()
    assert "\x1b[1" in printed(FORCE_COLOR="1", TERM="xterm")


# near misses


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("idntify a.csv", "there is no command 'idntify' (did you mean 'identify'?)"),
        ("identify a.csv --meterlag '0.1 s'", "has no option --meterlag (did you mean '--meter-lag'?)"),
        ("identify --bogus", "`dzdesign identify` has no option --bogus"),
        ("load --bogus --port COM1", "`dzdesign load` has no option --bogus"),
        ("--bogus", "`dzdesign` has no option --bogus"),
        ("identify a.csv --guard mean", "(it is an option of `dzdesign design`)"),
        ("design valve.json --meter-lag 1s", "(it is an option of `dzdesign identify`, `assess`)"),
        ("verify firmware more", "'more' is one word too many"),
        ("codegen --target f28334 x", "(did you mean 'f28335'?)"),
        ("derive --equation 16b", "no statement '16b' (did you mean"),
        ("derive --format HTML", "(did you mean 'html'?)"),
        ("identify ramp.csw", "ramp file 'ramp.csw' does not exist (did you mean 'ramp.csv'?)"),
        ("verify frmware", "'frmware/manifest.json' does not exist (did you mean 'firmware/manifest.json'?)"),
        ("identify rmps/*.csv", "no file matches 'rmps/*.csv' (did you mean 'ramps'?)"),
    ],
)
def test_a_near_miss_is_named(line, hint, ramp_file, tmp_path, monkeypatch, capsys):
    shutil.copy(ramp_file, tmp_path)
    (tmp_path / "firmware").mkdir()
    (tmp_path / "ramps").mkdir()
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(line)) == 2
    said = capsys.readouterr().err
    assert hint in said and said.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["firmware", "ramp.csv", "ramps"]


def test_what_init_proposes_for_the_record_is_no_mistake(tmp_path, capsys):
    file, templates = tmp_path / "dz.toml", Path(stages.__file__).parent / "templates"
    entries = (templates / "dzdesign.toml.jinja").read_text(encoding="utf-8").partition("# [record]\n")[2]
    file.write_text("[record]\n" + entries.replace("# ", ""), encoding="utf-8")
    assert {"serial", "oil"} <= parse(["identify", "a.csv", "--config", str(file)]).arguments.record.keys()
    assert capsys.readouterr().err == ""


def test_an_option_that_was_added_below_the_record_is_refused_and_an_entry_of_people_is_not(tmp_path, capsys):
    file = tmp_path / "dz.toml"
    file.write_text('[record]\nserial = "4711"\norder = "PO 12"\npressure-span = "250 bar"\n')
    with pytest.raises(InputError, match=r"'pressure-span' stands in the table \[record\].*above all tables"):
        parse(["identify", "a.csv", "--config", str(file)])
    file.write_text('[dp]\n"a.csv" = "1 MPa"\nguard = "mean"\n')  # no name of a recording
    with pytest.raises(InputError, match=r"'guard' stands in the table \[dp\]"):
        parse(["identify", "a.csv", "--config", str(file)])
    file.write_text('pressure-span = "250 bar"\n[record]\nserial = "4711"\norder = "PO 12"\n')
    assert parse(["identify", "a.csv", "--config", str(file)]).arguments.record == {"serial": "4711", "order": "PO 12"}
    said = capsys.readouterr().err
    assert "'order' stands in the table [record]" in said and "'serial'" not in said
    assert parse(["design", "valve.json", "--config", str(file)]).arguments.pressure_span == "250 bar"


def test_columns_of_the_command_line_stand_on_top_of_those_of_the_file(tmp_path):
    file = tmp_path / "dz.toml"
    file.write_text('[columns]\ntime = "Zeit"\nu = "AO0:V"\npA = "p1:bar"\npB = "p2:bar"\n')

    def merged(text):
        return parse(["identify", "a.csv", "--config", str(file), "--columns", text]).arguments.columns

    ports = {"pA": "p1:bar", "pB": "p2:bar"}
    assert merged("Q=flow:L/min") == {"time": "Zeit", "u": "AO0:V", **ports, "Q": "flow:L/min"}
    assert merged("u=AO1:V") == {"time": "Zeit", "u": "AO1:V", **ports}
    assert merged("dP=p3:bar") == {"time": "Zeit", "u": "AO0:V", "dP": "p3:bar"}  # not beside two ports
    file.write_text('[columns]\nspeed = "x"\n')
    with pytest.raises(InputError, match=r"dz\.toml': --columns names 'speed'"):
        merged("u=AO1:V")


@pytest.mark.parametrize(
    ("unit", "quantity", "meant"),
    [("L/mim", "flow", "L/min"), ("BARR", "pressure", "bar"), ("mVV", "voltage", "mV")],
)
def test_a_mistyped_unit_names_one_of_its_quantity(unit, quantity, meant):
    with pytest.raises(InputError, match=re.escape(f"(did you mean '{meant}'?)")):
        si_factor(unit, quantity)
    assert si_factor(meant, quantity) > 0


def test_nothing_near_gives_no_hint(tmp_path):
    assert nearest("zz", ["identify"]) == ""
    (tmp_path / "ramp.csv").touch()
    assert neighbour(tmp_path / "something-else.tdms") == ""
    assert neighbour(tmp_path / "ramp.csv") == ""
    assert neighbour(f"{tmp_path}/ramp.cvs") == f" (did you mean '{tmp_path}/ramp.csv'?)"


# tables


WORDS = st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=9)
CELLS = st.lists(WORDS, min_size=1, max_size=4).map(" ".join)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(2, 9), st.integers(0, 4), st.integers(26, 160), st.data())
def test_a_table_fits_the_page_with_every_word_whole(columns, rows, width, data):
    headers = data.draw(st.lists(CELLS, min_size=columns, max_size=columns))
    table = Table("a title", *headers)
    for _ in range(rows):
        table.add_row(data.draw(CELLS), *data.draw(st.lists(WORDS, min_size=columns - 1, max_size=columns - 1)))
    page = Console(width=width, file=io.StringIO(), highlight=False)
    put_table(page, table)
    text = page.file.getvalue()
    columns = zip(headers, *table.rows, strict=True)
    longest = [max(len(word) for cell in column for word in cell.split()) for column in columns]
    assert max(map(len, text.splitlines())) <= max(width, 1 + sum(longest) + len(longest))
    shown = text.split()
    for cell in (*headers, *(cell for row in table.rows for cell in row)):
        assert all(word in shown for word in cell.split())


def test_a_table_too_wide_goes_on_below_under_its_first_column():
    table = Table("t", "ramp test", *(f"number{k}" for k in range(12)))
    table.add_row("ramp_dP0.5.csv.gz", *(f"{k}.12345" for k in range(12)))
    page = Console(width=80, file=io.StringIO(), highlight=False)
    put_table(page, table)
    text = page.file.getvalue()
    assert [text.count(f" {k}.12345") for k in range(12)] == [1] * 12
    rows = [line for line in text.splitlines() if "12345" in line]
    assert len(rows) == 2 and all("ramp_dP0.5.csv.gz" in row for row in rows)
    assert "…" not in text and max(map(len, text.splitlines())) <= 80 and text.count("t\n") == 1


def test_a_name_longer_than_the_page_is_broken():
    table = Table("t", "file", "number")
    table.add_row("a" * 100, "1.5")
    page = Console(width=80, file=io.StringIO(), highlight=False)
    put_table(page, table)
    text = page.file.getvalue()
    assert max(map(len, text.splitlines())) <= 80 and text.count("a") == 100 and "1.5" in text


def test_markup_in_a_cell_is_text():
    table = Table("of [bold]x[/bold]", "[red]a", "b")
    table.add_row("[/nothing]", "1")
    page = Console(width=80, file=io.StringIO())
    page.print(table)
    assert all(word in page.file.getvalue() for word in ("[bold]x[/bold]", "[red]a", "[/nothing]"))


@pytest.mark.parametrize(("told", "width"), [(None, FILE_WIDTH), ("80", 80), ("0", FILE_WIDTH), ("wide", FILE_WIDTH)])
def test_a_pipe_is_as_wide_as_columns_says(monkeypatch, told, width):
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    monkeypatch.delenv("COLUMNS", raising=False)
    if told:
        monkeypatch.setenv("COLUMNS", told)
    assert new_console().width == width


def test_sentences_are_wrapped_for_a_person_and_whole_in_a_pipe(monkeypatch):
    sentence = "holds  equals the exactly rounded law: " + "inputs checked and none of them wrong " * 5
    for stream, lines in ((Terminal(), 4), (io.StringIO(), 1)):
        monkeypatch.setattr(sys, "stdout", stream)
        monkeypatch.setenv("TERM", "xterm")  # of a dumb one rich takes 80 columns
        monkeypatch.setenv("COLUMNS", "60")
        put_line(new_console(), sentence)
        written = stream.getvalue()
        assert written.split() == sentence.split() and written.count("\n") == lines
        assert lines == 1 or max(map(len, written.splitlines())) <= 60


# recordings of one name


def test_recordings_of_one_name_are_told_apart():
    paths = [Path("x/a/ramp.csv"), Path("y/a/ramp.csv"), Path("y/b/ramp.csv"), Path("y/b/other.csv")]
    assert distinct_names(paths) == ["x/a/ramp.csv", "y/a/ramp.csv", "b/ramp.csv", "other.csv"]
    assert distinct_names([Path("ramp.csv"), Path("b/ramp.csv")]) == ["ramp.csv", "b/ramp.csv"]


def test_their_folders_stand_in_the_valve_file_and_may_stand_in_dp(ramp_file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, *rows = ramp_file.read_text().splitlines()
    for number, folder in enumerate(("one", "two")):
        Path(folder).mkdir()
        cells = [row.split(",") for row in rows]
        bare = [f"{time},{u},{(1 + number) * float(q):.6f}" for time, u, _, q in cells]  # more flow at more pressure
        Path(folder, "ramp.csv").write_text("\n".join(["time_s,u_V,Q_Lmin", *bare]))
    Path("dz.toml").write_text('[dp]\n"one/ramp.csv" = "1 MPa"\n"two/*" = "40 bar"\n')
    assert main(["-q", "identify", "one/ramp.csv", "two/ramp.csv", "--config", "dz.toml", "--json"]) == 0
    tests = json.loads(Path("valve.json").read_text())["sides"]["positive"]["tests"]
    assert [(test["source"], test["dp_MPa"]) for test in tests] == [("one/ramp.csv", 1.0), ("two/ramp.csv", 4.0)]


# the start


HEAVY = ("numpy", "casadi", "sympy", "cvxpy", "matplotlib", "pint", "polars", "rich", "scipy")
SLOW = ("msgspec", "logging", "difflib", "json", "tempfile", "subprocess", "pathlib")


@pytest.mark.parametrize(
    ("words", "heavy"),
    [
        (["--help"], (*HEAVY, *SLOW)),
        (["batch", "--help"], (*HEAVY, "dzdesign.stages.assess", "dzdesign.commands.demo")),
    ],
)
def test_help_imports_little(words, heavy):
    """The cause of a fast start, for a time is no test: these cost more than all of --help."""
    code = (
        "import sys; before = set(sys.modules)\n"
        "import dzdesign.command_line.cli\n"
        f"try: dzdesign.command_line.cli.main({words})\n"
        "except SystemExit: pass\n"
        f"print('LOADED', sorted((set(sys.modules) - before) & set({heavy!r})))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "LOADED []"


@pytest.mark.parametrize("value", ["-10..10V x 0.15 + 1.5 V", "-10..10V", "-.5..0.5V", "-10..10 V"])
def test_a_value_that_begins_with_a_minus_sign_is_one(value):
    for words in (["--command-signal", value], [f"--command-signal={value}"]):
        assert parse(["design", "v.json", *words, "--guard", "mean"]).arguments.command_signal == value
    assert parse(["verify", "f", "--back-pressure", "-1MPa"]).arguments.back_pressure == ["-1MPa"]
    with pytest.raises(InputError, match="--command-signal"):
        parse(["design", "v.json", "--command-signal", "--guard", "mean"])
