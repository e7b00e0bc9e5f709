"""`init`: a look at recordings (columns, pressures, what is open, what `identify` finds) -> a proposed options file."""

import json
import math
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.artefact_files import check_file_may_be_written, write_file
from dzdesign.core.display import strict_templates
from dzdesign.core.errors import InputError, one_line
from dzdesign.core.options import AnyPath, Option, Paths, Table, paths_of, read_options
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.stages.recordings import (
    ColumnArguments,
    distinct_names,
    expand,
    read_recordings,
    recordings_in,
    refuse_copies,
)
from dzdesign.terminal.progress import say, stage_progress, with_bar

if TYPE_CHECKING:
    from dzdesign.identify.reading.columns import ProposedColumns
    from dzdesign.identify.reading.ramp_test import RampTest
    from dzdesign.identify.valve.model import ValveModel, Warning_


#: Full commands that amplifiers have, V: the smallest that the recordings do not exceed by 2 % is proposed.
USUAL_U_MAX = (1.0, 2.5, 3.3, 5.0, 10.0, 12.0, 15.0, 20.0, 24.0, 48.0)
#: Ramps that end above this share of full command are taken to end there.
ENDS_AT_FULL = 0.97
#: Files that a line names.
NAMED_FILES = 3
#: Said where a pressure was taken for the drop because of its unit alone.
CHECK_DP = "check that it is the drop over the valve, and not the pressure of one port or of the supply"


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """The proposed options file, and what was found in the recordings."""

    text: str
    seen: tuple[str, ...]
    #: The first warning of each code, in full.
    warnings: tuple[str, ...]
    #: What is open: without it `identify` can't run.
    opens: tuple[str, ...]
    #: The files, and the labels of each.
    recordings: tuple[Path, ...]
    labels: tuple[tuple[str, ...], ...]
    #: The tables of the file; empty where the recordings need none.
    columns: dict[str, str]
    dp: dict[str, str]
    #: Full command to declare, and the largest one seen (None: not looked at).
    u_max_V: float
    u_seen_V: float | None
    #: What `identify` finds; None while something is open.
    valve: "ValveModel | None"


@dataclass(frozen=True, slots=True)
class _Remarks:
    """What is open, and what is worth a note, as it is found."""

    opens: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def propose(arguments: "InitArguments") -> Proposal:
    """Look at recordings, and return the file of options that this gives."""
    from dzdesign.identify.reading.column_labels import PER_CENT, parse_columns
    from dzdesign.identify.reading.columns import propose_columns

    patterns, remarks, dp, columns = paths_of(arguments.ramps), _Remarks(), arguments.dp, arguments.columns
    read = read_options(arguments, ["skip_rows", "missing"])
    paths = expand(patterns) if patterns else _found_recordings()
    given = parse_columns(columns) if columns else {}
    looks = [
        propose_columns(path, given, read["skip_rows"], time_is_declared=bool(arguments.sample_rate))
        for path in with_bar(paths, "looking at columns")
    ]
    chosen, unclear = _columns_of_all(looks, given, bool(dp), remarks)
    guessed_dp = chosen.get("dP", "") if "dP" not in given else ""
    table, readings = _pressure_table(distinct_names(paths), looks, dp, bool(guessed_dp or "dP" in unclear), remarks)
    u_max, u_seen, valve = 10.0, None, None
    in_per_cent = "u" not in unclear and any(
        (look.known | look.proposed)["u"].unit.lower().endswith(PER_CENT) for look in looks
    )
    if not remarks.opens:
        tests = read_recordings(paths, replace(arguments, columns=chosen, dp=table or None), u_max)
        if in_per_cent:
            remarks.notes.append('full command: in per cent, so not recorded; u-max = "10 V" is a guess, correct it')
        else:
            u_max, u_seen = _full_command(tests)
        valve = _identified(tests, u_max, guessed_dp, remarks)
    seen, opens = tuple(_summary(looks, u_seen, valve, remarks.notes)), tuple(dict.fromkeys(remarks.opens))
    warnings = tuple(_warnings_in_full(valve.warnings if valve else ()))
    text = _rendered(
        seen=(*seen, *warnings), opens=opens, u_max=u_max, u_seen=u_seen, in_per_cent=in_per_cent,
        skip_rows=read["skip_rows"], missing=read["missing"] or (), ends_at_full=ENDS_AT_FULL,
        sample_rate=arguments.sample_rate,
        meter=valve and valve.meter, negative_drop=_negative_drop(valve),
        ramps=[os.fspath(path) for path in patterns or paths], first=paths[0].name, look=looks[0], columns=chosen,
        unclear=unclear, guessed_dp=guessed_dp, dp=table, readings=readings,
    )  # fmt: skip
    return Proposal(
        text=text, seen=seen, warnings=warnings, opens=opens, recordings=tuple(paths),
        labels=tuple(look.labels for look in looks), columns=chosen, dp=table, u_max_V=u_max, u_seen_V=u_seen,
        valve=valve,
    )  # fmt: skip


