"""`dzdesign init` at a terminal: a question for each thing that the recordings can't tell, and nowhere else one."""

import contextlib
import os
import re
import select
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

from dzdesign.command_line.cli import main
from dzdesign.commands import init as command
from dzdesign.terminal.questions import ask
from tests.dzdesign.commands.test_init import columns_of, write

pty = pytest.importorskip("pty", reason="this system has no pseudo-terminals")

ENTER = ""
PROGRAM = (sys.executable, "-c", "import sys; from dzdesign.command_line.cli import main; sys.exit(main())")


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def answering(monkeypatch):
    """Give what a person answers, by words of the question; and the questions that were asked."""
    asked = []

    def answers(**replies):
        monkeypatch.setattr(command, "may_ask", lambda: True)
        waiting = {key: [reply] if isinstance(reply, str) else list(reply) for key, reply in replies.items()}

        def answer(prompt):
            asked.append(prompt)
            found = next((key for key in waiting if key in prompt), None)
            return waiting[found].pop(0) if found is not None else ENTER

        monkeypatch.setattr("builtins.input", answer)
        return asked

    return answers


def recorded(labels, *, name="ramp.csv", stop_V=10.0, scale=1.0, beside=0.0):
    """Write a ramp test whose fourth and fifth columns are the pressures ahead and behind, in bar."""
    time_s, u, dp, q = columns_of(1.0)
    keep = u <= stop_V
    columns = (time_s, scale * u, q, 10 * dp + beside, 0 * dp + beside)[: labels.count(",") + 1]
    write(name, labels, *(column[keep] for column in columns))


def table():
    return tomllib.loads(Path("dzdesign.toml").read_text("utf-8"))


def test_only_what_is_not_known_is_asked(here, answering, capsys):
    """All columns are clear and the ramp ends at full command: the meter alone is asked about."""
    recorded("t_s,u_V,Q_Lmin,dP_bar")
    asked = answering(floor="0.6 L/min", lag="0.1 s +- 20 ms")
    assert main(["init", "ramp.csv"]) == 0
    assert [re.sub(r" by its data sheet.*", "", prompt) for prompt in asked] == ["Meter's floor", "Meter's lag"]
    assert table() == {"u-max": "10 V", "meter-floor": "0.6 L/min", "meter-lag": "0.1 s +- 20 ms"}
    said = capsys.readouterr().out
    assert said.rstrip().endswith("dzdesign identify ramp.csv --config dzdesign.toml")
    assert main(["-q", "identify", "ramp.csv", "--config", "dzdesign.toml"]) == 0


def test_enter_alone_writes_what_init_writes_without_a_terminal(here, answering):
    recorded("t_s,u_V,Q_Lmin,dP_bar")
    assert main(["init", "ramp.csv", "-o", "without.toml"]) == 0
    answering()
    assert main(["init", "ramp.csv"]) == 0
    assert Path("dzdesign.toml").read_bytes() == Path("without.toml").read_bytes()


def test_a_guess_that_is_confirmed_is_none_any_more(here, answering):
    recorded("t_s,u_V,Q_Lmin,Druck [bar]")
    answering()
    assert main(["init", "ramp.csv"]) == 0
    assert table()["columns"] == {"dP": "Druck [bar]"}
    assert "check that it is the drop" not in Path("dzdesign.toml").read_text("utf-8")


def test_which_pressure_is_which(here, answering, capsys):
    recorded("t_s,u_V,Q_Lmin,p1 [bar],p2 [bar]", beside=3.0)
    assert main(["init", "ramp.csv", "-o", "without.toml"]) == 1
    asked = answering(p1="pa", p2="pB")
    assert main(["init", "ramp.csv"]) == 0
    assert sum("Which pressure is" in prompt for prompt in asked) == 2
    assert table()["columns"] == {"pA": "p1 [bar]", "pB": "p2 [bar]"}
    assert "at 10 bar" in capsys.readouterr().out


