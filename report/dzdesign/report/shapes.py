"""What the report reads of the artefacts that no other module reads back."""

from types import NoneType

TEXT_OR_NONE = (str, NoneType)
TRUTH = (bool, NoneType)
MADE_FROM = [{"source": str, "sha256": str}]

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
