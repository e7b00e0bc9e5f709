"""How a quantity scatters over a lot, which valves lie far from the rest of it, and its figure."""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields, replace
from statistics import median
from typing import TYPE_CHECKING

from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.report.figure import LIGHT, ReportFigure, csv_text, legend_below, new_figure, to_report_figure
from dzdesign.report.lot.summary import OK, Quantiles
from dzdesign.report.lot.table import by_name, column_of, sides_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from polars import DataFrame

#: Of the fields of `Quantiles`, in their order.
LEVELS = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
#: Beyond so many robust standard deviations a valve is far from the rest: the limit that Iglewicz and Hoaglin (1993)
#: recommend. Of a normal lot one valve in 2000 lies there, which keeps a list of a thousand valves short.
FAR = 3.5
#: Median absolute deviation -> standard deviation, of a normal distribution: 1 over its upper quartile.
PER_MAD = 1.4826
#: In a smaller lot the deviation itself is not known well enough to call a valve far; and a twentieth is less than a
#: valve: 5 and 95 % say no more than the ends.
FEWEST, TWENTY = 8, 20
#: Of so few valves each is named, and there is no shape that bars could show; more dots than these are one image.
NAMED, MANY = 10, 500
#: Characters of a valve's name in a narrow place; of one that stands level below its dot, longer ones are slanted.
SHORT, LEVEL_NAME = 18, 8
#: Height of a panel, inches; names nearer than this in it, as shares of its width and height, cover each other.
PANEL, CLOSE = 1.75, (0.25, 0.12)
#: What a lot setting costs a valve.
EXTRA = "lot_extra_dead_zone_percent"


@dataclass(frozen=True, slots=True)
class Quantity:
    """A column of the table that scatters, without its side: in words, as a heading, unit (empty of a ratio), decimals.

    What is in V is shown in the units of the recordings. A valve can be far from the rest in it if it is judged. The
    cost of the lot setting is not: it follows from the offsets, and its least is no merit.
    """

    column: str
    label: str
    short_label: str
    unit: str
    digits: int
    judged: bool = True

    def heading(self, units: RecordedUnits, *, short: bool = False) -> str:
        """Return label and unit, as on an axis, or for the head of a narrow column."""
        label = self.short_label if short else self.label
        return f"{label} ({self.unit_in(units)})" if self.unit else label

    def unit_in(self, units: RecordedUnits) -> str:
        """Return the name of the unit in which it is shown."""
        return units.label("V") if self.unit == "V" else self.unit


