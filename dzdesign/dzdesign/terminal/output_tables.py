"""Tables of what is made beside a firmware: an amplifier's setting, a calibration block read back, the outputs."""

from functools import partial
from math import isinf
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.terminal.page import Column, new_console, put_line, put_rows
from dzdesign.terminal.tables import put_files, put_units

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rich.console import Console

    from dzdesign.codegen.calibration.reading import (
        CalibrationReading,
        DriveReading,
        NodeReading,
        SideReading,
    )
    from dzdesign.codegen.other_targets import Output
    from dzdesign.core.recorded_units import RecordedUnits
    from dzdesign.design.compensator import Compensator
    from dzdesign.design.fixed_offset import FixedDeadZone
    from dzdesign.report.artefacts import MadeOutputs
    from dzdesign.stages.calibration import ReadCalibration


BRANCHES = ("opening", "closing")


def print_output(output: "Output", console: "Console | None" = None, folder: str = "") -> None:
    """Print the files of an output other than a C firmware, and where they are; of an amplifier, its setting too."""
    console = console or new_console()
    place = f", in folder '{folder}'" if folder else ""
    settings = output.manifest.settings_in_words
    put_line(console, f"Output for {output.manifest.target}{settings}, law '{output.manifest.law}'{place}:")
    put_files(console, (*output.contents, MANIFEST_NAME))
    if output.manifest.target == "amplifier":
        _put_setting(console, output.compensator, output.manifest.settings)


def _put_setting(console: "Console", compensator: "Compensator", settings: "Mapping[str, str]") -> None:
    """Print what a device is told, and for each side what is left at the tested pressure drops."""
    from dzdesign.codegen.amplifier.files import setting_of, zones_of

    setting, units = setting_of(compensator, settings), compensator.valve.recorded_units
    device, zones = setting.device, zones_of(setting, compensator)
    words = ", ".join(f"{name} {counts}" for name, counts in setting.parameters.items()) + f" (unit {device.unit})"
    if setting.dp_MPa is not None:
        words = f"law at {units.text(float(setting.dp_MPa), '.2f MPa')}"
    put_line(console, f"{device.title}, {device.description}: {words}")
    for sign, offset in setting.offsets.items():
        side, of_side = compensator.valve.side_name(sign), units.of_side(compensator.valve.side_name(sign))
        certificate = compensator.side(sign).certificate
        low, high = (float(end) for end in offset.dp_MPa)
        put_line(
            console,
            ("" if len(setting.offsets) == 1 else f"{side} side: ")
            + f"largest fixed offset under the {100 * certificate.confidence:.6g}% lower bound of the "
            f"{certificate.guard} threshold {of_side.span(low, high, '.2f MPa')}: {float(offset.share):.3%} of full "
            f"drive (lowest at {of_side.text(float(offset.lowest_at_MPa), '.2f MPa')}); set: "
            f"{float(setting.characteristics[sign].offset):.3%}",
        )
        rows = [row for row in zones if row.side == side]
        title = f"Remaining dead zone (knee, share of command){'' if len(setting.offsets) == 1 else f', {side} side'}"
        title += ": with the fixed setting, and with the law, which reads the pressures"
        if any(row.law_end_L_min is not None for row in rows):
            end = float(compensator.transition_end / compensator.signals.command.span(sign))
            title += f"; flow on closing at {end:.2%} of command, the end of the transition"
        put_rows(console, title, rows, _zone_columns(rows, of_side))
    put_units(console, units, "compensator.json")


def _zone_columns(rows: "Sequence[FixedDeadZone]", units: "RecordedUnits") -> "dict[str, Column[FixedDeadZone]]":
    """Return the columns of the table: branches that no test recorded are left out, and so is a missing transition."""
    columns: dict[str, Column[FixedDeadZone]] = {
        f"dP ({units.label('MPa')})": lambda row: units.number(row.dp_MPa, ".2f MPa"),
    }
    for whose in ("fixed", "law"):
        for branch in (each for each in BRANCHES if any(each in row.fixed for row in rows)):
            columns[f"{whose}: {branch}"] = partial(_share, whose=whose, branch=branch)
    if any(row.law_end_L_min is not None for row in rows):
        for whose in ("fixed", "law"):
            columns[f"{whose}: flow ({units.label('L/min')})"] = partial(_flow, whose=whose, units=units)
    return columns


def _share(row: "FixedDeadZone", whose: str, branch: str) -> str:
    share = (row.fixed if whose == "fixed" else row.law).get(branch)
    return "-" if share is None else "never" if isinf(share) else f"{share:.2%}"


def _flow(row: "FixedDeadZone", whose: str, units: "RecordedUnits") -> str:
    flow = row.fixed_end_L_min if whose == "fixed" else row.law_end_L_min
    return "-" if flow is None else units.number(flow, ".2f L/min")


#: Nodes of beta that are printed, of up to 127; --json has all.
NODES_SHOWN = 12


