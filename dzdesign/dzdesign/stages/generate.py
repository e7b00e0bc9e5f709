"""`codegen`, in Python `generate`: Compensator + target -> Firmware."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.artefact_files import check_folder_may_be_written
from dzdesign.core.option_readers import percent, quantity, whole_number
from dzdesign.core.options import OUTPUTS, AnyPath, Option, Text, read_options
from dzdesign.stages.design import given_compensator, refuse_underived

if TYPE_CHECKING:
    from dzdesign.codegen.other_targets import Output
    from dzdesign.codegen.project import Firmware
    from dzdesign.design.compensator import Compensator


@dataclass(frozen=True, kw_only=True)
class OutputChoices:
    """What can be chosen of an output other than a C firmware: the same in `codegen` and in `batch`."""

    dialect: Annotated[Text, Option("NAME", OUTPUTS)] = None
    """Dialect of the PLC's tool, for iec61131: codesys or twincat (default: codesys)."""
    interface: Annotated[Text, Option("NAME", OUTPUTS)] = None
    """Inputs of the function block, for iec61131 (default: plc). plc: command in 0.01 % and pressures in 0.1 bar.
    codes: the converter codes of the design."""
    cycle_time: Annotated[Text, Option("T", OUTPUTS, example="10 ms", read=quantity("time"))] = None
    """Time between two calls of the function block, for iec61131. With it the block has the design's fault debounce, in
    whole cycles, and interlock (default: neither)."""
    plant: Annotated[AnyPath | None, Option("PLANT.toml", OUTPUTS)] = None
    """File with a plant, for an FMU of the plant in addition, such as demo/example/plant.toml. It is for the
    output fmu only."""
    device: Annotated[Text, Option("DEVICE", OUTPUTS)] = None
    """Device, for amplifier: west, west-pam190, west-pos123, cia408, rmc, rmc75, beckhoff or csv."""
    table_dp: Annotated[Text, Option("P", OUTPUTS, example="1 MPa", read=quantity("pressure"))] = None
    """Pressure drop of the characteristic, for amplifier with beckhoff or csv (default: dP0 of the valve)."""
    threshold: Annotated[Text, Option("SHARE", OUTPUTS, example="0.5 %", read=percent("0.5 %"))] = None
    """Command up to which the valve stays at rest, for amplifier (default: the zero band of the design's command)."""


@dataclass(frozen=True)
class GenerateArguments(OutputChoices):
    """Arguments of `codegen`, in Python `generate`."""

    compensator: Annotated["Compensator | AnyPath", Option("COMPENSATOR.json")]
    """The compensator.json made by `dzdesign design`."""
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option("DIR", short="-o")] = None
    """Folder to write (default of the command: firmware, or plc, fmu, matlab or amplifier for such an output)."""
    target: Annotated[Text, Option("NAME")] = None
    """Microcontroller, or another output: iec61131, fmu, matlab, amplifier (default: the design's microcontroller)."""
    calibration: Annotated[Text, Option("FORM")] = None
    """Form of the valve's numbers (default: fixed). fixed: constants in the core. block: a block of data that the core
    receives."""
    vectors: Annotated[int | str, Option("N", read=whole_number("a whole number up to 99999", digits=5))] = "0"
    """Number of test vectors in vectors.csv. Each has codes and the exact law's answer, at every node, corner and fault
    first, then at random codes."""
    replace: Annotated[bool, Option()] = False
    """Overwrite the firmware or output of another design in the folder."""


def generate(arguments: GenerateArguments) -> "Firmware | Output":
    """Generate the C project of a compensator, or another output, after its numbers were derived again.

    Returns
    -------
    Firmware or Output
        The files by path, with the manifest that states their origin.

    Raises
    ------
    InputError
        If the file can't be read, a number in it can't be derived, or the target's converter or timer differs from the
        design. Also if there are too few vectors, an option belongs to another target, or the folder holds the output
        of another design.

    Examples
    --------
    >>> from dzdesign import api
    >>> firmware = api.generate("compensator.json")                    # doctest: +SKIP
    >>> "core/dz_comp.c" in firmware.files                             # doctest: +SKIP
    True
    """
    from dzdesign.codegen.other_targets import (
        OF_FIRMWARE,
        OTHER_TARGETS,
        check_target_name,
        generate_output,
        settings_of,
    )
    from dzdesign.codegen.project import DEFAULT_TARGET
    from dzdesign.codegen.project import generate as generate_project
    from dzdesign.codegen.writing import write_generated
    from dzdesign.core.artefact_types import schema_of
    from dzdesign.design.firmware_manifest import FirmwareManifest, OutputManifest, form_named
    from dzdesign.design.redesign import refuse_without_options

    target = arguments.target or DEFAULT_TARGET
    check_target_name(target)
    is_other, place = target in OTHER_TARGETS, None if arguments.output is None else Path(arguments.output)
    if place is not None:
        check_folder_may_be_written(place, schema_of(OutputManifest if is_other else FirmwareManifest))
    given, form = chosen_of_outputs(arguments), form_named(arguments.calibration)
    if is_other:
        of_firmware = {name: getattr(arguments, name) for name in OF_FIRMWARE}
        given |= {name: str(value) for name, value in of_firmware.items() if value not in (None, 0, "0")}
    settings = settings_of(target, given)
    vectors: int = read_options(arguments, ["vectors"])["vectors"]
    compensator, _, source = given_compensator(arguments.compensator)
    of_file = compensator is not arguments.compensator
    if target == "amplifier":  # whose parameters go to a device as they are printed
        refuse_underived(compensator, source, of_file=of_file)
    elif of_file:
        refuse_without_options(compensator, source.strip("'"))
    if is_other:
        output = generate_output(compensator, target, settings)
        return output if place is None else write_generated(output, place, over_another=arguments.replace)
    firmware = generate_project(compensator, arguments.target, form, vectors)
    return firmware if place is None else write_generated(firmware, place, over_another=arguments.replace)


def chosen_of_outputs(arguments: OutputChoices) -> "dict[str, str | None]":
    """Return the options that are of one output other than a C firmware alone, as they were given; a plant is read."""
    from dzdesign.codegen.amplifier.setting import given_dp_MPa, given_threshold
    from dzdesign.codegen.integers.interface import cycle_time_s
    from dzdesign.codegen.other_targets import OTHER_TARGETS

    given_dp_MPa(arguments.table_dp), given_threshold(arguments.threshold)  # a wrong one is refused before any file
    cycle_time_s(arguments.cycle_time or "")
    given = {name: getattr(arguments, name) for other in OTHER_TARGETS.values() for name in other.options}
    return given | {"plant": None if arguments.plant is None else _plant_text(Path(arguments.plant))}


def _plant_text(path: Path) -> str:
    """Return a plant file's parameters as the setting that stands in a manifest: JSON, those by default included."""
    import json
    from dataclasses import asdict

    from dzdesign.terminal.progress import say
    from dzdesign.verify.closed_loop.plant import read_plant

    return json.dumps({name: float(value) for name, value in asdict(read_plant(path, say)).items()})
