"""Designs from the words of an engineer, as `dzdesign design` takes them."""

from dzdesign.codegen.project import target_named
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions, options_of
from dzdesign.identify.valve.model import ValveModel

BOTH_SIGNS = "-10..10 V x 0.15 + 1.5 V"
#: Three ways to declare a machine.
CURRENT = {
    "drive": "current",
    "coil": "3.5 ohm 40 mH",
    "rated_current": "1 A",
    "supply": "18..32 V",
    "current_signal": "0..1.2 A on 2 ohm + 0.15 V",
}
MACHINES = {
    "duty": {"coil_temperature": "-20..80 degC", "supply": "18..32 V"},
    "amplifier": {"amplifier": "1 %"},
    "current": CURRENT,
}


def options(target: str = "f28335", **texts: str) -> DesignOptions:
    """Return the options that texts are for a target."""
    return options_of(texts, target_named(target).inputs())


def designed(valve: ValveModel, target: str = "f28335", **texts: str) -> Compensator:
    """Design a valve's compensator."""
    return design(valve, options(target, **texts))
