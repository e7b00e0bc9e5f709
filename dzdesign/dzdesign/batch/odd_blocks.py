"""Anomalies of the block that a lot's firmware is linked with."""

from collections.abc import Sequence

from dzdesign.report.lot.summary import LOT_SETTING, LotFirmware


def foreign_block(firmware: LotFirmware | None, valves: int) -> Sequence[str]:
    """Say of the firmware of a lot of so many calibrated valves that it drives each of them by the block of one."""
    if firmware is None or firmware.block_of == LOT_SETTING or valves < 2:
        return ()
    return [
        f"'{firmware.folder}' drives every valve by the block of {firmware.block_of} until its own is loaded, which "
        "may over-compensate the others: there is no lot setting; load each valve's own block before it is driven"
    ]
