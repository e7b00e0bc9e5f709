"""`dzdesign batch`: calibrate many valves, in one table with the reasons of those that could not be."""

import contextlib
import errno
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path

from dzdesign.batch.arguments import BatchArguments
from dzdesign.batch.calibration import Outcome, Task
from dzdesign.batch.outputs import WantedOutput, wanted_outputs
from dzdesign.batch.runners import run_local, run_on_cluster
from dzdesign.batch.summary import (
    SETTING_NAME,
    anomalies_of,
    firmware_left,
    foreign_block,
    lot_outputs,
    lot_setting_of,
    needing_another,
    setting_summary,
    summary_of,
    units_of_lot,
    write_lot_firmware,
)
from dzdesign.batch.valve_folders import Results, ValveFolder, table_of_valves
from dzdesign.batch.valves import Valve, valves_of
from dzdesign.core.artefact_files import MANIFEST_NAME, write_file, write_files
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import read_bytes, read_recording
from dzdesign.core.errors import InputError
from dzdesign.core.options import arguments_of, paths_of, read_options
from dzdesign.design.design_choices import DEFAULTS, DesignChoices
from dzdesign.design.firmware_manifest import form_named
from dzdesign.report.lot.page import report_of_lot
from dzdesign.report.lot.summary import LotSummary
from dzdesign.report.lot.table import table_files
from dzdesign.report.valve_report import REPORT_NAME
from dzdesign.stages.design import design_options
from dzdesign.stages.identify import IdentifyChoices, identify_options, record_of
from dzdesign.terminal.progress import is_watched, say, with_bar

#: Of a disk, and of what a user may take of it; Windows knows no such limit.
FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))
#: Processes for each processor: more only take memory.
MOST_A_PROCESSOR = 4
#: Options of `identify` that a valve may have of its own, beside those of `design` and the target.
IDENTIFY = tuple(argument.name for argument in arguments_of(IdentifyChoices) if argument.name != "record")


def calibrate_lot(args: BatchArguments) -> LotSummary:
    """Calibrate the valves of a folder or a list, and make their table and report; return batch.json."""
    source, output = Path(args.source), Path(args.output)
    if args.jobs is not None and args.dask:
        raise InputError("--jobs is for this machine; with --dask its workers decide, so leave it out")
    jobs = read_options(args, ["jobs"])["jobs"] or os.cpu_count() or 1
    _check_options(args)
    form_named(args.calibration)
    if source.is_dir() and output.resolve().is_relative_to(source.resolve()):
        raise InputError(f"'{output}' lies in '{source}', whose subfolders are the valves; choose another with -o")
    valves = valves_of(source, args.pattern, (*IDENTIFY, *DEFAULTS, "target"))
    wanted, plant = wanted_outputs(args), _plant(args)
    results = Results(output)
    with _taken(output):
        results.begin([valve.name for valve in valves])
        digests = {valve.name: _task(valve, args, plant, wanted).digest for valve in with_bar(valves, "reading")}
        waiting = [valve for valve in valves if not results.is_done(valve.name, digests[valve.name])]
        say(f"{len(valves)} valves, {len(valves) - len(waiting)} of them done before")
        tasks = (_task(valve, args, plant, wanted) for valve in waiting)
        outcomes = run_on_cluster(tasks, args.dask) if args.dask else run_local(tasks, useful_jobs(jobs, len(waiting)))
        unwritten = _write_all(results, outcomes, len(waiting))
        summary = _finished(args, valves, results, unwritten, wanted)
        write_file(output / REPORT_NAME, report_of_lot(output).html)
    return summary


@contextlib.contextmanager
def _taken(output: Path) -> Iterator[None]:
    """Keep a second batch out of the folder, and say of a full disk what to do.

    A second batch would take up the first one's half, with other options perhaps. Another place for the output, which
    every command proposes where one is full, would leave behind what is done.
    """
    descriptor = _locked(output)
    try:
        yield
    except InputError as error:
        if not _is_full(error):
            raise
        raise InputError(
            f"no space is left to write into '{output}'; make room and give the same command again: it takes up the "
            "valves that are done"
        ) from error
    finally:
        if descriptor is not None:
            os.close(descriptor)


def _locked(folder: Path) -> int | None:
    """Lock a folder until the descriptor is closed, however the process ends.

    Windows, some file systems of networks, and folders that can't be listed have no such lock: then it is None.
    """
    try:
        import fcntl

        descriptor = os.open(folder, os.O_RDONLY)
    except (ImportError, PermissionError):
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(descriptor)
        raise InputError(
            f"another batch is writing into '{folder}'; wait until it has ended, or choose another folder with -o"
        ) from error
    except OSError:
        pass
    return descriptor


def _is_full(error: InputError) -> bool:
    return isinstance(error.__cause__, OSError) and error.__cause__.errno in FULL


