"""The sides of a compensator by their names."""

from dzdesign.design.compensator import Compensator, SideLaw

SIGNS = {"positive": 1, "negative": -1}


def laws_of(compensator: Compensator | None) -> dict[str, SideLaw]:
    """Return the law of each side that has one."""
    both = {"positive": compensator.positive, "negative": compensator.negative} if compensator else {}
    return {name: law for name, law in both.items() if law is not None}
