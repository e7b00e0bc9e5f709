"""A calibration block as a person reads it: whose it is, its connections, the law at some pressure drops."""

from typing import TYPE_CHECKING

from dzdesign.terminal.page import new_console, put_line, put_rows

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console

    from dzdesign.codegen.calibration.reading import (
        CalibrationReading,
        DriveReading,
        NodeReading,
        SensorReading,
        SideReading,
    )
    from dzdesign.core.recorded_units import RecordedUnits
    from dzdesign.stages.calibration import ReadCalibration

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
    sensors: dict[str, SensorReading] = {"A": reading.pressure_a, "B": reading.pressure_b}
    for name, sensor in sensors.items():
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
    columns: dict[str, Callable[[NodeReading], str]] = {
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
