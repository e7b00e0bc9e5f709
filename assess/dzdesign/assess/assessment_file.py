"""The artefact assessment.json (schema dzdesign.assessment/1)."""

from dataclasses import asdict
from typing import Any

from dzdesign.assess.assessment import SETS, Assessment, PressureAssessment
from dzdesign.assess.flow_curves import PressureCurves
from dzdesign.assess.limits import LIMITED, LOSS, LimitResult
from dzdesign.assess.valve_quantities import IN_UNIT, QUANTITIES, Reading
from dzdesign.core.artefact_files import TOOL
from dzdesign.identify.ramps.pooling import SAME_PRESSURE

SCHEMA = "dzdesign.assessment/1"
TERMS = (
    "terms as in tests of hydraulic valves (ISO 10770-1); the formulas are dzdesign's own, and no conformity with a "
    "standard is claimed"
)
MPA, L_MIN = 1e6, 1e-3 / 60


def assessment_document(assessment: Assessment) -> dict[str, Any]:
    """Return an assessment as JSON data: values in the unit of their formula's entry.

    Parameters
    ----------
    assessment : Assessment
        Of `assess`.
    """
    options = assessment.options
    return {
        "schema": SCHEMA,
        "tool": TOOL,
        "made_from": list(assessment.made_from),
        "holds": assessment.holds,
        "options": {
            "u_max_V": options.reading.u_max,
            "after_u_max_V": options.of_set("after").u_max,
            "knee_window": list(options.reading.knee_window),
            "linearity_window": list(options.window),
            "level_L_min": None if options.level is None else options.level / L_MIN,
            "level_share": options.level_share,
            "same_pressure_within": SAME_PRESSURE,
        },
        "meter": {
            "floor_L_min": assessment.floor / L_MIN,
            "lag_s": assessment.lag.seconds,
            "lag_is": assessment.lag.origin,
        },
        "terms": TERMS,
        "quantities": {
            key: {"name": item.name, "unit": item.unit, "formula": item.formula}
            for key, item in (QUANTITIES | {LOSS: LIMITED[LOSS]}).items()
        },
        "pressures": [_pressure(item) for item in assessment.pressures],
        "limits": [_limit(result) for result in assessment.limits],
        "notes": [asdict(note) for note in assessment.notes],
    }


def _pressure(item: PressureAssessment) -> dict[str, Any]:
    keys = next(iter(item.readings.values()))
    return {
        "side": item.side,
        "dp_MPa": None if item.dp is None else item.dp / MPA,
        "level_L_min": item.level / L_MIN,
        "rated_flow_L_min": item.rated / L_MIN,
        "before": _recordings(item.before),
        "after": _recordings(item.after),
        "quantities": {
            key: {name: _reading(key, item.readings[name][key]) if name in item.readings else None for name in SETS}
            | {"change": _change(key, item)}
            for key in keys
        },
    }


def _recordings(curves: PressureCurves | None) -> dict[str, Any] | None:
    if curves is None:
        return None
    return {
        "source": curves.source,
        "ramps": list(curves.ramps),
        "dp_MPa": None if curves.dp is None else curves.dp / MPA,
    }


def _reading(key: str, reading: Reading) -> dict[str, Any]:
    factor = IN_UNIT[QUANTITIES[key].unit]

    def scaled(value: float | None) -> float | None:
        return None if value is None else factor * value

    return {
        "value": scaled(reading.value),
        "se": scaled(reading.se),
        "at_most": scaled(reading.at_most),
        "not_observable": reading.not_observable or None,
        "note": reading.note or None,
        "where": reading.where or None,
    }


def _change(key: str, item: PressureAssessment) -> dict[str, float | None] | None:
    if key not in item.changes:
        return None
    factor = IN_UNIT[QUANTITIES[key].unit]
    value, se = item.changes[key]
    return {"value": factor * value, "se": None if se is None else factor * se}


def _limit(result: LimitResult) -> dict[str, Any]:
    quantity = LIMITED[result.key]
    return {
        "quantity": result.key,
        "place": result.place,
        "limit": IN_UNIT[quantity.unit] * result.limit,
        "unit": quantity.unit,
        "holds": result.holds,
        "text": result.text,
    }
