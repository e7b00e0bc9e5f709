"""Both sides of a compensator by their names, and the valve it holds."""

from dzdesign.design.compensator import Compensator, SideLaw
from dzdesign.verify.exhaustive.exact_law import ExactLaw

SIGNS = {"positive": 1, "negative": -1}


def laws_of(compensator: Compensator | None) -> dict[str, SideLaw]:
    """Return the law of each side that has one."""
    both = {"positive": compensator.positive, "negative": compensator.negative} if compensator else {}
    return {name: law for name, law in both.items() if law is not None}


def exact_law_of(compensator: Compensator, sign: int) -> ExactLaw:
    """Return the exact law of one sign of command."""
    return ExactLaw(compensator, sign)


def code_MPa(compensator: Compensator) -> float:
    """Return the pressure drop of one code, MPa."""
    sensor = compensator.signals.pressure_a
    return float(sensor.span_MPa) / (sensor.full_code - sensor.zero_code)
