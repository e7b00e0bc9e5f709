"""Which pressure input is the one ahead at negative commands: as the recordings show it, or as the engineer declares.

The firmware has two pressure inputs, and their wires stay where they are. At positive commands A minus B is the
pressure drop. At negative ones the same two sensors give A minus B or B minus A, and no other drop.
"""

from dataclasses import replace
from typing import Literal

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.options import DesignOptions
from dzdesign.identify.reading.metering_edge import TWO_SENSORS
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.recorded_drop import RecordedDrop

#: What recordings of both sides say: the drop of negative commands is A minus B, B minus A, that of other ports than
#: the two of positive commands, or nothing. A dP that is above zero on both sides may be a magnitude.
Shown = Literal["same", "swapped", "other ports", "nothing"]
IN_WORDS = {"same": "A minus B", "swapped": "B minus A"}


def shown_direction(valve: ValveModel) -> Shown:
    """Return what the recordings show of the pressure drop at negative commands."""
    positive, negative = (valve.sides[name].recorded_drop for name in ("positive", "negative"))
    if positive is None or negative is None:
        return "nothing"
    ways = positive.ways | negative.ways
    if ways <= {("dP",), TWO_SENSORS}:
        if negative.sign < 0:
            return "swapped"
        return "nothing" if ("dP",) in ways else "same"
    # A drop that some recordings hold as such may be of any ports.
    return "nothing" if ("dP",) in ways else "other ports"


def with_negative_drop(valve: ValveModel, options: DesignOptions) -> DesignOptions:
    """Return the options with the direction of the pressure drop at negative commands; refuse one that is not recorded.

    Raises
    ------
    InputError
        If no wiring of two pressure inputs gives the recorded drops, or the recordings contradict what is declared.
    """
    signals, shown = options.signals, shown_direction(valve)
    declared = options.negative_dp or ("swapped" if signals.swapped else "same")
    if declared == "wired":
        return replace(options, signals=replace(signals, swapped=False))
    positive, negative = (_recorded(valve, name) for name in ("positive", "negative"))
    if shown == "other ports":
        raise InputError(
            f"the pressure drop was recorded as {positive} at positive commands and as {negative} at negative ones. "
            "No fixed wiring of the firmware's two pressure inputs gives both, and three are not supported. Design one "
            "side alone, by a --command-signal of one sign, or give --negative-dp wired if the machine switches the "
            "inputs"
        )
    if declared == "recorded":
        return replace(options, signals=replace(signals, swapped=shown == "swapped"))
    if shown not in (declared, "nothing"):
        raise InputError(
            f"--negative-dp {declared} is {IN_WORDS[declared]}, but the recordings have {negative} at negative "
            f"commands, which is {IN_WORDS[shown]}; leave it out, or give --negative-dp wired if the machine switches "
            "the inputs"
        )
    return replace(options, signals=replace(signals, swapped=declared == "swapped"))


def wiring_in_words(compensator: Compensator) -> list[str]:
    """Say which recorded columns the pressure inputs are, and how the drop of negative commands comes of them."""
    lines = []
    if names := input_columns(compensator):
        lines.append(f"pressure inputs: A = {names[0]}, B = {names[1]}, as recorded at positive commands")
    return lines + ([negative_drop_in_words(compensator)] if compensator.negative else [])


def negative_drop_in_words(compensator: Compensator) -> str:
    """Say how the pressure drop of negative commands comes of the inputs, and why; nothing for one sign."""
    if compensator.negative is None:
        return ""
    drop = IN_WORDS["swapped" if compensator.signals.swapped else "same"]
    recorded = _recorded(compensator.valve, "negative")
    return f"negative commands: the pressure drop is {drop}{_reason(compensator, recorded)}"


def input_columns(compensator: Compensator) -> tuple[str, str] | None:
    """Return the recorded columns that pressure inputs A and B stand for; None where no two columns were recorded."""
    drop = compensator.valve.sides["positive"].recorded_drop
    if drop is None or len(drop.ways) != 1 or len(drop.columns[0].labels) != 2:
        return None
    of_each = zip(*(each.labels for each in drop.columns), strict=True)
    ahead, behind = (" or ".join(dict.fromkeys(labels)) for labels in of_each)
    return ahead, behind


def is_wired(compensator: Compensator) -> bool:
    """Tell whether the machine is declared to switch the pressure inputs."""
    return (compensator.options or {}).get("negative_dp") == "wired"


def _reason(compensator: Compensator, recorded: str) -> str:
    """Say what the direction rests on."""
    if is_wired(compensator):
        return f", which the machine must switch to the inputs (--negative-dp wired; recorded as {recorded})"
    if shown_direction(compensator.valve) == "nothing":
        return f" by assumption: the recordings ({recorded}) do not show which sensor is ahead; see --negative-dp"
    return f", as recorded ({recorded})"


def _recorded(valve: ValveModel, side: str) -> str:
    drop: RecordedDrop | None = valve.sides[side].recorded_drop
    return drop.in_words() if drop else "declared or unknown"
