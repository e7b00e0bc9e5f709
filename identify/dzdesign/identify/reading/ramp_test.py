"""`RampTest`: one recorded ramp test, as all rooms of identify take it; of a long recording thinned."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, wraps
from typing import Concatenate, ParamSpec, TypeVar, final

import numpy as np

from dzdesign.core.recorded_units import Quantity, Unit
from dzdesign.identify.reading.column_labels import Column
from dzdesign.identify.reading.time_stamps import Start
from dzdesign.identify.valve.left_out import LeftOut
from dzdesign.identify.valve.recorded_drop import DropColumns, DropSign

Given = ParamSpec("Given")
Found = TypeVar("Found")
#: Rows of one recording that are kept at most: more are thinned.
MOST_ROWS = 400_000
#: Runs whose medians are taken at a time: what that takes of memory has a bound.
PART = 1 << 17


def despiked(u: np.ndarray) -> np.ndarray:
    """Return the running median of three: a single sample that stands out is gone, a step stays where it was."""
    if u.size < 3:
        return u
    left, middle, right = u[:-2], u[1:-1], u[2:]
    inner = np.maximum(np.minimum(left, middle), np.minimum(np.maximum(left, middle), right))
    return np.concatenate([u[:1], inner, u[-1:]])


@dataclass(frozen=True, kw_only=True)
class RampTest:
    """One recorded ramp test in SI units, read-only."""

    #: File name (without its folder) and the hash of its bytes.
    source: str
    sha256: str
    #: Time in s, command in V, flow in m³/s; rows with a missing value are left out; (N,).
    time: np.ndarray
    u: np.ndarray
    q: np.ndarray
    #: Pressure drop in Pa, or None if it is unknown; (N,).
    dp: np.ndarray | None
    #: Which columns make the pressure drop at positive and at negative commands; empty where none does.
    dp_from: tuple[tuple[DropColumns, ...], tuple[DropColumns, ...]] = ((), ())
    #: -1 if `dp` was recorded below zero and is given here above it, as a side of a valve has it; 1 if not.
    dp_sign: DropSign = 1
    #: Side whose metering edge has no pressure drop, "positive" or "negative": its samples were left out.
    side_without_dp: str = ""
    #: True if the pressure drop is the engineer's word (one constant) and not a recording.
    dp_is_declared: bool = False
    #: Complete rows in the file, and how many of them in a row became one sample, their median (1: none did).
    rows_read: int = 0
    run: int = 1
    #: What is doubtful about the unit of the time, as `clock_doubt` gives it.
    clock_doubt: str = ""
    #: True if a comment line above the labels begins with `SIMULATED_MARK`.
    simulated: bool = False
    #: What was taken for missing samples, by kind, as `describe_missing` gives it.
    missing: Mapping[str, str] = field(default_factory=dict)
    #: Samples over which the command was averaged, as its column shows the dither; 0: it does not.
    dither_averaged: int = 0
    #: Peak of a square wave about the command that was not declared, V; 0: none is seen.
    undeclared_dither: float = 0.0
    #: Date and time of `time` = 0 that the recording itself states, and time on the clock of the series that counts, s.
    stamp: Start | None = None
    started: float | None = None
    #: What the engineer has left out of the file.
    left_out: tuple[LeftOut, ...] = ()
    #: Times before which the command was on the other side of zero, whose samples are left out, s.
    crossed: tuple[float, ...] = ()
    #: Declared range of the signal of Q, m³/s; and the least and the largest command whose flow it could not show, V.
    q_range: tuple[float, float] | None = None
    unseen: tuple[float, float] = (0.0, 0.0)
    #: Rows whose flow lies beyond what the meter can show, (N,) bool; None: none does.
    beyond: np.ndarray | None = None
    #: Flow below which nothing was written, which is given as zero here, m³/s; 0: there is none.
    clipped_below: float = 0.0
    #: Columns of the command and the flow as they were found, by quantity.
    columns: Mapping[str, Column] = field(default_factory=dict)
    #: Units of the file's columns, each once; `u`, `dp` and `q` are in SI.
    units: Mapping[Quantity, tuple[Unit, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for array in (self.time, self.u, self.q, self.dp, self.beyond):
            if array is None:
                continue
            if array.shape != self.time.shape or array.ndim != 1:
                raise ValueError("the columns of a ramp test are vectors of one length")
            array.flags.writeable = False

    @cached_property
    def smooth(self) -> np.ndarray:
        """The command without single samples that stand out, V (N,)."""
        smooth = despiked(self.u)
        smooth.flags.writeable = False
        return smooth

    @cached_property
    def top(self) -> float:
        """The largest command without such samples, V."""
        return float(self.smooth.max())

    def unseen_top(self, least: float) -> float:
        """Return the largest command of rows without a flow, V; 0 unless it is more than `least` above all others."""
        return self.unseen[1] if self.u.size and self.unseen[1] > float(self.u.max()) + least else 0.0

    def part(self, rows: slice | np.ndarray) -> "RampTest":
        """Return the recording with some of its rows; of all of them itself, whose command is smoothed once."""
        if isinstance(rows, np.ndarray) and rows.dtype == bool and rows.all():
            return self
        dp = None if self.dp is None else self.dp[rows]
        beyond = None if self.beyond is None else self.beyond[rows]
        return replace(self, time=self.time[rows], u=self.u[rows], q=self.q[rows], dp=dp, beyond=beyond)


def once_a_recording(
    function: "Callable[Concatenate[RampTest, Given], Found]",
) -> "Callable[Concatenate[RampTest, Given], Found]":
    """Return a function that is computed once for a recording and what else is given; nobody writes into its result."""

    @wraps(function)
    def found(test: RampTest, /, *given: Given.args, **named: Given.kwargs) -> Found:
        known: dict[object, Found] = test.__dict__.setdefault("_found", {})
        key = function.__name__, *given, *named.items()
        if key not in known:
            known[key] = function(test, *given, **named)
        return known[key]

    return found


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Thinned:
    """What is left of a recording: `rows` (C, M), medians of an odd number `run` of them (1: nothing was thinned)."""

    rows: np.ndarray
    run: int


def thin(rows: np.ndarray) -> Thinned:
    """Thin a recording of more than `MOST_ROWS` rows to that many at most: of runs of rows the median is kept.

    A ramp test needs some ten thousand samples per branch; what a logger writes beyond that only averages noise. Of a
    recording of more than `MOST_ROWS` rows, runs of an odd number of rows become one row each. The median and not the
    mean, because it is a value that was recorded:

    - no spike of flow, pressure or command moves it;
    - where a meter's floor parts readings from zeros, it is one of them: a mean would be a flow that the meter never
      reads;
    - the flow of a valve rises with the command, so the medians of both belong together, also where a fast sweep, a
      step or a turning point lies in a run: a mean would lie on a chord of the characteristic.

    Of white noise its standard deviation is about a quarter above that of the mean.

    Parameters
    ----------
    rows : (C, N) array
        Columns that rise, fall or stand still together, but for their noise. Up to a run of rows at the end is left
        out, for a shorter run would scatter more.

    Examples
    --------
    >>> thin(np.array([[0.0, 1.0, 2.0]])).run
    1
    """
    run = -(-rows.shape[1] // MOST_ROWS)
    run += run % 2 == 0
    if run <= 1:
        return Thinned(rows=rows, run=1)
    few = np.empty((rows.shape[0], rows.shape[1] // run))
    for column, medians in zip(rows, few, strict=True):
        for start in range(0, medians.size, PART):
            stop = min(start + PART, medians.size)
            runs = column[start * run : stop * run].reshape(-1, run)
            medians[start:stop] = np.partition(runs, run // 2, axis=1)[:, run // 2]
    return Thinned(rows=few, run=run)
