"""Questions to a person at a terminal: one line each, asked again until the answer can be read."""

import signal
import sys
from collections.abc import Callable

from dzdesign.core.errors import InputError, clear_line, one_line
from dzdesign.terminal.progress import is_quiet


def may_ask() -> bool:
    """Tell whether a person reads and types: stdin and stdout are a terminal, and --quiet was not given."""
    streams = (sys.stdin, sys.stdout)
    return not is_quiet() and all(stream is not None and stream.isatty() for stream in streams)


def ask(question: str, default: str = "", check: Callable[[str], object] | None = None) -> str:
    """Return the answer to a question, or its default where only Enter was typed.

    `check` refuses an answer by an `InputError`, whose sentence is printed before the question is asked again. The
    default is not checked.

    Raises
    ------
    InputError
        If the input ends, as by Ctrl-D.
    """
    prompt = one_line(f"{question} [{default}]: " if default else f"{question}: ")
    # polars sets a handler of its own, under which a wait for a line goes on after Ctrl-C; Python's ends it.
    signal.signal(signal.SIGINT, signal.getsignal(signal.SIGINT))
    while True:
        try:
            answer = clear_line(input(prompt)).strip()
        except EOFError as error:
            print()
            raise InputError(
                "the input ended before the last question; nothing was written. With --quiet init asks nothing and "
                "leaves open what it does not know"
            ) from error
        except UnicodeError:  # letters of another encoding
            print("  the answer has letters that the terminal's encoding does not know; type it again")
            continue
        if not answer:
            return default
        try:
            if check is not None:
                check(answer)
        except InputError as error:
            print(f"  {one_line(str(error))}")
        else:
            return answer
