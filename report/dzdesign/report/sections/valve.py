"""Sections on the identified valve: data and fit, thresholds, beta over the pressure drop."""

from collections.abc import Sequence

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.units import chance
from dzdesign.design.compensator import Compensator
from dzdesign.identify.plots.style import CYCLE
from dzdesign.identify.plots.valve_curves import BOUND_NAMES, BRANCHES, draw_beta, draw_thresholds
from dzdesign.identify.valve.low_flow import IN_WORDS
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.report.artefacts import laws_of
from dzdesign.report.cells import Cell, Table, counted, recorded, table_of
from dzdesign.report.figure import (
    LIGHT,
    ReportFigure,
    csv_text,
    label_ends,
    legend_below,
    side_words,
    span,
    titled_axes,
    to_report_figure,
)
from dzdesign.report.page import Section

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


def lines_figure(side: SideModel, name: str, both: bool, units: RecordedUnits) -> ReportFigure:
    """Draw the straight parts that were fitted, and the knees that they give, one hue a pressure drop."""
    figure, axes = titled_axes(3.5, name, both, right=0.65)
    rows, labels = [], []
    for index, test in enumerate(side.tests):
        hue = LIGHT[CYCLE[index % len(CYCLE)]]
        far = (0.0, 0.0)
        for branch, word, marker, dash, _ in BRANCHES:
            knee, share = getattr(test, f"u_knee_{branch}_V"), getattr(test, f"straight_{branch}")
            if knee is None:
                continue
            flows = np.array(share) * test.q_max_L_min
            ends = knee + flows / test.slope_L_min_V
            far = max(far, (float(ends[1]), float(flows[1])))
            shown, shown_knee = units.convert(ends, "V"), units.convert(knee, "V")
            shown_flows = units.convert(flows, "L/min")
            axes.plot([shown_knee, shown[0]], [0, shown_flows[0]], ":", color=hue, lw=1.2)
            axes.plot(shown, shown_flows, dash, color=hue, lw=1.8)
            axes.plot(shown_knee, 0, marker, color=hue, ms=5, clip_on=False, zorder=4)
            rows.append([test.dp_MPa, word, knee, *ends.round(4).tolist(), *flows.round(4).tolist()])
        place = units.convert(far[0], "V"), units.convert(far[1], "L/min")
        labels.append((*place, "dP not recorded" if test.dp_MPa is None else units.text(test.dp_MPa, ".2f MPa"), hue))
    label_ends(axes, labels)
    for _, word, marker, dash, _ in BRANCHES:
        axes.plot([], [], dash, marker=marker, color=LIGHT["soft"], label=word)
    axes.plot([], [], ":", color=LIGHT["soft"], label="extrapolated to the knee")
    axes.legend(loc="upper left")
    axes.set(
        xlabel=f"valve command u ({units.label('V')})", ylabel=f"flow Q ({units.label('L/min')})", ylim=(0, None)
    )
    if units.falling:
        axes.invert_xaxis()
    return to_report_figure(
        figure,
        f"fit-{name}",
        "The straight part of each branch, where the fit looked, and its extrapolation to zero flow: the knee"
        + side_words(name, both)
        + ". Samples and residuals are drawn by dzdesign identify --plots: the recordings are not part of an "
        "artefact folder.",
        f"Straight lines of flow against command of {counted(len(side.tests), 'pressure drop')}; they meet zero "
        f"flow at the knees, {span([row[2] for row in rows], '.3f V', units)}.",
        csv_text(("dp_MPa", "branch", "knee_V", "from_V", "to_V", "from_L_min", "to_L_min"), rows),
    )


