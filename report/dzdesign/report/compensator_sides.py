"""Both sides of a compensator by their names, and the valve it holds."""

from dzdesign.design.compensator import Compensator, SideLaw
from dzdesign.design.compensator_file import compensator_document
from dzdesign.identify.valve.model import ValveModel

SIGNS = {"positive": 1, "negative": -1}


def laws_of(compensator: Compensator | None) -> dict[str, SideLaw]:
    """Return the law of each side that has one."""
    both = {"positive": compensator.positive, "negative": compensator.negative} if compensator else {}
    return {name: law for name, law in both.items() if law is not None}


def valve_in(compensator: Compensator) -> ValveModel:
    """Return the valve that it was designed from."""
    return read_artefact(compensator.valve_document.encode(), ValveModel, "compensator.json: valve")


def lot_sha256(compensator: Compensator) -> str:
    """Return the hash of the valves of a lot setting."""
    return str(compensator_document(compensator)["lot_sha256"])
