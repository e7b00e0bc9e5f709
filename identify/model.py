"""`ValveModel`: what identification found, as the artefact valve.json (schema dzdesign.valve/1)."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from dzdesign.core.artefacts import TOOL
from dzdesign.core.errors import InputError
from dzdesign.identify.bounds import staircase

SCHEMA = "dzdesign.valve/1"
#: Both sides, and the sign of the command that opens each.
SIDES = {"positive": 1, "negative": -1}
TRENDS = ("decreasing", "flat", "increasing")
#: Numbers of the file are right to seven decimals; a comparison of two allows ten times that.
ROUNDING_V = 1e-6
#: Of a branch: the thresholds with their standard errors.
MEASURES = ("knee", "level", "onset")
DIRECTIONS = ("rising", "falling")


@dataclass(frozen=True, slots=True, kw_only=True)
class BranchResult:
    """Thresholds of one branch of a ramp test and their standard errors, V.

    Attributes
    ----------
    knee_V, knee_se_V : float
        The straight part of Q/sqrt(dP) extrapolated to zero.
    level_V, level_se_V : float
        Where the flow passes what counts as flow.
    onset_V, onset_se_V : float
        Where the valve opens (or closes) as far as the meter shows it: the first flow that stands out of its noise, or
        the tail (the first flow that counts, to three times it) extrapolated to zero, whichever is lower.
    straight : tuple of float
        Flows between which the characteristic was found straight, over the largest flow.
    """

    knee_V: float
    knee_se_V: float
    level_V: float
    level_se_V: float
    onset_V: float
    onset_se_V: float
    straight: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class TestResult:
    """One ramp test: flows in L/min, pressure drop in MPa, None where it is not known.

    ``rising`` and ``falling`` are its branches, None where there is none; ``not_observable`` says of thresholds, by
    their key, why the meter can't show them. ``u_guard_V`` is the threshold that the certificate protects (on the
    guarded branch the knee, or the tail's zero where the edge is soft), ``u_guard_lower_V`` its lower confidence bound.
    ``ramps`` names each ramp.
    """

    __test__ = False  # not a test case, whatever its name

    source: str
    dp_MPa: float | None
    rising: BranchResult | None
    falling: BranchResult | None
    not_observable: Mapping[str, str]
    u_guard_V: float
    u_guard_lower_V: float
    slope_L_min_V: float
    q_max_L_min: float
    saturates: bool
    noise_L_min: float
    noise_colour: float
    outliers: int
    ramps: tuple[str, ...] = ()

    @property
    def u_knee_rising_V(self) -> float | None:
        """Opening threshold, V."""
        return self.rising and self.rising.knee_V

    @property
    def u_knee_falling_V(self) -> float | None:
        """Closing threshold, V."""
        return self.falling and self.falling.knee_V

    @property
    def u_onset_rising_V(self) -> float | None:
        """First flow on opening, V."""
        return self.rising and self.rising.onset_V

    @property
    def u_onset_falling_V(self) -> float | None:
        """Last flow on closing, V."""
        return self.falling and self.falling.onset_V

    @property
    def u_knee_se_V(self) -> float:
        """The larger of the knees' standard errors, V."""
        return max(branch.knee_se_V for branch in (self.rising, self.falling) if branch)

    def to_document(self) -> dict[str, Any]:
        """Return the entry of valve.json; of the ramps, how many and which."""
        document: dict[str, Any] = {"source": self.source, "dp_MPa": self.dp_MPa}
        for direction, branch in zip(DIRECTIONS, (self.rising, self.falling), strict=True):
            for measure in MEASURES:
                for unit in ("V", "se_V"):
                    document[f"u_{measure}_{direction}_{unit}"] = branch and getattr(branch, f"{measure}_{unit}")
            document[f"straight_{direction}"] = branch and list(branch.straight)
        return {
            **document,
            "not_observable": dict(self.not_observable),
            "u_knee_se_V": self.u_knee_se_V,
            **{name: getattr(self, name) for name in PLAIN},
            "ramps": {"count": len(self.ramps), "sources": list(self.ramps)},
        }


