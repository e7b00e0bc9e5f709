"""What a firmware can be tried for, and which of it an evidence has: a reader sees what is missing too.

The names are those of the checks; a check of a name that is not here stands in the evidence all the same.
"""

from dataclasses import dataclass
from typing import Any

VALVE = "the valve is the one that compensator.json was made from"
COMPILES = "your board files compile"
#: The generator itself is asked by the command, not by this room.
REGENERATED = "the files are those that codegen makes of compensator.json"
#: Of a board file that its user filled in: nothing that was generated is there to compare it with.
REVIEW = "review it, and try it on the machine"
#: How to have tried what `verify` could not try. Of a valve.json that is not written as `identify` writes it, the hash
#: is known from the file alone.
HOW = {
    VALVE: "`verify` with the valve.json that compensator.json names by its SHA-256 beside the firmware",
}
#: What every `verify` tries.
ALWAYS = (
    "files as generated",
    "the manifest says what is in the firmware",
    "compiles without a warning",
    "every compiler sees the same core",
    "equals the exactly rounded law",
    "within range, monotone",
    "no over-compensation on the tested interval",
    "depends on the pressures by their difference only",
    "codes outside their signal's valid range fall back",
    "the drive follows its model",
    "the core keeps no state between calls",
    "the plant of the closed loop opens",
    "the plant opens where the identified valve does",
    "no flow at zero command in the closed loop",
    "no flow at zero command after any scenario",
    "the certificate follows from the valve",
    "the law follows from the valve and the options",
    VALVE,
    REGENERATED,
)
#: What is tried if it is asked for: how its checks' names begin, what it is, the option.
ASKED_FOR = (
    ("machine code of the ", "machine code of other processors, in simulators", "--machine-code"),
    ("no undefined behaviour with an int of 16 bits", "no undefined behaviour with an int of 16 bits", "--proof"),
    ("wrong C is caught", "wrong C is caught, a fault at every place", "--mutate"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Required:
    """One thing to try.

    Attributes
    ----------
    name : str
        What.
    done : bool
        Whether it was tried.
    holds : bool or None
        As found; None where it was not tried or could not be checked.
    how : str
        What to do to have it tried; a command stands in backticks.
    """

    name: str
    done: bool
    holds: bool | None
    how: str


def required_of(evidence: dict[str, Any]) -> tuple[Required, ...]:
    """Return everything that can be tried, with what the evidence says of it.

    Parameters
    ----------
    evidence : dict
        verification.json.
    """
    checks = evidence["checks"]
    found = [_part(f"{name}, which is yours and was changed", False, REVIEW) for name in evidence.get("yours", ())]
    found += [_part(f"{name}, which is yours", False, REVIEW) for name in evidence.get("own", ())]
    if evidence.get("board_untried"):
        found.append(_part(COMPILES, False, evidence["board_untried"]))
    found += [_tried(checks, name, name, HOW.get(name, "`verify`")) for name in ALWAYS]
    own = bool(evidence["closed_loop"].get("plant"))
    found.append(_part("closed loop with a plant of the machine's own", own, "`verify --plant`"))
    found.append(_part("load steps and frozen sensors in the closed loop", own, "`verify --plant`"))
    series = bool(evidence["monte_carlo"])
    found.append(_part("a series of plants, with tolerances", series, "`verify --tolerances`"))
    found += [_tried(checks, begins, name, f"`verify {option}`") for begins, name, option in ASKED_FOR]
    if evidence.get("target") in (None, "f28335"):
        name = "compiles against C2000Ware"
        found.append(_tried(checks, name, f"{name}, TI's headers", "`verify --c2000ware`"))
    return tuple(found)


def untried_of(evidence: dict[str, Any]) -> tuple[str, ...]:
    """Return what was not tried, each with the command that would.

    Parameters
    ----------
    evidence : dict
        verification.json.
    """
    return tuple(f"{each.name}: {each.how}" for each in required_of(evidence) if not each.done)


def _tried(checks: list[dict[str, Any]], begins: str, name: str, how: str) -> Required:
    """Return a requirement by the checks whose names begin so, of both signs of command."""
    said = [check["holds"] for check in checks if _plain(check["name"]).startswith(begins)]
    holds = False if False in said else None if None in said or not said else True
    return Required(name=name, done=bool(said), holds=holds, how=how)


def _part(name: str, done: bool, how: str) -> Required:
    return Required(name=name, done=done, holds=True if done else None, how=how)


def _plain(name: str) -> str:
    """Return a check's name without the sign of command that it is of."""
    return name.removeprefix("positive commands: ").removeprefix("negative commands: ")
