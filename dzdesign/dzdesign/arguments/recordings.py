"""Options of the stages that read recordings: `init`, `identify`, `assess`."""

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Annotated

from dzdesign.core.options import (
    FIT,
    METER,
    RECORDINGS,
    AnyPath,
    Option,
    Paths,
    Table,
    Text,
    number,
    percent_range,
    quantity,
    whole_number,
)
from dzdesign.core.units import parse_quantity

# fmt: off


@dataclass(frozen=True, kw_only=True)
class ColumnArguments:
    """How the columns of recordings are found."""

    columns: Annotated[Table, Option(
        'Columns, such as "u=AO0:V, Q=Flow (L/min)": a quantity (time, u, dP, pA, pB, Q), its label in the file and, '
        "after a colon, the unit that the label lacks. In the options file a table [columns].",
        "MAP", RECORDINGS)] = None
    dp: Annotated[Table, Option(
        'Pressure drop of files without a column of it, such as "1 MPa". In the options file also a table [dp] from '
        "file name or pattern to pressure.",
        "P", RECORDINGS, example="1 MPa")] = None
    skip_rows: Annotated[int | str | None, Option(
        "Rows above the header of a text file, such as a logger's preamble (default: found).", "N", RECORDINGS,
        read=whole_number("how many rows stand above the header, such as 12 (0: none)"))] = None


@dataclass(frozen=True, kw_only=True)
class RampArguments(ColumnArguments):
    """How ramp tests are read."""

    u_max: Annotated[str, Option(
        "Full command.", "U", RECORDINGS, example="10 V", read=quantity("voltage"))] = "10 V"
    meter_floor: Annotated[Text, Option(
        "Flow below which the meter reads zero (default: found).",
        "Q", METER, example="0.6 L/min", read=quantity("flow"))] = None
    meter_lag: Annotated[Text, Option(
        "Lag of the flow meter (default: found from ramps of two rates).",
        "T", METER, example="0.1 s", read=quantity("time"))] = None
    knee_window: Annotated[str, Option(
        "Flow range of the straight-line fit, in percent of maximum flow.",
        "A-B", FIT, read=percent_range("the largest flow such as '12-50'"))] = "12-50"


@dataclass(frozen=True, kw_only=True)
class IdentifyChoices(RampArguments):
    """Options of `identify`, of each valve of `batch` too."""

    meter_zero: Annotated[str, Option(
        "Bound of the flow meter's zero error.", "Q", METER, example="0.1 L/min", read=quantity("flow"))] = "0 L/min"
    dp0: Annotated[Text, Option(
        'Reference pressure drop (default: the test nearest to "1 MPa").',
        "P", FIT, example="1 MPa", read=quantity("pressure"))] = None
    x_max: Annotated[Text, Option(
        'Stroke of the spool, such as "1.8 mm": gives k in V/mm.',
        "X", FIT, example="1.8 mm", read=quantity("length"))] = None
    confidence: Annotated[float | str, Option(
        "Joint confidence level of all lower bounds.", "C", FIT, read=number("a number such as 0.99"))] = "0.99"
    flat_below: Annotated[float | str, Option(
        "Percent of full command: a threshold that changes by less over the tests counts as flat, and beta is 1.",
        "C", FIT, read=lambda text, option: number("a number such as 0.1")(text, option) / 100)] = "0.1"
    record: Annotated[Mapping[str, object] | None, Option(
        'Entry of the test record, such as "serial = 4711": kept in valve.json and printed in the report, nothing is '
        "computed from it. Repeatable. In the options file a table [record].",
        "ENTRY", RECORDINGS, by_entry=True)] = None


@dataclass(frozen=True)
class IdentifyArguments(IdentifyChoices):
    """Arguments of `identify`."""

    ramps: Annotated[Paths, Option(
        "Recordings, or patterns such as ramps/*.csv: CSV, TDMS, MAT, HDF5, Parquet or Feather, with columns time_s, "
        "u_V, dP_MPa, Q_Lmin.", "RAMP")]
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option(
        "File to write, valve.json.", "FILE", command_default="valve.json", short="-o")] = None
    plots: Annotated[AnyPath | None, Option(
        "Folder for plots in SVG and PNG: flow of each pressure drop with its knees, onsets and residuals; thresholds, "
        "bounds and beta over dP.", "DIR")] = None


@dataclass(frozen=True)
class InitArguments(ColumnArguments):
    """Arguments of `init`."""

    ramps: Annotated[Paths, Option("Recordings, as for identify (default: ramps/*, or *.csv).", "RAMP")] = ()
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option(
        "File to write; one that exists is never overwritten.",
        "FILE", command_default="dzdesign.toml", short="-o")] = None


def _flow_or_share(text: str, option: str) -> tuple[float | None, float | None]:
    """Read a flow (m³/s) or a share of the largest flow; None for what it is not."""
    if text.rstrip().endswith("%"):
        return None, parse_quantity(text, "ratio", option)
    return parse_quantity(text, "flow", option), None


@dataclass(frozen=True)
class AssessArguments(RampArguments):
    """Arguments of `assess`."""

    before: Annotated[Paths, Option("Recordings without the compensator, as for identify.", "BEFORE")]
    after: Annotated[Paths, Option(
        "Recordings with it; their command is the compensator's input.", "AFTER", named=True)]
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option(
        "File to write, assessment.json.", "FILE", command_default="assessment.json", short="-o")] = None
    limits: Annotated[Table, Option(
        'Largest values AFTER, such as "dead_zone_opening = 5 %, flow_at_zero = 0.1 L/min", also of dead_zone_closing, '
        "knee_opening, knee_closing, hysteresis, linearity, symmetry, largest_flow_loss. In the options file a table "
        "[limits].", "L", example="5 %")] = None
    level: Annotated[Text, Option(
        'Flow that ends the dead zone, such as "0.6 L/min", or "1 %" of the largest flow before (default: what counts '
        "as flow, which is the meter's floor, its noise or 0.5 % of the largest flow).",
        "Q", example="0.6 L/min", read=_flow_or_share)] = None
    linearity_window: Annotated[str, Option(
        "Range of the linearity, in percent of full command.",
        "A-B", FIT, read=percent_range("full command such as '10-90'"))] = "10-90"
    after_columns: Annotated[Table, Option(
        "Columns of the recordings after, where u is the compensator's input (default: as --columns or [columns]).",
        "MAP", RECORDINGS)] = None
    after_u_max: Annotated[Text, Option(
        "Full command of the recordings after (default: as --u-max).",
        "U", RECORDINGS, example="10 V", read=quantity("voltage"))] = None
    plots: Annotated[AnyPath | None, Option("Folder for plots in SVG: flow over command.", "DIR")] = None


# fmt: on
