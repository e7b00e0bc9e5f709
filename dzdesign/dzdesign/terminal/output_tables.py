"""What `dzdesign report` prints of the outputs that were made of one compensator."""

from typing import TYPE_CHECKING

from dzdesign.terminal.page import new_console, put_line, put_rows

if TYPE_CHECKING:
    from rich.console import Console

    from dzdesign.report.artefacts import MadeOutputs

#: Digits of a hash that tell two outputs apart.
SHORT = 12


def print_outputs(made: "MadeOutputs", console: "Console | None" = None) -> None:
    """Print a row for each output, and a line for each that was not listed; nothing of a folder without any."""
    console = console or new_console()
    if made.listed:
        put_rows(
            console,
            "Outputs of this compensator",
            made.listed,
            {
                "output": lambda each: each.kind,
                "settings": lambda each: each.settings or "-",
                "folder": lambda each: each.place,
                "SHA-256": lambda each: each.sha256[:SHORT],
                "check": lambda each: each.verdict,
                "inputs": lambda each: str(each.inputs or "-"),
            },
            words=(0, 1, 2, 4),
        )
    for line in made.others:
        put_line(console, f"other: {line}")
