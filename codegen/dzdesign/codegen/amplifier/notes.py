"""What a user must know of a fixed setting beside its numbers, a sentence each."""

from dzdesign.codegen.amplifier.files import WITHOUT_COMMENTS
from dzdesign.codegen.amplifier.setting import AmplifierSetting
from dzdesign.design.compensator import Compensator
from dzdesign.design.fixed_offset import zero_band
from dzdesign.design.signals import SIDE_NAMES

#: Where the threshold is lower than at any test, by its trend.
LOWER: dict[str | None, str] = {
    "decreasing": "above {high}, where the threshold is lower, nothing is certified: flow at zero command is possible",
    "increasing": "below {low}, where the threshold is lower, nothing is certified: flow at zero command is possible",
}
#: Of a threshold without a trend; and of one that was tested at one pressure drop.
EITHER = "below {low} and above {high} nothing is certified"
OTHER = "at another pressure drop than {low} nothing is certified"


def notes_of(
    setting: AmplifierSetting, compensator: Compensator, *, beside_compensator: bool = False
) -> tuple[str, ...]:
    """Return what the setting does not hold for, what the device's sources leave open, and what is still to be done.

    A file `beside_compensator` lies in a folder with what it was made from.
    """
    device, units = setting.device, compensator.valve.recorded_units
    notes = []
    for sign, offset in setting.offsets.items():
        low, high = (units.text(float(end), ".2f MPa") for end in offset.dp_MPa)
        trend = compensator.valve.sides[SIDE_NAMES[sign]].trend
        outside = LOWER.get(trend, EITHER if offset.dp_MPa[0] < offset.dp_MPa[1] else OTHER)
        side = "" if len(setting.offsets) == 1 else f"{SIDE_NAMES[sign]} side: "
        notes.append(side + outside.format(low=low, high=high))
    if compensator.negative is None and "negative" in compensator.valve.sides:
        notes.append("the valve's negative side is left out: the design's command has one sign")
    if compensator.valve.simulated:
        notes.append("the recordings are simulated: an example, not for a machine")
    notes += _of_zero_command(setting, compensator)
    notes += _of_the_machine(compensator)
    if compensator.lot:
        count = len(compensator.lot)
        notes.append(f"lot setting: under the bounds of each of {count} valves; the table is of one of them")
    if compensator.current_drive is not None:
        rated = units.text(compensator.current_drive.circuit.rated_A, ".3g A")
        notes.append(f"full drive is the rated current of this design, {rated}: set the device's nominal current to it")
    if compensator.drive_functions.dither_counts:
        notes.append("the offset stays lower by the design's dither: the amplifier's own must be no larger")
    notes += [f"not confirmed: {device.unconfirmed}"] if device.unconfirmed else []
    notes += [device.hint] if device.hint else []
    if device.format in WITHOUT_COMMENTS and not beside_compensator:
        notes.append("the format has no comments, so the file does not state its origin; keep this output")
    return tuple(notes)


def _of_zero_command(setting: AmplifierSetting, compensator: Compensator) -> list[str]:
    """Return what a threshold below the reading of a zero command, as declared for the design, leaves open."""
    declared = max(zero_band(compensator, sign) for sign in setting.offsets)
    if setting.threshold is None or setting.threshold >= declared:
        return []
    counted = f"only commands up to --threshold, {float(setting.threshold):.2%}, count as zero"
    return [f"{counted}: the design declares {float(declared):.2%}; between them flow at zero command is possible"]


def _of_the_machine(compensator: Compensator) -> list[str]:
    """Return what the budget leaves out of an amplifier that controls the current."""
    if compensator.machine is None:
        covered = "the certificate covers only the valve as recorded"
        return [f"{covered}: design with --amplifier to include the amplifier's error and the oil"]
    if compensator.machine.drive != "amplifier":
        drive = compensator.machine.drive
        return [f"the budget is that of a drive by {drive}: design with --amplifier for one that controls the current"]
    return []
