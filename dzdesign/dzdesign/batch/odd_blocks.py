"""What is odd about the serial numbers of a lot's valves, and about the block in the lot's firmware."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from dzdesign.batch.lot_firmware import LOT
from dzdesign.codegen.calibration.block import entry_of_record
from dzdesign.core.errors import and_more, quoted
from dzdesign.design.compensator import Compensator
from dzdesign.report.lot.summary import LOT_SETTING, LotFirmware
from dzdesign.report.lot.valve_folder import FIRMWARE

#: Names in a sentence.
NAMED = 5


def odd_blocks(designed: Mapping[str, Compensator], firmware: LotFirmware | None, folder: Path) -> list[str]:
    """Return sentences on the calibrated valves of a lot, by name, and on the firmware in its folder, if it has one."""
    return [*_shared_serials(designed), *_foreign_block(firmware, len(designed)), *_stale_firmware(firmware, folder)]


def _shared_serials(designed: Mapping[str, Compensator]) -> Iterator[str]:
    """At the end of the line the serial number is all that tells whose a block is."""
    owners: dict[str, list[str]] = {}
    for name, compensator in designed.items():
        if serial := entry_of_record(compensator, "serial").strip():
            owners.setdefault(serial, []).append(name)
    for serial, names in owners.items():
        if len(names) > 1:
            yield (
                f"{and_more(names, NAMED)} have the same serial number, {quoted(serial)}: nothing tells for which of "
                "them a firmware or block of that number is; correct their records"
            )


def _foreign_block(firmware: LotFirmware | None, valves: int) -> Sequence[str]:
    if firmware is None or firmware.block_of == LOT_SETTING or valves < 2:
        return ()
    return [
        f"'{firmware.folder}' drives every valve by the block of {firmware.block_of} until its own is loaded, which "
        "may over-compensate the others: there is no lot setting; load each valve's own block before it is driven"
    ]


def _stale_firmware(firmware: LotFirmware | None, folder: Path) -> Sequence[str]:
    if firmware is not None or not (folder / LOT / FIRMWARE).is_dir():
        return ()
    place = f"{LOT}/{FIRMWARE}"
    return [f"the folder '{place}' is of an earlier run, with --calibration block or other valves; take it away"]
