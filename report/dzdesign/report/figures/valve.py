"""Figures of the identified valve and of the law, from valve.json and compensator.json alone."""

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.identify.plots.style import CYCLE
from dzdesign.identify.plots.valve_curves import BOUND_NAMES, BRANCHES, draw_beta, draw_thresholds
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.report.compensator_sides import laws_of
from dzdesign.report.figures.figure import (
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
from dzdesign.report.sections.cells import counted


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