def _finished(
    args: BatchArguments,
    valves: Sequence[Valve],
    results: Results,
    unwritten: Mapping[str, str],
    wanted: Sequence[WantedOutput],
) -> LotSummary:
    """Write table, lot setting and batch.json, from the valves' folders alone; return the last."""
    output = results.folder
    found = [results.read(valve.name, unwritten) for valve in with_bar(valves, "making the table")]
    in_blocks = form_named(args.calibration) == "block"
    if in_blocks:
        found = _with_one_firmware(results, found)
    designed = {each.name: each.compensator for each in found if each.compensator is not None}
    setting, why_not = lot_setting_of(designed)
    frame = table_of_valves(
        found, setting.compensator if setting else None, {valve.name: _record(valve, args) for valve in valves}
    )
    table = table_files(frame)
    firmware = write_lot_firmware(output, designed, setting.compensator if setting else None) if in_blocks else None
    summary = summary_of(
        frame,
        files=table,
        verified=args.verify,
        lot_setting=setting_summary(setting) if setting else None,
        why_no_lot_setting=why_not,
        made_from={
            valve.name: read_bytes(results.of(valve.name) / MANIFEST_NAME, "manifest")
            for valve in valves
            if valve.name not in unwritten
        },
        anomalies=(
            *anomalies_of(found, output, valves),
            *firmware_left(output, firmware),
            *foreign_block(firmware, len(designed)),
        ),
        certified_of=tuple(sorted({each.certified_of for each in designed.values()})),
        firmware=firmware,
        outputs=lot_outputs(wanted, found),
        recorded_units=units_of_lot(designed),
    )
    if setting is None:
        (output / SETTING_NAME).unlink(missing_ok=True)  # of an earlier run with other valves
    write_files(output, {**table, **({SETTING_NAME: to_json_bytes(setting.compensator)} if setting else {})}, "-o")
    results.write_summary(summary)
    return summary


def _with_one_firmware(results: Results, found: list[ValveFolder]) -> list[ValveFolder]:
    """Turn the valves whose block needs another firmware into failed ones, which the next run tries again."""
    reasons = needing_another(found)
    for name, reason in reasons.items():
        results.refuse(name, reason)
    return [results.read(each.name, {}) if each.name in reasons else each for each in found]


def useful_jobs(jobs: int, waiting: int) -> int:
    """Return as many of the processes asked for as the waiting valves keep busy: a thousand would fill a machine."""
    most = MOST_A_PROCESSOR * (os.cpu_count() or 1)
    if jobs > most and waiting > most:
        say(f"--jobs {jobs}: {most} processes, as this machine has {os.cpu_count() or 1} processors")
    return min(jobs, max(min(most, waiting), 2))  # two, so that a valve that kills its process does not end this one


def _check_options(args: BatchArguments) -> None:
    """Refuse what no valve could be calibrated with, before any is; a valve's own options are its own affair."""
    from dzdesign.identify.reading.column_labels import parse_columns

    identify_options(args)
    record_of(args.record)
    design_options(args, args.target)
    read_options(args, ["skip_rows", "sample_rate", "missing"])
    if args.columns:
        parse_columns(args.columns)


def _plant(args: BatchArguments) -> tuple[str, bytes] | None:
    """Return name and content of the plant's file, which must be one."""
    if args.plant is None or not args.verify:  # of an output it is another setting
        return None
    from dzdesign.verify.closed_loop.plant import read_plant

    read_plant(Path(args.plant))
    return Path(args.plant).name, read_bytes(Path(args.plant), "plant")


def _task(
    valve: Valve, args: BatchArguments, plant: tuple[str, bytes] | None, wanted: tuple[WantedOutput, ...]
) -> Task:
    """Read a valve's recordings; where they can't be read the task says why."""
    options = {**vars(args), **valve.overrides, "record": _record(valve, args)}
    if options["order"] is not None:
        options["order"] = [os.fspath(item) for item in paths_of(options["order"])]
    recordings, refused = [], ""
    try:
        recordings = [(path.name, _of_recording(path)) for path in valve.recordings()]
    except InputError as error:
        refused = str(error)
    return Task(
        name=valve.name,
        recordings=tuple(recordings),
        identify=IdentifyChoices(**{each.name: options[each.name] for each in fields(IdentifyChoices)}),
        design=DesignChoices(**{each.name: options[each.name] for each in fields(DesignChoices)}),
        target=options["target"],
        calibration=form_named(args.calibration),
        verify=args.verify,
        plant=plant,
        outputs=wanted,
        refused=refused,
    )


def _of_recording(path: Path) -> bytes:
    """Read a recording, which a batch does twice: what gives its content once is refused."""
    if path.is_fifo():
        raise InputError(f"ramp file '{path}' is a pipe, which a batch can't read twice; save it to a file")
    return read_recording(path, "ramp file")


def _record(valve: Valve, args: BatchArguments) -> dict[str, str]:
    return {**record_of(args.record), **valve.record}


def _write_all(results: Results, outcomes: Iterator[Outcome], count: int) -> dict[str, str]:
    """Write each valve's folder as it comes; return the reasons of those that could not be written."""
    unwritten: dict[str, str] = {}
    for number, outcome in zip(with_bar(range(1, count + 1), "valves"), outcomes, strict=True):
        if not is_watched():  # in a pipe there is no bar
            say(f"valve {number} of {count}: {outcome.name}: {outcome.manifest.reason or 'calibrated'}")
        try:
            results.write(outcome)
        except InputError as error:
            if _is_full(error):  # no other would find room either, and each would count as failed
                raise
            unwritten[outcome.name] = str(error)
    return unwritten
