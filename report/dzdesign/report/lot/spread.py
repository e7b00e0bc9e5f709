"""How a quantity scatters over a lot, and which valves lie far from the rest of it."""

from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields, replace
from statistics import median

from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.report.lot.summary import Quantiles
from dzdesign.report.lot.table import TableRow, column_of
from dzdesign.report.lot.valve_names import by_name

#: Of the fields of `Quantiles`, in their order.
LEVELS = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
#: Beyond so many robust standard deviations a valve is far from the rest: the limit that Iglewicz and Hoaglin (1993)
#: recommend. Of a normal lot one valve in 2000 lies there, which keeps a list of a thousand valves short.
FAR = 3.5
#: Median absolute deviation -> standard deviation, of a normal distribution: 1 over its upper quartile.
PER_MAD = 1.4826
#: In a smaller lot the deviation itself is not known well enough to call a valve far.
FEWEST = 8
#: In a smaller lot a twentieth is less than a valve: 5 and 95 % say no more than the ends.
TWENTY = 20


@dataclass(frozen=True, slots=True)
class Quantity:
    """A column of the table that scatters, without its side: in words, as a heading, unit (empty of a ratio), decimals.

    What is in V is shown in the units of the recordings.
    A valve can be far from the rest in it if it is judged. The cost of the lot setting is not: it follows from the
    offsets, and its least is no merit.
    """

    column: str
    label: str
    short_label: str
    unit: str
    digits: int
    judged: bool = True

    def heading(self, units: RecordedUnits) -> str:
        """Return label and unit, as on an axis."""
        return self.label + self._in_brackets(units)

    def short_heading(self, units: RecordedUnits) -> str:
        """Return the same for the head of a narrow column."""
        return self.short_label + self._in_brackets(units)

    def unit_in(self, units: RecordedUnits) -> str:
        """Return the name of the unit in which it is shown."""
        return units.label("V") if self.unit == "V" else self.unit

    def _in_brackets(self, units: RecordedUnits) -> str:
        return f" ({self.unit_in(units)})" if self.unit else ""

    def text(self, value: float, units: RecordedUnits) -> str:
        """Return a value with its decimals."""
        return units.number(value, f".{self.digits}f V") if self.unit == "V" else f"{value:.{self.digits}f}"


#: What a lot setting costs a valve.
EXTRA = "lot_extra_dead_zone_percent"
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

    `deviation` is the robust standard deviation, in the quantity's unit; 0 where it says nothing.
    """

    quantity: Quantity
    side: str
    names: tuple[str, ...]
    values: tuple[float, ...]
    at: Quantiles
    deviation: float
    #: In which its side is shown.
    units: RecordedUnits = AS_COMPUTED

    @property
    def heading(self) -> str:
        """What stands on its axis."""
        return (f"{self.side} side: " if self.side else "") + self.quantity.heading(self.units)

    def text(self, value: float) -> str:
        """Return a value with its decimals, as it is shown."""
        return self.quantity.text(value, self.units)

    def shown(self) -> "Spread":
        """Return it with the numbers in the units of the recordings, to be drawn."""
        if self.quantity.unit != "V":
            return self
        values, at = (
            [float(self.units.convert(one, "V")) for one in known] for known in (self.values, astuple(self.at))
        )
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
    known = sorted(values)
    names = (each.name for each in fields(Quantiles))
    return Quantiles(
        **{name: _between(known, level * (len(known) - 1)) for name, level in zip(names, LEVELS, strict=True)}
    )


def _between(known: Sequence[float], place: float) -> float:
    """Return the value at a place of a rising sequence, which may lie between two."""
    index, share = int(place), place - int(place)
    if share < 1e-9:  # 0.05 times 100 is not 5
        return known[index]
    return round(known[index] + share * (known[index + 1] - known[index]), 7)


def spread_of(
    rows: Sequence[TableRow], column: str, side: str, units: RecordedUnits = AS_COMPUTED
) -> Spread | None:
    """Return how a column of `QUANTITIES` scatters on a side; None where none of these valves has it."""
    known = {row.name: value for row in rows if (value := row.number(side, column)) is not None}
    if not known:
        return None
    values = tuple(known.values())
    at = quantiles(values)
    deviation = PER_MAD * median(abs(value - at.median) for value in values)
    return Spread(
        quantity=QUANTITIES[column],
        side=side,
        names=tuple(known),
        values=values,
        at=at,
        deviation=deviation if len(values) >= FEWEST else 0.0,
        units=units.of_side(side),
    )


def spreads_of(rows: Sequence[TableRow], units: RecordedUnits = AS_COMPUTED) -> tuple[Spread, ...]:
    """Return how every quantity scatters that some calibrated valve has, side by side."""
    calibrated = [row for row in rows if row.calibrated]
    sides = rows[0].sides if rows else ()
    found = (spread_of(calibrated, column, side, units) for side in sides for column in QUANTITIES)
    return tuple(spread for spread in found if spread is not None)
