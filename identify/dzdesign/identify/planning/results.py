"""`SeriesPlan`: a planned test series in the units of a bench, for a page and for JSON."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.core.result_display import ShownInNotebooks
from dzdesign.identify.constants import MPA
from dzdesign.identify.planning.premises import Bench, ExpectedValve
from dzdesign.identify.planning.search import Plan, PlannedSeries, Request
from dzdesign.identify.ramps.pooling import SAME_PRESSURE
from dzdesign.identify.valve.repeatability import Origin

#: Significant digits of a number that is predicted: the draws tell it to 1 %.
DIGITS = 4
#: Share of the series that find the threshold's direction, below which that is said.
MOSTLY_FOUND = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class Premise:
    """One premise of a plan, as text, and where it is from: given, the pilot series, or assumed."""

    name: str
    value: str
    origin: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SeriesRow:
    """One series and its predicted result; see `Prediction`."""

    name: str
    pressure_drops_MPa: tuple[float, ...]
    #: From zero to full command, and as long back, s.
    ramp_time_s: float
    rounds: int
    ramps: int
    duration_min: float
    #: Whether repeats measure the scatter from ramp to ramp, or it has to be declared.
    repeatability: Origin
    #: Of one ramp, at each pressure drop.
    knee_se_mV: tuple[float, ...]
    loss_mV: float
    loss_nine_of_ten_mV: float
    of_scatter_mV: float
    of_noise_mV: float
    of_lag_mV: float
    of_meter_zero_mV: float
    of_staircase_mV: float
    trend_found: float


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class SeriesPlan(ShownInNotebooks):
    """A test series with its predicted result, and alternatives to it."""

    chosen: SeriesRow
    #: Pressure drop of each ramp, in the order of recording.
    order_MPa: tuple[float, ...]
    seed: int
    alternatives: tuple[SeriesRow, ...]
    budget_min: float
    #: Mean loss that was wanted, and whether it is predicted; None where none was.
    wanted_mV: float | None
    reached: bool | None
    premises: tuple[Premise, ...]
    notes: tuple[str, ...]
    u_max_V: float
    sample_rate_Hz: float
    pause_s: float
    #: Of the pilot series, in which a person sees the plan.
    recorded_units: RecordedUnits


def series_plan(
    plan: Plan,
    valve: ExpectedValve,
    bench: Bench,
    request: Request,
    premises: Sequence[Premise],
    units: RecordedUnits = AS_COMPUTED,
) -> SeriesPlan:
    """Return a plan in the units of a bench, with what should be known beside it."""
    series = plan.chosen.series
    wanted = None if request.wanted is None else 1e3 * request.wanted
    return SeriesPlan(
        chosen=_row("plan", plan.chosen),
        order_MPa=tuple(_rounded(series.dp[series.order] / MPA)),
        seed=request.seed,
        alternatives=tuple(_row(name, planned) for name, planned in plan.alternatives.items()),
        budget_min=request.budget / 60,
        wanted_mV=wanted,
        reached=plan.reached,
        premises=tuple(premises),
        notes=tuple(_notes(plan, valve, request, premises, units)),
        u_max_V=bench.u_max,
        sample_rate_Hz=bench.sample_rate,
        pause_s=bench.pause,
        recorded_units=units,
    )


def _row(name: str, planned: PlannedSeries) -> SeriesRow:
    series, found = planned.series, planned.prediction
    loss, nine, scatter, noise, lag, zero, stairs = _rounded(
        1e3
        * np.array([
            found.loss, found.loss_of_nine, found.of_scatter, found.of_noise, found.of_lag, found.of_zero,
            found.of_staircase,
        ])
    )  # fmt: skip
    return SeriesRow(
        name=name,
        pressure_drops_MPa=tuple(_rounded(series.dp / MPA)),
        ramp_time_s=float(series.ramp_time),
        rounds=series.rounds,
        ramps=int(series.order.size),
        duration_min=round(series.duration / 60, 2),
        repeatability="declared" if series.rounds == 1 else "repeats",
        knee_se_mV=tuple(_rounded(1e3 * found.knee_se)),
        loss_mV=loss,
        loss_nine_of_ten_mV=nine,
        of_scatter_mV=scatter,
        of_noise_mV=noise,
        of_lag_mV=lag,
        of_meter_zero_mV=zero,
        of_staircase_mV=stairs,
        trend_found=found.trend_found,
    )


def _rounded(values: np.ndarray) -> list[float]:
    return [float(f"{value:.{DIGITS}g}") for value in values]


def _notes(
    plan: Plan, valve: ExpectedValve, request: Request, premises: Sequence[Premise], units: RecordedUnits
) -> list[str]:
    """Return what should be known beside the numbers."""
    found, notes = plan.chosen.prediction, []
    if request.wanted is not None and not plan.reached:
        shares = {
            "scatter from ramp to ramp": found.of_scatter, "noise": found.of_noise, "the lag's tolerance": found.of_lag,
            "the meter's zero error": found.of_zero, "the steps between the tests": found.of_staircase,
        }  # fmt: skip
        largest = max(shares, key=lambda name: shares[name])
        notes.append(
            f"no series within {request.budget / 60:g} min reaches the loss wanted, "
            f"{units.text(1e3 * request.wanted, '.4g mV')}: the best one has {units.text(1e3 * found.loss, '.4g mV')}, "
            f"of which {units.text(1e3 * shares[largest], '.4g mV')} by {largest}; extend --budget, or reduce that"
        )
    lowest = float(valve.threshold.min())
    if found.loss >= lowest:
        notes.append(
            f"the loss exceeds the threshold, {units.text(1e3 * lowest, '.4g mV')}: identify will refuse such "
            "recordings, because no positive offset can be certified; reduce the largest share"
        )
    low, high = float(valve.dp[0]), float(valve.dp[-1])
    outside = request.dp_range[0] < (1 - SAME_PRESSURE) * low or request.dp_range[1] > (1 + SAME_PRESSURE) * high
    if outside:
        notes.append(
            f"the pilot series ran {units.span(low / MPA, high / MPA, '.2f MPa')}; beyond that its nearest threshold "
            "is taken, and the steps between the tests are predicted too small"
        )
    if found.trend_found < MOSTLY_FOUND:
        notes.append(
            f"only {found.trend_found:.0%} of such series find the direction in which the threshold runs; the others "
            "certify one offset for all pressure drops, the lowest bound"
        )
    assumed = [premise.name for premise in premises if premise.origin == "assumed"]
    if assumed:
        piloted = any(premise.origin == "pilot series" for premise in premises)
        notes.append(
            f"assumed, so check them: {', '.join(assumed)}"
            + ("" if piloted else ". Most of them follow from the valve.json of a quick series, given as VALVE.json")
        )
    return notes
