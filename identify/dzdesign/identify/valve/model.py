"""`ValveModel`: what identification found, as the artefact valve.json (schema dzdesign.valve/1)."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from dzdesign.core.artefact_files import TOOL
from dzdesign.core.errors import InputError
from dzdesign.core.result_display import ShownInNotebooks
from dzdesign.identify.fitting.guard_curve import GUARDS, ROUNDING_V, GuardCurve, OpeningCurve
from dzdesign.identify.valve.test_record import checked_record

SCHEMA = "dzdesign.valve/1"
#: Both sides, and the sign of the command that opens each.
SIDES = {"positive": 1, "negative": -1}
TRENDS = ("decreasing", "flat", "increasing")
#: Of a branch: the thresholds with their standard errors.
MEASURES = ("knee", "level", "onset")
DIRECTIONS = ("rising", "falling")
#: Standard errors by which closing must lie above opening to be no noise; and V, for a simulation has next to none.
ORDER_SIGNIFICANCE, ORDER_LEAST_V = 5.0, 1e-3


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

    @property
    def closes_above_opening(self) -> bool:
        """Whether the knees stand in an order that no valve has: then the lag or the time is wrong, and so are they."""
        opens, closes = self.u_knee_rising_V, self.u_knee_falling_V
        least = max(ORDER_SIGNIFICANCE * self.u_knee_se_V, ORDER_LEAST_V)
        return opens is not None and closes is not None and closes - opens > least

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
    confidence : float
        With which all lower bounds of a guard hold together.
    guard : {"closing", "mean", "opening"}
        The threshold that a certificate protects unless another is asked for: the safest that was recorded. The tests'
        ``u_guard_V`` and ``u_guard_lower_V`` are of it, and so are `u_min0_V`, `beta` and `certified_steps_V`.
    guards : mapping of str to GuardCurve
        What may be certified of each threshold that the tests show; in a file made before there were several, of
        `guard` alone. "mean" is the mean of both branches' thresholds, its error taken as large as their covariance
        could make it.
    opening_curve : OpeningCurve or None
        Where useful flow begins on opening; None without a rising branch or a pressure drop, and in such a file.
    level_L_min : float
        Flow that counts as flow: the largest of the meter's floor, its noise and half a per cent of the largest flow.
    active_constraints : tuple of str
        Constraints of the two fits that hold with equality.
    """

    tests: tuple[TestResult, ...]
    reference_dp_MPa: float | None
    k_x_max_over_u_max: float
    k_V_mm: float | None
    trend: str | None
    trend_change_V: float | None
    trend_change_se_V: float | None
    trend_p: float | None
    confidence: float
    guard: str
    guards: Mapping[str, GuardCurve]
    opening_curve: OpeningCurve | None
    level_L_min: float
    active_constraints: tuple[str, ...]

    def __post_init__(self) -> None:
        if self.trend not in TRENDS and not (self.trend is None and len(self.tests) == 1):
            raise InputError(f"trend is '{self.trend}', expected one of {', '.join(TRENDS)}")
        if self.guard not in self.guards or not set(self.guards) <= set(GUARDS):
            raise InputError(
                f"the guard is '{self.guard}' and there are curves of {', '.join(self.guards) or 'none'}, expected the "
                f"guard among them, and no others than {', '.join(GUARDS)}"
            )
        if self.beta_dp_MPa and (self.reference_dp_MPa is None or any(test.dp_MPa is None for test in self.tests)):
            raise InputError("a pressure drop is missing beside the nodes of beta; expected one per test and dP0")
        if any(test.rising is None and test.falling is None for test in self.tests):
            raise InputError("a test has no knee, neither rising nor falling; expected at least one")
        for guard in self.guards.values():
            self._check_nodes(guard.beta_dp_MPa, len(guard.u_lower_V))
            guard.check_staircase(self.trend or "flat")
        own = self.guards[self.guard]
        for test, threshold, bound in zip(self.tests, own.u_threshold_V, own.u_lower_V, strict=True):
            if abs(test.u_guard_V - threshold) > ROUNDING_V or abs(test.u_guard_lower_V - bound) > ROUNDING_V:
                raise InputError(f"the tests' guarded thresholds and bounds are not those of the {self.guard} curve")
        if self.opening_curve is not None:
            self._check_nodes(self.opening_curve.dp_MPa, len(self.opening_curve.u_V))
            self.opening_curve.check_order(self.trend or "flat", tuple(self.guards.values()))

    def _check_nodes(self, nodes: tuple[float, ...], count: int) -> None:
        """Check that a curve has one node a test, at its pressure drop; where that is unknown, none."""
        if count != len(self.tests) or len(nodes) != len(self.beta_dp_MPa):
            raise InputError(f"a curve has {count} thresholds for {len(self.tests)} tests, expected one each")
        if nodes and any(abs(test.dp_MPa - node) > ROUNDING_V for test, node in zip(self.tests, nodes, strict=True)):
            raise InputError("the nodes of beta must stand at the tests' pressure drops")

    @property
    def u_min0_V(self) -> float:
        """The law's offset at dP0: the largest that the certificate of `guard` allows, V."""
        return self.guards[self.guard].u_min0_V

    @property
    def beta_dp_MPa(self) -> tuple[float, ...]:
        """Pressure drops of the nodes of `beta`, MPa; empty where dP is unknown."""
        return self.guards[self.guard].beta_dp_MPa

    @property
    def beta(self) -> tuple[float, ...]:
        """Nodes of the piecewise linear beta(dP) of `guard`; empty where dP is unknown."""
        return self.guards[self.guard].beta

    @property
    def certified_steps_V(self) -> tuple[float, ...]:
        """Staircase: lower bound of the threshold of `guard` between neighbouring nodes of beta, V."""
        return self.guards[self.guard].certified_steps_V

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
            "guards": {name: curve.to_document() for name, curve in self.guards.items()},
            "opening_curve": self.opening_curve and self.opening_curve.to_document(),
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


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ValveModel(ShownInNotebooks):
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
    record : mapping of str to str
        Who and what, as the engineer says it: serial number, operator, oil. Nothing is computed from it.
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
    record: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.sides or not set(self.sides) <= set(SIDES):
            raise InputError(f"the sides are {', '.join(self.sides) or 'none'}, expected {' or '.join(SIDES)}")
        object.__setattr__(self, "record", checked_record(self.record.items(), "the record"))

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
            **({"record": dict(self.record)} if self.record else {}),
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
