"""`ValveModel`: what identification found, as the artefact valve.json (schema dzdesign.valve/1)."""

from dataclasses import asdict, dataclass, fields
from types import NoneType
from typing import Any

import numpy as np

from dzdesign.core.artefacts import TOOL, parse_document
from dzdesign.core.errors import InputError
from dzdesign.core.shape import Exactly, Number, check_shape
from dzdesign.identify.bounds import staircase

SCHEMA = "dzdesign.valve/1"
TRENDS = ("decreasing", "flat", "increasing")
#: Numbers of the file are right to seven decimals; a comparison of two allows ten times that.
ROUNDING_V = 1e-6
REMEDY = "make it again with `dzdesign identify`"
#: What valve.json must hold; the ends are far beyond any valve, and keep the exact arithmetic from overflowing.
VOLTAGE, PRESSURE, FLOW = Number(-1e4, 1e4), Number(1e-6, 1e3), Number(0, 1e6)
TEST_SHAPE = {
    "source": str,
    "dp_MPa": (PRESSURE, NoneType),
    **dict.fromkeys(
        ("u_knee_rising_V", "u_knee_falling_V", "u_onset_rising_V", "u_onset_falling_V"), (VOLTAGE, NoneType)
    ),
    **dict.fromkeys(("u_knee_se_V", "u_guard_V", "u_guard_lower_V"), VOLTAGE),
    **dict.fromkeys(("slope_L_min_V", "q_max_L_min", "noise_L_min", "noise_colour"), FLOW),
    "saturates": bool,
    "outliers": Number(0, 1e12, whole=True),
}
SIDE_SHAPE = {
    "tests": [TEST_SHAPE],
    "reference": {"dp_MPa": (PRESSURE, NoneType), "u_min_V": VOLTAGE},
    "k_x_max_over_u_max": Number(1e-3, 1e3),
    "k_V_mm": (float, NoneType),
    "trend": (str, NoneType),
    "trend_change_V": (VOLTAGE, NoneType),
    "trend_change_se_V": (VOLTAGE, NoneType),
    "beta": {"dp_MPa": [PRESSURE], "beta": [Number(0, 2)]},
    "certificate": {"confidence": Number(0.5, 1), "guard": str, "level_L_min": FLOW, "steps_V": [VOLTAGE]},
    "active_constraints": [str],
}
SHAPE = {
    "made_from": [{"source": str, "sha256": str}],
    "u_max_V": Number(1e-3, 1e4),
    "meter": {"floor_L_min": FLOW, "lag_s": Number(0, 1e6), "zero_L_min": FLOW},
    "knee_window": Exactly(2, Number(0, 1)),
    "sides": {"positive": SIDE_SHAPE},
    "warnings": [{"code": str, "text": str, "source": (str, NoneType)}],
}


@dataclass(frozen=True, slots=True, kw_only=True)
class TestResult:
    """One ramp test: thresholds in V, flows in L/min, pressure drop in MPa; None where a branch or dP is missing.

    ``u_knee_*`` are the straight part of Q/sqrt(dP) extrapolated to zero; ``u_onset_*`` the tail above the meter's
    floor extrapolated to zero. ``u_guard_V`` is the threshold that the certificate protects (the lower of knee and
    onset on the guarded branch), ``u_guard_lower_V`` its lower confidence bound. ``ramps`` names each ramp in it.
    """

    __test__ = False  # not a test case, whatever its name

    source: str
    dp_MPa: float | None
    u_knee_rising_V: float | None
    u_knee_falling_V: float | None
    u_knee_se_V: float
    u_onset_rising_V: float | None
    u_onset_falling_V: float | None
    u_guard_V: float
    u_guard_lower_V: float
    slope_L_min_V: float
    q_max_L_min: float
    saturates: bool
    noise_L_min: float
    noise_colour: float
    outliers: int
    ramps: tuple[str, ...] = ()

    def to_document(self) -> dict[str, Any]:
        """Return the entry of valve.json; of the ramps, how many and which."""
        return {**asdict(self), "ramps": {"count": len(self.ramps), "sources": list(self.ramps)}}


