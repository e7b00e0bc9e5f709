"""A planned test series as a table on stdout, with its order, its premises and what should be known beside it."""

from typing import TYPE_CHECKING

from dzdesign.terminal.page import new_console, put_line, put_rows

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console

    from dzdesign.core.recorded_units import RecordedUnits
    from dzdesign.identify.planning.results import SeriesPlan, SeriesRow


def print_plan(plan: "SeriesPlan", console: "Console | None" = None) -> None:
    """Print how to record the series, what it and others are predicted to certify, and on which premises."""
    console = console or new_console()
    chosen, units = plan.chosen, plan.recorded_units
    pressures = ", ".join(units.number(value, ".4g MPa") for value in chosen.pressure_drops_MPa)
    closing = "; the last one repeats the first" if len(chosen.pressure_drops_MPa) > 1 else ""
    put_line(
        console,
        f"Test series of {chosen.ramps} ramps, {chosen.duration_min:.3g} min, at {pressures} "
        f"{units.label('MPa')}{closing}",
    )
    put_line(
        console,
        f"each ramp: {units.number(0, 'g V')} to {units.text(plan.u_max_V, 'g V')} in {chosen.ramp_time_s:g} s and "
        f"back in {chosen.ramp_time_s:g} s, at {plan.sample_rate_Hz:g} Hz; {plan.pause_s:g} s between two ramps to set "
        f"the pressure drop and settle at {units.text(0, 'g V')}; record date and time",
    )
    order = ", ".join(units.number(value, ".4g MPa") for value in plan.order_MPa)
    put_line(console, f"order (random, seed {plan.seed}): {order} {units.label('MPa')}")
    rows = (chosen, *plan.alternatives)
    put_rows(console, f"Predicted loss ({units.label('mV')})", rows, _columns(rows, units))
    for line in _legend(plan):
        put_line(console, line)
    premises = "; ".join(f"{each.name} {each.value} ({each.origin})" for each in plan.premises)
    put_line(console, f"premises: {premises}")
    for note in plan.notes:
        put_line(console, f"note: {note}")


def _columns(rows: "tuple[SeriesRow, ...]", units: "RecordedUnits") -> "dict[str, Callable[[SeriesRow], str]]":
    columns: dict[str, Callable[[SeriesRow], str]] = {
        "series": lambda row: row.name,
        "pressures": lambda row: str(len(row.pressure_drops_MPa)),
        "ramps each": lambda row: str(row.rounds),
        "ramp (s)": lambda row: f"{row.ramp_time_s:g}",
        "time (min)": lambda row: f"{row.duration_min:.3g}",
        "s.e. of knee": lambda row: " to ".join(
            units.number(value, ".2f mV") for value in sorted({min(row.knee_se_mV), max(row.knee_se_mV)})
        ),
        "loss": lambda row: units.number(row.loss_mV, ".1f mV"),
        "9 of 10": lambda row: units.number(row.loss_nine_of_ten_mV, ".1f mV"),
        "scatter": lambda row: units.number(row.of_scatter_mV, ".1f mV"),
        "noise": lambda row: units.number(row.of_noise_mV, ".1f mV"),
        "lag": lambda row: units.number(row.of_lag_mV, ".1f mV"),
        "zero": lambda row: units.number(row.of_meter_zero_mV, ".1f mV"),
        "steps": lambda row: units.number(row.of_staircase_mV, ".1f mV"),
    }
    if not any(row.of_meter_zero_mV for row in rows):
        del columns["zero"]
    return columns


def _legend(plan: "SeriesPlan") -> list[str]:
    """Return what the columns mean."""
    lines = [
        "loss: distance of the certified offset below the threshold, averaged over the pressure drops; its mean, and "
        "the value that nine series out of ten do not exceed. It is the sum of the columns to the right: scatter from "
        "ramp to ramp, noise, tolerance of the meter's lag"
        + (", zero error of the meter" if plan.chosen.of_meter_zero_mV else "")
        + ", and the steps of the staircase between the tests",
        "s.e. of knee: standard error that the noise gives the knee of one ramp, smallest and largest"
        if len(plan.chosen.pressure_drops_MPa) > 1
        else "s.e. of knee: standard error that the noise gives the knee of one ramp",
    ]
    if any(row.repeatability == "declared" for row in plan.alternatives):
        lines.append(
            "no repeats: nothing in that series measures the scatter from ramp to ramp, so its bound holds only if the "
            "valve repeats as well as --repeatability says, which identify then needs too"
        )
    return lines
