"""Printed result of `dzdesign batch`: counts, spread, the cost of the lot setting, and why valves failed."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from dzdesign.core.errors import and_more
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.report.lot.page import certified_lines, checked_line, cost_lines, output_lines, span, untested_lines
from dzdesign.report.lot.summary import LOT_SETTING, LotFirmware, LotSummary
from dzdesign.report.valve_report import REPORT_NAME
from dzdesign.terminal.page import Table, new_console, put_table

#: Valves that are named of one warning, and of those that hold the lot setting down.
NAMED, BINDING_NAMED = 3, 5


def print_quantiles(summary: LotSummary) -> None:
    """Print how the calibrated valves scatter."""
    count = summary.calibrated
    title = f"{count} calibrated valve{'' if count == 1 else 's'} of {summary.valves}"
    table = Table(title, "", "least", "5 %", "median", "95 %", "largest")
    for column, at in summary.quantiles.items():
        values = (at.least, at.q05, at.median, at.q95, at.largest)
        table.add_row(_in_words(column, summary.recorded_units), *_numbers(column, values, summary.recorded_units))
    put_table(new_console(), table)


def lines_of_lot(summary: LotSummary, folder: Path) -> Iterator[str]:
    """Yield what a lot came to, and where it was written."""
    count = summary.calibrated
    yield from (*certified_lines(summary.certified_of), *_setting_lines(summary), *output_lines(summary))
    if summary.firmware:
        yield _firmware_line(summary.firmware, folder)
    warned = sorted(summary.warnings.items(), key=lambda item: len(item[1]))
    if warned:
        few = {code: f" ({', '.join(names)})" if len(names) <= NAMED else "" for code, names in warned}  # where to look
        yield "warnings: " + ", ".join(f"{code} {len(names)}{few[code]}" for code, names in warned)
    yield from (f"{each.status}  {each.name}: {each.reason}" for each in summary.failed)
    yield from (f"odd: {line}" for line in summary.anomalies)
    yield (
        f"{count} of {summary.valves} valves calibrated, {len(summary.failed)} not. Table: {folder}/valves.csv, "
        f"valves.parquet; to be read: {folder / REPORT_NAME}"
    )


def _firmware_line(firmware: LotFirmware, folder: Path) -> str:
    held = firmware.block_of if firmware.block_of == LOT_SETTING else f"valve {firmware.block_of}"
    return (
        f"one firmware for {firmware.target}: {folder / firmware.folder}, with the block of {held} until a valve's own "
        f"is loaded; these are {folder}/valves/NAME/{' and '.join(firmware.blocks)}, each tried on every input"
    )


def _in_words(column: str, units: RecordedUnits) -> str:
    """Return a column's name with its unit in brackets."""
    name, _, unit = column.rpartition("_")
    known = {"V": units.label("V"), "percent": "%"}
    return f"{name.replace('_', ' ')} ({known[unit]})" if unit in known else column.replace("_", " ")


def _numbers(column: str, values: Sequence[float], units: RecordedUnits) -> list[str]:
    if not column.endswith("_V"):
        return [f"{value:.3f}" for value in values]
    shown = units.of_side("negative" if column.startswith("negative_") else "positive")
    # The least threshold has the largest reading where that falls.
    return [shown.number(value, ".3f V") for value in (reversed(values) if shown.falling else values)]


def _setting_lines(summary: LotSummary) -> list[str]:
    """Say what one setting for all would cost, or why there is none."""
    setting = summary.lot_setting
    if setting is None:
        return [f"no lot setting: {summary.why_no_lot_setting}"]
    return [
        f"one lot setting, safe for each of these valves {span(*setting.dp_MPa, summary.recorded_units)}, is held "
        f"down by {and_more(setting.binding, BINDING_NAMED)}; it is in {setting.file}",
        checked_line(setting, summary.recorded_units),
        *untested_lines(setting, summary.recorded_units),
        *cost_lines(summary),
    ]
