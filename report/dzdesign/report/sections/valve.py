"""Sections on the identified valve: data and fit, thresholds, beta over the pressure drop."""

from collections.abc import Sequence

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.units import chance
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.low_flow import IN_WORDS
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.report.compensator_sides import laws_of
from dzdesign.report.figures.valve import beta_figure, lines_figure, thresholds_figure
from dzdesign.report.page import Section
from dzdesign.report.sections.cells import Cell, Table, counted, recorded, table_of

#: Warnings about the order of the recordings, which bear on the bounds.
ORDER = ("order", "time-stamps")


def valve_sections(valve: ValveModel | None, compensator: Compensator | None) -> dict[str, Section]:
    """Return the sections "data", "thresholds" and "beta", of the guard of the compensator where there is one."""
    if valve is None:
        gap = Section(missing="The valve is not here: `dzdesign identify` makes valve.json.")
        return {"data": gap, "thresholds": gap, "beta": gap}
    both = len(valve.sides) > 1
    fits, thresholds, tables, betas = [], [], [], []
    for name, side in valve.sides.items():
        law, units = laws_of(compensator).get(name), valve.recorded_units.of_side(name)
        guard = law.certificate.guard if law else side.certificate.guard
        fits.append(lines_figure(side, name, both, units))
        thresholds.append(thresholds_figure(side, guard, name, both, units))
        tables.append(thresholds_table(side, guard, f"Thresholds, {name} commands", units))
        if side.low_flow:
            tables.append(low_flow_table(side, f"Flows measured by hand, {name} commands", units))
        betas.append(beta_figure(side, guard, name, both, compensator if law else None, units))
    meter, units = valve.meter, valve.recorded_units
    shown = units.in_words()
    return {
        "data": Section(
            figures=fits,
            lines=(
                f"{_ramp_tests(valve)}; full command {units.text(valve.u_max_V, 'g V')}.",
                *([f"Units: {shown}; the files and the curves as CSV are in V, MPa and L/min."] if shown else []),
                f"Flow meter: floor {units.text(meter.floor_L_min, '.2f L/min')}; {meter.lag_in_words()}.",
                *([f"Recorded under {valve.dither_in_words}."] if valve.dither else []),
                *(_trend(name, side, units.of_side(name)) for name, side in valve.sides.items()),
                *(
                    f"{name.capitalize()} commands, from ramp to ramp: "
                    f"{side.certificate.repeatability.in_words(units)}."
                    for name, side in valve.sides.items()
                ),
                *(f"{name.capitalize()} commands: not tested." for name in valve.untested_sides),
            ),
        ),
        "thresholds": Section(
            figures=thresholds,
            tables=tables,
            lines=(
                *(f"Premise, {name} commands: {side.premise_in_words(units)}." for name, side in valve.sides.items()),
                *(
                    f"At the bounds, {name} commands: {side.none_in_words(side.certificate.guard, units)}."
                    for name, side in valve.sides.items()
                    if side.low_flow
                ),
                *(f"{warning.text}." for warning in valve.warnings if warning.code in (*ORDER, "low-flow")),
            ),
        ),
        "beta": Section(
            figures=betas,
            missing="" if any(betas) else "One pressure drop was tested, so β is 1 and its trend is not known.",
        ),
    }


def _ramp_tests(valve: ValveModel) -> str:
    """Count the ramp tests, and the recordings that they are of: repeats are one test."""
    tests, recordings = sum(len(side.tests) for side in valve.sides.values()), len(valve.made_from)
    of = "" if tests == recordings else f" from {counted(recordings, 'recording')}"
    return f"{counted(tests, 'ramp test')}{of}"