def _test_from_document(test: dict[str, Any]) -> TestResult:
    """Read an entry of valve.json; one made before ramps were pooled is one ramp."""
    keys = {field.name for field in fields(TestResult)} - {"ramps"}
    ramps = test["ramps"]["sources"] if "ramps" in test else [test["source"]]
    return TestResult(**{key: test[key] for key in keys}, ramps=tuple(ramps))


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
        if any(test.u_knee_rising_V is None and test.u_knee_falling_V is None for test in self.tests):
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
    knee_window : tuple of float
        Shares of the largest flow between which the characteristic was taken as straight.
    positive : SideModel
        The side of positive commands.
    warnings : tuple of Warning_
        In the order in which they matter.
    made_from : tuple of (str, str)
        Source file and its SHA-256.
    """

    u_max_V: float
    meter_floor_L_min: float
    meter_lag_s: float
    meter_zero_L_min: float
    knee_window: tuple[float, float]
    positive: SideModel
    warnings: tuple[Warning_, ...]
    made_from: tuple[tuple[str, str], ...]

    def to_document(self) -> dict[str, Any]:
        """Return the JSON document of schema dzdesign.valve/1; numbers rounded to a microvolt's worth."""
        side = self.positive
        valid = side.valid_dp_MPa
        document = {
            "schema": SCHEMA,
            "tool": TOOL,
            "made_from": [{"source": source, "sha256": digest} for source, digest in self.made_from],
            "u_max_V": self.u_max_V,
            "meter": {
                "floor_L_min": self.meter_floor_L_min,
                "lag_s": self.meter_lag_s,
                "zero_L_min": self.meter_zero_L_min,
            },
            "knee_window": list(self.knee_window),
            "sides": {
                "positive": {
                    "tests": [test.to_document() for test in side.tests],
                    "reference": {"dp_MPa": side.reference_dp_MPa, "u_min_V": side.u_min0_V},
                    "k_x_max_over_u_max": side.k_x_max_over_u_max,
                    "k_V_mm": side.k_V_mm,
                    "trend": side.trend,
                    "trend_change_V": side.trend_change_V,
                    "trend_change_se_V": side.trend_change_se_V,
                    "beta": {"dp_MPa": list(side.beta_dp_MPa), "beta": list(side.beta)},
                    "valid_dp_MPa": list(valid) if valid else None,
                    "certificate": {
                        "confidence": side.confidence,
                        "guard": side.guard,
                        "level_L_min": side.level_L_min,
                        "steps_V": list(side.certified_steps_V),
                    },
                    "active_constraints": list(side.active_constraints),
                }
            },
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


def valve_from_document(content: bytes, source: str) -> ValveModel:
    """Read valve.json; a missing or misshapen key is named.

    Raises
    ------
    InputError
        If the document is not a valve of this schema.
    """
    document = parse_document(content, source, (SCHEMA,))
    check_shape(document, SHAPE, source, REMEDY)
    try:
        side = document["sides"]["positive"]
        certificate = side["certificate"]
        positive = SideModel(
            tests=tuple(_test_from_document(test) for test in side["tests"]),
            reference_dp_MPa=side["reference"]["dp_MPa"],
            u_min0_V=side["reference"]["u_min_V"],
            k_x_max_over_u_max=side["k_x_max_over_u_max"],
            k_V_mm=side["k_V_mm"],
            trend=side["trend"],
            trend_change_V=side["trend_change_V"],
            trend_change_se_V=side["trend_change_se_V"],
            beta_dp_MPa=tuple(side["beta"]["dp_MPa"]),
            beta=tuple(side["beta"]["beta"]),
            confidence=certificate["confidence"],
            guard=certificate["guard"],
            level_L_min=certificate["level_L_min"],
            certified_steps_V=tuple(certificate["steps_V"]),
            active_constraints=tuple(side["active_constraints"]),
        )
        return ValveModel(
            u_max_V=document["u_max_V"],
            meter_floor_L_min=document["meter"]["floor_L_min"],
            meter_lag_s=document["meter"]["lag_s"],
            meter_zero_L_min=document["meter"]["zero_L_min"],
            knee_window=tuple(document["knee_window"]),
            positive=positive,
            warnings=tuple(
                Warning_(**{key: item[key] for key in ("code", "text", "source")}) for item in document["warnings"]
            ),
            made_from=tuple((item["source"], item["sha256"]) for item in document["made_from"]),
        )
    except InputError as error:
        raise InputError(f"'{source}': {error}; {REMEDY}") from error
