"""`output_files`: a compensator and a device in; the device's file, and a table of the dead zones it leaves, out.

`notes_of` says what a user must know of a fixed setting beside its numbers, a sentence each.
"""

from collections.abc import Mapping, Sequence

from dzdesign.codegen.amplifier.device import device_named
from dzdesign.codegen.amplifier.files import WITHOUT_COMMENTS, amplifier_file
from dzdesign.codegen.amplifier.setting import AmplifierSetting, amplifier_setting, given_dp_MPa, given_threshold
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareOrigin
from dzdesign.design.fixed_offset import FixedDeadZone, dead_zones, zero_band
from dzdesign.design.signals import SIDE_NAMES

#: The table beside the device's file; `verify` has the same name and header.
TABLE = "dead_zones.csv"
HEADER = "side,dp_MPa,branch,dead_zone_fixed,dead_zone_law"
#: Where the threshold is lower than at any test, by its trend.
LOWER: dict[str | None, str] = {
    "decreasing": "above {high}, where the threshold is lower, nothing is certified: flow at zero command is possible",
    "increasing": "below {low}, where the threshold is lower, nothing is certified: flow at zero command is possible",
}
#: Of a threshold without a trend; and of one that was tested at one pressure drop.
EITHER = "below {low} and above {high} nothing is certified"
OTHER = "at another pressure drop than {low} nothing is certified"


def output_files(compensator: Compensator, origin: FirmwareOrigin, settings: Mapping[str, str]) -> dict[str, bytes]:
    """Return the file of a device, named after it, and the table of the dead zones that it leaves.

    What the device does not take, and an option that is not of it, are an `InputError`.
    """
    setting = _setting(compensator, settings)
    device = setting.device
    zones = [row for sign, drives in setting.characteristics.items() for row in dead_zones(compensator, drives, sign)]
    return {
        device.name + device.ending: amplifier_file(setting, compensator, origin.compensator_json),
        TABLE: _table(zones).encode("ascii"),
    }


def note_of(compensator: Compensator, settings: Mapping[str, str]) -> str:
    """Return what a user must know beside the numbers of the device."""
    notes = notes_of(_setting(compensator, settings), compensator, beside_compensator=True)
    return "; ".join(note.removesuffix(".") for note in notes)


def _setting(compensator: Compensator, settings: Mapping[str, str]) -> AmplifierSetting:
    return amplifier_setting(
        compensator,
        device_named(settings["device"]),
        dp_MPa=given_dp_MPa(settings["table_dp"] or None),
        threshold=given_threshold(settings["threshold"] or None),
    )


def _table(zones: Sequence[FixedDeadZone]) -> str:
    """Return a line for each branch of each test: shares of command, infinite where no command opens the valve."""
    rows = [
        f"{row.side},{row.dp_MPa:.6f},{branch},{row.fixed[branch]:.6f},{row.law[branch]:.6f}"
        for row in zones
        for branch in row.fixed
    ]
    return "".join(f"{line}\n" for line in (HEADER, *rows))


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
