"""Sections on the identified valve: test conditions and data, thresholds over the pressure drop."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from msgspec import UnsetType

from dzdesign.assess.assessment import Assessment
from dzdesign.assess.options import SETS
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.units import chance
from dzdesign.design.compensator import Compensator
from dzdesign.identify.plots.valve_curves import BOUND_NAME, draw_thresholds
from dzdesign.identify.valve.low_flow import IN_WORDS
from dzdesign.identify.valve.model import ValveModel, lag_in_words
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.report.artefacts import laws_of
from dzdesign.report.figure import (
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
    for_both_sides,
    in_number_font,
    in_units,
    recorded,
    table_of,
    table_of_rows,
)
from dzdesign.report.sections.quantities import entry_of, measured_curve_of
from dzdesign.verify.evidence import Evidence

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


def thresholds_section(valve: ValveModel | None, compensator: Compensator | None, evidence: Evidence | None) -> Section:
    """Return the section on the thresholds, of the guard of the compensator where there is one."""
    if valve is None:
        return Section(missing="The valve is not here: `dzdesign identify` makes valve.json.")
    both = len(valve.sides) > 1
    figures, tables, lines = [], [], []
    for name, side in valve.sides.items():
        law, units = laws_of(compensator).get(name), valve.recorded_units.of_side(name)
        guard = law.certificate.guard if law else side.certificate.guard
        figures.append(thresholds_figure(side, guard, name, both, units) if len(side.tests) > 1 else None)
        tables.append(thresholds_table(side, guard, f"Thresholds, {name} commands", units))
        if side.low_flow:
            tables.append(low_flow_table(side, f"Flows measured by hand, {name} commands", units))
        lines.append(f"Premise, {name} commands: {side.premise_in_words(units)}.")
        if side.low_flow:
            lines.append(f"At the bounds, {name} commands: {side.none_in_words(side.certificate.guard, units)}.")
    if compensator:
        lines += certificate_lines(compensator, evidence)
    lines += [f"{warning.text}." for warning in valve.warnings if warning.code in (*ORDER, "low-flow")]
    return Section(figures=figures, tables=tables, lines=for_both_sides(lines))


def certificate_lines(compensator: Compensator, evidence: Evidence | None) -> Iterator[str]:
    """Yield of each side what is certified, and by which margin the output at zero command lies under it."""
    # A machine's or a lot's reserve is in the margin, too.
    rounding = compensator.machine is None and not compensator.lot
    for name, law in laws_of(compensator).items():
        certificate, side = law.certificate, compensator.valve.sides[name]
        units = compensator.valve.recorded_units.of_side(name)
        found = [each.smallest_margin_V for each in (evidence.inputs if evidence else ()) if each.side == name]
        margin = units.text(1e3 * min(found, default=float(certificate.smallest_margin_V)), ".3f mV")
        of_c = f"of the C code{': rounding alone' if rounding else ''}; the statistical reserve is in the bound"
        of_law = "of the exact law under the certified offset; the statistical reserve is in that offset"
        low, high = map(float, certificate.dp_MPa)
        interval = units.span(low, high, ".2f MPa")
        declared = "" if certificate.zero_flow_L_min is None else f"; {side.zero_flow_in_words(units)}"
        between = side.between_in_words(certificate.guard).removeprefix("between the tests: ")
        yield (
            f"Certificate, {name} commands: with {100 * certificate.confidence:g} % confidence the output at zero "
            f"command stays below the {certificate.guard} threshold {interval}; "
            f"smallest margin {margin} {of_c if found else of_law}{declared}; {between}."
        )


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
        ("ramps", lambda test: in_number_font(str(len(test.ramps)))),
    )


def thresholds_figure(side: SideModel, guard: str, name: str, both: bool, units: RecordedUnits) -> ReportFigure:
    """Draw the thresholds against the pressure drop, and what is certified of the guarded one."""
    curve = side.certified[guard]
    def span(values: Sequence[float]) -> str:
        return units.span(min(values), max(values), ".3f V")

    nodes, bound = np.array(curve.bound_dp_MPa), np.array(curve.bound_V)
    certified = curve.premise != "none"
    least_to_next = [
        round(float(bound[(nodes >= low - SAME_MPa) & (nodes <= high + SAME_MPa)].min()), 7)
        for low, high in pairwise(curve.dp_MPa)
    ] if certified else []  # fmt: skip
    figure, axes = titled_axes(3.2, name, both)
    draw_thresholds(axes, side, curve, units)
    legend_below(figure, 4)
    return to_report_figure(
        figure,
        f"thresholds-{name}",
        f"Thresholds against the pressure drop{side_words(name, both)}. The {guard} threshold is guarded: the "
        f"output at zero command stays below the {BOUND_NAME}, which is what the bounds of all tests together certify "
        "between the tests too.",
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


# --- test conditions -------------------------------------------------------------------------------------------


def conditions_section(valve: ValveModel | None, assessment: Assessment | None) -> Section:
    """Return the section on how, with which meter and oil the ramps were recorded, with the compensator apart."""
    lines = _data_lines(valve) if valve else ()
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
    return Section(tables=(table,), lines=lines, missing=hint, optional=True)


def _data_lines(valve: ValveModel) -> tuple[str, ...]:
    """Return what was recorded, and what it shows of the valve beside its thresholds."""
    units = valve.recorded_units
    shown = units.in_words()
    sides = for_both_sides(
        line
        for name, side in valve.sides.items()
        for line in (
            _trend(name, side, units.of_side(name)),
            f"{name.capitalize()} commands, from ramp to ramp: {side.certificate.repeatability.in_words(units)}.",
        )
    )
    return (
        f"{_ramp_tests(valve)}; full command {units.text(valve.u_max_V, 'g V')}.",
        *([f"Units: {shown}; the files and the curves as CSV are in V, MPa and L/min."] if shown else []),
        *sides,
        *(f"{name.capitalize()} commands: not tested." for name in valve.untested_sides),
    )


def _condition(text: str) -> Cell:
    return in_number_font(text) if text[:1].isdigit() else Cell(text=text or "not recorded")


def _range(values: Sequence[float | None], form: str, units: RecordedUnits) -> str:
    known = [value for value in values if value is not None]
    if not known:
        return ""
    spec, _, unit = form.partition(" ")
    ends = (format(end, spec) if unit == "Hz" else units.number(end, form) for end in (min(known), max(known)))
    return f"{' … '.join(dict.fromkeys(ends))} {unit if unit == 'Hz' else units.label(unit)}"
