"""Reads valve.json (schema dzdesign.valve/1) back into a `ValveModel`; what is missing or does not fit is named."""

from types import NoneType
from typing import Any

from dzdesign.core.artefact_files import parse_document
from dzdesign.core.errors import InputError
from dzdesign.core.shape import Exactly, Number, check_shape
from dzdesign.identify.fitting.guard_curve import CURVE_LISTS, GUARDS, ROUNDING_V, GuardCurve, OpeningCurve
from dzdesign.identify.valve.model import (
    DIRECTIONS,
    MEASURES,
    PLAIN,
    SCHEMA,
    SIDES,
    BranchResult,
    SideModel,
    TestResult,
    ValveModel,
    Warning_,
)

REMEDY = "make it again with `dzdesign identify`"
#: What valve.json must hold; the ends are far beyond any valve, and keep the exact arithmetic from overflowing.
VOLTAGE, PRESSURE, FLOW = Number(-1e4, 1e4), Number(1e-6, 1e3), Number(0, 1e6)
TEST_SHAPE = {
    "source": str,
    "dp_MPa": (PRESSURE, NoneType),
    **{
        f"u_{measure}_{direction}_{unit}": (VOLTAGE, NoneType)
        for direction in DIRECTIONS
        for measure in MEASURES
        for unit in ("V", "se_V")
    },
    **{f"straight_{direction}": (Exactly(2, Number(0, 2)), NoneType) for direction in DIRECTIONS},
    **dict.fromkeys(("u_knee_se_V", "u_guard_V", "u_guard_lower_V"), VOLTAGE),
    "not_observable": dict,
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
    "trend_p": (Number(0, 1), NoneType),
    "beta": {"dp_MPa": [PRESSURE], "beta": [Number(0, 2)]},
    "certificate": {"confidence": Number(0.5, 1), "guard": str, "level_L_min": FLOW, "steps_V": [VOLTAGE]},
    "active_constraints": [str],
}
#: One guard's curve, and the curve of opening: they came later, so a file may lack them.
CURVE_SHAPE = {
    "u_min0_V": VOLTAGE,
    "beta_dp_MPa": [PRESSURE],
    "beta": [Number(0, 2)],
    **{key: [VOLTAGE] for key in ("certified_steps_V", "u_lower_V", "u_threshold_V")},
}
OPENING_SHAPE = {"dp_MPa": [PRESSURE], "u_V": [VOLTAGE], "u_se_V": [Number(0, 1e4)]}
SHAPE = {
    "made_from": [{"source": str, "sha256": str}],
    "u_max_V": Number(1e-3, 1e4),
    "meter": {"floor_L_min": FLOW, "lag_s": Number(0, 1e6), "lag_is": str, "zero_L_min": FLOW},
    "knee_window": Exactly(2, Number(0, 1)),
    "sides": dict,
    "warnings": [{"code": str, "text": str, "source": (str, NoneType)}],
}


def _test_from_document(test: dict[str, Any]) -> TestResult:
    """Read an entry of valve.json; one made before ramps were pooled is one ramp."""
    ramps = test["ramps"]["sources"] if "ramps" in test else [test["source"]]
    rising, falling = (_branch_from_document(test, direction) for direction in DIRECTIONS)
    return TestResult(
        source=test["source"],
        dp_MPa=test["dp_MPa"],
        rising=rising,
        falling=falling,
        not_observable=test["not_observable"],
        **{name: test[name] for name in PLAIN},
        ramps=tuple(ramps),
    )


def _branch_from_document(test: dict[str, Any], direction: str) -> BranchResult | None:
    """Read a branch of a test; a missing branch has no threshold at all."""
    values = {
        f"{measure}_{unit}": test[f"u_{measure}_{direction}_{unit}"] for measure in MEASURES for unit in ("V", "se_V")
    }
    straight = test[f"straight_{direction}"]
    if straight is None and set(values.values()) == {None}:
        return None
    if straight is None or None in values.values():
        raise InputError(f"'{test['source']}' has some thresholds of its {direction} branch and lacks others")
    return BranchResult(**values, straight=tuple(straight))


