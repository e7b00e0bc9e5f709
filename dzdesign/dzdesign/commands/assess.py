"""`dzdesign assess`: ramps recorded without and with the compensator, side by side, and the limits of the latter."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import check_file_may_be_written, to_json, write_file, write_files
from dzdesign.core.errors import InputError, one_line
from dzdesign.core.units import parse_quantity
from dzdesign.recordings import (
    check_plots,
    knee_window,
    optional_quantity,
    read_recordings,
    refuse_copies,
    two_per_cents,
)
from dzdesign.terminal.progress import say, stages

if TYPE_CHECKING:
    from dzdesign.assess.assessment import Assessment, AssessOptions
    from dzdesign.identify.reading.ramp_test import RampTest


def run_assess(args: argparse.Namespace) -> int:
    """Compare recordings; 1 if one with the compensator misses a limit, or a limit can't be checked."""
    from dzdesign.assess.assessment_file import SCHEMA, assessment_document
    from dzdesign.terminal.assessment_tables import print_assessment

    options = assess_options(args)
    output = Path(args.output)
    check_file_may_be_written(output, SCHEMA)
    check_plots(args.plots, output)
    found = compare(args, options)
    document = assessment_document(found)
    write_file(output, to_json(document), SCHEMA)
    if args.plots:
        from dzdesign.assess.plots import plot_files

        with stages() as stage:
            stage("drawing")
            drawn = plot_files(found)
        write_files(Path(args.plots), drawn, "--plots")
    if args.json:
        print(to_json(document), end="")
    else:
        print_assessment(found)
        print(one_line(f"Written: {args.output}" + (f", plots in {args.plots}" if args.plots else "")))
    return 0 if found.holds else 1


def compare(args: argparse.Namespace, options: "AssessOptions") -> "Assessment":
    """Read the recordings of both sets and compare them.

    Parameters
    ----------
    args : argparse.Namespace
        ``before``, ``after``, ``columns``, ``after_columns``, ``dp`` and ``skip_rows`` of the command.
    options : AssessOptions
        Of `assess_options`.
    """
    from dzdesign.assess.assessment import assess

    sets = {
        name: _read_set(name, patterns, columns, args, options.of_set(name).u_max)
        for name, patterns, columns in (
            ("before", args.before, args.columns),
            ("after", args.after, args.after_columns or args.columns),
        )
    }
    refuse_copies([*sets["before"], *sets["after"]])
    with stages() as stage:
        stage(f"comparing {len(sets['before'])} recordings before with {len(sets['after'])} after")
        return assess(sets["before"], sets["after"], options)


def _read_set(
    name: str, patterns: list[str], columns: str | dict[str, str] | None, args: argparse.Namespace, u_max: float
) -> "list[RampTest]":
    """Read the recordings before or after; what is wrong with the columns of those after is said of --after-columns."""
    inherited = name == "after" and columns and not args.after_columns
    if inherited:
        say("recordings after: columns as those before, by --columns or [columns]; --after-columns says others")
    try:
        return read_recordings(
            patterns, u_max=u_max, columns=columns, dp=args.dp, skip_rows=args.skip_rows,
            what=f"reading recordings {name}",
        )  # fmt: skip
    except InputError as error:
        if name == "before" or "--columns" not in str(error):
            raise
        if inherited:
            raise InputError(
                f"{error}; the recordings after are read by the same --columns, or [columns], as those before: say "
                "theirs by --after-columns"
            ) from error
        raise InputError(str(error).replace("--columns", "--after-columns")) from error


def assess_options(args: argparse.Namespace) -> "AssessOptions":
    """Return the engineer's choices, SI; `args` has them as the command's texts."""
    from dzdesign.assess.assessment import AssessOptions
    from dzdesign.assess.limits import parse_limits
    from dzdesign.identify.options import IdentifyOptions

    reading = IdentifyOptions(
        u_max=parse_quantity(args.u_max, "voltage", "--u-max"),
        meter_floor=optional_quantity(args.meter_floor, "flow", "--meter-floor"),
        meter_lag=optional_quantity(args.meter_lag, "time", "--meter-lag"),
        knee_window=knee_window(args.knee_window),
    )
    after_u_max = optional_quantity(args.after_u_max, "voltage", "--after-u-max")
    if after_u_max is not None and not after_u_max > 0:
        raise InputError(f"--after-u-max is '{args.after_u_max}', expected a positive command")
    level, share = _level(args.level)
    return AssessOptions(
        reading=reading,
        after_u_max=after_u_max,
        level=level,
        level_share=share,
        window=two_per_cents(args.linearity_window, "--linearity-window", "full command such as '10-90'"),
        limits=parse_limits(args.limits, after_u_max or reading.u_max) if args.limits is not None else {},
    )


def _level(text: str | None) -> tuple[float | None, float | None]:
    """Return the level as a flow (m³/s) or as a share of the largest flow; None for what it is not."""
    if text is None:
        return None, None
    if text.rstrip().endswith("%"):
        return None, parse_quantity(text, "ratio", "--level")
    return parse_quantity(text, "flow", "--level"), None