def _negative_drop(valve: "ValveModel | None") -> dict[str, str]:
    """Return what the recordings show of the pressure drop at negative commands; nothing of one side."""
    from dzdesign.design.pressure_inputs import shown_pair

    if valve is None or len(valve.sides) < 2:
        return {}
    drop = valve.sides["negative"].recorded_drop
    return {"shown": shown_pair(valve), "recorded": drop.in_words() if drop else "not recorded"}


def _found_recordings() -> list[Path]:
    """Return the recordings in ./ramps, or in this folder."""
    for folder in (Path("ramps"), Path()):
        if found := recordings_in(folder):
            say(f"recordings found in {folder if folder.name else 'this folder'}: {len(found)}")
            return found
    raise InputError("there are no recordings in ./ramps or in this folder; name them: dzdesign init RAMP...")


def _columns_of_all(
    looks: "Sequence[ProposedColumns]", given: Mapping[str, str], dp_is_declared: bool, remarks: _Remarks
) -> tuple[dict[str, str], dict[str, str]]:
    """Return the columns to declare, and of those that are unclear the reason."""
    columns, unclear = dict(given), dict[str, str]()
    for look in looks:
        for quantity, column in look.proposed.items():
            if quantity == "dP" and dp_is_declared:
                remarks.notes.append(f"not used: '{column.label}', as --dp says the pressure drop")
            elif (first := columns.setdefault(quantity, column.label)) != column.label:
                remarks.opens.append(f"column of {quantity}: '{first}' in one file, '{column.label}' in another")
        for quantity, why in look.unclear.items():
            if quantity != "dP" or not dp_is_declared:
                unclear.setdefault(quantity, why)
        if look.bare_pressures and not dp_is_declared:
            labels = look.bare_pressures
            ports = ("pA", "pB") if len(labels) > 1 else ("dP",)
            declared = ", ".join(f"{port}={label}:bar" for port, label in zip(ports, labels, strict=False))
            look_like = "look like pressures" if len(labels) > 1 else "looks like a pressure"
            remarks.notes.append(
                f"not used: {' and '.join(map(repr, labels))} {look_like}, without a unit; declare by --columns "
                f'"{declared}"'
            )
    remarks.opens.extend(f"column of {quantity}: {why}" for quantity, why in unclear.items())
    if "dP" in columns and "dP" not in given:
        remarks.notes.append(f"pressure drop: '{columns['dP']}', the only column in a unit of pressure; {CHECK_DP}")
    return columns, unclear


def _pressure_table(
    names: Sequence[str],
    looks: "Sequence[ProposedColumns]",
    declared: Table,
    has_column: bool,
    remarks: _Remarks,
) -> tuple[dict[str, str], dict[str, tuple[str, ...]]]:
    """Return the pressure drops to declare, as declared or by names; and as what other files' names can be read."""
    from dzdesign.identify.reading.series import pressures_in_name

    if declared:
        return dict(declared) if isinstance(declared, Mapping) else dict.fromkeys(names, declared), {}
    recorded = [has_column or look.has_dp for look in looks]
    readings = {name: pressures_in_name(name) for name, has in zip(names, recorded, strict=True) if not has}
    table = {name: texts[0] for name, texts in readings.items() if len(texts) == 1}
    readings = {name: texts for name, texts in readings.items() if len(texts) != 1}
    if readings and len(names) == 1 and not any(readings.values()):
        remarks.notes.append(
            'no pressure drop, by a column or a file\'s name; declare it, if you know it, by --dp "1 MPa"'
        )
        return {}, {}
    for name, texts in readings.items():
        why = (
            f"its name may say {' or '.join(texts)}; declare the right one"
            if texts
            else "no column, and none in its name; declare it"
        )
        remarks.opens.append(f"pressure drop of '{name}': {why} by --dp or [dp]")
    if table and not readings:
        remarks.notes.append(f"pressure drop by the files' names: {', '.join(dict.fromkeys(table.values()))}")
    return table, readings


def _full_command(tests: "Sequence[RampTest]") -> tuple[float, float]:
    """Return the full command to declare, and the largest one seen, both in V."""
    seen = max(float(abs(test.smooth).max()) for test in tests)
    return next((usual for usual in USUAL_U_MAX if seen <= 1.02 * usual), math.ceil(seen)), seen


