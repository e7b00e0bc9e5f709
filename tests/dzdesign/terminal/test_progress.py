"""The bar: on a terminal, after a second, on stderr, and gone afterwards; nothing anywhere else."""

import io
import itertools
import sys

import pytest

from dzdesign.terminal.progress import with_bar


class Terminal(io.StringIO):
    def isatty(self):
        return True


def ticking(step_s):
    ticks = itertools.count()
    return lambda: step_s * next(ticks)


@pytest.mark.parametrize(("terminal", "step_s", "shown"), [(True, 0.6, True), (True, 0.01, False), (False, 0.6, False)])
def test_a_bar_only_for_a_person_who_waits(monkeypatch, terminal, step_s, shown):
    stream = Terminal() if terminal else io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    assert list(with_bar(range(9), "reading ramp tests", ticking(step_s))) == list(range(9))
    assert ("reading ramp tests" in stream.getvalue()) == shown
    assert shown or stream.getvalue() == ""


def test_the_bar_is_gone_when_the_work_fails(monkeypatch):
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm")

    def work():
        for item in with_bar(range(9), "reading", ticking(0.6)):
            if item == 5:
                raise ValueError("broken")

    with pytest.raises(ValueError, match="broken"):
        work()
    assert "\x1b[?25h" in stream.getvalue()  # the cursor is back
