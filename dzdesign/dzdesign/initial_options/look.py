"""What a look at recordings found, and the file of options that it proposes."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dzdesign.identify.first_look import SideOverview
    from dzdesign.identify.reading.guessed_columns import GuessedColumns


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """What was seen of all recordings; the maps are empty where the files need none."""

    paths: "list[Path]"
    guesses: "list[GuessedColumns]"
    #: Of the tables [columns] and [dp] to write.
    columns: dict[str, str]
    dp: dict[str, str]
    #: Full command to declare and the largest seen, V.
    u_max: float = 10.0
    u_seen: float | None = None
    #: Whether the command is, so that full command can't be seen.
    in_per_cent: bool = False
    #: As `look_at_sides` gives them.
    sides: "dict[str, SideOverview]"
    refused: dict[str, str]
    #: What was seen and is not used, or comes from elsewhere than a column.
    notes: tuple[str, ...] = ()
    skip_rows: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """What a look at recordings proposes.

    Attributes
    ----------
    text : str
        Of the file of options.
    seen : tuple of str
        What was seen, for a person.
    opens : tuple of str
        What is open: without it `identify` can't run.
    look : Look
        What was seen.
    """

    text: str
    seen: tuple[str, ...]
    opens: tuple[str, ...]
    look: Look
