"""The drive functions and the current controller with the blocks of other valves, once for each of their settings.

Every input tries dz_comp() alone. The drive around it takes its numbers from the same block: how it ramps with another
block, that of the firmware, which may have no ramps, does not show.
"""

import shutil
from collections.abc import Iterable, Iterator
from dataclasses import astuple, fields
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.errors import and_more
from dzdesign.core.placing import scratch_folder

if TYPE_CHECKING:
    from dzdesign.codegen.calibration.layout import CalibrationBlock
    from dzdesign.design.compensator import Compensator
    from dzdesign.verify.requirements import Check

#: Entries of a block that say whose it is, how it is shown, and what every input tries.
OF_ONE_VALVE = (
    "compensator_sha256", "serial", "record", "u_max_uV", "a_span_Pa", "b_span_Pa", "a_full", "b_full", "sides",
    "crc32",
)  # fmt: skip
#: Blocks that a sentence names.
NAMED = 3
#: A block, where it lies, and its compensator.
Tried = tuple[Path, "CalibrationBlock", "Compensator"]


def drives_checked(folder: Path, blocks: Iterable[Tried]) -> Iterator["Check"]:
    """Yield a requirement for each setting of the drive that blocks have and the block in `folder` has not.

    Ramps count as settings, not so the widths of a play, which differ from valve to valve: one of them is tried.
    """
    from dzdesign.codegen.calibration.packing import pack
    from dzdesign.design.firmware_manifest import BLOCK_FILE
    from dzdesign.verify.current.current_checks import current_checks
    from dzdesign.verify.exhaustive.drive_check import drive_follows
    from dzdesign.verify.requirements import CALIBRATION_BLOCK

    settings: dict[tuple[object, ...], list[Tried]] = {}
    for each in blocks:
        settings.setdefault(_settings(each[1]), []).append(each)
    for (path, block, compensator), *others in settings.values():
        with scratch_folder() as temporary:
            shutil.copytree(folder / "core", temporary / "core")
            (temporary / BLOCK_FILE).write_bytes(pack(block))
            found = [drive_follows(temporary, compensator)]
            found += current_checks(temporary, compensator, lambda _: None).checks
        faults = [f"{check.name}: {check.text}" for check in found if not check.holds]
        text = "; ".join(faults) or "; ".join(check.text for check in found)
        alike = and_more([str(other) for other, _, _ in others], NAMED)
        yield CALIBRATION_BLOCK.check(
            holds=not faults,
            name=f"the drive functions with the calibration block: {path}",
            text=f"{text}{f'; with the same settings: {alike}' if alike else ''}",
        )


def _settings(block: "CalibrationBlock") -> tuple[object, ...]:
    """Return what the drive around the law follows, but for the widths of a play."""
    shared = [getattr(block, each.name) for each in fields(block) if each.name not in (*OF_ONE_VALVE, "current")]
    sides = [(side.ramp_up, side.ramp_down, side.span, any(side.play)) for side in block.sides]
    return (*shared, *sides, astuple(block.current))
