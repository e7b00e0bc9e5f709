"""The sides of a compensator by their names."""

from dzdesign.design.compensator import Compensator
from dzdesign.design.side_law import SideLaw

SIGNS = {"positive": 1, "negative": -1}


def laws_of(compensator: Compensator | None) -> dict[str, SideLaw]:
    """Return the law of each side that has one."""
    return {name: law for name in SIGNS if compensator and (law := getattr(compensator, name))}
