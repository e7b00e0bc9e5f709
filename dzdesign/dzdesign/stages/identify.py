"""`identify`: ramp tests -> ValveModel."""

import datetime
import os
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from dzdesign.core.artefact_files import check_file_may_be_written, check_place_of_files, write_file, write_files
from dzdesign.core.dither import read_dithered
from dzdesign.core.errors import InputError, quoted
from dzdesign.core.option_readers import number, percent, quantity
from dzdesign.core.options import FIT, METER, RECORDINGS, AnyPath, Option, Paths, Table, Text, Texts, arguments_of
from dzdesign.stages.recording_choices import in_order, parts_of, stated_order
from dzdesign.stages.recordings import RampArguments, expand, meter_choices, read_recordings, refuse_copies
from dzdesign.terminal.progress import stage_progress

if TYPE_CHECKING:
    from dzdesign.identify.options import IdentifyOptions
    from dzdesign.identify.reading.ramp_test import RampTest
    from dzdesign.identify.valve.low_flow import LowFlow
    from dzdesign.identify.valve.model import StatedOptions, ValveModel

#: Arguments that are not an option of the identification itself: what is read and written, and what nothing is made of.
NOT_STATED = ("ramps", "output", "plots", "record")


@dataclass(frozen=True, kw_only=True)
class IdentifyChoices(RampArguments):
    """Options of `identify`, of each valve of `batch` too."""

    meter_zero: Annotated[str, Option("Q", METER, example="0.1 L/min", read=quantity("flow"))] = "0 L/min"
    """Bound of the flow meter's zero error."""
    noise_level: Annotated[Text, Option("Q", METER, example="0.1 L/min", read=quantity("flow"))] = None
    """Smallest flow that counts as flow, if averages over the dead zone resolve it (default: the resolved flow, and at
    least 0.5 % of the largest flow)."""
    zero_flow: Annotated[Text, Option("Q", FIT, example="0.1 L/min", read=quantity("flow"))] = None
    """Flow that is allowed at zero command, including a leak (default: none). The guarded threshold is then the command
    at which the valve passes this flow, and otherwise that of the first flow seen."""
    dp0: Annotated[Text, Option("P", FIT, example="1 MPa", read=quantity("pressure"))] = None
    """Reference pressure drop (default: the test nearest to "1 MPa")."""
    x_max: Annotated[Text, Option("X", FIT, example="1.8 mm", read=quantity("length"))] = None
    """Stroke of the spool, such as "1.8 mm". It gives k in V/mm."""
    confidence: Annotated[float | str, Option("C", FIT, read=number("a number such as 0.99"))] = "0.99"
    """Joint confidence level of all lower bounds."""
    flat_below: Annotated[
        float | str, Option("C", FIT, read=lambda text, option: number("a number such as 0.1")(text, option) / 100)
    ] = "0.1"
    """Change of the threshold over the tests below which it counts as flat and beta is 1, in percent of full
    command."""
    repeatability: Annotated[Text, Option("S", FIT, example="0.1 %", read=percent("0.1 %"))] = None
    """Standard deviation of the threshold from ramp to ramp, in percent of full command, such as "0.1 %" (default:
    measured on repeated ramps, otherwise 0.25 %)."""
    curve: Annotated[Text, Option("PREMISE", FIT)] = None
    """Premise about the threshold between the tests. line: a straight line against the pressure drop. smooth:
    curvature at most M, or no bend stronger than the tests show. monotone: it runs one way. The default is smooth; with
    two pressure drops nothing is certified between them."""
    curvature: Annotated[Text, Option("M", FIT, example="20 mV/MPa^2", read=quantity("curvature"))] = None
    """Bound M of the premise smooth, such as "20 mV/MPa^2" (default: estimated from the tests). It bounds the
    threshold's second divided difference, kinks included."""
    dithered: Annotated[Text, Option("D", RECORDINGS, example="150 Hz 1 %", read=read_dithered)] = None
    """Dither that the drive superimposed on the command of every recording. It is the frequency and peak of a square
    wave, such as "150 Hz 1 %" of full command, or "150 Hz 0.1 V". `design --dither` then requires the same."""
    order: Annotated[Paths | None, Option("FILE", RECORDINGS)] = None
    """Recordings in the order of the measurement, such as "p1.csv, p5.csv, p1_again.csv" (default: by date and time in
    the recordings). The order separates a drift of the valve from the effect of the pressure drop. Repeatable; in the
    options file also a list."""
    from_: Annotated[Table, Option("T", RECORDINGS, example="12.3 s")] = None
    """Start time on a recording's clock, such as "12.3 s"; earlier rows are left out. Dates count from the first row.
    In the options file also a table [from] from file name or pattern to time."""
    to: Annotated[Table, Option("T", RECORDINGS, example="62.1 s")] = None
    """End time on a recording's clock; later rows are left out. In the options file also a table [to]."""
    record: Annotated[Mapping[str, object] | None, Option("ENTRY", RECORDINGS, by_entry=True)] = None
    """Entry of the test record, such as "serial = 4711". It is kept in valve.json and printed in the report, and
    nothing is computed from it. Repeatable; in the options file this is a table [record]."""