def low_flow_table(side: SideModel, title: str, units: RecordedUnits) -> Table:
    """Return the readings of flows below the meter's floor."""
    command, dp, flow = (units.label(unit) for unit in ("V", "MPa", "L/min"))
    return table_of(
        title,
        side.low_flow,
        ("reading", lambda row: row.source),
        ("branch", lambda row: IN_WORDS[row.branch]),
        (f"command ({command})", lambda row: recorded(row.u_V, ".3f V", units)),
        (f"dP ({dp})", lambda row: recorded(row.dp_MPa, ".3f MPa", units)),
        (f"flow ({flow})", lambda row: recorded(row.q_L_min, ".4f L/min", units)),
        (f"error ({flow})", lambda row: recorded(row.q_error_L_min, ".4f L/min", units)),
    )


def _trend(name: str, side: SideModel, units: RecordedUnits) -> str:
    stroke = (
        f"{name.capitalize()} commands: drive range of the valve k x_max/u_max = {side.k_x_max_over_u_max:.4f}, the "
        "command from the knee to full stroke as a share of full command"
    )
    if side.trend is None or side.trend_change_V is None or side.trend_change_se_V is None or side.trend_p is None:
        unknown = "how the threshold moves with the pressure drop is unknown, as all tests have one pressure drop"
        return f"{stroke}; {unknown}."
    change = units.number(1e3 * side.trend_change_V, "+.1f mV")
    error = units.text(1e3 * side.trend_change_se_V, ".1f mV")
    return (
        f"{stroke}; trend of the threshold with the pressure drop: {side.trend}, {change} ± {error} "
        f"over the tested range ({chance(side.trend_p)})."
    )


def _first_of(ramps: Sequence[str]) -> str:
    """Return the first ramp of a test, and how many more there are; valve.json names them all."""
    return f"{ramps[0]} and {len(ramps) - 1} more" if len(ramps) > 1 else ramps[0]


def thresholds_table(side: SideModel, guard: str, title: str, units: RecordedUnits) -> Table:
    """Return the thresholds of each ramp test, with the lower bounds of the guarded one."""
    command, dp, flow = (units.label(unit) for unit in ("V", "MPa", "L/min"))

    def cell(value: float | None, form: str) -> Cell:
        return recorded(value, form, units)

    allowed = (
        (f"allowed at zero ({flow})", lambda row: cell(row[0].zero_flow_L_min, ".2f L/min")),
    )
    leaks = ((f"leak ({flow})", lambda row: cell(row[0].leak_L_min, ".2f L/min")),)
    return table_of(
        title,
        zip(side.tests, side.certified[guard].u_lower_V, strict=True),
        (f"dP ({dp})", lambda row: cell(row[0].dp_MPa, ".3f MPa")),
        (f"knee opening ({command})", lambda row: cell(row[0].u_knee_rising_V, ".3f V")),
        (f"knee closing ({command})", lambda row: cell(row[0].u_knee_falling_V, ".3f V")),
        (f"onset opening ({command})", lambda row: cell(row[0].u_onset_rising_V, ".3f V")),
        (f"onset closing ({command})", lambda row: cell(row[0].u_onset_falling_V, ".3f V")),
        (f"s.e. of knee ({units.label('mV')})", lambda row: cell(1e3 * row[0].u_knee_se_V, ".1f mV")),
        (f"lower bound, {guard} ({command})", lambda row: cell(row[1], ".3f V")),
        (f"slope ({units.label('L/min/V')})", lambda row: cell(row[0].slope_L_min_V, ".3f L/min/V")),
        (f"largest flow ({flow})", lambda row: cell(row[0].q_max_L_min, ".2f L/min")),
        (f"noise ({flow})", lambda row: cell(row[0].noise_L_min, ".3f L/min")),
        (f"noise level ({flow})", lambda row: cell(row[0].noise_level_L_min, ".2f L/min")),
        *(leaks if any(test.leak_L_min for test in side.tests) else ()),
        *(allowed if side.certificate.zero_flow_L_min is not None else ()),
        ("ramp test", lambda row: _first_of(row[0].ramps)),
    )
