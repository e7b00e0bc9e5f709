"""How a quantity scatters over a lot, which valves lie far from the rest of it, and its figure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.report.figure import LIGHT, ReportFigure, csv_text, legend_below, new_figure, to_report_figure
from dzdesign.report.lot.summary import OK, Quantiles
from dzdesign.report.lot.table import column_of, sides_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from polars import DataFrame

#: Of the fields of `Quantiles`, in their order.
LEVELS = (0.0, 0.05, 0.5, 0.95, 1.0)
#: Beyond so many robust standard deviations a valve is far from the rest: the limit that Iglewicz and Hoaglin (1993)
#: recommend. Of a normal lot one valve in 2000 lies there, which keeps a list of a thousand valves short.
FAR = 3.5
#: Median absolute deviation -> standard deviation, of a normal distribution: 1 over its upper quartile.
PER_MAD = 1.4826
#: In a smaller lot the deviation itself is not known well enough to call a valve far; and a twentieth is less than a
#: valve: 5 and 95 % say no more than the ends.
FEWEST, TWENTY = 8, 20
#: Of so few valves each is named; more dots than these are one image.
NAMED, MANY = 10, 500
#: Characters of a valve's name in a narrow place, and how many of those far from the rest a panel names.
SHORT, FAR_NAMED = 18, 3
#: Height of a panel, inches.
PANEL = 1.75
#: What a lot setting costs a valve.
EXTRA = "lot_extra_dead_zone_percent"


@dataclass(frozen=True, slots=True)
class Quantity:
    """A column of the table that scatters, without its side: in words, unit (empty of a ratio), decimals.

    What is in V is shown in the units of the recordings. A valve can be far from the rest in it if it is judged. The
    cost of the lot setting is not: it follows from the offsets, and its least is no merit.
    """

    column: str
    label: str
    unit: str
    digits: int
    judged: bool = True


#: Columns of the table whose quantiles tell of the batch.
QUANTITIES = (
    Quantity("knee_opening_V", "knee on opening", "V", 3),
    Quantity("knee_closing_V", "knee on closing", "V", 3),
    Quantity("offset_V", "offset at dP0", "V", 3),
    Quantity("beta_at_highest_dp", "β at the highest dP", "", 4),
    Quantity("k_x_max_over_u_max", "k x_max/u_max", "", 4),
    Quantity("dead_zone_opening_percent", "dead zone left on opening", "%", 2),
    Quantity("dead_zone_closing_percent", "dead zone left on closing", "%", 2),
    Quantity(EXTRA, "extra dead zone of the lot setting", "%", 2, judged=False),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """A quantity of one side over the calibrated valves that have it.

    `valves` has a row each, in the order of the lot: name, value, and distance from the median in robust standard
    deviations, null where the lot is too small or has no spread. `deviation` is that deviation, in the quantity's
    unit; `units` are those in which its side is shown.
    """

    quantity: Quantity
    side: str
    valves: "DataFrame"
    at: Quantiles
    deviation: float | None
    units: RecordedUnits

    @property
    def unit(self) -> str:
        """The name of the unit in which it is shown."""
        return self.units.label("V") if self.quantity.unit == "V" else self.quantity.unit

    @property
    def heading(self) -> str:
        """Label and unit, as on an axis."""
        label = f"{self.side} side: {self.quantity.label}" if self.side else self.quantity.label
        return f"{label} ({self.unit})" if self.unit else label

    @property
    def column(self) -> str:
        """Its column of the table."""
        return column_of(self.side, self.quantity.column)

    @property
    def far(self) -> "DataFrame":
        """The valves far from the rest, the farthest first."""
        beyond = self.valves.filter(self.valves["distance"].abs() > FAR)
        return beyond.sort(beyond["distance"].abs(), descending=True, maintain_order=True)

    def text(self, value: float) -> str:
        """Return a value with its decimals, in the unit in which it is shown."""
        digits = self.quantity.digits
        return self.units.number(value, f".{digits}f V") if self.quantity.unit == "V" else f"{value:.{digits}f}"

    def shown(self, values: Any) -> Any:
        """Return a number or an array in the unit in which it is shown, for a plot."""
        return self.units.convert(values, "V") if self.quantity.unit == "V" else values


def quantiles(values: Sequence[float]) -> Quantiles:
    """Return quantiles, linear between the two nearest valves (the seventh method of Hyndman and Fan, 1996).

    Examples
    --------
    >>> quantiles([1.0, 2.0, 5.0, 4.0]).median
    3.0
    """
    import polars

    known = polars.Series(values, dtype=polars.Float64)
    names = (each.name for each in fields(Quantiles))
    at = (round(known.quantile(level, "linear") or 0.0, 7) for level in LEVELS)
    return Quantiles(**dict(zip(names, at, strict=True)))


def spreads_of(frame: "DataFrame", units: RecordedUnits = AS_COMPUTED) -> tuple[Spread, ...]:
    """Return how every quantity scatters that some calibrated valve has, side by side."""
    import polars

    found, calibrated = [], frame.filter(frame["status"] == OK)
    for side in sides_of(frame.columns):
        for quantity in QUANTITIES:
            known = calibrated.select("name", value=column_of(side, quantity.column)).drop_nulls()
            if known.is_empty():
                continue
            away = polars.col("value") - polars.col("value").median()
            deviation = PER_MAD * float(known.select(away.abs().median()).item())
            judged = quantity.judged and len(known) >= FEWEST and deviation > 0
            distance = away / deviation if judged else polars.lit(None, polars.Float64)
            found.append(
                Spread(
                    quantity=quantity, side=side, valves=known.with_columns(distance=distance),
                    at=quantiles(known["value"].to_list()), deviation=deviation if judged else None,
                    units=units.of_side(side),
                )
            )  # fmt: skip
    return tuple(found)


def short(name: str) -> str:
    """Return a valve's name for a narrow place.

    Examples
    --------
    >>> short("V0001"), short("a" * 30)
    ('V0001', 'aaaaaaaaaaaaaaaaa…')
    """
    printable = "".join(letter if letter.isprintable() else "·" for letter in name)
    return printable if len(printable) <= SHORT else f"{printable[: SHORT - 1]}…"


def spread_figure(name: str, spreads: Sequence[Spread], caption: str) -> ReportFigure | None:
    """Draw quantities over the order of the names, a panel each; None of none."""
    if not spreads:
        return None
    figure = new_figure(0.95 + PANEL * len(spreads))
    panels = figure.subplots(len(spreads), sharex="col", squeeze=False)[:, 0]
    for axes, spread in zip(panels, spreads, strict=True):
        _draw(axes, spread)
    panels[-1].set_xlabel("valve, in the order of the names")
    legend_below(figure, 5)
    rows = ((spread.column, *row) for spread in spreads for row in spread.valves.iter_rows())
    ends = (f"{each.heading}: {len(each.valves)} valves from {each.text(each.at.least)} to "
            f"{each.text(each.at.largest)}, median {each.text(each.at.median)}" for each in spreads)  # fmt: skip
    return to_report_figure(
        figure, name, caption, f"{'; '.join(ends)}.",
        csv_text(("quantity", "valve", "value", "robust_sd_from_median"), rows),
    )  # fmt: skip


def _draw(axes: "Axes", spread: Spread) -> None:
    """Draw every valve, the median, and which lie far from the rest, of which a few are named."""
    from matplotlib.ticker import MaxNLocator

    names, count = spread.valves["name"].to_list(), len(spread.valves)
    axes.plot(range(1, count + 1), spread.shown(spread.valves["value"].to_numpy()), "o", mew=0, label="a valve",
              ms=min(max(30 / math.sqrt(count), 1.8), 6), color=LIGHT["blue"], rasterized=count > MANY)  # fmt: skip
    axes.axhline(spread.shown(spread.at.median), color=LIGHT["ink"], lw=1.4, label="median")
    for value in (spread.at.q05, spread.at.q95) if count >= TWENTY else ():
        axes.axhline(spread.shown(value), color=LIGHT["soft"], lw=1.1, ls="--", label="5 and 95 %")
    for place, (name, value, _) in enumerate(spread.far.iter_rows()):
        at = names.index(name) + 1
        near_end = at > 0.8 * count
        axes.plot(at, spread.shown(value), "D", ms=4.5, mfc="none", color=LIGHT["vermilion"],
                  label="far from the rest", zorder=4)  # fmt: skip
        if place < FAR_NAMED:
            axes.annotate(short(name), (at, spread.shown(value)), xytext=(-6 if near_end else 6, 0), fontsize=8,
                          textcoords="offset points", va="center", ha="right" if near_end else "left",
                          color=LIGHT["vermilion"])  # fmt: skip
    least_height = 10.0 ** (1 - spread.quantity.digits)  # no scale finer than the decimals that are shown
    middle = spread.shown(spread.at.median)
    axes.update_datalim([(1, middle - least_height), (1, middle + least_height)])
    axes.margins(y=0.12)
    axes.set_title(spread.heading)
    axes.set_xlim(0.5, count + 0.5)
    if count <= NAMED:
        axes.set_xticks(range(1, count + 1), list(map(short, names)), rotation=12)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(nbins="auto", steps=[1, 2, 2.5, 5, 10], integer=True))