def test_a_wrong_answer_is_asked_again_and_one_quantity_is_given_once(here, answering, capsys):
    recorded("t_s,u_V,Q_Lmin,p1 [bar],p2 [bar]", beside=3.0)
    asked = answering(p1=["p9", "pA", "pA"], p2=["pA", "pT", "pB"], floor=["0.6", "0.6 L/min"])
    assert main(["init", "ramp.csv"]) == 0
    said = capsys.readouterr().out
    assert "'p9' is none of dP, pP, pA, pB, pT, -" in said and "pA is 'p1 [bar]' already" in said
    # pA and pT make the drop at negative commands, and these are positive ones.
    assert "make the pressure drop of the other side" in said
    assert sum("'p1 [bar]'" in prompt for prompt in asked) == 3
    assert table()["columns"] == {"pA": "p1 [bar]", "pB": "p2 [bar]"} and table()["meter-floor"] == "0.6 L/min"


def test_pressures_without_a_unit_and_a_guess_that_is_wrong(here, answering):
    recorded("t_s,u_V,Q_Lmin,p_1,p_2", beside=3.0)
    which = {"Which pressure is 'p_1'": "pA", "Which pressure is 'p_2'": "pB"}
    answering(**which, **{"unit of": ["furlong", "bar", "bar"]})
    assert main(["init", "ramp.csv"]) == 0
    assert table()["columns"] == {"pA": "p_1:bar", "pB": "p_2:bar"}
    Path("dzdesign.toml").unlink()
    recorded("t_s,u_V,Q_Lmin,Tank [bar]")
    answering(Tank="-", **{"drop of": ["", "10 bar"]})  # a pressure drop must be given then
    assert main(["init", "ramp.csv"]) == 0
    assert table()["dp"] == {"ramp.csv": "10 bar"} and "columns" not in table()


def test_four_ports_name_the_metering_edge(here, answering):
    time_s, u, dp, q = columns_of(1.0)
    p = 10 * dp
    ports = (p + 20, 0 * p + 20, 0 * p + 5, 0 * p + 2)
    write("ramp.csv", "t_s,u_V,Q_Lmin,pP_bar,pA_bar,pB_bar,pT_bar", time_s, u, q, *ports)
    asked = answering()
    assert main(["init", "ramp.csv"]) == 1  # Enter to all leaves it open, after two rounds
    assert sum("Which pressure" in prompt for prompt in asked) == 8
    Path("dzdesign.toml").unlink()
    answering(pT_bar="-")
    assert main(["init", "ramp.csv"]) == 0
    assert set(table()["columns"]) == {"pP", "pA", "pB"}


def test_columns_of_command_and_time_and_full_command(here, answering):
    recorded("X,AO0,Q_Lmin,dP_bar", scale=0.1, stop_V=8.0)
    answering(**{
        "label of time": ["nowhere", "X:s"], "label of the command": ["AO0", "AO0:0..1 = 0..100 %"],
        "Full command": ["ten", "10 V"],
    })  # fmt: skip
    assert main(["init", "ramp.csv"]) == 0
    assert table() == {"u-max": "10 V", "columns": {"time": "X:s", "u": "AO0:0..1 = 0..100 %"}}


def test_pressure_drops_of_files_and_a_smaller_command(here, answering):
    for number in (1, 2):
        recorded("t_s,u_V,Q_Lmin", name=f"r{number}.csv", stop_V=8.0)
    answering(r1="10 bar", r2=["low", "20 bar"], Full=["5 V", "10 V"])
    assert main(["init", "r1.csv", "r2.csv"]) in (0, 1)
    assert table()["dp"] == {"r1.csv": "10 bar", "r2.csv": "20 bar"} and table()["u-max"] == "10 V"


def test_a_file_that_came_while_it_asked_stays(here, monkeypatch, capsys):
    recorded("t_s,u_V,Q_Lmin,dP_bar")
    monkeypatch.setattr(command, "may_ask", lambda: True)
    monkeypatch.setattr("builtins.input", lambda prompt: Path("dzdesign.toml").write_text("mine") and ENTER)
    assert main(["init", "ramp.csv"]) == 2
    assert "init never writes over a file" in capsys.readouterr().err
    assert Path("dzdesign.toml").read_text() == "mine"