def _identified(tests: "list[RampTest]", u_max: float, guessed_dp: str, remarks: _Remarks) -> "ValveModel | None":
    """Return what `identify` finds, None if it can't; with a remark where a file's name says another pressure drop."""
    from dzdesign.identify.identification import identify
    from dzdesign.identify.options import IdentifyOptions

    wrong = list(_contradicted(tests))
    if guessed_dp and wrong:
        remarks.opens.extend(
            f"column of dP: '{source}' says {stated} in its name, and {dp_MPa:.3g} MPa in '{guessed_dp}', the only "
            "column in a unit of pressure; declare the one that is the drop, by --columns or --dp"
            for source, stated, dp_MPa in wrong
        )
        return None
    with stage_progress(f"looking at {len(tests)} recording{'s' if len(tests) > 1 else ''}"):
        try:
            refuse_copies(tests)
            valve = identify(tests, IdentifyOptions(u_max=u_max))
        except InputError as error:
            remarks.opens.append(f"identify would refuse these recordings: {error}")
            return None
    if wrong and not any(warning.code == "pressure-stuck" for warning in valve.warnings):
        found = [f"'{source}' holds {dp_MPa:.3g} MPa" for source, _, dp_MPa in wrong[:NAMED_FILES]]
        more = f" and {len(wrong) - NAMED_FILES} more" if len(wrong) > NAMED_FILES else ""
        remarks.notes.append(
            f"CHECK: a name says another pressure drop than the column: {', '.join(found)}{more}; the sensor is stuck, "
            "the unit is wrong, or the name is of another pressure"
        )
    return valve


def _contradicted(tests: "Sequence[RampTest]") -> Iterator[tuple[str, str, float]]:
    """Yield recordings whose names say another pressure than was recorded, what they say, and that in MPa."""
    from dzdesign.identify.reading.series import contradicts

    for test in tests:
        if test.dp is not None and not test.dp_is_declared:
            dp = median(test.dp.tolist())
            if stated := contradicts(test.source, dp):
                yield test.source, stated, dp / 1e6


def _summary(
    looks: "Sequence[ProposedColumns]", u_seen: float | None, valve: "ValveModel | None", notes: Sequence[str]
) -> Iterator[str]:
    """Yield what was seen, for a person."""
    units = valve.recorded_units if valve else AS_COMPUTED
    yield f"recordings: {len(looks)}, columns {', '.join(looks[0].labels[:12])}"
    if u_seen is not None:
        yield f"largest command: {units.text(u_seen, '.2f V')}"
    yield from dict.fromkeys(notes)
    for name, side in valve.sides.items() if valve else ():
        ramps = sum(len(test.ramps) for test in side.tests)
        known = [test.dp_MPa for test in side.tests if test.dp_MPa is not None]
        pressures = ", ".join(units.number(dp_MPa, ".3g MPa") for dp_MPa in known)
        where = f"{pressures} {units.label('MPa')}" if pressures else "an unknown pressure drop"
        flow = units.text(max(test.q_max_L_min for test in side.tests), ".3g L/min")
        yield f"{name} commands: {ramps} ramp{'s' if ramps > 1 else ''} at {where}, up to {flow}"


def _warnings_in_full(warnings: "Sequence[Warning_]") -> Iterator[str]:
    """Yield the first warning of each code, with how often it was raised."""
    counts = Counter(warning.code for warning in warnings)
    for code, count in counts.items():
        warning = next(each for each in warnings if each.code == code)
        times = f" ({count})" if count > 1 else ""
        yield f"warning [{warning.code}]{times} {f'{warning.source}: ' if warning.source else ''}{warning.text}"


def _rendered(**content: object) -> str:
    environment = strict_templates(
        "dzdesign.stages",
        lstrip_blocks=True,
        finalize=lambda value: one_line(str(value)),  # labels come from the recordings
    )
    # A string of TOML: as in JSON, and without DEL.
    environment.filters["quoted"] = lambda text: json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
    return str(environment.get_template("dzdesign.toml.jinja").render(check_dp=CHECK_DP, **content))


@dataclass(frozen=True)
class InitArguments(ColumnArguments):
    """Arguments of `init`."""

    ramps: Annotated[Paths, Option("RAMP")] = ()
    """Recordings, as for identify (default: ramps/*, or *.csv)."""
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option("FILE", command_default="dzdesign.toml", short="-o")] = None
    """File to write. An existing file is never overwritten."""


def init(arguments: InitArguments) -> Proposal:
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
    output = arguments.output
    if output is not None:
        if os.path.lexists(output):
            raise InputError(
                f"'{output}' exists, and init never writes over a file; give another name with -o, or move it away"
            )
        check_file_may_be_written(Path(output))
    proposal = propose(arguments)
    if output is not None:
        write_file(Path(output), proposal.text)
    return proposal
