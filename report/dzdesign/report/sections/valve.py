"""Sections on the identified valve: test conditions, data and fit, thresholds, beta over the pressure drop."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from msgspec import UnsetType

from dzdesign.assess.assessment import Assessment
from dzdesign.assess.options import SETS
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.units import chance
from dzdesign.design.compensator import Compensator
from dzdesign.identify.plots.valve_curves import BOUND_NAME, draw_beta, draw_thresholds
from dzdesign.identify.valve.low_flow import IN_WORDS
from dzdesign.identify.valve.model import ValveModel, lag_in_words
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.report.artefacts import laws_of
from dzdesign.report.figure import (
    LIGHT,
    ReportFigure,
    csv_text,
    legend_below,
    side_words,
    titled_axes,
    to_report_figure,
)
from dzdesign.report.page import (
    Cell,
    Section,
    Table,
    counted,
    in_number_font,
    in_units,
    recorded,
    table_of,
    table_of_rows,
)
from dzdesign.report.sections.quantities import entry_of, measured_curve_of

#: Nodes nearer to a test than this are in its interval, MPa.
SAME_MPa = 1e-6
#: Warnings about the order of the recordings, which bear on the bounds.
ORDER = ("order", "time-stamps")
#: What a record may tell -> words in the names of its entries; the first entry that has one counts.
RECORDED = {
    "Oil": ("oil", "fluid", "öl", "druckflüssigkeit", "hydraulic oil", "hydrauliköl"),
    "Oil temperature": (
        "oil temperature", "temperature", "oil temp", "fluid temperature", "öltemperatur", "temperatur",
        "temperatur der druckflüssigkeit",
    ),
    "Filter": ("filter", "flow filter", "signal filter", "messfilter"),
}  # fmt: skip


def valve_sections(valve: ValveModel | None, compensator: Compensator | None) -> dict[str, Section]:
    """Return the sections "data", "thresholds" and "beta", of the guard of the compensator where there is one."""
    if valve is None:
        gap = Section(missing="The valve is not here: `dzdesign identify` makes valve.json.")
        return {"data": gap, "thresholds": gap, "beta": gap}
    both = len(valve.sides) > 1
    thresholds, tables, betas = [], [], []
    for name, side in valve.sides.items():
        law, units = laws_of(compensator).get(name), valve.recorded_units.of_side(name)
        guard = law.certificate.guard if law else side.certificate.guard
        thresholds.append(thresholds_figure(side, guard, name, both, units))
        tables.append(thresholds_table(side, guard, f"Thresholds, {name} commands", units))
        if side.low_flow:
            tables.append(low_flow_table(side, f"Flows measured by hand, {name} commands", units))
        betas.append(beta_figure(side, guard, name, both, compensator if law else None, units))
    meter, units = valve.meter, valve.recorded_units
    shown = units.in_words()
    return {
        "data": Section(
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
    return table_of(
        title,
        side.low_flow,
        ("reading", lambda row: row.source),
        ("branch", lambda row: IN_WORDS[row.branch]),
        in_units("command", "u_V", ".3f V", units),
        in_units("dP", "dp_MPa", ".3f MPa", units),
        in_units("flow", "q_L_min", ".4f L/min", units),
        in_units("error", "q_error_L_min", ".4f L/min", units),
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
    bounds = dict(zip(map(id, side.tests), side.certified[guard].u_lower_V, strict=True))
    leaks = [in_units("leak", "leak_L_min", ".2f L/min", units)]
    allowed = [in_units("allowed at zero", "zero_flow_L_min", ".2f L/min", units)]
    return table_of(
        title,
        side.tests,
        in_units("dP", "dp_MPa", ".3f MPa", units),
        in_units("knee opening", "u_knee_rising_V", ".3f V", units),
        in_units("knee closing", "u_knee_falling_V", ".3f V", units),
        in_units("onset opening", "u_onset_rising_V", ".3f V", units),
        in_units("onset closing", "u_onset_falling_V", ".3f V", units),
        (f"s.e. of knee ({units.label('mV')})", lambda test: recorded(1e3 * test.u_knee_se_V, ".1f mV", units)),
        (f"lower bound, {guard} ({units.label('V')})", lambda test: recorded(bounds[id(test)], ".3f V", units)),
        in_units("slope", "slope_L_min_V", ".3f L/min/V", units),
        in_units("largest flow", "q_max_L_min", ".2f L/min", units),
        in_units("noise", "noise_L_min", ".3f L/min", units),
        in_units("noise level", "noise_level_L_min", ".2f L/min", units),
        *(leaks if any(test.leak_L_min for test in side.tests) else ()),
        *(allowed if side.certificate.zero_flow_L_min is not None else ()),
        ("ramp test", lambda test: _first_of(test.ramps)),
    )


def thresholds_figure(side: SideModel, guard: str, name: str, both: bool, units: RecordedUnits) -> ReportFigure:
    """Draw the thresholds against the pressure drop, and what is certified of the guarded one."""
    curve = side.certified[guard]
    several = len(side.tests) > 1

    def span(values: Sequence[float]) -> str:
        return units.span(min(values), max(values), ".3f V")

    nodes, bound = np.array(curve.bound_dp_MPa), np.array(curve.bound_V)
    certified = several and curve.premise != "none"
    least_to_next = [
        round(float(bound[(nodes >= low - SAME_MPa) & (nodes <= high + SAME_MPa)].min()), 7)
        for low, high in pairwise(curve.dp_MPa)
    ] if certified else []  # fmt: skip
    figure, axes = titled_axes(3.8, name, both)
    draw_thresholds(axes, side, curve, units)
    legend_below(figure, 4)
    return to_report_figure(
        figure,
        f"thresholds-{name}",
        f"Thresholds against the pressure drop{side_words(name, both)}. The {guard} threshold is guarded: the "
        "output at zero command stays below "
        + (
            f"the {BOUND_NAME}, which is what the bounds of all tests together certify between the "
            f"tests too. {curve.premise_in_words(units)}."
            if several
            else "its lower bound. One pressure drop was tested, and nothing is certified at another."
        ),
        f"Thresholds against the pressure drop: the {guard} threshold lies {span(curve.u_threshold_V)}, its lower "
        f"bound {span(curve.u_lower_V)}, the largest certified offset {span(curve.u_offset_V)}.",
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
    figure, axes = titled_axes(3.6, name, both)
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
        f"Identified beta lies between {low:.4f} and {high:.4f} {units.span(dp[0], dp[-1], '.2f MPa')}, the largest "
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
    ahead = compensator.signals.pair(-1 if name == "negative" else 1).ahead
    where = np.arange(nodes.size) * compensator.beta_step_codes * float(ahead.per_code_MPa)
    return where, nodes / compensator.beta_denominator, float(law.u_min0_over_u_max * compensator.u_max_V)


# --- test conditions -------------------------------------------------------------------------------------------


def conditions_section(valve: ValveModel | None, assessment: Assessment | None) -> Section:
    """Return the section on how, with which meter and oil the ramps were recorded, with the compensator apart."""
    if assessment:
        heads: tuple[str, ...] = ("without the compensator", "with the compensator")
        sets = [
            [curve.conditions for item in assessment.pressures if (curve := measured_curve_of(item, name))]
            for name in SETS
        ]
        units, floor = assessment.recorded_units, assessment.meter.floor_L_min
        meter = lag_in_words(assessment.meter.lag_s, assessment.meter.lag_is)
    elif valve:
        heads = ("recordings",)
        found = [test.conditions for side in valve.sides.values() for test in side.tests]
        sets = [[each for each in found if not isinstance(each, UnsetType)]]
        units, floor, meter = valve.recorded_units, valve.meter.floor_L_min, valve.meter.lag_in_words()
    else:
        return Section(missing="No recordings are here: `dzdesign identify` makes valve.json.")
    entries = {name: entry_of(valve.record if valve else {}, known) for name, known in RECORDED.items()}
    alike = [
        ("Flow meter", f"{meter}; floor {units.text(floor, '.2f L/min')}"),
        *([("Dither", valve.dither_in_words)] if valve and valve.dither else []),
        *entries.items(),
    ]
    rows = [
        ("Ramp rate", [_range([each.rate_V_s for each in of], ".3g V/s", units) for of in sets]),
        ("Sampling", [_range([each.sampling_Hz for each in of], ".4g Hz", units) for of in sets]),
        ("Samples", [str(sum(each.samples for each in of)) if of else "" for of in sets]),
        *((name, [text] * len(sets)) for name, text in alike),
    ]
    missing = [name.lower() for name, text in entries.items() if not text]
    hint = "".join(f"`identify --record \"{name} = ...\"` writes it into valve.json." for name in missing[:1])
    hint = f"Not recorded: {', '.join(missing)}. {hint}" if missing else ""
    table = table_of_rows("Recordings", ("", *heads), [(name, *map(_condition, texts)) for name, texts in rows])
    return Section(tables=(table,), missing=hint, optional=True)


def _condition(text: str) -> Cell:
    return in_number_font(text) if text[:1].isdigit() else Cell(text=text or "not recorded")


def _range(values: Sequence[float | None], form: str, units: RecordedUnits) -> str:
    known = [value for value in values if value is not None]
    if not known:
        return ""
    spec, _, unit = form.partition(" ")
    ends = (format(end, spec) if unit == "Hz" else units.number(end, form) for end in (min(known), max(known)))
    return f"{' … '.join(dict.fromkeys(ends))} {unit if unit == 'Hz' else units.label(unit)}"