def test_an_answer_in_another_encoding_is_asked_again(monkeypatch, capsys):
    replies = iter([UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"), " 10 bar\x07 "])

    def answer(prompt):
        reply = next(replies)
        if isinstance(reply, Exception):
            raise reply
        return reply

    monkeypatch.setattr("builtins.input", answer)
    assert ask("Pressure drop") == "10 bar"
    assert "type it again" in capsys.readouterr().out


# --- with a terminal, and without -----------------------------------------------------------------------------------


def _heed_ctrl_c():
    """Undo what a shell does to a test that runs in its background."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


class Terminal:
    """`dzdesign init` on a pseudo-terminal."""

    def __init__(self, *words, stdout_is_terminal=True):
        self.mine, theirs = pty.openpty()
        self.process = subprocess.Popen(
            [*PROGRAM, *words],
            stdin=theirs, stdout=theirs if stdout_is_terminal else subprocess.PIPE, stderr=subprocess.STDOUT,
            start_new_session=True, preexec_fn=_heed_ctrl_c, env={**os.environ, "TERM": "dumb", "COLUMNS": "200"},
        )  # fmt: skip
        os.close(theirs)
        self.text = ""

    def until(self, words, limit_s=120.0):
        end = time.monotonic() + limit_s
        while words not in self.text:
            assert time.monotonic() < end, self.text
            if select.select([self.mine], [], [], 0.2)[0]:
                try:
                    self.text += os.read(self.mine, 4096).decode("utf-8", "replace")
                except OSError:  # the other end is closed
                    break
        return self.text

    def type(self, text):
        os.write(self.mine, text.encode())

    def interrupt(self):
        """Press Ctrl-C until it is heard: between the prompt and the wait for a line Python may miss one."""
        for _ in range(20):
            time.sleep(1)
            if self.process.poll() is not None:
                return
            self.process.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(timeout=5)

    def end(self):
        if self.process.stdout is None:
            self.until("\0 never")
        else:
            self.process.communicate()
        status = self.process.wait(timeout=60)
        os.close(self.mine)
        return status


@pytest.mark.slow
def test_on_a_terminal_it_asks_and_says_the_next_command(here):
    recorded("t_s,u_V,Q_Lmin,p1 [bar],p2 [bar]", beside=3.0)
    terminal = Terminal("init", "ramp.csv")
    answers = (("'p1 [bar]'?", "pA"), ("'p2 [bar]'?", "pB"), ("Meter's floor", ""), ("Meter's lag", "0.1 s"))
    for question, answer in answers:
        terminal.until(question)
        assert not Path("dzdesign.toml").exists()
        terminal.type(f"{answer}\n")
    assert terminal.end() == 0
    assert "dzdesign identify ramp.csv --config dzdesign.toml" in terminal.text
    assert table()["columns"] == {"pA": "p1 [bar]", "pB": "p2 [bar]"} and table()["meter-lag"] == "0.1 s"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "status", "words"), [("eof", 2, "the input ended before"), ("ctrl-c", 130, "interrupted")]
)
def test_an_end_in_the_questions_leaves_nothing(here, how, status, words):
    recorded("t_s,u_V,Q_Lmin,dP_bar")
    terminal = Terminal("init", "ramp.csv")
    terminal.until("Meter's floor")
    if how == "eof":
        terminal.type("\x04")
    else:
        terminal.interrupt()
    assert terminal.end() == status
    assert words in terminal.text and "nothing" in terminal.text
    assert [path.name for path in here.iterdir()] == ["ramp.csv"]


@pytest.mark.slow
def test_without_a_terminal_for_both_or_with_quiet_or_json_it_never_asks(here):
    recorded("t_s,u_V,Q_Lmin,dP_bar")
    for number, words in enumerate((("-q", "init"), ("init", "--json"))):
        terminal = Terminal(*words, "ramp.csv", "-o", f"{number}.toml")
        assert terminal.end() == 0
        assert "Meter's floor" not in terminal.text and Path(f"{number}.toml").exists()
    terminal = Terminal("init", "ramp.csv", "-o", "piped.toml", stdout_is_terminal=False)
    assert terminal.end() == 0 and Path("piped.toml").exists()
    done = subprocess.run([*PROGRAM, "init", "ramp.csv"], stdin=subprocess.DEVNULL, capture_output=True, check=False)
    assert done.returncode == 0 and Path("dzdesign.toml").exists()
