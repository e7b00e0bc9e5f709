"""What `print` and a notebook show of each result: the page that its command prints, under a heading.

A notebook has the one screen of it as tables of their own widths, and the page of ``-v`` folded below.
"""

import io
from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any, cast

from dzdesign.core.errors import one_line
from dzdesign.terminal import brief
from dzdesign.terminal.design_tables import print_compensator
from dzdesign.terminal.evidence_tables import print_output_verification, print_verification
from dzdesign.terminal.output_tables import print_output
from dzdesign.terminal.page import FILE_WIDTH, put_line
from dzdesign.terminal.tables import print_firmware, print_valve

if TYPE_CHECKING:
    from rich.console import Console

    from dzdesign.codegen.other_targets import Output
    from dzdesign.codegen.project import Firmware
    from dzdesign.design.compensator import Compensator
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.terminal.page import Table

def _valve_heading(valve: "ValveModel") -> str:
    count, sides = len(valve.made_from), " and ".join(valve.sides)
    side = f"{sides} side{'s' * (len(valve.sides) > 1)}"
    full = valve.recorded_units.text(valve.u_max_V, "g V")
    return f"Valve of {full}, {side}, from {count} recording{'s' * (count != 1)}"


def _compensator_heading(compensator: "Compensator") -> str:
    target = f" for {compensator.target.name}" if compensator.target else ""
    full = compensator.valve.recorded_units.text(float(compensator.u_max_V), "g V")
    return f"Compensator{target}, law {compensator.law}, of a valve of {full}"


def _print_made(made: "Firmware | Output", console: "Console") -> None:
    """Print the files, and the note that the command line has on standard error."""
    if type(made).__name__ == "Firmware":
        print_firmware(cast("Firmware", made), console)
    else:
        print_output(cast("Output", made), console)
    if made.note:
        put_line(console, made.note)


#: Class of a result -> its heading, and what prints it.
PAGES: Mapping[str, tuple[Callable[[Any], str], Callable[[Any, "Console"], None]]] = {
    "ValveModel": (_valve_heading, print_valve),
    "Compensator": (_compensator_heading, print_compensator),
    "Firmware": (
        lambda made: f"Firmware for {made.manifest.target}, law {made.manifest.law}, {len(made.files)} files",
        _print_made,
    ),
    "Output": (
        lambda made: f"Output for {made.manifest.target}, law {made.manifest.law}, {len(made.files)} files",
        _print_made,
    ),
    "Verification": (lambda verification: f"Verification: {verification.verdict}", print_verification),
    "OutputVerification": (lambda verification: f"Verification: {verification.verdict}", print_output_verification),
}

#: Class of a result -> what puts its one screen on a page.
SCREENS: Mapping[str, Callable[[Any, "Console"], None]] = {
    "ValveModel": brief.put_valve, "Compensator": brief.put_design, "Verification": brief.put_result,
}  # fmt: skip


def heading_of(result: object) -> str:
    """Return the one line that stands for a result."""
    return one_line(PAGES[type(result).__name__][0](result))


def text_of(result: object) -> str:
    """Return a result as plain text."""
    return f"{heading_of(result)}\n{_recorded(result).export_text()}".rstrip()


def html_of(result: object) -> str:
    """Return a result as HTML without script, style sheet or network; all text is escaped."""
    name, page, whole = type(result).__name__, HtmlPage(), HtmlPage()
    PAGES[name][1](result, cast("Console", whole))
    if name not in SCREENS:
        return f"<b>{escape(heading_of(result))}</b>{whole.html}"
    SCREENS[name](result, cast("Console", page))
    return f"<b>{escape(heading_of(result))}</b>{page.html}<details><summary>All of it</summary>{whole.html}</details>"


class HtmlPage:
    """What stands in for a console: lines and tables are put on it in turn."""

    is_terminal = False

    def __init__(self) -> None:
        self.html = ""

    def print(self, item: "Table | str", **_how: object) -> None:
        """Put a line, or a table with its words at the left and its numbers at the right."""
        if isinstance(item, str):
            self.html += f"<div>{escape(item)}</div>"
            return
        rows = [_row("th", item.headers, item.words), *(_row("td", cells, item.words) for cells in item.rows)]
        title = f'<caption style="text-align:left;white-space:nowrap">{escape(item.title)}</caption>'
        self.html += f"<table>{title}{''.join(rows)}</table>"


def _row(kind: str, cells: Sequence[str], words: Sequence[int]) -> str:
    left = ' style="text-align:left"'
    parts = (f"<{kind}{left * (at in words)}>{escape(cell)}</{kind}>" for at, cell in enumerate(cells))
    return f'<tr style="text-align:right">{"".join(parts)}</tr>'


def _recorded(result: object) -> "Console":
    from rich.console import Console

    console = Console(record=True, file=io.StringIO(), width=FILE_WIDTH, highlight=False, force_jupyter=False)
    PAGES[type(result).__name__][1](result, console)
    return console
