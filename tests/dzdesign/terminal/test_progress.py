"""The bar is gone when its work has ended; for whom it is shown is in tests/dzdesign/command_line."""

import io
import sys
import time

import pytest

from dzdesign.terminal.progress import with_bar


class Terminal(io.StringIO):
    def isatty(self):
        return True


def until_seen(stream, text):
    until = time.monotonic() + 5
    while text not in stream.getvalue() and time.monotonic() < until:
        time.sleep(0.005)


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
