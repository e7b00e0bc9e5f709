"""Plots of an assessment: flow over command at each pressure drop, without and with the compensator."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dzdesign.assess.assessment import Assessment, PressureAssessment
from dzdesign.assess.curve_pairs import Comparison, CurvePair
from dzdesign.assess.options import AssessOptions
from dzdesign.assess.quantities import L_MIN
from dzdesign.identify.plots.frame import finish, new_figure, plot_style, saved

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Before and after: they differ in hue for the colour-blind (Okabe and Ito), in lightness in print, and in line.
COLOURS = {"before": "#6E6E6E", "after": "#0072B2"}
LINES, MARKERS, DIRECTIONS = ("-", "--"), ("^", "v"), ("opening", "closing")
BLACK = "#000000"


def plot_files(comparison: Comparison, assessment: Assessment) -> dict[str, bytes]:
    """Draw an SVG for each side and pressure drop: file name -> content; the same recordings give the same bytes."""
    names = _names(assessment.pressures)
    with plot_style():
        return {
            f"{name}.svg": saved(_figure(pair, item, comparison.options), "svg")
            for name, pair, item in zip(names, comparison.pairs, assessment.pressures, strict=True)
        }


def _names(pressures: Sequence[PressureAssessment]) -> list[str]:
    """Return a name for each plot, with as many digits of the pressure drop as tell them apart."""
    several = len({item.side for item in pressures}) > 1
    names: list[str] = []
    for digits in range(3, 17):
        names = [
            (f"{item.side}_" if several else "")
            + "before_after"
            + ("" if item.dp_MPa is None else f"_{item.dp_MPa:.{digits}g}_MPa")
            for item in pressures
        ]
        if len(set(names)) == len(names):
            break
    return names


def _figure(pair: CurvePair, item: PressureAssessment, options: AssessOptions) -> "Figure":
    """Draw the averaged curves of both sets over the whole command, and the level beside its crossings."""
    sources = "; ".join(f"{name}: {curves.source}" for name, curves in pair.sets.items())
    figure = new_figure(5.0, f"Flow over command, {item.place}", sources)
    axes = figure.subplots()
    for name, curves in pair.sets.items():
        u_max, readings = options.of_set(name).u_max, item.readings(name)
        both = zip((curves.rising, curves.falling), LINES, DIRECTIONS, strict=True)
        for curve, line, direction in both:
            if curve is not None:
                u, q = curve.read.profile
                axes.plot(100 * u / u_max, q / L_MIN, line, lw=1.4, color=COLOURS[name], label=f"{name}, {direction}")
        for direction, marker in zip(DIRECTIONS, MARKERS, strict=True):
            at = readings[f"dead_zone_{direction}"].value
            if at is not None:
                axes.plot(at, item.level_L_min, marker, ms=7, color=COLOURS[name], mec=BLACK, mew=0.8,
                          label=f"{name}, dead zone {direction}", zorder=5)  # fmt: skip
    axes.axhline(item.level_L_min, color=BLACK, lw=0.9, ls=":", label=f"level {item.level_L_min:.3g} L/min")
    axes.set(xlabel="command (% of full)", ylabel="flow at the nominal pressure drop (L/min)", xlim=(0, 100))
    return finish(figure, 3)
