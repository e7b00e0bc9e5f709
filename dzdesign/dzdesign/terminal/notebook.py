"""What `print` and a notebook show of each result: the page that its command prints, under a heading."""

import io
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, cast

from dzdesign.core.errors import one_line
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

#: A page in a notebook; rich has escaped what stands in it.
FRAME = '<pre style="white-space:pre;overflow-x:auto">{code}</pre>'


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


def heading_of(result: object) -> str:
    """Return the one line that stands for a result."""
    return one_line(PAGES[type(result).__name__][0](result))


def text_of(result: object) -> str:
    """Return a result as plain text."""
    return f"{heading_of(result)}\n{_recorded(result).export_text()}".rstrip()


def html_of(result: object) -> str:
    """Return a result as HTML without script, style sheet or network; all text is escaped."""
    return _recorded(result).export_html(inline_styles=True, code_format=FRAME)


def _recorded(result: object) -> "Console":
    from rich.console import Console

    console = Console(record=True, file=io.StringIO(), width=FILE_WIDTH, highlight=False, force_jupyter=False)
    PAGES[type(result).__name__][1](result, console)
    return console
