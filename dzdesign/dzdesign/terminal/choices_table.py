"""The table of what each way with the valve's hysteresis leaves, as `dzdesign design` prints it."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from dzdesign.terminal.page import new_console, put_line, put_rows

if TYPE_CHECKING:
    from rich.console import Console

    from dzdesign.design.redesign import HysteresisChoice

DITHER = (
    "Dither also reduces the hysteresis, but it shifts the thresholds. If the amplifier uses dither, record the ramps "
    "with it, and use identify --dithered and design --dither."
)
HEADING = (
    "Remaining dead zone and hysteresis in % of full command. To the knee: largest over the whole tested range. To a "
    "flow: largest at the tests. Hysteresis: mean and largest of the tests"
)
#: Of the inverse play where it is recommended: the table is of the recorded sweeps.
PLAY = (
    "The play (backlash inverse) subtracts the hysteresis measured on full sweeps. In small command cycles the "
    "hysteresis may be smaller. The play may then subtract too much, up to its full width. Try small cycles on the "
    "machine."
)


def print_choices(
    choices: "Sequence[HysteresisChoice]", read_at: str, *, dithered: bool = False, console: "Console | None" = None
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
        "opening dead zone, to knee": lambda each: share(each.onset),
        f"opening dead zone, to {read_at}": lambda each: share(each.reading),
        "hysteresis, mean": lambda each: share(each.hysteresis),
        "hysteresis, largest": lambda each: share(each.largest),
    }
    put_rows(console, HEADING, choices, columns)
    for each in choices:
        if each.refused:
            put_line(console, f"{each.given}: {each.refused}")
    if any(each.recommended and "play" in each.given for each in choices):
        put_line(console, PLAY)
    if not dithered:
        put_line(console, DITHER)
