"""`init`: recordings -> a proposal of the options file."""

import os
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.artefact_files import check_file_may_be_written, write_file
from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath, Option, Paths, read_options
from dzdesign.stages.recordings import ColumnArguments, read_missing

if TYPE_CHECKING:
    from dzdesign.initial_options.proposal import Proposal


@dataclass(frozen=True)
class InitArguments(ColumnArguments):
    """Arguments of `init`."""

    ramps: Annotated[Paths, Option("RAMP")] = ()
    """Recordings, as for identify (default: ramps/*, or *.csv)."""
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option("FILE", command_default="dzdesign.toml", short="-o")] = None
    """File to write. An existing file is never overwritten."""


def init(arguments: InitArguments) -> "Proposal":
    """Inspect recordings and propose an options file.

    Returns
    -------
    Proposal
        Text of the file, what was found, and what is open. `identify` can't run before every open point is settled.

    Raises
    ------
    InputError
        If a recording can't be read, or the file exists.

    Examples
    --------
    >>> from dzdesign import api
    >>> from dzdesign.example import example_folder
    >>> proposal = api.init(example_folder() / "ramps" / "ramp_dP1_1.csv.gz")
    >>> proposal.columns
    {}
    """
    from dzdesign.initial_options.proposal import propose

    output = arguments.output
    if output is not None:
        if os.path.lexists(output):
            raise InputError(
                f"'{output}' exists, and init never writes over a file; give another name with -o, or move it away"
            )
        check_file_may_be_written(Path(output))
    proposal = propose(
        arguments.ramps,
        columns=arguments.columns,
        dp=arguments.dp,
        sample_rate=arguments.sample_rate,
        skip_rows=read_options(arguments, ["skip_rows"])["skip_rows"],
        missing=read_missing(arguments.missing),
    )
    if output is not None:
        write_file(Path(output), proposal.text)
    return proposal
