"""The manifest's account of every constant: C symbol -> equation -> engineering value -> datum -> file and hash."""

from collections.abc import Mapping, Sequence

from dzdesign.codegen.core.constants import Constant
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareConstant


def constants_of(compensator: Compensator, constants: Mapping[str, Sequence[Constant]]) -> tuple[FirmwareConstant, ...]:
    """Return where each constant came from, in the order of the files of the core and of what stands in them."""
    valve_keys = _valve_keys(compensator)
    return tuple(constant.entry(path, valve_keys) for path in sorted(constants) for constant in constants[path])


def _valve_keys(compensator: Compensator) -> dict[str, tuple[str, ...]]:
    """Return which keys of valve.json `design` read for each key of compensator.json; all else are its options."""
    found: dict[str, tuple[str, ...]] = {"u_max_V": ("u_max_V",)}
    for sign in compensator.signals.signs:
        name = "positive" if sign > 0 else "negative"
        side = f"sides.{name}"
        curve = f"{side}.certified.{compensator.side(sign).certificate.guard}"
        offset, bounds = f"{curve}.u_min0_V", (f"{curve}.offset_V", f"{curve}.u_lower_V", f"{curve}.curvature_V_MPa2")
        # With a transition the law's offset is that of the opening threshold.
        opening = (f"{side}.opening_curve",) if compensator.transition_codes else ()
        found |= {
            f"{side}.u_min0_over_u_max": opening or (offset,),
            f"{side}.drive_range_over_u_max": (f"{side}.k_x_max_over_u_max", f"{side}.tests", *(opening or (offset,))),
            f"{side}.certificate.dp_MPa": (f"{curve}.dp_MPa",),
            f"{side}.beta": (offset, *bounds, f"{side}.trend"),
            f"{side}.transition_beta": (*opening, f"{side}.trend"),
        }
    return found
