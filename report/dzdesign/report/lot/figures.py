"""Figures of the report of a lot: how each quantity scatters, and whether it drifts over the lot."""

import math
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.report.figures.figure import (
    LIGHT,
    WIDTH,
    ReportFigure,
    csv_text,
    figure_style,
    legend_below,
    new_figure,
    to_report_figure,
)
from dzdesign.report.lot.spread import FAR, TWENTY, Spread
from dzdesign.report.lot.valve_names import short

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Bars of a histogram at most: one valve far off must not make a thousand of them.
MOST_BARS = 50
#: Of a smaller lot every valve has its dot; of a larger one the dots would be a line.
EVERY_DOT = 60
#: Of so few there is no shape that bars could show: each valve is a dot on a line, with its name.
STRIP = 10
#: Characters of a name that stands below its dot.
SHORT_NAME = 8
#: Height of a panel with bars, and of one with a line of dots, inches.
BARS_HIGH, STRIP_HIGH = 1.75, 1.15
#: Where dots stand on their line, as a share of the panel's height.
LINE = 0.3
#: Rows of names above the dots; what finds no place is in the table.
LEVELS = 4
#: Names nearer than this in a plane, as shares of its width and height, cover each other.
CLOSE = 0.2, 0.07
#: Behind a name that may stand on a line.
BACKED = {"facecolor": LIGHT["face"], "edgecolor": "none", "pad": 0.8, "alpha": 0.85}
#: Width of a character of a label over the width of the axes.
PER_CHARACTER = 0.011


@contextmanager
def lot_style() -> Iterator[None]:
    """Draw in the report's style; a name may have letters that the font for measuring lacks, the page's has them."""
    with figure_style(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
        yield


def spread_figure(name: str, spreads: Sequence[Spread], caption: str, *, one_scale: bool) -> ReportFigure | None:
    """Draw how quantities scatter, a panel each, top to bottom, on one axis of values or on one each; None of none."""
    if not spreads:
        return None
    figure = new_figure(0.95 + sum(STRIP_HIGH if _is_strip(each) else BARS_HIGH for each in spreads), legend_rows=1)
    panels = figure.subplots(len(spreads), 1, sharex=one_scale, squeeze=False)[:, 0]
    strips = any(map(_is_strip, spreads))
    figure.subplots_adjust(hspace=0.75 if strips else 0.42)
    for axes, spread in zip(panels, spreads, strict=True):
        (_strip if _is_strip(spread) else _bars)(axes, spread)
    for axes, spread in zip(panels, spreads, strict=True):  # where no panel widens the common axis any more
        _mark_far(axes, spread)
        _name_valves(axes, spread)
    handles = {}
    for axes in panels:
        handles.update(dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True)))
    figure.legend(
        handles.values(), handles.keys(), loc="lower center", ncols=5, columnspacing=1.2, borderpad=0.1,
        borderaxespad=0.1, handlelength=1.6,
    )  # fmt: skip
    description = "; ".join(in_words(spread) for spread in spreads) + "."
    csv = csv_text(
        ("quantity", "valve", "value", "robust_sd_from_median"),
        (
            (
                spread.column, valve, value,
                round(spread.distance(value), 2) if spread.limits else None,
            )
            for spread in spreads
            for valve, value in zip(spread.names, spread.values, strict=True)
        ),
    )
    return to_report_figure(figure, name, caption, description, csv)


def in_words(spread: Spread) -> str:
    """Say how a quantity scatters, for who can't see the figure."""
    digits = spread.quantity.digits
    low, middle, high = (f"{value:.{digits}f}" for value in (spread.at.least, spread.at.median, spread.at.largest))
    return f"{spread.heading}: {len(spread.values)} valves from {low} to {high}, median {middle}"


def _is_strip(spread: Spread) -> bool:
    return len(spread.values) <= STRIP or _are_alike(spread)


def _are_alike(spread: Spread) -> bool:
    """Tell whether all valves have one value, as far as its decimals are shown."""
    return spread.at.largest - spread.at.least < 10.0**-spread.quantity.digits


