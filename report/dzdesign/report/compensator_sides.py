"""The sides of a compensator by their names, and which of its valve's warnings still stand beside it."""

from dzdesign.design.compensator import Compensator
from dzdesign.design.side_law import SideLaw
from dzdesign.identify.valve.model import ValveModel, Warning_

SIGNS = {"positive": 1, "negative": -1}
#: Of a valve, what a design for commands of both signs has made untrue: that one side is left out.
OF_ONE_SIGN = "two-sides"


def laws_of(compensator: Compensator | None) -> dict[str, SideLaw]:
    """Return the law of each side that has one."""
    return {name: law for name in SIGNS if compensator and (law := getattr(compensator, name))}


def standing_warnings(valve: ValveModel | None, compensator: Compensator | None) -> tuple[Warning_, ...]:
    """Return the warnings of a valve without what its compensator, made for commands of both signs, has settled."""
    drives_both = len(laws_of(compensator)) == len(SIGNS)
    return tuple(each for each in (valve.warnings if valve else ()) if not (drives_both and each.code == OF_ONE_SIGN))
