"""What is odd about the firmware of a lot: whose block it is linked with, and what an earlier run left."""

from collections.abc import Sequence
from pathlib import Path

from dzdesign.batch.lot_firmware import LOT
from dzdesign.report.lot.summary import LOT_SETTING, LotFirmware
from dzdesign.report.lot.valve_folder import FIRMWARE


def odd_blocks(valves: int, firmware: LotFirmware | None, folder: Path) -> list[str]:
    """Return sentences on the firmware of a lot of so many calibrated valves, if it has one, in its folder."""
    return [*_foreign_block(firmware, valves), *_stale_firmware(firmware, folder)]


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
