"""`StatedOptions`: what `identify` was asked for, as written; part of valve.json, so that it can be asked again."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from msgspec import Meta

#: Of texts of an option, and of names of files in a table or a list.
LONGEST = 4096
Name = Annotated[str, Meta(min_length=1, max_length=LONGEST)]
Words = Annotated[str, Meta(max_length=LONGEST)]


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedOptions:
    """Options of `identify` as entered, defaults included; an option without a value is omitted."""

    texts: Annotated[Mapping[Name, Words], Meta(description="Options with one text value, such as meter_lag.")] = field(
        default_factory=dict
    )
    tables: Mapping[Name, Mapping[Name, Words]] = field(default_factory=dict)
    """Options given as a table, such as columns, or dp by the recording's name."""
    lists: Mapping[Name, tuple[Words, ...]] = field(default_factory=dict)
    """Options with several text values. The list of `order` holds the recordings in the order in which they were
    taken."""
