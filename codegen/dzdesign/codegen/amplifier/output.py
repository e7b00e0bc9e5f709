"""`output_files`: a compensator and a device in; the device's file, and a table of the dead zones it leaves, out."""

from collections.abc import Mapping, Sequence

from dzdesign.codegen.amplifier.device import device_named
from dzdesign.codegen.amplifier.files import amplifier_file
from dzdesign.codegen.amplifier.given import given_dp_MPa, given_threshold
from dzdesign.codegen.amplifier.notes import notes_of
from dzdesign.codegen.amplifier.setting import AmplifierSetting, amplifier_setting
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareOrigin
from dzdesign.design.fixed_offset import FixedDeadZone, dead_zones

#: The table beside the device's file; `verify` has the same name and header.
TABLE = "dead_zones.csv"
HEADER = "side,dp_MPa,branch,dead_zone_fixed,dead_zone_law"


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
