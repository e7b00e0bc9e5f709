"""What stands around the four stages, for notebooks and scripts: `init`, `simulate`, `assess`, `report`, `batch`.

Part of `dzdesign.api`, with its conventions: options in the words of the command line, files only with ``output``, no
word on stdout or stderr. What is heavy is imported when a function is called.
"""

import os
from argparse import Namespace
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dzdesign.command_line.argument_types import takes_text
from dzdesign.core.artefact_files import (
    check_file_may_be_written,
    check_folder_may_be_written,
    write_file,
    write_folder,
)
from dzdesign.core.artefact_types import schema_of, to_json_bytes
from dzdesign.core.errors import InputError, nearest
from dzdesign.terminal.progress import talking

if TYPE_CHECKING:
    from dzdesign.assess.assessment import Assessment
    from dzdesign.commands.init import Proposal
    from dzdesign.report.valve_report import Report

__all__ = ["assess", "batch", "init", "report", "simulate"]

#: A file or folder as the standard library takes it.
AnyPath = str | os.PathLike[str]


def _patterns(paths: AnyPath | Iterable[AnyPath]) -> list[str]:
    return [os.fspath(path) for path in ([paths] if isinstance(paths, str | os.PathLike) else paths)]


def _said(option: str | Mapping[str, str] | None) -> str | dict[str, str] | None:
    return dict(option) if isinstance(option, Mapping) else option


@takes_text
def init(
    ramps: AnyPath | Iterable[AnyPath] = (),
    *,
    columns: str | Mapping[str, str] | None = None,
    dp: str | Mapping[str, str] | None = None,
    skip_rows: int | None = None,
    output: AnyPath | None = None,
) -> "Proposal":
    """Look at recordings and propose the file of options, as `dzdesign init` does.

    Parameters
    ----------
    ramps : path or iterable of paths
        Recordings, or patterns; without any those of ./ramps, or of this folder.
    columns, dp, skip_rows : optional
        As for `identify`.
    output : path, optional
        Also write the file here; one that exists is never written over.

    Returns
    -------
    Proposal
        Its text, what was seen, and what is open: while something is, `identify` can't run.

    Raises
    ------
    InputError
        If a recording can't be read, or the file exists.
    """
    from dzdesign.commands.init import propose

    name = None if output is None else os.fspath(output)
    with talking(quiet=True, verbose=False):
        return propose(_patterns(ramps), columns=_said(columns), dp=_said(dp), skip_rows=skip_rows, output=name)


@takes_text
def simulate(
    *,
    plant: AnyPath | None = None,
    firmware: AnyPath | None = None,
    dp: str | Iterable[str] = (),
    ramp_time: str = "100 s",
    seed: int = 1,
    output: AnyPath | None = None,
) -> dict[str, bytes]:
    """Simulate ramp tests of a valve, marked as simulated, as `dzdesign simulate` does.

    Parameters
    ----------
    plant : path, optional
        TOML file of the plant; without it the example's.
    firmware : path, optional
        Folder of a firmware, whose compensator then drives the valve.
    dp : str or iterable of str
        Pressure drops, such as ``["1 MPa", "4 MPa"]``; without any 0.5 to 5 MPa.
    ramp_time : str
        From zero to full command.
    seed : int
        Of the noise.
    output : path, optional
        Also write the folder of recordings here.

    Returns
    -------
    dict
        Name of each recording to its bytes, CSV in gzip.

    Raises
    ------
    InputError
        If a file or an option can't be read.
    """
    from dzdesign.commands import pipeline as commands

    said = Namespace(
        plant=None if plant is None else os.fspath(plant),
        firmware=None if firmware is None else os.fspath(firmware),
        dp=[dp] if isinstance(dp, str) else list(dp),
        ramp_time=ramp_time,
        seed=str(seed),
    )
    if output is not None:
        check_folder_may_be_written(Path(output))
    with talking(quiet=True, verbose=False):
        files, manifest = commands.simulate(said)
    if output is not None:
        write_folder(Path(output), files, manifest)
    return files