def _strip(axes: "Axes", spread: Spread) -> None:
    """Draw every valve on one line, with the median."""
    low, high = spread.at.least, spread.at.largest
    if _are_alike(spread):
        room = 10.0 ** (1 - spread.quantity.digits)
        axes.set_xlim(low - room, high + room)
        axes.set_xticks([low], [f"{low:.{spread.quantity.digits}f}"])
    axes.axhline(LINE, color=LIGHT["soft"], lw=0.8)
    _limit_lines(axes, spread, low, high)
    axes.plot(spread.values, [LINE] * len(spread.values), "o", ms=6, mfc=LIGHT["sky"], color=LIGHT["blue"],
              label="a valve", zorder=3)  # fmt: skip
    axes.margins(x=0.08)
    axes.set(xlabel=spread.heading, ylim=(0, 1), yticks=[])
    axes.spines["left"].set_visible(False)
    axes.tick_params(labelbottom=True)


def _limit_lines(axes: "Axes", spread: Spread, low: float, high: float) -> None:
    """Draw the median, and the limits of what lies far where they are near the valves."""
    axes.axvline(spread.at.median, color=LIGHT["ink"], lw=1.6, label="median")
    for limit in spread.limits or ():
        if low - 0.15 * (high - low) < limit < high + 0.15 * (high - low):
            axes.axvline(limit, color=LIGHT["vermilion"], lw=1.2, ls=":", label=f"{FAR:g} robust s.d. from it")


def _bars(axes: "Axes", spread: Spread) -> None:
    """Draw bars, median and limits of one quantity."""
    from matplotlib.ticker import MaxNLocator

    counts, edges = np.histogram(spread.values, bins=_edges(spread))
    top = max(counts)
    axes.stairs(counts, edges, fill=True, color=LIGHT["sky"], alpha=0.35)
    axes.stairs(counts, edges, color=LIGHT["blue"], lw=1.1)
    _limit_lines(axes, spread, min(edges), max(edges))
    for value in (spread.at.q05, spread.at.q95) if len(spread.values) >= TWENTY else ():
        axes.axvline(value, color=LIGHT["soft"], lw=1.2, ls="--", label="5 and 95 %")
    if len(spread.values) <= EVERY_DOT:
        axes.plot(spread.values, [-0.09 * top] * len(spread.values), "o", ms=3.5, mfc="none", color=LIGHT["blue"],
                  clip_on=False, label="a valve")  # fmt: skip
    whole_steps = MaxNLocator(nbins=4, integer=True, min_n_ticks=1).tick_values(0, top)
    axes.set(xlabel=spread.heading, ylabel="valves", ylim=(-0.17 * top, 1.08 * top),
             yticks=[tick for tick in whole_steps if 0 <= tick <= top])  # fmt: skip
    axes.tick_params(labelbottom=True)


def _edges(spread: Spread) -> np.ndarray:
    """Return edges of bars by the rule of Freedman and Diaconis, and no more of them than can be seen."""
    low, high = spread.at.least, spread.at.largest
    width = 2 * (spread.at.q75 - spread.at.q25) / len(spread.values) ** (1 / 3)
    fewest = math.ceil(math.log2(len(spread.values))) + 1
    wanted = (high - low) / width if width > 0 else fewest
    most = min(MOST_BARS, 2 * math.sqrt(len(spread.values)))  # of a few valves a quartile says little
    return np.linspace(low, high, 1 + int(max(min(wanted, most), fewest)))


def _mark_far(axes: "Axes", spread: Spread) -> None:
    """Mark the valves that lie far from the rest."""
    far = spread.far()
    if far:
        height = LINE if _is_strip(spread) else 0.55 * axes.get_ylim()[0]
        axes.plot([value for _, value in far], [height] * len(far), "D", ms=4.5, color=LIGHT["vermilion"],
                  clip_on=False, label="far from the rest", zorder=4)  # fmt: skip


