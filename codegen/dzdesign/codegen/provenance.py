"""The manifest's account of every constant: C symbol -> equation -> engineering value -> datum -> file and hash."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from dzdesign.codegen.core.constants import Constant
from dzdesign.core.artefact_types import SourceFile
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareConstant, FirmwareOrigin


def origin_of(compensator: Compensator, compensator_sha256: str) -> FirmwareOrigin:
    """Return the hashes of the files that a firmware was made from, compensator.json as it stands in it."""
    made_from = json.loads(compensator.valve_document).get("made_from", ())
    return FirmwareOrigin(
        compensator_json=compensator_sha256,
        valve_json=compensator.valve_sha256,
        ramp_tests=tuple(SourceFile(source=str(each["source"]), sha256=str(each["sha256"])) for each in made_from),
    )


def constants_of(
    compensator: Compensator, constants: Mapping[str, Sequence[Constant]]
) -> tuple[FirmwareConstant, ...]:
    """Return where each constant came from, in the order of the files of the core and of what stands in them."""
    valve_keys = _valve_keys(compensator, json.loads(compensator.valve_document))
    return tuple(constant.entry(path, valve_keys) for path in sorted(constants) for constant in constants[path])


def _valve_keys(compensator: Compensator, valve: Mapping[str, Any]) -> dict[str, tuple[str, ...]]:
    """Return which keys of valve.json `design` read for each key of compensator.json; all else are its options."""
    found: dict[str, tuple[str, ...]] = {"u_max_V": ("u_max_V",)}
    for sign in compensator.signals.signs:
        name = "positive" if sign > 0 else "negative"
        side, document = f"sides.{name}", valve["sides"][name]
        guard = compensator.side(sign).certificate.guard
        curve = f"{side}.guards.{guard}" if guard in document.get("guards", {}) else None
        # A valve.json from before there was a choice of guards has one curve, in other places.
        offset = f"{curve}.u_min0_V" if curve else f"{side}.reference.u_min_V"
        bounds = (f"{curve}.beta", f"{curve}.certified_steps_V") if curve else (f"{side}.beta", f"{side}.certificate")
        # With an edge the law's offset is that of the opening threshold.
        opening = (f"{side}.opening_curve",) if compensator.edge_codes else ()
        found |= {
            f"{side}.u_min0_over_u_max": opening or (offset,),
            f"{side}.k_x_max_over_u_max": (f"{side}.k_x_max_over_u_max", f"{side}.tests", *(opening or (offset,))),
            f"{side}.beta": (offset, *bounds, f"{side}.trend"),
            f"{side}.edge_beta": (*opening, f"{side}.trend"),
        }
    return found