@takes_text
def assess(
    before: AnyPath | Iterable[AnyPath],
    after: AnyPath | Iterable[AnyPath],
    *,
    columns: str | Mapping[str, str] | None = None,
    after_columns: str | Mapping[str, str] | None = None,
    dp: str | Mapping[str, str] | None = None,
    skip_rows: int | None = None,
    u_max: str = "10 V",
    after_u_max: str | None = None,
    meter_floor: str | None = None,
    meter_lag: str | None = None,
    knee_window: str = "12-50",
    level: str | None = None,
    linearity_window: str = "10-90",
    limits: str | Mapping[str, str] | None = None,
    output: AnyPath | None = None,
) -> "Assessment":
    """Compare ramp tests without and with the compensator, as `dzdesign assess` does.

    Parameters
    ----------
    before, after : path or iterable of paths
        Recordings without the compensator and with it, or patterns. The command of ``after`` is the compensator's
        input.
    columns, dp, skip_rows, u_max, meter_floor, meter_lag, knee_window
        As for `identify`, of both sets.
    after_columns, after_u_max : optional
        Of the recordings with the compensator, where they differ.
    level : str, optional
        Flow that ends the dead zone: "0.6 L/min", or "1 %" of the largest flow before.
    linearity_window : str
        Per cent of full command between which linearity is taken.
    limits : str or mapping, optional
        Largest values after, such as ``{"dead_zone_opening": "5 %"}``.
    output : path, optional
        Also write assessment.json here.

    Raises
    ------
    InputError
        If a file or an option can't be read. A limit that is missed is no error: see ``holds``.
    """
    from dzdesign.assess.assessing import assess_curves
    from dzdesign.assess.assessment import Assessment
    from dzdesign.commands.assess import assess_options, compare

    said = Namespace(
        before=_patterns(before), after=_patterns(after), columns=_said(columns), after_columns=_said(after_columns),
        dp=_said(dp), skip_rows=skip_rows, u_max=u_max, after_u_max=after_u_max, meter_floor=meter_floor,
        meter_lag=meter_lag, knee_window=knee_window, level=level, linearity_window=linearity_window,
        limits=_said(limits),
    )  # fmt: skip
    options = assess_options(said)
    if output is not None:
        check_file_may_be_written(Path(output), schema_of(Assessment), "output")
    with talking(quiet=True, verbose=False):
        found = assess_curves(compare(said, options))
    if output is not None:
        write_file(Path(output), to_json_bytes(found).decode(), schema_of(Assessment), "output")
    return found


@takes_text
def report(folder: AnyPath, *, output: AnyPath | None = None) -> "Report":
    """Make the report of a folder of artefacts, or of a lot, as `dzdesign report` does.

    Parameters
    ----------
    folder : path
        Of `demo`, `verify`, `codegen` or `batch`, or with valve.json or compensator.json.
    output : path, optional
        Also write the page here.

    Returns
    -------
    Report
        ``html``, and ``holds``: None where something was not checked.

    Raises
    ------
    InputError
        If there is nothing to report, or an artefact is none. A requirement that does not hold is no error.
    """
    from dzdesign.commands.report import report_of, write_report

    with talking(quiet=True, verbose=False):
        made = report_of(Path(folder))
        if output is not None:
            write_report(Path(output), made.html)
    return made


@takes_text
def batch(
    source: AnyPath,
    *,
    output: AnyPath,
    identify: Mapping[str, object] | None = None,
    design: Mapping[str, str] | None = None,
    target: str = "f28335",
    verify: bool = False,
    plant: AnyPath | None = None,
    pattern: str | None = None,
    jobs: int | None = None,
    dask: str | None = None,
) -> dict[str, Any]:
    """Calibrate many valves, as `dzdesign batch` does; an earlier run in the folder is taken up.

    Parameters
    ----------
    source : path
        Folder with one subfolder of recordings a valve, or a CSV file with a row a valve.
    output : path
        Folder to write.
    identify, design : mapping, optional
        Options of the functions of those names, of all valves: ``{"meter_lag": "0.1 s"}``.
    target : str
        Microcontroller.
    verify : bool
        Whether each valve's firmware is verified too.
    plant : path, optional
        TOML file of the plant, for the verification.
    pattern : str, optional
        Recordings in a subfolder, such as ``*.csv``.
    jobs : int, optional
        Processes of this machine; as many as it has processors without it.
    dask : str, optional
        Instead, address of a Dask scheduler.

    Returns
    -------
    dict
        Content of batch.json: counts, reasons, quantiles, the common setting.

    Raises
    ------
    InputError
        If the list, the folder or an option is wrong. A valve that can't be calibrated is no error: see ``failed``.
    """
    from dzdesign.batch.command import IDENTIFY, calibrate_lot
    from dzdesign.command_line.cli import parse
    from dzdesign.design.request import DEFAULTS

    said = parse(["batch", "lot"])
    for name, given, known in (
        ("identify", identify or {}, (*IDENTIFY, "record")),
        ("design", design or {}, tuple(DEFAULTS)),
    ):
        for option, value in given.items():
            if option not in known:
                raise InputError(f"{name} has no option '{option}' for a lot{nearest(option, known)}")
            setattr(said, option, value)
    said.source, said.output, said.target = os.fspath(source), os.fspath(output), target
    said.verify, said.pattern, said.dask = verify, pattern, dask
    said.plant = None if plant is None else os.fspath(plant)
    said.jobs = None if jobs is None else str(jobs)
    with talking(quiet=True, verbose=False):
        document, _ = calibrate_lot(said)
    return document
