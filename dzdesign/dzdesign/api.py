"""The four stages for notebooks and scripts, `identify`, `design`, `generate`, `verify`, and what stands around them.

Each stage takes paths or the result of the stage before it, options in the words of the command line ("1 MPa", "0.1
s"), and returns the stage's frozen result, which `print` sums up and a notebook shows as a table. With ``output`` it
also writes the file or folder that the command of the same stage writes, byte for byte. What is heavy is imported when
a stage is called. `init`, `simulate`, `assess`, `report` and `batch` are the commands of those names.

>>> from dzdesign import api
>>> valve = api.identify("ramps/*.csv", meter_lag="0.1 s")         # doctest: +SKIP
>>> compensator = api.design(valve, target="f28335")               # doctest: +SKIP
>>> firmware = api.generate(compensator, output="firmware")        # doctest: +SKIP
>>> api.verify(firmware).holds                                     # doctest: +SKIP
True
"""

import os
from argparse import Namespace
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from dzdesign.api_around import assess, batch, init, report, simulate
from dzdesign.command_line.argument_types import takes_text
from dzdesign.core.artefact_files import (
    TOOL,
    check_file_may_be_written,
    check_folder_may_be_written,
    read_bytes,
    sha256_of,
    to_json,
    write_file,
    write_folder,
)
from dzdesign.core.artefact_types import schema_of
from dzdesign.core.errors import DzdesignError, InputError, RequirementError
from dzdesign.core.result_display import show_by
from dzdesign.regeneration import with_regenerated
from dzdesign.terminal.notebook import WRITERS
from dzdesign.terminal.summaries import SUMMARIES

if TYPE_CHECKING:
    from dzdesign.codegen.project import Firmware
    from dzdesign.design.compensator import Compensator
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.verify.verification import Verification

__all__ = [
    "DzdesignError", "InputError", "RequirementError",
    "assess", "batch", "design", "generate", "identify", "init", "report", "simulate", "verify",
]  # fmt: skip

#: A file or folder as the standard library takes it.
AnyPath = str | os.PathLike[str]

show_by(WRITERS, SUMMARIES)


@takes_text
def identify(
    ramps: AnyPath | Iterable[AnyPath],
    *,
    columns: str | Mapping[str, str] | None = None,
    dp: str | Mapping[str, str] | None = None,
    skip_rows: int | str | None = None,
    dp0: str | None = None,
    u_max: str = "10 V",
    meter_floor: str | None = None,
    meter_lag: str | None = None,
    meter_zero: str = "0 L/min",
    x_max: str | None = None,
    confidence: float | str = 0.99,
    knee_window: str = "12-50",
    flat_below: float | str = 0.1,
    record: Mapping[str, object] | None = None,
    output: AnyPath | None = None,
) -> "ValveModel":
    """Identify a valve from ramp tests; the options are those of `dzdesign identify`.

    Parameters
    ----------
    ramps : path or iterable of paths
        Recordings, or patterns such as ``ramps/*.csv``.
    columns : str or mapping, optional
        Quantity (time, u, dP, pA, pB, Q) to its label and, after a colon, the unit that the label lacks.
    dp : str or mapping, optional
        Pressure drop of files without a column of it: one for all, or by name or pattern of the file.
    skip_rows : int, optional
        Rows that stand above the header of a file of text; found where not given.
    dp0 : str, optional
        Reference pressure drop; the test nearest to 1 MPa without it.
    u_max : str
        Full command, in V.
    meter_floor, meter_lag, meter_zero : str, optional
        Of the flow meter: flow below which it reads zero, lag (both found where not given), bound of its zero error.
    x_max : str, optional
        Stroke, such as "1.8 mm": gives k in V/mm.
    confidence : float
        Of all lower bounds together.
    knee_window : str
        Per cent of the largest flow between which the characteristic is straight.
    flat_below : float
        Per cent of full command: a threshold that changes by less over the tests is flat.
    record : mapping, optional
        Who and what: name to text, number or date, such as ``{"serial": "4711"}``. Nothing is computed from it.
    output : path, optional
        Also write valve.json here.

    Raises
    ------
    InputError
        If a file or an option can't be read, or no threshold can be given; the reason.
    """
    from dzdesign.command_line.identify_options import identify_options, record_of
    from dzdesign.identify.identification import identify as identify_tests
    from dzdesign.identify.valve.model import SCHEMA
    from dzdesign.recordings import read_recordings, refuse_copies

    options = identify_options(
        Namespace(
            u_max=u_max, dp0=dp0, meter_floor=meter_floor, meter_lag=meter_lag, meter_zero=meter_zero, x_max=x_max,
            confidence=confidence, knee_window=knee_window, flat_below=flat_below,
        )
    )  # fmt: skip
    said = record_of(record)
    if output is not None:
        check_file_may_be_written(Path(output), SCHEMA, "output")
    patterns = [ramps] if isinstance(ramps, str | os.PathLike) else list(ramps)
    tests = read_recordings(
        [os.fspath(pattern) for pattern in patterns],
        u_max=options.u_max,
        columns=dict(columns) if isinstance(columns, Mapping) else columns,
        dp=dict(dp) if isinstance(dp, Mapping) else dp,
        skip_rows=skip_rows,
    )
    refuse_copies(tests)
    valve = identify_tests(tests, options, said)
    if output is not None:
        write_file(Path(output), to_json(valve.to_document()), SCHEMA, "output")
    return valve


