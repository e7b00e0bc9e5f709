"""`export`: Compensator -> the parameters of an amplifier that compensates a fixed dead zone, and what they leave."""

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.artefact_files import check_file_may_be_written, write_file
from dzdesign.core.documents import read_bytes
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.option_readers import percent, quantity
from dzdesign.core.options import AnyPath, Option, Text
from dzdesign.stages.design import given_compensator, refuse_underived

if TYPE_CHECKING:
    from dzdesign.codegen.amplifier.device import Device
    from dzdesign.codegen.amplifier.setting import AmplifierSetting
    from dzdesign.design.compensator import Compensator
    from dzdesign.design.fixed_offset import FixedDeadZone
    from dzdesign.verify.requirements import Check


@dataclass(frozen=True)
class ExportArguments:
    """Arguments of `export`."""

    compensator: Annotated["Compensator | AnyPath", Option("COMPENSATOR.json")]
    """The compensator.json of the valve, or a folder that holds one. Its numbers are first derived again."""
    _: KW_ONLY
    to: Annotated[Text, Option("DEVICE")] = None
    """Device: west (W.E.St. PAM-199), west-pam190, west-pos123, cia408 (CANopen), rmc (Delta RMC100), rmc75, beckhoff
    (TF5810) or csv."""
    output: Annotated[AnyPath | None, Option("FILE", short="-o")] = None
    """File to write (default: none, the parameters are only printed)."""
    table_dp: Annotated[Text, Option("P", example="1 MPa", read=quantity("pressure"))] = None
    """Pressure drop of the characteristic, for beckhoff and csv (default: dP0 of the valve)."""
    threshold: Annotated[Text, Option("SHARE", example="0.5 %", read=percent("0.5 %"))] = None
    """Command up to which the valve stays at rest, for the error of the device's zero command (default: the zero band
    of the design's command)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AmplifierExport:
    """The parameters of a device, the content of its file, and the dead zone that remains."""

    setting: "AmplifierSetting"
    content: bytes
    compensator: "Compensator"
    compensator_sha256: str
    #: At each tested pressure drop, positive commands first.
    dead_zones: "tuple[FixedDeadZone, ...]"
    #: What a user must know beside the numbers.
    notes: tuple[str, ...]
    #: What was found as the file was read back, by code that it was not written with.
    checks: "tuple[Check, ...]"


def export(arguments: ExportArguments) -> AmplifierExport:
    """Return the largest fixed compensation of an amplifier that opens the valve at no tested pressure drop.

    The same input gives the same bytes.

    Returns
    -------
    AmplifierExport
        The parameters of the device, the content of its file and the remaining dead zone.

    Raises
    ------
    InputError
        If the compensator can't be read, a number in it can't be derived, or the device is unknown. Also if the setting
        exceeds the device's range, an option belongs to another device, or the file can't be written.
    RequirementError
        If the file, read back, is not safe or leaves other dead zones than stated. This is a fault of dzdesign.
    """
    from dzdesign.codegen.amplifier.device import device_named
    from dzdesign.codegen.amplifier.files import amplifier_file, notes_of
    from dzdesign.codegen.amplifier.setting import amplifier_setting, given_dp_MPa, given_threshold
    from dzdesign.design.fixed_offset import dead_zones

    device = device_named(arguments.to)
    output = None if arguments.output is None else Path(arguments.output)
    dp_MPa, threshold = given_dp_MPa(arguments.table_dp), given_threshold(arguments.threshold)
    if output is not None:
        _check_output(output, device)
    compensator, digest, source = given_compensator(arguments.compensator)
    refuse_underived(compensator, source, of_file=compensator is not arguments.compensator)
    setting = amplifier_setting(compensator, device, dp_MPa=dp_MPa, threshold=threshold)
    content = amplifier_file(setting, compensator, digest)
    zones = {sign: dead_zones(compensator, drives, sign) for sign, drives in setting.characteristics.items()}
    made = AmplifierExport(
        setting=setting,
        content=content,
        compensator=compensator,
        compensator_sha256=digest,
        dead_zones=tuple(row for rows in zones.values() for row in rows),
        notes=notes_of(setting, compensator),
        checks=_read_back(device, content, compensator, zones, threshold),
    )
    if output is not None:
        write_file(output, made.content)
    return made


def _read_back(
    device: "Device",
    content: bytes,
    compensator: "Compensator",
    zones: "Mapping[int, Sequence[FixedDeadZone]]",
    threshold: Fraction | None,
) -> "tuple[Check, ...]":
    """Check a file before anybody has it; refuse one that does not hold."""
    from dzdesign.verify.outputs.amplifier import file_checks

    stated = {sign: [(row.dp_MPa, row.fixed) for row in rows] for sign, rows in zones.items()}
    found = file_checks(device.name, content, compensator, stated, threshold)
    if wrong := [check for check in found if not check.holds]:
        raise RequirementError(
            f"the file for {device.name} does not hold as it is read back, so it is not written: {wrong[0].name}: "
            f"{wrong[0].text}; this is a fault of dzdesign"
        )
    return found


def _check_output(output: Path, device: "Device") -> None:
    """Refuse to write over what is not a file of dzdesign for this device: a recording may end with .csv too."""
    from dzdesign.codegen.amplifier.files import is_file_of

    check_file_may_be_written(output)
    if output.exists() and output.stat().st_size and not is_file_of(device, read_bytes(output, "amplifier file")):
        raise InputError(
            f"'{output}' exists and is no file of dzdesign for {device.name}, so it is left alone; choose another name "
            "with -o"
        )
