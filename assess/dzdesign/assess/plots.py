"""Plots of an assessment: flow over command at each pressure drop, without and with the compensator."""

from typing import TYPE_CHECKING

from dzdesign.assess.assessment import SETS, Assessment, PressureAssessment
from dzdesign.assess.valve_quantities import Reading
from dzdesign.identify.plots.frame import finish, new_figure, plot_style, saved

if TYPE_CHECKING:
    from matplotlib.figure import Figure

L_MIN, MPA = 1e-3 / 60, 1e6
#: Before and after: they differ in hue for the colour-blind (Okabe and Ito), in lightness in print, and in line.
COLOURS = {"before": "#6E6E6E", "after": "#0072B2"}
LINES, NAMES = ("-", "--"), ("opening", "closing")
BLACK = "#000000"


def plot_files(assessment: Assessment) -> dict[str, bytes]:
    """Draw an assessment; the same recordings give the same bytes.

    Parameters
    ----------
    assessment : Assessment
        Of `assess`.

    Returns
    -------
    dict
        File name -> content: an SVG for each side and pressure drop.
    """
    files = {}
    with plot_style():
        for name, item in zip(_names(assessment), assessment.pressures, strict=True):
            files[f"{name}.svg"] = saved(_figure(assessment, item), "svg")
    return files


def _names(assessment: Assessment) -> list[str]:
    """Return a name for each plot, with as many digits of the pressure drop as tell them apart."""
    several = len({item.side for item in assessment.pressures}) > 1
    for digits in range(3, 17):
        names = [
            "_".join(
                [
                    *([item.side] if several else []),
                    "before_after",
                    *([] if item.dp is None else [f"{item.dp / MPA:.{digits}g}_MPa"]),
                ]
            )
            for item in assessment.pressures
        ]
        if len(set(names)) == len(names):
            break
    return names


def _figure(assessment: Assessment, item: PressureAssessment) -> "Figure":
    """Draw the averaged curves of both sets over the whole command, and the level beside its crossings."""
    sources = [f"{name}: {getattr(item, name).source}" for name in SETS if getattr(item, name)]
    figure = new_figure(5.0, f"Flow over command, {item.place}", "; ".join(sources))
    axes = figure.subplots()
    for name in SETS:
        curves, u_max = getattr(item, name), assessment.options.of_set(name).u_max
        if curves is None:
            continue
        for curve, line, direction in zip((curves.rising, curves.falling), LINES, NAMES, strict=True):
            if curve is not None:
                u, q = curve.read.profile
                axes.plot(100 * u / u_max, q / L_MIN, line, lw=1.4, color=COLOURS[name], label=f"{name}, {direction}")
        for key, marker in (("dead_zone_opening", "^"), ("dead_zone_closing", "v")):
            found: Reading = item.readings[name][key]
            if found.value is not None:
                axes.plot(100 * found.value, item.level / L_MIN, marker, ms=7, color=COLOURS[name], mec=BLACK, mew=0.8,
                          label=f"{name}, dead zone {NAMES[marker == 'v']}", zorder=5)  # fmt: skip
    axes.axhline(item.level / L_MIN, color=BLACK, lw=0.9, ls=":", label=f"level {item.level / L_MIN:.3g} L/min")
    axes.set(xlabel="command (% of full)", ylabel="flow at the nominal pressure drop (L/min)", xlim=(0, 100))
    return finish(figure, 3)