def thresholds_figure(side: SideModel, guard: str, name: str, both: bool, units: RecordedUnits) -> ReportFigure:
    """Draw the thresholds against the pressure drop, and what is certified of the guarded one."""
    curve = side.certified[guard]
    several = len(side.tests) > 1
    pieces = curve.bound(side.trend or "flat").pieces if several else ()
    least_to_next = [round(float(piece.least(piece.from_MPa, piece.to_MPa)), 7) for piece in pieces]
    figure, axes = titled_axes(3.8, name, both, legend_rows=2)
    draw_thresholds(axes, side, curve, units)
    legend_below(figure, 4)
    return to_report_figure(
        figure,
        f"thresholds-{name}",
        f"Thresholds against the pressure drop{side_words(name, both)}. The {guard} threshold is guarded: the "
        "output at zero command stays below "
        + (
            f"the {BOUND_NAMES[curve.premise]}, which is what the bounds of all tests together certify between the "
            f"tests too. {curve.premise_in_words(units)}."
            if several
            else "its lower bound. One pressure drop was tested, and nothing is certified at another."
        ),
        f"Thresholds against the pressure drop: the {guard} threshold lies at "
        f"{span(curve.u_threshold_V, '.3f V', units)}, its lower bound at {span(curve.u_lower_V, '.3f V', units)}, the "
        f"largest certified offset at {span(curve.u_offset_V, '.3f V', units)}.",
        csv_text(
            ("dp_MPa", "knee_opening_V", "knee_closing_V", "onset_opening_V", "onset_closing_V", "threshold_V",
             "lower_bound_V", "offset_V", "certified_up_to_next_V"),
            [
                [
                    test.dp_MPa, test.u_knee_rising_V, test.u_knee_falling_V, test.u_onset_rising_V,
                    test.u_onset_falling_V, curve.u_threshold_V[i], curve.u_lower_V[i],
                    round(curve.u_offset_V[i], 7),
                    least_to_next[i] if i < len(least_to_next) else None,
                ]
                for i, test in enumerate(side.tests)
            ],
        ),
    )  # fmt: skip


def beta_figure(
    side: SideModel, guard: str, name: str, both: bool, compensator: Compensator | None, units: RecordedUnits
) -> ReportFigure | None:
    """Draw beta between what the bounds allow and, where there is a compensator, its table of integers.

    None of a valve tested at one pressure drop.
    """
    curve = side.certified[guard]
    if len(curve.dp_MPa) < 2:
        return None
    dp, u_min0 = np.array(curve.dp_MPa), side.reference.u_min_V
    figure, axes = titled_axes(3.6, name, both, legend_rows=2)
    draw_beta(axes, side, curve, units)
    rows: list[list[str | float | None]] = [
        [f"identified {branch}", at, value, se, volts]
        for branch, found in side.identified.items()
        for at, value, se, volts in zip(found.dp_MPa, found.beta, found.beta_se, found.u_V, strict=True)
    ]
    rows += [
        ["certified", at, round(volts / u_min0, 7), None, volts]
        for at, volts in zip(curve.offset_dp_MPa, curve.offset_V, strict=True)
    ]
    if compensator:
        where, nodes, of_the_C = _beta_table(compensator, name)
        table = nodes * of_the_C / u_min0  # with a transition the C code counts from the opening threshold
        near = (where >= dp[0] - 0.1 * np.ptp(dp)) & (where <= dp[-1] + 0.1 * np.ptp(dp))
        shown = units.convert(where[near], "MPa")
        axes.plot(shown, table[near], ".-", color=LIGHT["ink"], ms=4, lw=1, label="the C code's offset / u_min0")
        rows += [
            ["C", round(float(x), 6), round(float(y), 7), None, round(float(y * of_the_C), 7)]
            for x, y in zip(where, nodes, strict=True)
        ]
    legend_below(figure, 3)
    low, high = min(side.beta.beta), max(side.beta.beta)
    shares = [volts / u_min0 for volts in curve.offset_V]
    return to_report_figure(
        figure,
        f"beta-{name}",
        f"β against the pressure drop{side_words(name, both)}: the identified thresholds over that at dP0, u_min0 = "
        f"{units.text(u_min0, '.4f V')} (Eq. 5), with their error; and over the same u_min0 what is certified of the "
        f"{guard} threshold, under which the law puts out its offset at zero command." + _about_the_table(compensator),
        f"Identified beta lies between {low:.4f} and {high:.4f} over {span(dp, '.2f MPa', units)}, the largest "
        f"certified offset at {min(shares):.4f} to {max(shares):.4f} of u_min0.",
        csv_text(("of", "dp_MPa", "beta", "beta_se", "u_V"), rows),
    )


def _about_the_table(compensator: Compensator | None) -> str:
    if compensator is None:
        return ""
    holds = compensator.below_dp0 == "hold"
    held = " Up to dP0 the C code holds what it has there, as the paper does." if holds else ""
    return f"{held} The table in the C code is rounded down, so that it stays below the bound."


def _beta_table(compensator: Compensator, name: str) -> tuple[np.ndarray, np.ndarray, float]:
    """Return pressure drops (MPa) and betas at the nodes of the compensator's table, and its u_min0 (V)."""
    law = laws_of(compensator)[name]
    nodes = np.array(law.beta)
    where = np.arange(nodes.size) * compensator.beta_step_codes * float(compensator.signals.pressure_a.per_code_MPa)
    return where, nodes / compensator.beta_denominator, float(law.u_min0_over_u_max * compensator.u_max_V)
