"""The table of what each way with the valve's hysteresis leaves, as `dzdesign design` prints it."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from dzdesign.terminal.page import new_console, put_line, put_rows

if TYPE_CHECKING:
    from rich.console import Console

    from dzdesign.design.hysteresis_choices import HysteresisChoice

DITHER = (
    "A dither also reduces the hysteresis, but moves the thresholds: record the ramps under it, identify them with "
    "--dithered, and give --dither here."
)
HEADING = "Remaining dead zone and hysteresis in command, worst of all tests (onset: also between tests)"
#: Of the inverse play where it is recommended: the table is of the recorded sweeps.
PLAY = (
    "The width of the inverse play comes from full sweeps, which do not show the hysteresis of small loops. If that is "
    "smaller, small loops are over-compensated by up to the play's width; try them on the machine."
)


def print_choices(
    choices: "Sequence[HysteresisChoice]", *, dithered: bool = False, console: "Console | None" = None
) -> None:
    """Print the choices, nothing where there are none; the recommended one is marked.

    Of a valve that was not recorded under a dither it is said what one would need.
    """
    if not choices:
        return
    console = console or new_console()

    def share(value: float | None) -> str:
        return "-" if value is None else f"{value:.2%}"

    columns: dict[str, Callable[[HysteresisChoice], str]] = {
        "choice": lambda each: each.given + (" (recommended)" if each.recommended else ""),
        "dead zone on opening, onset": lambda each: share(each.onset),
        "at the reading flow": lambda each: share(each.reading),
        "hysteresis, mean": lambda each: share(each.hysteresis),
        "largest": lambda each: share(each.largest),
    }
    put_rows(console, HEADING, choices, columns)
    for each in choices:
        if each.refused:
            put_line(console, f"{each.given}: {each.refused}")
    if any(each.recommended and "play" in each.given for each in choices):
        put_line(console, PLAY)
    if not dithered:
        put_line(console, DITHER)
