"""What a plan rests on: the valve that is expected, from a few numbers or from a pilot series, and the bench."""

import math
from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import InputError, nearest
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.worded import worded
from dzdesign.identify.constants import L_MIN, MPA
from dzdesign.identify.knees.linear_region import ABOVE_LEVEL, NOISE_LEVEL, USEFUL_FLOW, WIDER
from dzdesign.identify.knees.meter_lag import MeterLag
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.ramp_result import TestResult
from dzdesign.identify.valve.repeatability import Origin

#: A line through fewer readings is none.
FEWEST_READINGS = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpectedValve:
    """The guarded threshold of the valve and its flow at N pressure drops, which rise; straight lines between them."""

    #: Pa, V, m³/(s V) and m³/s, all (N,).
    dp: np.ndarray
    threshold: np.ndarray
    slope: np.ndarray
    q_max: np.ndarray
    #: Shares of the largest flow between which the characteristic is straight (N, 2); NaN where that is not known.
    straight: np.ndarray
    #: Standard deviation of the threshold from ramp to ramp, V.
    scatter: float

    def __post_init__(self) -> None:
        if not np.all(np.diff(self.dp) > 0):
            raise InputError("the pressure drops of the expected valve must rise")
        for name, values, unit in (("threshold", self.threshold, "V"), ("slope", self.slope / L_MIN, "L/min/V")):
            if not np.all(values > 0):
                raise InputError(f"the {name} of the expected valve is {values.min():.3g} {unit}, expected above zero")

    def threshold_at(self, dp: np.ndarray) -> np.ndarray:
        """Return the threshold, V; outside the known pressure drops that of the nearest."""
        threshold: np.ndarray = np.interp(dp, self.dp, self.threshold)
        return threshold

    def slope_at(self, dp: np.ndarray) -> np.ndarray:
        """Return the slope of the flow over the command, m³/(s V): it runs with the root of the pressure drop."""
        slope: np.ndarray = np.interp(dp, self.dp, self.slope / np.sqrt(self.dp)) * np.sqrt(dp)
        return slope

    def q_max_at(self, dp: np.ndarray) -> np.ndarray:
        """Return the largest flow, m³/s."""
        q_max: np.ndarray = np.interp(dp, self.dp, self.q_max / np.sqrt(self.dp)) * np.sqrt(dp)
        return q_max


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """The bench, and the choices with which its recordings will be identified; SI."""

    u_max: float
    #: Standard deviation of a reading of the flow, m³/s, and what its colour adds to the variance of a mean.
    noise: float
    noise_inflation: float = 1.0
    #: Hz.
    sample_rate: float
    meter_floor: float = 0.0
    meter_zero: float = 0.0
    lag: MeterLag
    #: Time between two ramps in which the next pressure drop is set, s.
    pause: float
    confidence: float = 0.99
    flat_below: float = 1e-3

    def __post_init__(self) -> None:
        shown = (("noise of the flow", self.noise / L_MIN, "L/min"), ("sampling rate", self.sample_rate, "Hz"))
        for name, value, unit in shown:
            if not (value > 0 and math.isfinite(value)):
                raise InputError(
                    f"the {name} is {value:g} {unit}, expected above zero; give --noise and --sample-rate of the bench"
                )
        if not 0 <= self.pause < math.inf:
            raise InputError(f"the pause between two ramps is {self.pause:g} s, expected zero or more")

    def knee_errors(self, valve: ExpectedValve, dp: np.ndarray, ramp_time: float) -> np.ndarray:
        """Return the standard errors that the noise gives the knee of one branch of one ramp at each pressure drop, V.

        The line is laid as identification lays it: through the readings from well above the flow that counts as flow
        up to where the ramp turns, or through the straight part that a pilot series has shown. Infinite where the ramp
        has too few samples.
        """
        slope, q_max = valve.slope_at(dp), valve.q_max_at(dp)
        level = np.maximum(max(self.meter_floor, NOISE_LEVEL * self.noise), USEFUL_FLOW * q_max)
        lowest = np.minimum(ABOVE_LEVEL * level / q_max, 0.5 * WIDER[-1])
        low, high = (np.interp(dp, valve.dp, valve.straight[:, end]) for end in (0, 1))
        low, high = np.where(np.isnan(low), lowest, low), np.where(np.isnan(high), WIDER[-1], high)
        density = self.sample_rate * ramp_time / self.u_max
        return line_errors(slope, low * q_max, high * q_max, density, self.noise * math.sqrt(self.noise_inflation))


def line_errors(slope: np.ndarray, low: np.ndarray, high: np.ndarray, density: float, noise: float) -> np.ndarray:
    """Return the standard errors (V) of the zeros of straight lines through readings between two flows.

    With `density` readings per volt. From the meter's floor to the largest flow this is the Cramér-Rao limit of a hinge
    line, to 3 %: readings below the hinge tell nothing of it, and those below the floor next to nothing.
    """
    n = density * (high - low) / slope
    # About their centre the commands of the readings spread by their range over the root of 12.
    lever = 1 + 12 * ((low + high) / 2 / (high - low)) ** 2
    error: np.ndarray = np.where(n >= FEWEST_READINGS, noise / slope * np.sqrt(lever / n), np.inf)
    return error


