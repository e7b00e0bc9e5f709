"""`batch`: recordings of many valves -> a calibration of each, in one table."""

from typing import TYPE_CHECKING

from dzdesign.batch.arguments import BatchArguments

if TYPE_CHECKING:
    from dzdesign.report.lot.summary import LotSummary


def batch(arguments: BatchArguments) -> "LotSummary":
    """Calibrate many valves; an earlier run in the same folder is continued.

    Returns
    -------
    LotSummary
        Content of batch.json: counts, reasons of failures, quantiles and the lot setting.

    Raises
    ------
    InputError
        If the list, the folder or an option is wrong. A valve that can't be calibrated is not an error: see ``failed``.
    """
    from dzdesign.batch.command import calibrate_lot

    return calibrate_lot(arguments)
