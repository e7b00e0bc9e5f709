"""`codegen`, in Python `generate`: Compensator + target -> Firmware."""

import os
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.artefact_files import check_folder_may_be_written, parse_document, read_bytes
from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath, Option, Text, flag_of
from dzdesign.design.design_choices import DEFAULTS, DesignChoices
from dzdesign.stages.design import TARGETS, design_options

#: Forms of the core, the default first.
FORMS = "dzdesign.design.firmware_manifest:FORMS"

if TYPE_CHECKING:
    from dzdesign.codegen.project import Firmware
    from dzdesign.design.compensator import Compensator


@dataclass(frozen=True)
class GenerateArguments(DesignChoices):
    """Arguments of `codegen`, in Python `generate`."""

    compensator: Annotated["Compensator | AnyPath", Option("COMPENSATOR.json")]
    """compensator.json, or a valve.json, which is designed first with the options of `design`."""
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option("DIR", command_default="firmware", short="-o")] = None
    """Folder to write, with the C project."""
    target: Annotated[Text, Option("NAME", choices=TARGETS)] = None
    """Microcontroller (default: that of the design; of a VALVE.json f28335)."""
    calibration: Annotated[Text, Option("FORM", choices=FORMS)] = None
    """Where the numbers of the valve stand: fixed in the core (default), or in a block of data that it is handed."""
    replace: Annotated[bool, Option()] = False
    """Write over the firmware of another design in the folder."""


def generate(arguments: GenerateArguments) -> "Firmware":
    """Generate the C project of a compensator, whose numbers are derived again first.

    Raises
    ------
    InputError
        If the file can't be read, a number in it does not follow, the target counts otherwise, or the folder holds the
        firmware of another design.
    """
    from dzdesign.codegen.project import DEFAULT_TARGET, target_named, write_firmware
    from dzdesign.codegen.project import generate as generate_project
    from dzdesign.core.artefact_reading import read_artefact
    from dzdesign.core.artefact_types import schema_of
    from dzdesign.design.compensator import SCHEMA as COMPENSATOR_SCHEMA
    from dzdesign.design.compensator import Compensator
    from dzdesign.design.designing import design as design_valve
    from dzdesign.design.firmware_manifest import FirmwareManifest, form_named
    from dzdesign.design.redesign_check import refuse_without_options
    from dzdesign.identify.valve.model import SCHEMA as VALVE_SCHEMA
    from dzdesign.identify.valve.model import ValveModel

    target, form = arguments.target or DEFAULT_TARGET, form_named(arguments.calibration)
    target_named(target)
    if arguments.output is not None:
        check_folder_may_be_written(Path(arguments.output), schema_of(FirmwareManifest))
    given = arguments.compensator
    if isinstance(given, Compensator):
        firmware = generate_project(_proven(given, "the compensator", arguments), arguments.target, calibration=form)
    else:
        source, content = os.fspath(given), read_bytes(Path(given), "compensator file")
        document = parse_document(content, source, (COMPENSATOR_SCHEMA, VALVE_SCHEMA))
        if document["schema"] == VALVE_SCHEMA:
            valve = read_artefact(content, ValveModel, source)
            compensator = design_valve(valve, design_options(arguments, target), content)
            firmware = generate_project(compensator, target, calibration=form)
        else:
            compensator = read_artefact(content, Compensator, source)
            refuse_without_options(compensator, source)
            proven = _proven(compensator, f"'{source}'", arguments)
            firmware = generate_project(proven, arguments.target, content, form)
    if arguments.output is None:
        return firmware
    return write_firmware(firmware, Path(arguments.output), over_another=arguments.replace)


def _proven(compensator: "Compensator", source: str, choices: DesignChoices) -> "Compensator":
    """Return a compensator whose numbers follow from its valve and options; refuse other options for it."""
    from dzdesign.design.redesign_check import prove_derived

    for option in (flag_of(name) for name in DEFAULTS if getattr(choices, name) is not None):
        raise InputError(f"{option} is an option of the design, and {source} is designed; use `dzdesign design`")
    try:
        prove_derived(compensator)
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
    return compensator
