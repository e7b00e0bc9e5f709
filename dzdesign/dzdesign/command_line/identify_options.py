"""The options of `identify` on the command line, turned into `IdentifyOptions`."""

import argparse
import datetime
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from dzdesign.core.errors import InputError, quoted
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


def record_of(given: Sequence[str | Mapping[str, object]] | Mapping[str, object] | None) -> dict[str, str]:
    """Return the record of a test.

    Parameters
    ----------
    given : sequence, mapping or None
        Of --record: texts such as ``serial = 4711``, and before them the table of the file of options, of which an
        entry gives way to a text of the same name. Or a mapping of Python, whose values may be numbers and dates.

    Raises
    ------
    InputError
        If an entry is none, or a name is given twice.
    """
    from dzdesign.identify.valve.test_record import checked_record

    items = [given] if isinstance(given, Mapping) else given or []
    entries = [(name, _as_text(text)) for item in items if isinstance(item, Mapping) for name, text in item.items()]
    table = checked_record(entries, "the record")
    told = checked_record([_entry(item) for item in items if isinstance(item, str)], "--record")
    return checked_record((table | told).items(), "the record")


def _entry(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise InputError(f'--record is {quoted(text)}, expected a name and a text such as "serial = 4711"')
    return name.strip(), value.strip()


def _as_text(value: object) -> object:
    """Return a number or a date as text; what else is no text is refused where the record is checked."""
    is_said = isinstance(value, int | float | datetime.date | datetime.time) and not isinstance(value, bool)
    return str(value) if is_said else value
