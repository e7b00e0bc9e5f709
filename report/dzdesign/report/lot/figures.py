"""Figures of the report of a lot: each quantity over the order of the valves' names, and its histogram."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from dzdesign.report.figures.figure import (
    LIGHT,
    ReportFigure,
    csv_text,
    legend_below,
    new_figure,
    to_report_figure,
)
from dzdesign.report.lot.spread import FAR, TWENTY, Spread
from dzdesign.report.lot.valve_names import short

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Of so few valves each is named, and there is no shape that bars could show.
NAMED = 10
#: Characters of a name that stands level below its dot; longer ones are slanted.
LEVEL_NAME = 8
#: More dots than these are one image: as shapes they would make the page large.
MANY = 500
#: Height of a panel, inches.
PANEL = 1.75
#: Names nearer than this in a panel, as shares of its width and height, cover each other.
CLOSE = 0.25, 0.12


def spread_figure(name: str, spreads: Sequence[Spread], caption: str, *, one_scale: bool) -> ReportFigure | None:
    """Draw quantities over the order of the names, a panel each, on one scale or on one each; None of none.

    Beside a panel stands its histogram, unless the valves are few.
    """
    if not spreads:
        return None
    many = max(len(spread.values) for spread in spreads) > NAMED
    figure = new_figure(0.95 + PANEL * len(spreads), legend_rows=1, top=0.3)
    panels = figure.subplots(
        len(spreads), 1 + many, sharex="col", sharey="all" if one_scale else "row", squeeze=False,
        width_ratios=(5, 1) if many else None, gridspec_kw={"wspace": 0.03, "hspace": 0.32},
    )  # fmt: skip
    drawn = [spread.shown() for spread in spreads]
    for (axes, *beside), spread in zip(panels, drawn, strict=True):
        _draw_order(axes, spread)
        for shape in beside:
            _draw_bars(shape, spread)
    for row, spread in zip(panels, drawn, strict=True):  # where no panel widens a common scale any more
        _name_far(row[0], spread)
    panels[-1][0].set_xlabel("valve, in the order of the names")
    if many:
        panels[-1][1].set_xlabel("valves")
    legend_below(figure, 5)
    csv = csv_text(
        ("quantity", "valve", "value", "robust_sd_from_median"),
        (
            (spread.column, valve, value, round(spread.distance(value), 2) if spread.limits else None)
            for spread in spreads
            for valve, value in zip(spread.names, spread.values, strict=True)
        ),
    )
    return to_report_figure(figure, name, caption, "; ".join(map(_in_words, spreads)) + ".", csv)


def _in_words(spread: Spread) -> str:
    """Say how a quantity scatters, for who can't see the figure."""
    low, middle, high = map(spread.text, (spread.at.least, spread.at.median, spread.at.largest))
    return f"{spread.heading}: {len(spread.values)} valves from {low} to {high}, median {middle}"


def _draw_order(axes: "Axes", spread: Spread) -> None:
    """Draw every valve, the median and, where they are near the valves, the limits of what lies far."""
    from matplotlib.ticker import MaxNLocator

    count, low, high = len(spread.values), spread.at.least, spread.at.largest
    axes.plot(range(1, count + 1), spread.values, "o", ms=min(max(30 / math.sqrt(count), 1.8), 6), mew=0,
              color=LIGHT["blue"], label="a valve", rasterized=count > MANY)  # fmt: skip
    axes.axhline(spread.at.median, color=LIGHT["ink"], lw=1.4, label="median")
    for value in (spread.at.q05, spread.at.q95) if count >= TWENTY else ():
        axes.axhline(value, color=LIGHT["soft"], lw=1.1, ls="--", label="5 and 95 %")
    for limit in spread.limits or ():
        if low - 0.15 * (high - low) < limit < high + 0.15 * (high - low):
            axes.axhline(limit, color=LIGHT["vermilion"], lw=1.2, ls=":", label=f"{FAR:g} robust s.d. from it")
    least_height = 10.0 ** (1 - spread.quantity.digits)  # no scale finer than the decimals that are shown
    axes.update_datalim([(1, spread.at.median - least_height), (1, spread.at.median + least_height)])
    axes.margins(y=0.12)
    axes.set_title(spread.heading)
    edge = 0.5 if count <= NAMED else 1
    axes.set_xlim(1 - edge, count + edge)
    if count <= NAMED:
        level = max(map(len, spread.names)) <= LEVEL_NAME
        axes.set_xticks(range(1, count + 1), list(map(short, spread.names)), rotation=0 if level else 12)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(nbins="auto", steps=[1, 2, 2.5, 5, 10], integer=True))


def _draw_bars(axes: "Axes", spread: Spread) -> None:
    """Draw how many valves have which value, in as many bars as the rule of Rice says."""
    from matplotlib.ticker import MaxNLocator

    count = math.ceil(2 * len(spread.values) ** (1 / 3))
    axes.hist(spread.values, bins=count, orientation="horizontal", histtype="stepfilled",
              fc=(LIGHT["sky"], 0.35), ec=LIGHT["blue"])  # fmt: skip
    axes.xaxis.set_major_locator(MaxNLocator(nbins=3, integer=True))
    axes.tick_params(labelleft=False)


def _name_far(axes: "Axes", spread: Spread) -> None:
    """Mark the valves that lie far from the rest, and name those for which there is room, the farthest first."""
    far = dict(spread.far())
    if not far:
        return
    places = [spread.names.index(valve) + 1 for valve in far]
    axes.plot(places, list(far.values()), "D", ms=4.5, mfc="none", color=LIGHT["vermilion"], label="far from the rest",
              zorder=4)  # fmt: skip
    low, high = axes.get_ylim()
    named: list[tuple[float, float]] = []
    for place, (valve, value) in zip(places, far.items(), strict=True):
        at = place / len(spread.values), (value - low) / (high - low)
        if any(abs(at[0] - x) < CLOSE[0] and abs(at[1] - y) < CLOSE[1] for x, y in named):
            continue  # covered; the table names it
        named.append(at)
        near_end = at[0] > 0.8
        axes.annotate(short(valve), (place, value), xytext=(-6 if near_end else 6, 0), textcoords="offset points",
                      fontsize=8, va="center", ha="right" if near_end else "left",
                      color=LIGHT["vermilion"])  # fmt: skip