@takes_text
def design(
    valve: "ValveModel | AnyPath",
    *,
    target: str = "f28335",
    law: str | None = None,
    guard: str | None = None,
    edge: str | None = None,
    below_dp0: str | None = None,
    command_signal: str | None = None,
    polarity: str | None = None,
    pressure_span: str | None = None,
    pressure_a: str | None = None,
    pressure_b: str | None = None,
    negative_dp: str | None = None,
    zero_window: str | None = None,
    ramp_up: str | None = None,
    ramp_down: str | None = None,
    dither: str | None = None,
    output_max: str | None = None,
    accept: str | None = None,
    output: AnyPath | None = None,
) -> "Compensator":
    """Design the compensator of a valve, certified; the options are those of `dzdesign design`, None is its default.

    Parameters
    ----------
    valve : ValveModel or path
        From `identify`, or valve.json.
    target : str
        Microcontroller, whose converter and timer the law's integers are for.
    law : {"paper", "target"}, optional
        Eq. (18), or the law that meets Eq. (16).
    guard : {"closing", "mean", "opening"}, optional
        Threshold to protect.
    edge : str, optional
        Share of command over which the drive runs from the closing threshold to the opening one.
    below_dp0 : {"hold", "extend"}, optional
        Below dP0 hold beta = 1, or follow the tests there.
    command_signal, pressure_a, pressure_b : str, optional
        Signals at the converter, such as "-10..10 V x 0.15 + 1.5 V" and "4..20 mA on 150 ohm = 25 MPa".
    polarity : {"normal", "inverted"}, optional
        Whether the command counts the other way.
    pressure_span : str, optional
        Span of both sensors.
    negative_dp : {"same", "swapped"}, optional
        Pressure drop of negative commands.
    zero_window : str, optional
        Of both signs: pass zero by this before the other solenoid is driven.
    ramp_up, ramp_down : str, optional
        Time between zero and full command.
    dither : str, optional
        Such as "150 Hz 1 %".
    output_max : str, optional
        Largest drive.
    accept : str, optional
        "branch-order": design though the knees stand in the wrong order.
    output : path, optional
        Also write compensator.json here.

    Raises
    ------
    InputError
        If the file or an option can't be read, or the law can't be used for this valve.
    RequirementError
        If a proof fails.
    """
    given = dict(locals())  # first of all: the options by their names, once
    from dzdesign.codegen.project import target_named
    from dzdesign.command_line.design_options import design_options
    from dzdesign.design.compensator_file import SCHEMA, compensator_document
    from dzdesign.design.designing import design as design_valve
    from dzdesign.design.request import DEFAULTS
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.identify.valve.valve_file import valve_from_document

    options = design_options(Namespace(**{name: given[name] for name in DEFAULTS}), target_named(target).inputs())
    if output is not None:
        check_file_may_be_written(Path(output), SCHEMA, "output")
    if isinstance(valve, ValveModel):
        compensator = design_valve(valve, options)
    else:
        content = read_bytes(Path(valve), "valve file")
        compensator = design_valve(valve_from_document(content, os.fspath(valve)), options, content)
    if output is not None:
        write_file(Path(output), to_json(compensator_document(compensator)), SCHEMA, "output")
    return compensator