#: Fields of a test that valve.json has under their own names.
PLAIN = (
    *("u_guard_V", "u_guard_lower_V", "slope_L_min_V", "q_max_L_min"),
    *("saturates", "noise_L_min", "noise_colour", "outliers"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SideModel:
    """One side of the valve (one direction of flow).

    Attributes
    ----------
    tests : tuple of TestResult
        In the order of rising pressure drop.
    reference_dp_MPa : float or None
        dP0; None where the ramp test has no pressure.
    u_min0_V : float
        The law's offset at dP0: the largest that the certificate allows, V.
    k_x_max_over_u_max : float
        Command that full stroke takes beyond the threshold, over u_max.
    k_V_mm : float or None
        k of Eq. (11) in V/mm, where x_max was given.
    trend : {"decreasing", "flat", "increasing"} or None
        How the threshold runs with the pressure drop; None where fewer than two were tested.
    trend_change_V, trend_change_se_V : float or None
        Its change over the tested range, and the standard error.
    trend_p : float or None
        Probability of so large a change if the threshold were flat.
    beta_dp_MPa, beta : tuple of float
        Nodes of the piecewise linear beta(dP); empty where dP is unknown.
    confidence : float
        With which all lower bounds hold together.
    guard : {"closing", "opening"}
        The threshold that the certificate protects.
    level_L_min : float
        Flow that counts as flow: the largest of the meter's floor, its noise and half a per cent of the largest flow.
    certified_steps_V : tuple of float
        Staircase: lower bound of the guarded threshold between neighbouring beta nodes.
    active_constraints : tuple of str
        Constraints of the two fits that hold with equality.
    """

    tests: tuple[TestResult, ...]
    reference_dp_MPa: float | None
    u_min0_V: float
    k_x_max_over_u_max: float
    k_V_mm: float | None
    trend: str | None
    trend_change_V: float | None
    trend_change_se_V: float | None
    trend_p: float | None
    beta_dp_MPa: tuple[float, ...]
    beta: tuple[float, ...]
    confidence: float
    guard: str
    level_L_min: float
    certified_steps_V: tuple[float, ...]
    active_constraints: tuple[str, ...]

    def __post_init__(self) -> None:
        if self.trend not in TRENDS and not (self.trend is None and len(self.tests) == 1):
            raise InputError(f"trend is '{self.trend}', expected one of {', '.join(TRENDS)}")
        if len(self.beta) != len(self.beta_dp_MPa) or any(
            right <= left for left, right in zip(self.beta_dp_MPa, self.beta_dp_MPa[1:], strict=False)
        ):
            raise InputError("the nodes of beta must be as many as their pressure drops, which must rise")
        if not self.tests or (self.beta_dp_MPa and len(self.tests) != len(self.beta_dp_MPa)):
            raise InputError(
                f"{len(self.tests)} tests stand beside {len(self.beta_dp_MPa)} nodes of beta, expected one each"
            )
        if len(self.certified_steps_V) != len(self.tests) - 1:
            raise InputError(f"{len(self.certified_steps_V)} steps bound {len(self.tests)} tests, expected one fewer")
        if self.beta_dp_MPa and (self.reference_dp_MPa is None or any(test.dp_MPa is None for test in self.tests)):
            raise InputError("a pressure drop is missing beside the nodes of beta; expected one per test and dP0")
        if any(test.rising is None and test.falling is None for test in self.tests):
            raise InputError("a test has no knee, neither rising nor falling; expected at least one")
        if any(test.u_guard_lower_V > test.u_guard_V + ROUNDING_V for test in self.tests):
            raise InputError("a lower bound lies above the threshold that it bounds")
        if self.beta_dp_MPa and any(
            abs(test.dp_MPa - node) > ROUNDING_V for test, node in zip(self.tests, self.beta_dp_MPa, strict=True)
        ):
            raise InputError("the nodes of beta must stand at the tests' pressure drops")
        steps, _ = staircase(np.array([test.u_guard_lower_V for test in self.tests]), self.trend or "flat")
        if any(abs(step - known) > ROUNDING_V for step, known in zip(steps, self.certified_steps_V, strict=True)):
            raise InputError("the certified steps do not follow from the tests' lower bounds")
        if not self.u_min0_V > 0:
            raise InputError(f"u_min0 is {self.u_min0_V} V, expected a positive threshold")

    def to_document(self) -> dict[str, Any]:
        """Return the entry of valve.json."""
        valid = self.valid_dp_MPa
        return {
            "tests": [test.to_document() for test in self.tests],
            "reference": {"dp_MPa": self.reference_dp_MPa, "u_min_V": self.u_min0_V},
            "k_x_max_over_u_max": self.k_x_max_over_u_max,
            "k_V_mm": self.k_V_mm,
            "trend": self.trend,
            "trend_change_V": self.trend_change_V,
            "trend_change_se_V": self.trend_change_se_V,
            "trend_p": self.trend_p,
            "beta": {"dp_MPa": list(self.beta_dp_MPa), "beta": list(self.beta)},
            "valid_dp_MPa": list(valid) if valid else None,
            "certificate": {
                "confidence": self.confidence,
                "guard": self.guard,
                "level_L_min": self.level_L_min,
                "steps_V": list(self.certified_steps_V),
            },
            "active_constraints": list(self.active_constraints),
        }

    @property
    def valid_dp_MPa(self) -> tuple[float, float] | None:
        """Tested interval of dP in MPa; nothing is certified outside it."""
        return (self.beta_dp_MPa[0], self.beta_dp_MPa[-1]) if self.beta_dp_MPa else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Warning_:
    """Something a person should know: `code` for machines, `text` with the numbers and what to do, `source` file."""

    code: str
    text: str
    source: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveModel:
    """The identified valve.

    Attributes
    ----------
    u_max_V : float
        Full command.
    meter_floor_L_min, meter_lag_s, meter_zero_L_min : float
        What was taken of the flow meter: floor (given or found), lag, bound of its zero error.
    meter_lag_is : str
        "declared", "identified" or "unknown": then it was taken as zero.
    knee_window : tuple of float
        Shares of the largest flow between which the characteristic was taken as straight.
    sides : mapping of str to SideModel
        "positive", "negative" or both: what was tested. On the negative side commands and flows count from zero down.
    warnings : tuple of Warning_
        In the order in which they matter.
    made_from : tuple of (str, str)
        Source file and its SHA-256.
    """

    u_max_V: float
    meter_floor_L_min: float
    meter_lag_s: float
    meter_lag_is: str
    meter_zero_L_min: float
    knee_window: tuple[float, float]
    sides: Mapping[str, SideModel]
    warnings: tuple[Warning_, ...]
    made_from: tuple[tuple[str, str], ...]

    def __post_init__(self) -> None:
        if not self.sides or not set(self.sides) <= set(SIDES):
            raise InputError(f"the sides are {', '.join(self.sides) or 'none'}, expected {' or '.join(SIDES)}")

    @property
    def positive(self) -> SideModel:
        """The side of positive commands.

        Raises
        ------
        InputError
            If it was not tested.
        """
        if "positive" not in self.sides:
            raise InputError("the valve was tested with negative commands only; record ramp tests with positive ones")
        return self.sides["positive"]

    def to_document(self) -> dict[str, Any]:
        """Return the JSON document of schema dzdesign.valve/1; numbers rounded to a microvolt's worth."""
        document = {
            "schema": SCHEMA,
            "tool": TOOL,
            "made_from": [{"source": source, "sha256": digest} for source, digest in self.made_from],
            "u_max_V": self.u_max_V,
            "meter": {
                "floor_L_min": self.meter_floor_L_min,
                "lag_s": self.meter_lag_s,
                "lag_is": self.meter_lag_is,
                "zero_L_min": self.meter_zero_L_min,
            },
            "knee_window": list(self.knee_window),
            "sides": {name: side.to_document() for name, side in self.sides.items()},
            "untested_sides": [name for name in SIDES if name not in self.sides],
            "warnings": [asdict(warning) for warning in self.warnings],
        }
        return _rounded(document)


def _rounded(value: Any) -> Any:
    """Round every float to 7 decimals: below every error here, and the same bytes on every machine."""
    if isinstance(value, float):
        return round(value, 7)
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return [_rounded(item) for item in value] if isinstance(value, list | tuple) else value