def print_calibration(found: "ReadCalibration", console: "Console | None" = None) -> None:
    """Print a block in the recordings' units where they are known, else in V and MPa."""
    console = console or new_console()
    reading, units = found.reading, found.units
    put_line(console, f"Serial number: {reading.serial or 'none'}; record: {reading.record or 'none'}")
    put_line(console, f"Belongs to the compensator.json with the SHA-256 {reading.compensator_sha256}")
    if found.belongs is not None:
        which = "Is the block" if found.belongs else "IS NOT THE BLOCK"
        why = f": {found.difference}" if found.difference else ""
        put_line(console, f"{which} of {found.compared_with}{why}")
    put_line(console, f"Layout {reading.layout}, {reading.length_words} words, CRC-32 {reading.crc32}")
    if found.placed:
        put_line(console, f"The file places it at {found.placed}")
    kind = "; ".join(reading.shape) or "one solenoid, duty as output"
    put_line(
        console,
        f"For firmware with: {kind}; codes 0 to {reading.code_max}, {reading.compare_max} counts at full drive, "
        f"{reading.sample_Hz} samples and {reading.tick_Hz} PWM periods per second",
    )
    _put_signals(console, reading, units)
    _put_drive(console, reading.drive, units)
    for name, side in reading.sides.items():
        _put_side(console, name, side, units.of_side(name))
    if reading.current is not None:
        integers = {name: number for name, number in reading.current.items() if name != "supply"}
        words = ", ".join(f"{name} {number}" for name, number in integers.items())
        put_line(console, f"Current controller, in its integers: {words}")
    if units.in_words():
        put_line(console, f"units: {units.in_words()}, those of the recordings; the block holds codes and counts")


def _put_signals(console: "Console", reading: "CalibrationReading", units: "RecordedUnits") -> None:
    command = reading.command
    codes = ", ".join(f"{codes} codes to full {name} command" for name, codes in command.codes.items())
    put_line(
        console,
        f"Command: zero at code {command.zero_code}, {codes}, {units.text(reading.u_max_V, 'g V')}; "
        f"valid {_range(command.valid_codes)}",
    )
    for name, sensor in reading.pressures.items():
        put_line(
            console,
            f"Pressure {name}: 0 at code {sensor.zero_code}, {units.text(sensor.span_MPa, '.4g MPa')} at code "
            f"{sensor.full_code}; valid {_range(sensor.valid_codes)}",
        )
    put_line(console, f"A pressure drop below {units.text(-reading.reverse_MPa, '.3f MPa')} is a failed sensor")


def _range(codes: tuple[int, int]) -> str:
    return f"from {codes[0]} to {codes[1]}"


def _put_drive(console: "Console", drive: "DriveReading", units: "RecordedUnits") -> None:
    def command(value_V: float) -> str:
        return units.text(value_V, ".3f dV")

    waits = "none" if drive.interlock_V is None else f"up to {command(drive.interlock_V)} is zero command"
    dither = f"{command(drive.dither_V)} at {drive.dither_Hz:.4g} Hz" if drive.dither_Hz else "none"
    play = f"travel {command(drive.play_travel_V)}, noise {command(drive.play_noise_V)}"
    lines = {
        "Largest output": command(drive.output_max_V),
        "Zero band": command(drive.zero_band_V),
        "Transition": command(drive.transition_V) if drive.transition_V else "none",
        "Leaves rest beyond": command(drive.leave_zero_V),
        "Interlock": waits,
        "Fault": f"ends after {drive.fault_samples} valid samples{', latched' if drive.fault_latch else ''}",
        "Dither": dither,
        "Inverse play": play if drive.play_travel_V else "none",
    }
    for name, text in lines.items():
        put_line(console, f"{name}: {text}")


def _put_side(console: "Console", name: str, side: "SideReading", units: "RecordedUnits") -> None:
    nodes, label = side.nodes, units.label("dV")
    places = {round(place * (len(nodes) - 1) / (NODES_SHOWN - 1)) for place in range(NODES_SHOWN)}
    columns: dict[str, Column[NodeReading]] = {
        f"dP ({units.label('MPa')})": lambda node: units.number(node.dp_MPa, ".3f MPa"),
        "beta": lambda node: f"{node.beta:.4f}",
        "beta at zero command": lambda node: f"{node.beta_at_zero:.4f}",
        f"output just above zero ({label})": lambda node: units.number(node.offset_V, ".3f dV"),
        f"at full command ({label})": lambda node: units.number(node.full_V, ".3f dV"),
    }
    title = f"Law of {name} commands, at {len(places)} of {len(nodes)} nodes"
    put_rows(console, title, [nodes[place] for place in sorted(places)], columns, words=())
    ramps = (
        f"{way} {seconds:.3g} s" for way, seconds in (("up", side.ramp_up_s), ("down", side.ramp_down_s)) if seconds
    )
    put_line(
        console,
        f"Tested to {units.text(side.tested_to_MPa, '.3f MPa')}; ramps: {', '.join(ramps) or 'none'}; inverse play: "
        f"{units.text(side.play_V, '.3f dV') if side.play_V else 'none'}",
    )


#: Digits of a hash that tell two outputs apart.
SHORT = 12


def print_outputs(made: "MadeOutputs", console: "Console | None" = None) -> None:
    """Print a row for each output, and a line for each that was not listed; nothing of a folder without any."""
    console = console or new_console()
    if made.listed:
        put_rows(
            console,
            "Outputs of this compensator",
            made.listed,
            {
                "output": lambda each: each.kind,
                "settings": lambda each: each.settings or "-",
                "folder": lambda each: each.place,
                "SHA-256": lambda each: each.sha256[:SHORT],
                "check": lambda each: each.verdict,
                "inputs": lambda each: str(each.inputs or "-"),
            },
            words=(0, 1, 2, 4),
        )
    for line in made.others:
        put_line(console, f"other: {line}")
