"""The one firmware of a lot in block form: which it is, which valves need another, and its folder."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dzdesign.batch.calibration import BLOCK_IMAGE
from dzdesign.batch.valve_folders import ValveFolder
from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.documents import read_bytes, sha256_of
from dzdesign.design.firmware_manifest import BLOCK_FILE
from dzdesign.report.lot.summary import FIRMWARE, LOT_SETTING, LotFirmware
from dzdesign.report.lot.table import by_name

if TYPE_CHECKING:
    from dzdesign.codegen.calibration.layout import BuiltFor
    from dzdesign.design.compensator import Compensator

#: Folder of what is of all valves together: `output` itself is locked as long as the batch runs.
LOT = "lot"


class Project(NamedTuple):
    """All that the C code of a firmware in block form depends on."""

    target: str
    built: "BuiltFor"


def project_of(compensator: "Compensator") -> Project:
    """Return the firmware that a compensator's block needs."""
    from dzdesign.codegen.calibration.block import built_for
    from dzdesign.codegen.project import DEFAULT_TARGET

    return Project(compensator.target.name if compensator.target else DEFAULT_TARGET, built_for(compensator))


def needing_another(valves: Sequence[ValveFolder]) -> dict[str, str]:
    """Return the valves whose block the lot's firmware would refuse, by name, each with the reason.

    The lot's firmware is the one that most of its valves need; of two that as many need the one of the first valve.
    """
    needed = {each.name: project_of(each.compensator) for each in valves if each.compensator is not None}
    if not needed:
        return {}
    ((lot, _),) = Counter(needed.values()).most_common(1)
    return {name: _reason(own, lot) for name, own in needed.items() if own != lot}


def _reason(own: Project, lot: Project) -> str:
    """Say in what a valve's firmware would differ."""
    others = [("target", own.target, lot.target), ("wiring", _wiring(own.built), _wiring(lot.built))]
    names = [field.name for field in fields(own.built) if field.name != "shape"]
    others += [(name, str(getattr(own.built, name)), str(getattr(lot.built, name))) for name in names]
    words = ", ".join(f"{what} {mine} instead of {theirs}" for what, mine, theirs in others if mine != theirs)
    return (
        f"its calibration block needs another firmware than that of the lot: {words}; give it the lot's options, or "
        "calibrate it in a batch of its own"
    )


def _wiring(built: "BuiltFor") -> str:
    from dzdesign.codegen.calibration.layout import SHAPE_BITS

    return " and ".join(text for name, text in SHAPE_BITS.items() if built.has(name)) or "one solenoid"


def write_lot_firmware(
    output: Path, designed: "Mapping[str, Compensator]", setting: "Compensator | None"
) -> LotFirmware | None:
    """Write the lot's firmware into `output`, and return what batch.json says of it; None without a calibrated valve.

    Until a valve's own block is loaded it has that of the lot setting, which over-compensates none of the valves;
    where there is no such setting that of the first valve.
    """
    from dzdesign.codegen.project import generate
    from dzdesign.codegen.writing import write_generated

    if not designed:
        return None
    first = min(designed, key=by_name)
    project = project_of(designed[first])
    fits = setting is not None and project_of(setting) == project
    compensator = setting if setting is not None and fits else designed[first]
    folder = output / LOT / FIRMWARE
    firmware = generate(compensator, project.target, "block")
    write_generated(firmware, folder, over_another=True)
    return LotFirmware(
        folder=f"{LOT}/{FIRMWARE}",
        target=project.target,
        manifest_sha256=sha256_of(read_bytes(folder / MANIFEST_NAME, "firmware manifest")),
        block_of=LOT_SETTING if fits else first,
        blocks=(BLOCK_FILE, BLOCK_IMAGE),
    )


def firmware_left(output: Path, firmware: LotFirmware | None) -> list[str]:
    """Return what to say of a lot's firmware that this run did not write: it would pass for one of this lot."""
    if firmware is not None or not (output / LOT / FIRMWARE / MANIFEST_NAME).is_file():
        return []
    return [
        f"the folder '{LOT}/{FIRMWARE}' is left of an earlier run with --calibration block, and none of these valves "
        "has a block for it; take it away, or give --calibration block again"
    ]


def foreign_block(firmware: LotFirmware | None, valves: int) -> Sequence[str]:
    """Say of the firmware of a lot of so many calibrated valves that it drives each of them by the block of one."""
    if firmware is None or firmware.block_of == LOT_SETTING or valves < 2:
        return ()
    return [
        f"'{firmware.folder}' drives every valve by the block of {firmware.block_of} until its own is loaded, which "
        "may over-compensate the others: there is no lot setting; load each valve's own block before it is driven"
    ]
