"""What the report reads of the artefacts that no other module reads back."""

from types import NoneType

TEXT_OR_NONE = (str, NoneType)
TRUTH = (bool, NoneType)
SPREAD = {"0.5": float, "0.01": float, "0.99": float}
MADE_FROM = [{"source": str, "sha256": str}]

#: verification.json.
VERIFICATION = {
    "tool": {"name": str, "version": str},
    "made_from": MADE_FROM,
    "holds": bool,
    "checks": [{"name": str, "holds": TRUTH, "text": str}],
    "inputs": [
        {
            "sign": int,
            "inputs": int,
            "wrong": int,
            "largest_error": int,
            "over_compensated": int,
            "smallest_margin_V": float,
            "object_sha256": str,
            "core_sha256": str,
            "outputs_hash": str,
            "first_wrong": TEXT_OR_NONE,
        }
    ],
    "closed_loop": {
        "plant_source": str,
        "pressures": [
            {
                "side": str,
                "dp_MPa": float,
                "dead_zone_opening": float,
                "dead_zone_closing": float,
                "residual_opening": float,
                "residual_closing": float,
                "q_zero_L_min": float,
                "q_zero_without_beta_L_min": float,
                "q_max_direct_L_min": float,
                "q_max_L_min": float,
            }
        ],
    },
    "scenarios": [
        {
            "name": str,
            "side": str,
            "dp_MPa": float,
            "q_zero_L_min": float,
            "q_peak_at_zero_L_min": float,
            "must_shut": bool,
        }
    ],
    "monte_carlo": (
        {
            "pressures": [
                {
                    "side": str,
                    "dp_MPa": float,
                    "plants": int,
                    "leaking": int,
                    "quantiles": {"residual_opening": SPREAD, "residual_closing": SPREAD, "q_zero_L_min": SPREAD},
                }
            ]
        },
        NoneType,
    ),
}
#: manifest.json of a firmware folder.
FIRMWARE = {
    "tool": {"name": str, "version": str},
    "made_from": MADE_FROM,
    "target": str,
    "law": str,
    "origin": {"compensator_json": str, "valve_json": str, "ramp_tests": MADE_FROM},
    "files": dict,
}
#: Of a constant also `value`: a whole number, or the rows of a table.
CONSTANTS = {
    "constants": [
        {
            "file": str,
            "symbol": str,
            "equation": str,
            "engineering": str,
            "rounding": str,
            "compensator_json": [str],
            "valve_json": [str],
            "generator": str,
        }
    ]
}
#: Keys that came later, by the kind of artefact.
LATER = {
    "firmware": {"constants": CONSTANTS, "board": {"board": [str]}},
    "verification": {"target": {"target": str}, "yours": {"yours": [str]}, "own": {"own": [str]},
                     "board_untried": {"board_untried": str}},
}
NUMBER_OR_NONE = (float, NoneType)
#: assessment.json.
READING = ({"value": NUMBER_OR_NONE, "se": NUMBER_OR_NONE, "at_most": NUMBER_OR_NONE}, NoneType)
ASSESSMENT = {
    "tool": {"name": str, "version": str},
    "made_from": MADE_FROM,
    "holds": TRUTH,
    "quantities": dict,
    "pressures": [{"side": str, "dp_MPa": NUMBER_OR_NONE, "quantities": dict}],
    "limits": [{"quantity": str, "place": str, "limit": float, "unit": str, "holds": TRUTH, "text": str}],
    "notes": [{"code": str, "text": str}],
}
#: reproduction.json.
REPRODUCTION = {
    "tool": {"name": str, "version": str},
    "paper": str,
    "holds": bool,
    "rows": [
        {
            "valve": str,
            "quantity": str,
            "unit": str,
            "dp_MPa": NUMBER_OR_NONE,
            "published": str,
            "outcomes": [{"by": str, "value": NUMBER_OR_NONE, "difference": NUMBER_OR_NONE, "holds": TRUTH}],
            "tolerance": str,
            "why": str,
            "holds": TRUTH,
        }
    ],
    "valves": [dict],
}
