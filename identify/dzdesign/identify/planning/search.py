"""The best series for a time: pressure drops, rounds and ramp times tried, each by what it is predicted to certify."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.worded import worded
from dzdesign.identify.constants import LARGEST_DP, MPA, SMALLEST_DP
from dzdesign.identify.knees.between_ramps import FEW_DEGREES
from dzdesign.identify.planning.prediction import Prediction, predict
from dzdesign.identify.planning.premises import FEWEST_READINGS, Bench, ExpectedValve
from dzdesign.identify.planning.series import Series, lay_out_series, most_rounds, place_pressures

#: Times of a ramp that a bench is set to, s.
RAMP_TIMES = (2.0, 5.0, 10.0, 20.0, 30.0, 50.0, 75.0, 100.0, 150.0, 200.0, 300.0, 500.0, 1000.0)
#: Numbers of pressure drops, where there are several, and the most rounds of them.
PRESSURES, MOST_ROUNDS = (2, 3, 4, 5, 6, 7, 8, 10, 12, 15), 12
#: Neighbouring pressure drops differ by more than this share: nearer ones are pooled to one test, or nearly.
LEAST_STEP = 0.05
#: Draws by which series are compared, and by which one is predicted: the mean is then good to 3 and to 1 %.
DRAWS_TO_COMPARE, DRAWS_TO_PREDICT = 24, 400
#: Series that are predicted in full before a wanted loss is given up.
MOST_TRIED = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What is asked of a plan; SI."""

    #: Pa, s.
    dp_range: tuple[float, float]
    budget: float
    ramp_times: tuple[float, float]
    #: Mean distance of the certified offset below the threshold that is wanted, V; None takes the best for the time.
    wanted: float | None = None
    seed: int = 1

    def __post_init__(self) -> None:
        low, high = self.dp_range
        if not SMALLEST_DP <= low <= high <= LARGEST_DP:
            raise InputError(
                worded(
                    "the pressure drops run from {low:g #MPa} to {high:g MPa}, expected a rising range within "
                    "{least:g #MPa} to {most:g MPa}",
                    low=low / MPA,
                    high=high / MPA,
                    least=SMALLEST_DP / MPA,
                    most=LARGEST_DP / MPA,
                )
            )
        if low < high < low / (1 - LEAST_STEP):
            raise InputError(
                worded(
                    "{low:g #MPa} and {high:g MPa} are too near to one another to be told apart, expected a range of "
                    "{step:.0%} or more; give one pressure drop, or a wider range",
                    low=low / MPA,
                    high=high / MPA,
                    step=LEAST_STEP,
                )
            )
        if not 0 < self.ramp_times[0] <= self.ramp_times[1]:
            raise InputError(
                f"the ramp times run from {self.ramp_times[0]:g} to {self.ramp_times[1]:g} s, expected a rising range "
                "above zero"
            )
        if self.wanted is not None and not self.wanted > 0:
            raise InputError(worded("the loss wanted is {loss:g mV}, expected above zero", loss=1e3 * self.wanted))


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedSeries:
    """A series, and what it is predicted to certify."""

    series: Series
    prediction: Prediction


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The series that is proposed, and beside it what others would give, by name."""

    chosen: PlannedSeries
    alternatives: dict[str, PlannedSeries]
    #: Whether the loss that was wanted is predicted; None where none was.
    reached: bool | None


def plan_series(valve: ExpectedValve, bench: Bench, request: Request) -> Plan:
    """Find the series that certifies most in a time, or the shortest that certifies what is wanted.

    The scatter from ramp to ramp is measured by repeats; a series without, whose bounds rest on the declared scatter,
    is an alternative only.

    Raises
    ------
    InputError
        If no series with enough repeats fits in the time.
    """
    search = _Search(valve, bench, request)
    best = search.best(request.budget)
    if best is None:
        raise search.too_short()
    chosen, reached = search.in_full(best), None
    if request.wanted is not None:
        chosen, reached = search.shortest(request.wanted, chosen)
    time = chosen.series.duration
    others = {
        "half the time": search.best(time / 2),
        "twice the time": search.best(2 * time),
        "no repeats": search.best(time, repeated=False),
    }
    return Plan(
        chosen=chosen,
        alternatives={name: search.in_full(series) for name, series in others.items() if series is not None},
        reached=reached,
    )


@dataclass(frozen=True, slots=True)
class _Search:
    valve: ExpectedValve
    bench: Bench
    request: Request

    def best(self, budget: float, *, repeated: bool = True) -> Series | None:
        """Return the series with the smallest loss that fits in a time, s; None if none does."""
        series = [
            self._series(tests, ramp_time, rounds if repeated else 1)
            for tests, ramp_time, rounds in self._frames(budget, repeated=repeated)
        ]
        losses = [self._loss(one) for one in series]
        return series[int(np.argmin(losses))] if series else None

    def shortest(self, wanted: float, best: PlannedSeries) -> tuple[PlannedSeries, bool]:
        """Return the shortest series with a loss that is wanted, V, and True; the best there is and False else."""
        enough = [
            found
            for tests, ramp_time, most in self._frames(self.request.budget, repeated=True)
            if (found := self._fewest_rounds(tests, ramp_time, most, wanted)) is not None
        ]
        for series in sorted(enough, key=lambda one: one.duration)[:MOST_TRIED]:
            planned = self.in_full(series)
            if planned.prediction.loss <= wanted:
                return planned, True
        return best, best.prediction.loss <= wanted

    def in_full(self, series: Series) -> PlannedSeries:
        """Return a series with its prediction, by many draws."""
        return PlannedSeries(series=series, prediction=self._predicted(series, DRAWS_TO_PREDICT))

    def too_short(self) -> InputError:
        """Return the error for a time in which no series fits."""
        resolved = [time for time in self._ramp_times() if self._resolved(time)]
        if not resolved:
            return InputError(
                f"at {self.bench.sample_rate:g} Hz a ramp of {self.request.ramp_times[1]:g} s has too few readings for "
                f"a line, expected {FEWEST_READINGS} or more on its straight part; sample faster, or allow longer "
                "ramps by --ramp-times"
            )
        low = resolved[0]
        one = 2 * low + self.bench.pause
        fewest = min(_fewest_ramps(tests) for tests in self._tests())
        return InputError(
            f"in {self.request.budget / 60:.3g} min no series with enough repeats can be recorded: {fewest} ramps of "
            f"{low:g} s up and down, with pauses of {self.bench.pause:g} s, take {fewest * one / 60:.3g} min; give a "
            f"longer --budget, or {'shorter --ramp-times' if low == self.request.ramp_times[0] else 'sample faster'}"
        )

    def _tests(self) -> list[int]:
        """Return the numbers of pressure drops that the range has room for."""
        low, high = self.request.dp_range
        if low == high:
            return [1]
        placed = [place_pressures(self.valve, self.bench, low, high, count) for count in PRESSURES]
        return [dp.size for dp in placed if np.all(np.diff(dp) >= LEAST_STEP * dp[1:])]

    def _ramp_times(self) -> list[float]:
        shortest, longest = self.request.ramp_times
        return sorted({shortest, longest, *(time for time in RAMP_TIMES if shortest < time < longest)})

    def _frames(self, budget: float, *, repeated: bool) -> Iterator[tuple[int, float, int]]:
        """Yield pressure drops, ramp time (s) and most rounds of the series that fit in a time."""
        for tests in self._tests():
            for ramp_time in self._ramp_times():
                rounds = min(most_rounds(tests, budget, ramp_time, self.bench.pause), MOST_ROUNDS)
                ramps = tests * rounds + (tests > 1)
                if rounds < 1 or (repeated and ramps < _fewest_ramps(tests)):
                    continue
                if self._resolved(ramp_time):
                    yield tests, ramp_time, rounds

    def _resolved(self, ramp_time: float) -> bool:
        """Tell whether ramps of a time, s, have enough readings at both ends of the range."""
        errors = self.bench.knee_errors(self.valve, np.array(self.request.dp_range), ramp_time)
        return bool(np.isfinite(errors).all())

    def _fewest_rounds(self, tests: int, ramp_time: float, most: int, wanted: float) -> Series | None:
        """Return the series with the fewest rounds that reaches what is wanted; the loss falls with every round."""
        series = [self._series(tests, ramp_time, rounds) for rounds in range(2, most + 1)]
        series = [one for one in series if one.order.size >= _fewest_ramps(tests)]
        low, high = 0, len(series)
        while low < high:
            middle = (low + high) // 2
            low, high = (low, middle) if self._loss(series[middle]) <= wanted else (middle + 1, high)
        return series[low] if low < len(series) else None

    def _series(self, tests: int, ramp_time: float, rounds: int) -> Series:
        dp = place_pressures(self.valve, self.bench, *self.request.dp_range, tests)
        return lay_out_series(dp, rounds=rounds, ramp_time=ramp_time, pause=self.bench.pause, seed=self.request.seed)

    def _loss(self, series: Series) -> float:
        return self._predicted(series, DRAWS_TO_COMPARE).loss

    def _predicted(self, series: Series, draws: int) -> Prediction:
        return predict(series, self.valve, self.bench, draws=draws, seed=self.request.seed)


def _fewest_ramps(tests: int) -> int:
    """Return how many ramps leave enough degrees of freedom for the scatter; each pressure drop is repeated."""
    return max(tests + (tests > 1) + FEW_DEGREES, 2 * tests + (tests > 1))
