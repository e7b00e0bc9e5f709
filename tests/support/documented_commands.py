"""Runs the commands that a page shows, and compares what they print with what the page says they print.

A fenced block ``console`` holds commands, each after ``$ `` (continued after a backslash), and their output. It is
run by bash in the page's folder, all of a page in order. Shown is standard output; progress goes to standard error
and is left out, but for an exit status of 2 the error's line is shown. A command that does not end with 0 says so in
a comment: ``# exit status 1``. A block ``c`` below a paragraph that begins with a file's name in backticks is that
file: it is written into the folder before any command runs. In the output a line ``...`` stands for any lines, and
``…`` for any part of one line (a hash, a list of compilers); blanks at the end of a line do not count. Nothing else is
normalised: what a page shows has no times and no folders of this machine.
"""

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

BLOCK = re.compile(r"^```console\n(.*?)^```$", re.DOTALL | re.MULTILINE)
FILE = re.compile(r"^`([\w.]+\.[ch])` (?:(?!\n\n).)*\n\n```c\n(.*?)^```$", re.DOTALL | re.MULTILINE)
STATUS = re.compile(r"#\s*exit status (\d+)\s*$")


@dataclass(frozen=True)
class Command:
    """One command of a page: its text as shown, its output as shown, and the exit status that the page states."""

    shown: str
    output: str
    status: int

    @property
    def script(self) -> str:
        """What bash runs."""
        return re.sub(r"^> ", "", self.shown.removeprefix("$ "), flags=re.MULTILINE)


def commands_of(text: str) -> list[Command]:
    """Return the commands of a page, in order."""
    return [command for block in BLOCK.findall(text) for command in _commands(block)]


def _commands(block: str) -> list[Command]:
    found: list[Command] = []
    lines = block.splitlines()
    while lines:
        first = lines.pop(0)
        if not first.startswith("$ "):
            raise ValueError(f"a console block starts with '{first}', expected '$ ' and a command")
        shown = [first]
        while shown[-1].endswith("\\"):
            shown.append(lines.pop(0))
        output = []
        while lines and not lines[0].startswith("$ "):
            output.append(lines.pop(0))
        status = STATUS.search(shown[-1])
        text = "\n".join(output).strip("\n")
        found.append(Command(shown="\n".join(shown), output=text, status=int(status[1]) if status else 0))
    return found


def run(command: Command, folder: Path) -> tuple[int, str]:
    """Run a command as its page says; return the exit status and what a page shows of its output."""
    scripts = Path(sys.executable).parent  # `dzdesign` is beside the Python that runs the tests
    environment = {**os.environ, "PATH": f"{scripts}{os.pathsep}{os.environ['PATH']}", "COLUMNS": "200"}
    environment |= {"OPENBLAS_NUM_THREADS": "1", "PYTHONIOENCODING": "utf-8"}
    done = subprocess.run(
        ["bash", "-c", command.script], cwd=folder, capture_output=True, text=True, check=False, env=environment,
        encoding="utf-8", timeout=600,
    )  # fmt: skip
    lines = done.stdout.splitlines()
    if done.returncode == 2:
        lines += done.stderr.splitlines()[-1:]
    return done.returncode, "\n".join(line.rstrip() for line in lines).strip("\n")


def agrees(shown: str, printed: str) -> bool:
    """Return whether the output that a page shows is what was printed; ``...`` alone on a line is any lines."""
    lines = [line.rstrip() for line in shown.splitlines()]
    pattern = "".join(r"(?:.*\n)*?" if line == "..." else re.escape(f"{line}\n").replace("…", ".*") for line in lines)
    return re.fullmatch(pattern, f"{printed}\n" if printed else "") is not None


def leaves_out(shown: str) -> bool:
    """Return whether an output stands for more than it shows."""
    return "…" in shown or "..." in shown.splitlines()


def with_outputs(text: str, outputs: dict[str, str]) -> str:
    """Return a page whose commands show these outputs; an output that leaves something out stays as it is."""

    def block(found: re.Match) -> str:
        lines = []
        for command in _commands(found[1]):
            known = outputs.get(command.shown, command.output)
            lines.append(command.shown)
            lines.append(command.output if leaves_out(command.output) else known)
        return "```console\n" + "\n".join(line for line in lines if line) + "\n```"

    return BLOCK.sub(block, text)


def try_page(page: Path, folder: Path, update: bool) -> list[str]:
    """Run a page's commands in a folder; return what differs. With `update` the page is written anew instead."""
    text = page.read_text(encoding="utf-8")
    wrong: list[str] = []
    outputs: dict[str, str] = {}
    for name, content in FILE.findall(text):
        (folder / name).write_text(content, encoding="utf-8")
    for command in commands_of(text):
        status, printed = run(command, folder)
        outputs[command.shown] = printed
        if status != command.status:
            wrong.append(f"{command.shown}\nexit status {status}, the page says {command.status}\n{printed}")
        elif not agrees(command.output, printed) and not (update and not leaves_out(command.output)):
            wrong.append(f"{command.shown}\nthe page shows\n{command.output}\nprinted was\n{printed}")
    if update:
        page.write_text(with_outputs(text, outputs), encoding="utf-8")
    return wrong
