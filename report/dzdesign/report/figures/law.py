"""Figure of the law in exact coefficients."""

from fractions import Fraction

import numpy as np

from dzdesign.design.compensator import Compensator
from dzdesign.report.compensator_sides import SIGNS, laws_of
from dzdesign.report.figures.figure import LIGHT, ReportFigure, csv_text, side_words, titled_axes, to_report_figure
from dzdesign.verify.exhaustive.exact_law import ExactLaw


def law_figure(compensator: Compensator, name: str, both: bool) -> ReportFigure:
    """Draw the output against the command at the ends of the tested interval, and the threshold's bound."""
    exact = ExactLaw(compensator, SIGNS[name])
    u_max, certificate = float(compensator.u_max_V), laws_of(compensator)[name].certificate
    units = compensator.valve.recorded_units.of_side(name)
    low, high = map(float, certificate.dp_MPa)
    figure, axes = titled_axes(3.2, name, both)
    bare = units.convert(np.array([0.0, u_max]), "V")
    axes.plot([0, 100], bare, ":", color=LIGHT["soft"], lw=1.3, label="without compensator")
    rows = []
    for dp_MPa, dash, hue in ((low, "-", "blue"), (high, "--", "vermilion")):
        corners = exact.corners(exact.betas(round(compensator.signals.dp_code(Fraction(dp_MPa)))))
        percent = [100 * away / exact.span for away, _ in corners]
        volts = [u_max * float(count) / exact.compare_max for _, count in corners]
        shown = units.convert(np.array(volts), "V")
        axes.plot(percent, shown, dash, color=LIGHT[hue], lw=1.8, label=f"at {units.text(dp_MPa, '.2f MPa')}")
        rows += [[round(dp_MPa, 4), round(x, 4), round(y, 6)] for x, y in zip(percent, volts, strict=True)]
    bound = units.convert(min(compensator.valve.sides[name].certified[certificate.guard].u_lower_V), "V")
    axes.axhline(bound, color=LIGHT["green"], lw=1.2, ls="-.", label="least lower bound of the threshold")
    label = f"output u_O ({units.label('V')})"
    axes.set(xlabel="command u_i (% of full)", ylabel=label, xlim=(0, 100))
    if units.falling:
        axes.invert_yaxis()
    else:
        axes.set(ylim=(units.convert(0.0, "V"), None))
    axes.legend(loc="lower right")
    return to_report_figure(
        figure,
        f"law-{name}",
        f"The law in exact coefficients at both ends of the tested interval{side_words(name, both)}.",
        f"The compensator's output starts at {units.text(rows[0][2], '.3f V')} and ends at "
        f"{units.text(rows[-1][2], '.3f V')}.",
        csv_text(("dp_MPa", "command_percent", "output_V"), rows),
    )
