"""What `dzdesign export` prints: the setting, and the dead zone that it leaves beside that of the law."""

from functools import partial
from math import isinf
from typing import TYPE_CHECKING

from dzdesign.terminal.page import new_console, put_line, put_rows
from dzdesign.terminal.tables import put_units

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rich.console import Console

    from dzdesign.core.recorded_units import RecordedUnits
    from dzdesign.design.fixed_offset import FixedDeadZone, FixedOffset
    from dzdesign.stages.export import AmplifierExport

BRANCHES = ("opening", "closing")


def print_export(made: "AmplifierExport", console: "Console | None" = None) -> None:
    """Print what a device is told, and for each side what is left at the tested pressure drops."""
    from dzdesign.design.signals import SIDE_NAMES

    console = console or new_console()
    setting, units = made.setting, made.compensator.valve.recorded_units
    device = setting.device
    words = ", ".join(f"{name} {counts}" for name, counts in setting.parameters.items())
    if setting.dp_MPa is None:
        put_line(console, f"{device.title}, {device.description}: {words} (unit {device.unit})")
    else:
        at = units.text(float(setting.dp_MPa), ".2f MPa")
        put_line(console, f"{device.title}, {device.description}: law at {at}")
    for sign, offset in setting.offsets.items():
        side = SIDE_NAMES[sign]
        label = "" if len(setting.offsets) == 1 else f"{side} side: "
        put_line(console, label + _offset_line(made, offset, units.of_side(side)))
        rows = [row for row in made.dead_zones if row.side == side]
        title = f"Remaining dead zone (knee, share of command){f', {side} side' if label else ''}"
        title += ": with the fixed setting, and with the law, which reads the pressures"
        if any(row.law_end_L_min is not None for row in rows):
            title += f"; flow on closing at {_transition_end(made, sign):.2%} of command, the end of the transition"
        put_rows(console, title, rows, _columns(rows, units.of_side(side)))
    for check in made.checks:
        put_line(console, f"HOLDS  {check.name}: {check.text}")
    for note in made.notes:
        put_line(console, f"note: {note}")
    put_units(console, units, "compensator.json")
    put_line(console, f"SHA-256 of its compensator.json: {made.compensator_sha256}")


def _offset_line(made: "AmplifierExport", offset: "FixedOffset", units: "RecordedUnits") -> str:
    """Return what the largest safe offset is, what it lies under, and to what it was rounded."""
    certificate = made.compensator.side(offset.sign).certificate
    low, high = (float(end) for end in offset.dp_MPa)
    set_to = made.setting.characteristics[offset.sign].offset
    return (
        f"largest fixed offset under the {100 * certificate.confidence:.6g}% lower bound of the {certificate.guard} "
        f"threshold {units.span(low, high, '.2f MPa')}: {float(offset.share):.3%} of full drive (lowest at "
        f"{units.text(float(offset.lowest_at_MPa), '.2f MPa')}); set: {float(set_to):.3%}"
    )


def _columns(rows: "Sequence[FixedDeadZone]", units: "RecordedUnits") -> "dict[str, Callable[[FixedDeadZone], str]]":
    """Return the columns of the table: branches that no test recorded are left out, and so is a missing transition."""
    columns: dict[str, Callable[[FixedDeadZone], str]] = {
        f"dP ({units.label('MPa')})": lambda row: units.number(row.dp_MPa, ".2f MPa"),
    }
    for whose in ("fixed", "law"):
        for branch in (each for each in BRANCHES if any(each in row.fixed for row in rows)):
            columns[f"{whose}: {branch}"] = partial(_share, whose=whose, branch=branch)
    if any(row.law_end_L_min is not None for row in rows):
        for whose in ("fixed", "law"):
            columns[f"{whose}: flow ({units.label('L/min')})"] = partial(_flow, whose=whose, units=units)
    return columns


def _transition_end(made: "AmplifierExport", sign: int) -> float:
    """Return the command at which the transition ends, as a share of full command."""
    compensator = made.compensator
    return float(compensator.transition_end / compensator.signals.command.span(sign))


def _share(row: "FixedDeadZone", whose: str, branch: str) -> str:
    share = (row.fixed if whose == "fixed" else row.law).get(branch)
    return "-" if share is None else "never" if isinf(share) else f"{share:.2%}"


def _flow(row: "FixedDeadZone", whose: str, units: "RecordedUnits") -> str:
    flow = row.fixed_end_L_min if whose == "fixed" else row.law_end_L_min
    return "-" if flow is None else units.number(flow, ".2f L/min")