@dataclass(frozen=True)
class IdentifyArguments(IdentifyChoices):
    """Arguments of `identify`."""

    ramps: Annotated[Paths, Option("RAMP")]
    """Recordings, or patterns such as ramps/*.csv. Formats are CSV, TDMS, MAT, HDF5, Parquet and Feather, with columns
    time_s, u_V, dP_MPa and Q_Lmin."""
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option("FILE", command_default="valve.json", short="-o")] = None
    """File to write."""
    low_flow: Annotated[Texts, Option("READING", METER)] = ()
    """Flow below the meter's floor, measured by hand with a measuring glass or by a cylinder's drift, such as
    "5 +- 1 mL/min at 5.16 V, 5 MPa, closing". The last word is opening or closing. Repeatable."""
    plots: Annotated[AnyPath | None, Option("DIR")] = None
    """Folder for plots in SVG and PNG. They show the flow at each pressure drop with knees, onsets and residuals, and
    thresholds, bounds and beta against dP."""


def identify_options(choices: IdentifyChoices) -> "IdentifyOptions":
    """Return the options of `identify` in SI units."""
    from dzdesign.identify.options import IdentifyOptions

    names = [field.name for field in fields(IdentifyOptions) if field.name != "meter_lag_tolerance"]
    return IdentifyOptions(**meter_choices(choices, names))


def record_of(given: Mapping[str, object] | None) -> dict[str, str]:
    """Return the record of a test, its numbers and dates as text; refuse an entry that is neither."""
    from dzdesign.identify.valve.test_record import checked_record

    def as_text(value: object) -> object:
        plain = isinstance(value, int | float | datetime.date | datetime.time) and not isinstance(value, bool)
        return str(value) if plain else value

    return checked_record([(name, as_text(value)) for name, value in (given or {}).items()], "the record")


def identify(arguments: IdentifyArguments) -> "ValveModel":
    """Identify a valve from ramp tests.

    Returns
    -------
    ValveModel
        The identified valve with bounds, warnings and provenance.

    Raises
    ------
    InputError
        If a file or an option can't be read, or no threshold can be identified. The message states the reason.

    Examples
    --------
    >>> from dzdesign import api
    >>> from dzdesign.example import example_folder
    >>> valve = api.identify(example_folder() / "ramps" / "ramp_dP[15]_1.csv.gz", meter_lag="0.1 s")
    >>> valve.positive.trend, round(valve.positive.reference.u_min_V, 2)
    ('decreasing', 5.22)
    """
    from dzdesign.core.artefact_types import to_json_bytes
    from dzdesign.identify.identification import identify_sides
    from dzdesign.identify.plots.valve_plots import plot_files
    from dzdesign.identify.valve.low_flow import read_low_flow

    options, record = identify_options(arguments), record_of(arguments.record)
    _check_places(arguments)
    paths = expand(arguments.ramps)
    tests = _read(arguments, options, paths)
    by_hand = read_low_flow(arguments.low_flow, options.u_max)
    refuse_copies(tests)
    order = stated_order(tests, paths, arguments.order)
    tests = in_order(tests, order)
    with stage_progress(f"fitting {len(tests)} recording{'s' if len(tests) > 1 else ''}"):
        found = identify_sides(tests, options, record, by_hand)
    stated = stated_options(arguments, order)
    found = replace(found, model=replace(found.model, options=stated))
    if arguments.output is not None:
        write_file(Path(arguments.output), to_json_bytes(found.model), found.model.schema)
    if arguments.plots is not None:
        with stage_progress("drawing"):
            write_files(Path(arguments.plots), plot_files(found), "--plots")
    return found.model