@takes_text
def generate(
    compensator: "Compensator | AnyPath", *, target: str | None = None, output: AnyPath | None = None
) -> "Firmware":
    """Generate the C project of a compensator, whose numbers are derived again first.

    Parameters
    ----------
    compensator : Compensator or path
        From `design`, or compensator.json.
    target : str, optional
        Microcontroller, by default the one that `design` was told; of another the converter and timer must be the same.
    output : path, optional
        Also write the firmware folder here.

    Raises
    ------
    InputError
        If the file can't be read, a number in it does not follow, or the target counts otherwise.
    """
    from dzdesign.codegen.project import generate as generate_project
    from dzdesign.codegen.project import write_firmware
    from dzdesign.design.compensator import Compensator
    from dzdesign.design.compensator_file import compensator_from_document
    from dzdesign.design.firmware_manifest import FirmwareManifest
    from dzdesign.design.redesign_check import prove_derived, refuse_unsaid

    if output is not None:
        check_folder_may_be_written(Path(output), schema_of(FirmwareManifest))
    content = None
    if not isinstance(compensator, Compensator):
        content = read_bytes(Path(compensator), "compensator file")
        source, compensator = os.fspath(compensator), compensator_from_document(content, os.fspath(compensator))
        refuse_unsaid(compensator, source)
    prove_derived(compensator)
    firmware = generate_project(compensator, target, content)
    return firmware if output is None else write_firmware(firmware, Path(output))


@takes_text
def verify(
    firmware: "Firmware | AnyPath",
    *,
    plant: AnyPath | None = None,
    tolerances: AnyPath | None = None,
    include: AnyPath | Iterable[AnyPath] = (),
    output: AnyPath | None = None,
) -> "Verification":
    """Verify a firmware: every input against the exact law, then the closed loop; needs a C compiler.

    Parameters
    ----------
    firmware : Firmware or path
        From `generate`, or its folder.
    plant : path, optional
        TOML file of the plant; without it one is made from the identified thresholds.
    tolerances : path, optional
        TOML file of a series of plants about `plant`.
    include : path or iterable of paths, optional
        Folders of headers that board files of yours include.
    output : path, optional
        Also write the evidence folder here.

    Raises
    ------
    InputError
        If a file can't be read, or there is no C compiler. A requirement that does not hold is no error: see ``holds``.
    """
    from dzdesign.codegen.project import Firmware
    from dzdesign.report.valve_report import with_report
    from dzdesign.verify.closed_loop.plant import read_plant
    from dzdesign.verify.closed_loop.tolerances import read_tolerances
    from dzdesign.verify.verification import SCHEMA, evidence_files
    from dzdesign.verify.verification import verify as verify_folder

    if output is not None:
        check_folder_may_be_written(Path(output), SCHEMA)
    with TemporaryDirectory() as temporary:
        folder = Path(temporary) / "firmware" if isinstance(firmware, Firmware) else Path(firmware)
        if isinstance(firmware, Firmware):
            write_folder(folder, firmware.files, firmware.manifest)
        verification = verify_folder(
            folder,
            read_plant(Path(plant)) if plant is not None else None,
            Path(plant).name if plant is not None else "",
            sha256_of(read_bytes(Path(plant), "plant file")) if plant is not None else None,
            tolerances=read_tolerances(Path(tolerances)) if tolerances is not None else None,
            include=[Path(place) for place in ([include] if isinstance(include, str | os.PathLike) else include)],
        )
        verification = with_regenerated(verification, folder)
        if output is not None:
            manifest = {"schema": SCHEMA, "tool": TOOL, "made_from": verification.document["made_from"]}
            files = with_report(evidence_files(verification), folder, Path(output))
            write_folder(Path(output), files, manifest)
    return verification
