"""`assess`: recordings without and with the compensator -> Assessment."""

from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.artefact_files import check_file_may_be_written, write_file
from dzdesign.core.errors import InputError
from dzdesign.core.option_readers import percent_range, quantity
from dzdesign.core.options import FIT, RECORDINGS, AnyPath, Option, Paths, Table, Text, read_options
from dzdesign.core.units import parse_quantity
from dzdesign.stages.recordings import RampArguments, meter_choices, read_recordings, refuse_copies
from dzdesign.terminal.progress import say, stage_progress

if TYPE_CHECKING:
    from dzdesign.assess.assessment import Assessment
    from dzdesign.assess.options import AssessOptions
    from dzdesign.identify.reading.ramp_test import RampTest


def _flow_or_share(text: str, option: str) -> tuple[float | None, float | None]:
    """Read a flow (m³/s) or a share of the largest flow; None for what it is not."""
    if text.rstrip().endswith("%"):
        return None, parse_quantity(text, "ratio", option)
    return parse_quantity(text, "flow", option), None


@dataclass(frozen=True)
class AssessArguments(RampArguments):
    """Arguments of `assess`."""

    before: Annotated[Paths, Option("BEFORE")]
    """Recordings without the compensator, as for identify."""
    after: Annotated[Paths, Option("AFTER", named=True)]
    """Recordings with the compensator, with its input as the command."""
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option("FILE", command_default="assessment.json", short="-o")] = None
    """File to write."""
    limits: Annotated[Table, Option("L", example="5 %")] = None
    """Largest permitted values with the compensator, such as "dead_zone_opening = 5 %, flow_at_zero = 0.1 L/min".
    Further names are dead_zone_closing, onset_opening, onset_closing, knee_opening, knee_closing, hysteresis,
    linearity, symmetry and largest_flow_loss. In the options file this is a table [limits]."""
    reading_flow: Annotated[Text, Option("Q", example="0.6 L/min", read=_flow_or_share)] = None
    """Flow at which dead zones are read, in addition to the onset, such as "0.6 L/min", or "1 %" of the largest flow
    before. The default is the largest of the meter's floor, its noise and 0.5 % of the largest flow."""
    linearity_window: Annotated[str, Option("A-B", FIT, read=percent_range("full command such as '10-90'"))] = "10-90"
    """Range of the linearity, in percent of full command."""
    after_columns: Annotated[Table, Option("MAP", RECORDINGS)] = None
    """Columns of the recordings with the compensator, with its input as u (default: as --columns or [columns])."""
    after_u_max: Annotated[Text, Option("U", RECORDINGS, example="10 V", read=quantity("voltage"))] = None
    """Full command of the recordings with the compensator (default: as --u-max)."""


def assess(arguments: AssessArguments) -> "Assessment":
    """Compare ramp tests without and with the compensator.

    Returns
    -------
    Assessment
        Each quantity without and with the compensator, and the result of each limit.

    Raises
    ------
    InputError
        If a file or an option can't be read. An exceeded limit is not an error: see ``holds``.
    """
    from dzdesign.assess.assessing import assess as assess_recordings
    from dzdesign.assess.assessment import Assessment
    from dzdesign.core.artefact_types import schema_of, to_json_bytes

    options = assess_options(arguments)
    if arguments.output is not None:
        check_file_may_be_written(Path(arguments.output), schema_of(Assessment))
    before = _read_set("before", arguments.before, arguments.columns, arguments, options.of_set("before").u_max)
    columns = arguments.after_columns or arguments.columns
    after = _read_set("after", arguments.after, columns, arguments, options.of_set("after").u_max)
    refuse_copies([*before, *after])
    with stage_progress(f"comparing {len(before)} recordings before with {len(after)} after"):
        found = assess_recordings(before, after, options)
    if arguments.output is not None:
        write_file(Path(arguments.output), to_json_bytes(found), found.schema)
    return found


def _read_set(name: str, patterns: Paths, columns: Table, arguments: AssessArguments, u_max: float) -> "list[RampTest]":
    """Read the recordings before or after; what is wrong with the columns of those after is said of --after-columns."""
    inherited = name == "after" and columns and not arguments.after_columns
    if inherited:
        say("recordings after: columns as those before, by --columns or [columns]; --after-columns says others")
    try:
        return read_recordings(patterns, replace(arguments, columns=columns), u_max, f"reading recordings {name}")
    except InputError as error:
        if name == "before" or "--columns" not in str(error):
            raise
        if inherited:
            raise InputError(
                f"{error}; the recordings after are read by the same --columns, or [columns], as those before: say "
                "theirs by --after-columns"
            ) from error
        raise InputError(str(error).replace("--columns", "--after-columns")) from error


def assess_options(arguments: AssessArguments) -> "AssessOptions":
    """Return the options of `assess` in SI units."""
    from dzdesign.assess.options import AssessOptions
    from dzdesign.assess.quantities import parse_limits
    from dzdesign.identify.options import IdentifyOptions

    reading = IdentifyOptions(**meter_choices(arguments, ["u_max", "meter_floor", "meter_lag", "knee_window"]))
    read = read_options(arguments, ["after_u_max", "reading_flow", "linearity_window"])
    after_u_max = read["after_u_max"]
    if after_u_max is not None and not after_u_max > 0:
        raise InputError(f"--after-u-max is '{arguments.after_u_max}', expected a positive command")
    flow, share = read["reading_flow"] or (None, None)
    limits = arguments.limits
    return AssessOptions(
        reading=reading,
        after_u_max=after_u_max,
        reading_flow=flow,
        reading_share=share,
        window=read["linearity_window"],
        limits=parse_limits(limits, after_u_max or reading.u_max) if limits is not None else {},
    )
