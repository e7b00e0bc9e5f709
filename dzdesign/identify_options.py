"""The options of `identify` on the command line, turned into `IdentifyOptions`."""

import argparse
from typing import TYPE_CHECKING

from dzdesign.core.errors import InputError
from dzdesign.core.units import parse_quantity
from dzdesign.recordings import knee_window, optional_quantity

if TYPE_CHECKING:
    from dzdesign.identify.options import IdentifyOptions

#: Their names on the command line, in words of Python.
IDENTIFY_NAMES = (
    *("u_max", "dp0", "meter_floor", "meter_lag", "meter_zero"),
    *("x_max", "confidence", "knee_window", "flat_below"),
)


def identify_options(args: argparse.Namespace) -> "IdentifyOptions":
    """Return the engineer's choices, SI.

    Parameters
    ----------
    args : argparse.Namespace
        Of `identify` or `batch`: texts.

    Raises
    ------
    InputError
        If an option can't be read; it is named.
    """
    from dzdesign.identify.options import IdentifyOptions

    return IdentifyOptions(
        u_max=parse_quantity(args.u_max, "voltage", "--u-max"),
        dp0=optional_quantity(args.dp0, "pressure", "--dp0"),
        meter_floor=optional_quantity(args.meter_floor, "flow", "--meter-floor"),
        meter_lag=optional_quantity(args.meter_lag, "time", "--meter-lag"),
        meter_zero=parse_quantity(args.meter_zero, "flow", "--meter-zero"),
        x_max=optional_quantity(args.x_max, "length", "--x-max"),
        confidence=_number(args.confidence, "--confidence", "0.99"),
        knee_window=knee_window(args.knee_window),
        flat_change=_number(args.flat_below, "--flat-below", "0.1") / 100,
    )


def _number(text: str, option: str, example: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise InputError(f"{option} is '{text}', expected a number such as {example}") from error