def _check_places(arguments: IdentifyArguments) -> None:
    """Refuse places where valve.json or plots can't be written, or which would take each other's."""
    from dzdesign.core.artefact_types import schema_of
    from dzdesign.identify.valve.model import ValveModel

    output, plots = arguments.output, arguments.plots
    if output is not None:
        check_file_may_be_written(Path(output), schema_of(ValveModel))
    if plots is None:
        return
    if not os.fspath(plots):
        raise InputError("--plots is empty, expected the name of a folder, such as plots")
    folder = Path(plots)
    check_place_of_files(folder, "--plots")
    if output is not None and Path(output).absolute() in (folder.absolute(), *folder.absolute().parents):
        raise InputError(f"--plots '{plots}' lies at '{output}', where -o puts a file; choose another --plots")


def _read(
    arguments: IdentifyArguments, options: "IdentifyOptions", paths: Paths, names: Sequence[str] = ()
) -> "list[RampTest]":
    """Read the recordings, those parts that are asked for."""
    tests = read_recordings(paths, arguments, options.u_max, names=names)
    return parts_of(tests, arguments.from_, arguments.to)


def identify_again(options: "StatedOptions", record: Mapping[str, str], files: Mapping[str, Path]) -> "ValveModel":
    """Identify a valve as its valve.json says that it was; `files` by the names of made_from, in that order.

    Raises
    ------
    InputError
        If an option or a file can't be read, or no threshold can be given; the reason.
    """
    from dzdesign.identify.identification import identify_sides

    again = read_again(options, files)
    return replace(identify_sides(again.tests, again.options, record, again.by_hand).model, options=options)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadAgain:
    """The files of a valve.json, read as its options say."""

    options: "IdentifyOptions"
    tests: "list[RampTest]"
    by_hand: "list[LowFlow]"


def read_again(options: "StatedOptions", files: Mapping[str, Path]) -> ReadAgain:
    """Read the files of a valve.json as it says that they were read, by the names of made_from.

    Raises
    ------
    InputError
        If an option or a file can't be read.
    """
    from dzdesign.identify.valve.low_flow import read_low_flow

    known = {argument.name for argument in arguments_of(IdentifyArguments)} - {*NOT_STATED, "order"}
    given: dict[str, Any] = {**options.texts, **options.tables, **options.lists}
    order = given.pop("order", ())
    if strange := [name for name in given if name not in known]:
        raise InputError(f"its options name {quoted(strange[0])}, which is no option of `identify`")
    arguments = IdentifyArguments([], **given)
    choices = identify_options(arguments)
    tests = in_order(_read(arguments, choices, list(files.values()), list(files)), order)
    return ReadAgain(options=choices, tests=tests, by_hand=read_low_flow(arguments.low_flow, choices.u_max))


def stated_options(arguments: IdentifyArguments, order: Sequence[str] = ()) -> "StatedOptions":
    """Return the options as valve.json has them: all but places and the record, those that were not given too."""
    from dzdesign.identify.valve.model import StatedOptions

    texts: dict[str, str] = {}
    tables: dict[str, Mapping[str, str]] = {}
    lists = {"order": tuple(order)} if order else {}
    for argument in arguments_of(IdentifyArguments):
        value = None if argument.name in (*NOT_STATED, "order") else getattr(arguments, argument.name)
        if isinstance(value, Mapping):
            tables[argument.name] = {str(key): str(text) for key, text in value.items()}
        elif isinstance(value, list | tuple):
            if not value:
                continue
            lists[argument.name] = tuple(map(str, value))
        elif value is not None:
            texts[argument.name] = str(value)
    return StatedOptions(texts=texts, tables=tables, lists=lists)
