"""Plots of an assessment: flow against command at each pressure drop, without and with the compensator."""

from typing import TYPE_CHECKING

from dzdesign.assess.assessment import Assessment, PressureAssessment
from dzdesign.assess.curve_pairs import Comparison, CurvePair
from dzdesign.identify.constants import L_MIN
from dzdesign.identify.plots.frame import finish, new_figure, pressure_names, saved
from dzdesign.identify.plots.style import HUES, plot_style
from dzdesign.identify.plots.valve_curves import BRANCHES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = {"before": HUES["soft"], "after": HUES["blue"]}


def plot_files(comparison: Comparison, assessment: Assessment) -> dict[str, bytes]:
    """Draw an SVG for each side and pressure drop: file name -> content; the same recordings give the same bytes."""
    pressures = assessment.pressures
    several = len({item.side for item in pressures}) > 1
    stems = [f"{item.side}_before_after" if several else "before_after" for item in pressures]
    names = pressure_names(stems, [item.dp_MPa for item in pressures])
    with plot_style():
        return {
            f"{name}.svg": saved(_figure(pair, item, comparison), "svg")
            for name, pair, item in zip(names, comparison.pairs, pressures, strict=True)
        }


def _figure(pair: CurvePair, item: PressureAssessment, comparison: Comparison) -> "Figure":
    """Draw the averaged curves of both sets over the whole command, and the reading flow beside its crossings."""
    options, units = comparison.options, comparison.units
    reading_flow = units.convert(item.reading_flow_L_min, "L/min")
    sources = "; ".join(f"{name}: {curves.source}" for name, curves in pair.sets.items())
    figure = new_figure(5.0, f"Flow against command, {item.place(units)}", sources)
    axes = figure.subplots()
    for name, curves in pair.sets.items():
        u_max, readings = options.of_set(name).u_max, item.readings(name)
        for (_, direction, _, line, _), curve in zip(BRANCHES, (curves.rising, curves.falling), strict=True):
            if curve is not None:
                u, q = curve.read.profile
                flow = units.convert(q / L_MIN, "L/min")
                axes.plot(100 * u / u_max, flow, line, lw=1.4, color=COLOURS[name], label=f"{name}, {direction}")
        for _, direction, marker, *_ in BRANCHES:
            at = readings[f"dead_zone_{direction}"].value
            if at is not None:
                axes.plot(at, reading_flow, marker, ms=7, color=COLOURS[name], mec=HUES["ink"], mew=0.8,
                          label=f"{name}, dead zone {direction}", zorder=5)  # fmt: skip
    shown = units.text(item.reading_flow_L_min, ".3g L/min")
    axes.axhline(reading_flow, color=HUES["ink"], lw=0.9, ls=":", label=f"reading flow {shown}")
    flow_axis = f"flow at the nominal pressure drop ({units.label('L/min')})"
    axes.set(xlabel="command (% of full)", ylabel=flow_axis, xlim=(0, 100))
    return finish(figure, 3)
