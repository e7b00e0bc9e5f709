"""The bar: on a terminal, on stderr, and gone afterwards; nothing anywhere else."""

import io
import sys
import time

import pytest

from dzdesign.terminal import progress
from dzdesign.terminal.progress import with_bar


class Terminal(io.StringIO):
    def isatty(self):
        return True


def until_seen(stream, text):
    until = time.monotonic() + 5
    while text not in stream.getvalue() and time.monotonic() < until:
        time.sleep(0.005)


@pytest.mark.parametrize(
    ("terminal", "quiet", "seen"), [(True, False, True), (True, True, False), (False, False, False)]
)
def test_a_bar_only_for_a_person_who_watches(monkeypatch, terminal, quiet, seen):
    stream = Terminal() if terminal else io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress._Verbosity, "quiet", quiet)
    monkeypatch.setenv("TERM", "xterm")
    items = []
    for item in with_bar(range(9), "reading ramp tests"):
        items.append(item)
        if seen:
            until_seen(stream, "reading ramp tests")
    assert items == list(range(9))
    assert ("reading ramp tests" in stream.getvalue()) == seen
    assert seen or stream.getvalue() == ""


def test_the_bar_is_gone_when_the_work_fails(monkeypatch):
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm")

    def work():
        for item in with_bar(range(9), "reading"):
            until_seen(stream, "reading")
            if item == 5:
                raise ValueError("broken")

    with pytest.raises(ValueError, match="broken"):
        work()
    assert "\x1b[?25h" in stream.getvalue()  # the cursor is back
