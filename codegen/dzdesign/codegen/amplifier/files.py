"""`output_files`: a compensator and a device in; the device's file, and a table of the dead zones it leaves, out.

The file has the parameters or the table as text, with tool and hash where the format has comments. `notes_of` says what
a user must know of a fixed setting beside its numbers, a sentence each.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from itertools import pairwise

from dzdesign.codegen.amplifier.device import Format, device_named
from dzdesign.codegen.amplifier.setting import AmplifierSetting, amplifier_setting, given_dp_MPa, given_threshold
from dzdesign.codegen.banner import banner_of
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareOrigin
from dzdesign.design.fixed_offset import Characteristic, FixedDeadZone, Node, dead_zones, zero_band

NO_NODE: Node = (Fraction(0), Fraction(0))
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
    setting = setting_of(compensator, settings)
    device = setting.device
    return {
        device.name + device.ending: amplifier_file(setting, compensator, origin.compensator_json),
        TABLE: _table(zones_of(setting, compensator)).encode("ascii"),
    }


def note_of(compensator: Compensator, settings: Mapping[str, str]) -> str:
    """Return what a user must know beside the numbers of the device."""
    notes = notes_of(setting_of(compensator, settings), compensator)
    return "; ".join(note.removesuffix(".") for note in notes)


def setting_of(compensator: Compensator, settings: Mapping[str, str]) -> AmplifierSetting:
    """Return what a device is told, from the settings of the output."""
    return amplifier_setting(
        compensator,
        device_named(settings["device"]),
        dp_MPa=given_dp_MPa(settings["table_dp"] or None),
        threshold=given_threshold(settings["threshold"] or None),
    )


def zones_of(setting: AmplifierSetting, compensator: Compensator) -> list[FixedDeadZone]:
    """Return the dead zones that a setting leaves, positive commands first."""
    return [row for sign, drives in setting.characteristics.items() for row in dead_zones(compensator, drives, sign)]


def _table(zones: Sequence[FixedDeadZone]) -> str:
    """Return a line for each branch of each test: shares of command, infinite where no command opens the valve."""
    rows = [
        f"{row.side},{row.dp_MPa:.6f},{branch},{row.fixed[branch]:.6f},{row.law[branch]:.6f}"
        for row in zones
        for branch in row.fixed
    ]
    return "".join(f"{line}\n" for line in (HEADER, *rows))


def amplifier_file(setting: AmplifierSetting, compensator: Compensator, digest: str) -> bytes:
    """Return the content of a device's file; `digest` is the SHA-256 of compensator.json. ASCII, lines end as in DOS.

    The same input gives the same bytes.
    """
    device = setting.device
    first, *others = banner_of(compensator, digest).lines(f"{device.name}.toml")
    made_from = f"Made from compensator.json with the SHA-256 {digest}."
    of_the_valve = (line for line in others if digest not in line)
    head = [first, made_from, *of_the_valve, *_about(setting, compensator)]
    lines = WRITERS[device.format](setting, head)
    return "".join(f"{line}\r\n" for line in lines).encode("ascii")


def _about(setting: AmplifierSetting, compensator: Compensator) -> list[str]:
    """Return what a reader of the file should know, a line each."""
    device, (low, high) = setting.device, setting.offsets[1].dp_MPa
    lines = [
        f"Device: {device.title}, {device.description}.",
        f"At zero command it opens the valve at no pressure drop from {float(low):.4g} to {float(high):.4g} MPa,",
        f"certified of {compensator.certified_of}; above and below nothing is certified.",
    ]
    if setting.dp_MPa is not None:
        lines.append(f"Beyond the transition it is the law at {float(setting.dp_MPa):.4g} MPa.")
    lines += [f"Source: {source}" for source in device.sources]
    lines += [f"Not confirmed: {device.unconfirmed}"] if device.unconfirmed else []
    return lines


def _commands(setting: AmplifierSetting, head: Sequence[str]) -> Iterable[str]:
    """Yield the lines for a serial line: it takes no comments."""
    yield from (f"{name} {counts}" for name, counts in setting.parameters.items())


def _parameters(setting: AmplifierSetting, head: Sequence[str]) -> Iterable[str]:
    """Yield name and value of each parameter, to be typed in."""
    device = setting.device
    yield from (f"# {line}" for line in head)
    for name, counts in setting.parameters.items():
        value = f"{counts // 1000}.{counts % 1000:03d} V" if device.written_in == "V" else f"{counts} {device.unit}"
        yield f"{name} = {value}"


def _dcf(setting: AmplifierSetting, head: Sequence[str]) -> Iterable[str]:
    """Yield a device configuration file of CiA 306 with these objects alone."""
    objects = setting.device.objects
    listed = {str(n): f"0x{each.index:04X}" for n, each in enumerate(objects, start=1)}
    sections: dict[str, Mapping[str, str]] = {
        "FileInfo": {"FileVersion": "1", "FileRevision": "0", "EDSVersion": "4.0", "Description": "dead band"},
        "DeviceInfo": {"VendorName": "any", "ProductName": "CiA 408", "Granularity": "8", "LSS_Supported": "0"},
        "MandatoryObjects": {"SupportedObjects": "0"},
        "OptionalObjects": {"SupportedObjects": str(len(objects)), **listed},
        "ManufacturerObjects": {"SupportedObjects": "0"},
    }
    for each in objects:
        section = f"{each.index:04X}"
        if each.sub_index is not None:
            sections[section] = {"ParameterName": each.name, "ObjectType": "0x9", "SubNumber": "2"}
            sections[f"{section}sub0"] = {
                "ParameterName": "HighestSubIndexSupported",
                "ObjectType": "0x7",
                "DataType": "0x0005",
                "AccessType": "const",
                "DefaultValue": str(each.sub_index),
                "PDOMapping": "0",
            }
            section += f"sub{each.sub_index:X}"
        sections[section] = {
            "ParameterName": each.name,
            "ObjectType": "0x7",
            "DataType": f"0x{each.data_type:04X}",
            "AccessType": "rw",
            "PDOMapping": "0",
            "ParameterValue": str(setting.parameters.get(each.name, each.value)),
        }
    yield from (f"; {line}" for line in head)
    yield "; A part of a DCF: these objects alone; the node's number, and all others, are those of the device."
    for section, entries in sections.items():
        yield from ("", f"[{section}]", *(f"{key}={value}" for key, value in entries.items()))


def _structured_text(setting: AmplifierSetting, head: Sequence[str]) -> Iterable[str]:
    """Yield a list of global variables with the table of TF5810."""
    unit = setting.device.counts_of_full
    points = _with_odd_count(_rising_points(setting.characteristics), least=(Fraction(-1), Fraction(-1, unit)))
    yield from (f"(* {line} *)" for line in head)
    yield "VAR_GLOBAL"
    yield "    (* of each point: normalised velocity, normalised output *)"
    yield "    ValveCharacteristicTable : ARRAY[1..100,1..2] OF LREAL := ["
    pairs = [f"{_decimal(command, unit)}, {_decimal(drive, unit)}" for command, drive in points]
    yield from (f"        {pair}," for pair in pairs)
    yield f"        {2 * (100 - len(points))}(0.0)"
    yield "    ];"
    yield f"    ValveCharacteristicTblCount : INT := {len(points)};"
    yield "END_VAR"


def _csv(setting: AmplifierSetting, head: Sequence[str]) -> Iterable[str]:
    """Yield a table in percent."""
    unit = setting.device.counts_of_full
    yield from (f"# {line}" for line in head)
    yield "command_percent,drive_percent"
    for point in _rising_points(setting.characteristics):
        yield ",".join(_decimal(100 * value, unit // 100) for value in point)


def _rising_points(characteristics: Mapping[int, Characteristic]) -> tuple[Node, ...]:
    """Return command and drive from full negative command to full positive one; both are negative of the one side."""
    other_side = characteristics[-1].nodes if -1 in characteristics else ()
    negative = [(-command, -drive) for command, drive in reversed(other_side)]
    return tuple(dict.fromkeys([*negative, NO_NODE, *characteristics[1].nodes]))


def _with_odd_count(points: tuple[Node, ...], *, least: Node) -> tuple[Node, ...]:
    """Return points that reach full negative command, an odd number of them: of an even one the largest rise is halved.

    `least` stands at full negative command where the points begin at zero.
    """
    if points[0] == NO_NODE:
        points = (least, *points)
    if len(points) % 2:
        return points
    rises = [right[1] - left[1] for left, right in pairwise(points)]
    place = rises.index(max(rises)) + 1  # of a short one half a step of the device would be lost
    (left, low), (right, high) = points[place - 1 : place + 1]
    return (*points[:place], ((left + right) / 2, (low + high) / 2), *points[place:])


def _decimal(value: Fraction, unit: int) -> str:
    """Return an exact decimal number with as many digits as a power of ten, the unit, has; towards zero."""
    digits = len(str(unit)) - 1
    counts = abs(value) * unit
    whole = counts.numerator // counts.denominator
    return f"{'-' if value < 0 and whole else ''}{whole // unit}.{whole % unit:0{digits}d}"


Writer = Callable[[AmplifierSetting, Sequence[str]], Iterable[str]]
WRITERS: Mapping[Format, Writer] = {
    "commands": _commands,
    "parameters": _parameters,
    "dcf": _dcf,
    "structured text": _structured_text,
    "csv": _csv,
}


def notes_of(setting: AmplifierSetting, compensator: Compensator) -> tuple[str, ...]:
    """Return what the setting does not hold for, what the device's sources leave open, and what is still to be done."""
    device, units = setting.device, compensator.valve.recorded_units
    notes = []
    for sign, offset in setting.offsets.items():
        low, high = (units.text(float(end), ".2f MPa") for end in offset.dp_MPa)
        trend = compensator.valve.side(sign).trend
        outside = LOWER.get(trend, EITHER if offset.dp_MPa[0] < offset.dp_MPa[1] else OTHER)
        side = "" if len(setting.offsets) == 1 else f"{compensator.valve.side_name(sign)} side: "
        notes.append(side + outside.format(low=low, high=high))
    if not compensator.two_sided and len(compensator.valve.sides) > 1:
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
