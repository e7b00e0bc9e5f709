"""The catalogue of warnings, `warnings.toml`: what is printed of each code, what it means and what to do about it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Literal, Protocol, TypeVar

import msgspec

from dzdesign.core.recorded_units import worded
from dzdesign.identify.valve.model import Warning_


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """What the catalogue says of one code.

    Attributes
    ----------
    about : str
        Chapter of the documentation.
    text : str or dict
        What is printed, with places for the numbers: of the code, or of each case.
    meaning, remedy : str
        For the documentation, in Markdown.
    """

    about: Literal["the recordings", "the flow meter", "the pressure"]
    text: str | dict[str, str]
    meaning: str
    remedy: str


@cache
def catalogue() -> dict[str, Entry]:
    """Return code -> entry, the most serious first."""
    return msgspec.toml.decode(files(__package__).joinpath("warnings.toml").read_bytes(), type=dict[str, Entry])


def warn(code: str, source: str | None = None, case: str = "", **numbers: object) -> Warning_:
    """Return a warning of the catalogue, in the units of `shown_in`.

    A code that has several texts names one by `case`; `numbers` are what stands in it. No source: it is about all
    recordings.
    """
    text = catalogue()[code].text
    text = text if isinstance(text, str) else text[case]
    return Warning_(code=code, text=worded(" ".join(text.split()), **numbers), source=source)


class _Coded(Protocol):
    @property
    def code(self) -> str: ...


AnyWarning = TypeVar("AnyWarning", bound=_Coded)


def most_serious_first(warnings: Sequence[AnyWarning]) -> tuple[AnyWarning, ...]:
    """Return warnings in the order of the catalogue; those of one code stay as they stand."""
    rank = {code: place for place, code in enumerate(catalogue())}
    return tuple(sorted(warnings, key=lambda warning: rank.get(warning.code, len(rank))))