#: Columns of the table whose quantiles tell of the batch, by name.
QUANTITIES = {
    each.column: each
    for each in (
        Quantity("knee_opening_V", "knee on opening", "knee opening", "V", 3),
        Quantity("knee_closing_V", "knee on closing", "knee closing", "V", 3),
        Quantity("offset_V", "offset at dP0", "offset", "V", 3),
        Quantity("beta_at_highest_dp", "β at the highest dP", "β at highest dP", "", 4),
        Quantity("k_x_max_over_u_max", "k x_max/u_max", "k x_max/u_max", "", 4),
        Quantity("dead_zone_opening_percent", "dead zone left on opening", "left on opening", "%", 2),
        Quantity("dead_zone_closing_percent", "dead zone left on closing", "left on closing", "%", 2),
        Quantity(EXTRA, "extra dead zone of the lot setting", "extra of the lot setting", "%", 2, judged=False),
    )
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """A quantity of one side over the lot: the valves that have it, in the order of the table, with their values.

    `deviation` is the robust standard deviation, in the quantity's unit; 0 where it says nothing. `units` are those in
    which its side is shown.
    """

    quantity: Quantity
    side: str
    names: tuple[str, ...]
    values: tuple[float, ...]
    at: Quantiles
    deviation: float
    units: RecordedUnits = AS_COMPUTED

    @property
    def heading(self) -> str:
        """What stands on its axis."""
        return (f"{self.side} side: " if self.side else "") + self.quantity.heading(self.units)

    def text(self, value: float) -> str:
        """Return a value with its decimals, as it is shown."""
        digits = self.quantity.digits
        return self.units.number(value, f".{digits}f V") if self.quantity.unit == "V" else f"{value:.{digits}f}"

    def shown(self) -> "Spread":
        """Return it with the numbers in the units of the recordings, to be drawn."""
        if self.quantity.unit != "V":
            return self
        values, at = ([float(self.units.convert(one, "V")) for one in of] for of in (self.values, astuple(self.at)))
        names = (each.name for each in fields(Quantiles))
        return replace(
            self,
            values=tuple(values),
            at=Quantiles(**dict(zip(names, sorted(at), strict=True))),  # a reading may fall where the command rises
            deviation=float(self.units.convert(self.deviation, "dV")),
        )

    @property
    def column(self) -> str:
        """Its column of the table."""
        return column_of(self.side, self.quantity.column)

    @property
    def limits(self) -> tuple[float, float] | None:
        """Beyond which a valve is far from the rest; None where the lot is too small or has no spread."""
        if not self.deviation or not self.quantity.judged:
            return None
        return self.at.median - FAR * self.deviation, self.at.median + FAR * self.deviation

    def distance(self, value: float) -> float:
        """Return how many robust standard deviations a value lies from the median."""
        return (value - self.at.median) / self.deviation

    def far(self) -> tuple[tuple[str, float], ...]:
        """Return name and value of the valves far from the rest, the farthest first."""
        if self.limits is None:
            return ()
        found = [one for one in zip(self.names, self.values, strict=True) if abs(self.distance(one[1])) > FAR]
        return tuple(sorted(found, key=lambda one: (-abs(self.distance(one[1])), by_name(one[0]))))

    @property
    def ends(self) -> tuple[str, str]:
        """A valve that has the least value, and one that has the largest."""
        low, high = (self.names[self.values.index(value)] for value in (self.at.least, self.at.largest))
        return low, high


def quantiles(values: Sequence[float]) -> Quantiles:
    """Return quantiles, linear between the two nearest valves (the seventh method of Hyndman and Fan, 1996).

    The median of an even number is then the mean of the two middle ones, the ends are values of valves.

    Examples
    --------
    >>> quantiles([1.0, 2.0, 5.0, 4.0]).median
    3.0
    """
    import polars

    known = polars.Series(values, dtype=polars.Float64)
    at = [known.quantile(level, "linear") or 0.0 for level in LEVELS]
    between = [known.min(), *(round(value, 7) for value in at[1:-1]), known.max()]
    return Quantiles(**dict(zip((each.name for each in fields(Quantiles)), between, strict=True)))


def spread_of(frame: "DataFrame", column: str, side: str, units: RecordedUnits = AS_COMPUTED) -> Spread | None:
    """Return how a column of `QUANTITIES` scatters on a side; None where none of these valves has it."""
    known = frame.select("name", column_of(side, column)).drop_nulls()
    if known.is_empty():
        return None
    names, values = (each.to_list() for each in known)
    at = quantiles(values)
    deviation = PER_MAD * median(abs(value - at.median) for value in values) if len(values) >= FEWEST else 0.0
    return Spread(
        quantity=QUANTITIES[column], side=side, names=tuple(names), values=tuple(values), at=at, deviation=deviation,
        units=units.of_side(side),
    )  # fmt: skip


def spreads_of(frame: "DataFrame", units: RecordedUnits = AS_COMPUTED) -> tuple[Spread, ...]:
    """Return how every quantity scatters that some calibrated valve has, side by side."""
    calibrated = frame.filter(frame["status"] == OK)
    found = (spread_of(calibrated, column, side, units) for side in sides_of(frame.columns) for column in QUANTITIES)
    return tuple(spread for spread in found if spread is not None)


def short(name: str) -> str:
    """Return a valve's name for a narrow place.

    Examples
    --------
    >>> short("V0001"), short("a" * 30)
    ('V0001', 'aaaaaaaaaaaaaaaaa…')
    """
    printable = "".join(letter if letter.isprintable() else "·" for letter in name)
    return printable if len(printable) <= SHORT else f"{printable[: SHORT - 1]}…"


# --- figures ------------------------------------------------------------------------------------------------


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