def straight_valve(
    dp: tuple[float, float],
    *,
    threshold: float,
    change: float,
    max_flow: float,
    u_max: float,
    scatter: float,
) -> ExpectedValve:
    """Return a valve with a straight characteristic and a threshold that runs straight over the pressure drop.

    Parameters
    ----------
    dp : tuple of float
        Lowest and highest pressure drop, Pa; at the lowest one the other numbers hold.
    threshold : float
        Closing threshold, V.
    change : float
        By how much it falls over the pressure drops, V; negative if it rises.
    max_flow : float
        Flow at full command, m³/s.
    u_max : float
        Full command, V.
    scatter : float
        Standard deviation of the threshold from ramp to ramp, V.
    """
    nodes = np.unique(dp)
    thresholds = np.linspace(threshold, threshold - change, 2)[: nodes.size]
    if not 0 < thresholds.min() <= thresholds.max() < u_max:
        raise InputError(
            f"the threshold runs from {100 * thresholds[0] / u_max:.3g} to {100 * thresholds[-1] / u_max:.3g} % of "
            "full command, expected above 0 and below 100 %; correct --dead-zone or --threshold-change"
        )
    if not 0 < max_flow < math.inf:
        raise InputError(
            worded("the largest flow is {flow:g L/min}, expected above zero; correct --max-flow", flow=max_flow / L_MIN)
        )
    slope = max_flow / (u_max - thresholds[0]) * np.sqrt(nodes / nodes[0])
    return ExpectedValve(
        dp=nodes,
        threshold=thresholds,
        slope=slope,
        q_max=slope * (u_max - thresholds),
        straight=np.full((nodes.size, 2), np.nan),
        scatter=scatter,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Pilot:
    """What a quick series of the valve tells."""

    valve: ExpectedValve
    #: Where its scatter is from (of too few repeats it is assumed), and its standard error, V; NaN if not measured.
    scatter_is: Origin
    scatter_se: float
    u_max: float
    #: m³/s, what its colour adds to the variance of a mean, and m³/s.
    noise: float
    noise_inflation: float
    meter_floor: float
    meter_zero: float
    #: s; None where the pilot could not tell it.
    meter_lag: float | None
    recorded_units: RecordedUnits


def read_pilot(model: ValveModel, wanted: str | None = None) -> Pilot:
    """Take noise, slopes, thresholds and repeatability from the valve.json of a quick series.

    None takes the first of its sides.

    Raises
    ------
    InputError
        If its pressure drops are not known, or it lacks the side.
    """
    if wanted is not None and wanted not in model.sides:
        raise InputError(
            f"--side is '{wanted}'{nearest(wanted, model.sides)}, expected {' or '.join(model.sides)}, which the pilot "
            "series has"
        )
    name = wanted or next(iter(model.sides))
    side = model.sides[name]
    if any(test.dp_MPa is None for test in side.tests):
        raise InputError(
            "the pilot series was recorded without a pressure drop, and a plan needs it; record it, or declare it by "
            "--dp when you identify the pilot"
        )
    tests, found = side.tests, side.certificate.repeatability
    # What the repeats of the pilot scatter by has the noise of a single ramp in it; the new ramps bring their own.
    noise = np.mean([_knee_error(test) ** 2 * len(test.ramps) for test in tests])
    scatter = found.sd_V if found.origin != "repeats" else math.sqrt(max(found.sd_V**2 - float(noise), 0.0))
    return Pilot(
        valve=ExpectedValve(
            dp=MPA * np.array([test.dp_MPa for test in tests]),
            threshold=np.array([test.u_guard_V for test in tests]),
            slope=L_MIN * np.array([test.slope_L_min_V for test in tests]),
            q_max=L_MIN * np.array([test.q_max_L_min for test in tests]),
            straight=np.array([test.straight_falling or test.straight_rising for test in tests], dtype=float),
            scatter=scatter,
        ),
        scatter_is=found.origin,
        scatter_se=found.sd_V / math.sqrt(2 * (found.degrees_of_freedom or math.nan)),
        u_max=model.u_max_V,
        noise=L_MIN * float(np.median([test.noise_L_min for test in tests])),
        noise_inflation=float(np.median([test.noise_variance_inflation for test in tests])),
        meter_floor=L_MIN * model.meter.floor_L_min,
        meter_zero=L_MIN * model.meter.zero_L_min,
        meter_lag=None if model.meter.lag_is == "unknown" or model.meter.lag_s < 0 else model.meter.lag_s,
        recorded_units=model.recorded_units.of_side(name),
    )


def _knee_error(test: TestResult) -> float:
    """Return the standard error of the guarded branch's knee, V."""
    closing, opening = test.u_knee_falling_se_V, test.u_knee_rising_se_V
    return closing if closing is not None else opening or 0.0