def _guards_from_document(side: dict[str, Any], tests: tuple[TestResult, ...]) -> dict[str, GuardCurve]:
    """Read the curves of all guards; of a file made before there were several, the one that it has."""
    guard = side["certificate"]["guard"]
    own = GuardCurve(
        u_min0_V=side["reference"]["u_min_V"],
        beta_dp_MPa=tuple(side["beta"]["dp_MPa"]),
        beta=tuple(side["beta"]["beta"]),
        certified_steps_V=tuple(side["certificate"]["steps_V"]),
        u_lower_V=tuple(test.u_guard_lower_V for test in tests),
        u_threshold_V=tuple(test.u_guard_V for test in tests),
    )
    curves = {guard: own}
    for name, curve in side.get("guards", {}).items():
        if name not in GUARDS:
            continue
        try:
            lists = {key: tuple(curve[key]) for key in CURVE_LISTS}
            curves[name] = GuardCurve(u_min0_V=curve["u_min0_V"], **lists)
        except InputError as error:
            raise InputError(f"'guards.{name}': {error}") from error
    if not _agree(curves[guard], own):
        raise InputError(f"'guards.{guard}' is not the curve of 'reference', 'beta', 'certificate' and 'tests'")
    return {name: curves[name] for name in (*GUARDS, guard) if name in curves}


def _agree(one: GuardCurve, other: GuardCurve) -> bool:
    """Tell whether two curves are the same but for rounding."""
    if abs(one.u_min0_V - other.u_min0_V) > ROUNDING_V:
        return False
    pairs = [(getattr(one, name), getattr(other, name)) for name in CURVE_LISTS]
    return all(
        len(left) == len(right) and all(abs(a - b) <= ROUNDING_V for a, b in zip(left, right, strict=True))
        for left, right in pairs
    )


def _side_from_document(side: dict[str, Any]) -> SideModel:
    certificate = side["certificate"]
    tests = tuple(_test_from_document(test) for test in side["tests"])
    opening = side.get("opening_curve")
    return SideModel(
        tests=tests,
        reference_dp_MPa=side["reference"]["dp_MPa"],
        k_x_max_over_u_max=side["k_x_max_over_u_max"],
        k_V_mm=side["k_V_mm"],
        trend=side["trend"],
        trend_change_V=side["trend_change_V"],
        trend_change_se_V=side["trend_change_se_V"],
        trend_p=side["trend_p"],
        confidence=certificate["confidence"],
        guard=certificate["guard"],
        guards=_guards_from_document(side, tests),
        opening_curve=opening and OpeningCurve(**{key: tuple(opening[key]) for key in OPENING_SHAPE}),
        level_L_min=certificate["level_L_min"],
        active_constraints=tuple(side["active_constraints"]),
    )


def _later_shape(side: dict[str, Any]) -> dict[str, Any]:
    """Return the shape of those keys of a side that a file may lack and this one has."""
    shape: dict[str, Any] = {}
    if "guards" in side:
        present = side["guards"] if isinstance(side["guards"], dict) else {}
        shape["guards"] = {name: CURVE_SHAPE for name in GUARDS if name in present}
    if "opening_curve" in side:
        shape["opening_curve"] = (OPENING_SHAPE, NoneType)
    return shape


def _check_ramps(tests: list[dict[str, Any]], place: str, source: str) -> None:
    """Check the names of the recordings of those tests that say which they were pooled from."""
    for index, test in enumerate(tests):
        if "ramps" in test:
            key = f"{place}[{index}]"
            check_shape({key: test}, {key: {"ramps": {"sources": [str]}}}, source, REMEDY)


def valve_from_document(content: bytes, source: str) -> ValveModel:
    """Read valve.json; a missing or misshapen key is named.

    Raises
    ------
    InputError
        If the document is not a valve of this schema.
    """
    document = parse_document(content, source, (SCHEMA,))
    check_shape(document, SHAPE, source, REMEDY)
    for name in SIDES:
        if name in document["sides"]:
            check_shape(document, {"sides": {name: SIDE_SHAPE}}, source, REMEDY)
            check_shape(document, {"sides": {name: _later_shape(document["sides"][name])}}, source, REMEDY)
            _check_ramps(document["sides"][name]["tests"], f"sides.{name}.tests", source)
    if "record" in document:  # it came later
        check_shape(document, {"record": dict}, source, REMEDY)
    try:
        return ValveModel(
            u_max_V=document["u_max_V"],
            meter_floor_L_min=document["meter"]["floor_L_min"],
            meter_lag_s=document["meter"]["lag_s"],
            meter_lag_is=document["meter"]["lag_is"],
            meter_zero_L_min=document["meter"]["zero_L_min"],
            knee_window=tuple(document["knee_window"]),
            sides={name: _side_from_document(side) for name, side in document["sides"].items() if name in SIDES},
            warnings=tuple(
                Warning_(**{key: item[key] for key in ("code", "text", "source")}) for item in document["warnings"]
            ),
            made_from=tuple((item["source"], item["sha256"]) for item in document["made_from"]),
            record=document.get("record", {}),
        )
    except InputError as error:
        raise InputError(f"'{source}': {error}; {REMEDY}") from error