def _name_valves(axes: "Axes", spread: Spread) -> None:
    """Name the valves that lie far from the rest, of a strip all; those for which there is room."""
    left, right = axes.get_xlim()
    far = {valve for valve, _ in spread.far()}
    strip = _is_strip(spread)
    named = [one for one in zip(spread.names, spread.values, strict=True) if strip or one[0] in far]
    if _are_alike(spread) and len(named) > 1:
        named = [(f"all {len(named)}", spread.at.median)]
    lowest, step = (LINE + 0.16, 0.17) if strip else (0.2, 0.13)
    ends = [-1.0] * LEVELS
    for valve, value in sorted(named, key=lambda one: one[1]):
        text, at = short(valve), (value - left) / (right - left)
        room = PER_CHARACTER * (len(text) + 1)
        start = min(max(at - room / 2, 0.0), 1 - room)
        level = next((place for place, end in enumerate(ends) if end < start), None)
        if level is None:
            continue
        ends[level] = start + room
        axes.text(start + room / 2, lowest + step * level, text, transform=axes.transAxes, ha="center", fontsize=8,
                  color=LIGHT["vermilion" if valve in far else "ink"], bbox=BACKED)  # fmt: skip


def order_figure(name: str, spread: Spread, caption: str) -> ReportFigure:
    """Draw a quantity over the order of the valves' names."""
    from matplotlib.ticker import MaxNLocator

    figure = new_figure(2.9, legend_rows=1)
    axes = figure.subplots()
    count = len(spread.values)
    size = min(max(30 / math.sqrt(count), 1.8), 4.0)
    axes.plot(range(1, count + 1), spread.values, "o", ms=size, mew=0,
              color=LIGHT["blue"], label="a valve")  # fmt: skip
    axes.axhline(spread.at.median, color=LIGHT["ink"], lw=1.4, label="median")
    for value, label in ((spread.at.q05, "5 and 95 %"), (spread.at.q95, None)) if count >= TWENTY else ():
        axes.axhline(value, color=LIGHT["soft"], lw=1.1, ls="--", label=label)
    far = dict(spread.far())
    places = {valve: place for place, valve in enumerate(spread.names, start=1)}
    if far:
        axes.plot([places[valve] for valve in far], list(far.values()), "D", ms=4.5, mfc="none",
                  color=LIGHT["vermilion"], label="far from the rest", zorder=4)  # fmt: skip
    named: list[tuple[float, float]] = []
    for valve in far:
        at = places[valve] / count, (far[valve] - spread.at.least) / (spread.at.largest - spread.at.least)
        if any(abs(at[0] - x) < CLOSE[0] and abs(at[1] - y) < CLOSE[1] for x, y in named):
            continue  # covered; the table names it
        named.append(at)
        near_end = at[0] > 0.8
        axes.annotate(short(valve), (places[valve], far[valve]), xytext=(-6 if near_end else 6, 0), fontsize=8,
                      textcoords="offset points", va="center", ha="right" if near_end else "left",
                      color=LIGHT["vermilion"])  # fmt: skip
    axes.set(xlabel="valve, in the order of the names", ylabel=spread.heading)
    axes.margins(y=0.12)
    if count <= STRIP and max(map(len, spread.names)) <= SHORT_NAME:
        axes.set(xticks=range(1, count + 1), xticklabels=[short(name) for name in spread.names])
    else:
        axes.xaxis.set_major_locator(MaxNLocator(nbins="auto", steps=[1, 2, 2.5, 5, 10], integer=True))
    edge = 0.5 if count <= STRIP else 1
    axes.set_xlim(1 - edge, count + edge)
    legend_below(figure, 4)
    figure.subplots_adjust(left=0.68 / WIDTH)
    description = f"{in_words(spread)}, in the order of the names."
    csv = csv_text(
        ("place", "valve", spread.column),
        zip(range(1, count + 1), spread.names, spread.values, strict=True),
    )
    return to_report_figure(figure, name, caption, description, csv)
