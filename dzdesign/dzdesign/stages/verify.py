"""`verify`: firmware, or another output, -> evidence."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import KW_ONLY, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.artefact_files import check_folder_may_be_written, write_folder
from dzdesign.core.documents import read_bytes, sha256_of
from dzdesign.core.errors import InputError, quoted
from dzdesign.core.options import CHECKS, AnyPath, Option, Paths, Text, Texts, flag_of, paths_of, read_options, texts_of
from dzdesign.core.placing import scratch_folder
from dzdesign.core.units import parse_quantity
from dzdesign.design.design_choices import LOOP_WITH_GAIN, read_position_loop
from dzdesign.stages.recordings import expand
from dzdesign.terminal.progress import say, stage_progress

if TYPE_CHECKING:
    from dzdesign.codegen.other_targets import Output
    from dzdesign.codegen.project import Firmware
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.verify.outputs.verification import OutputVerification
    from dzdesign.verify.requirements import Check
    from dzdesign.verify.verification import Verification

#: Options that make no sense for an output other than a C firmware, unless its kind takes one.
OF_FIRMWARE = ("blocks", "plant", "back_pressure", "position_loop", "include", "machine_code", "board_code")
#: No port behind a valve's edge has more.
LARGEST_BACK_MPA = 100.0


@dataclass(frozen=True)
class VerifyArguments:
    """Arguments of `verify`."""

    firmware: Annotated["Firmware | Output | AnyPath", Option("DIR")]
    """Folder made by `dzdesign codegen`."""
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option("DIR", command_default="evidence", short="-o")] = None
    """Folder for the evidence."""
    ramps: Annotated[Paths, Option("RAMP", several=True)] = ()
    """Recordings of valve.json, or patterns such as "ramps/*.csv", in any order (default: the thresholds are taken as
    stated). The valve is identified again and compared with the valve of the firmware."""
    blocks: Annotated[Paths, Option("FILE", several=True)] = ()
    """Calibration blocks of other valves, or patterns such as "lot/valves/*/calibration.bin", each beside its
    compensator.json. Each is tried with this firmware, of block form, on every input."""
    plant: Annotated[AnyPath | None, Option("PLANT.toml")] = None
    """File with the plant of the closed loop, such as demo/example/plant.toml (default: a plant made from the
    identified thresholds)."""
    back_pressure: Annotated[Texts, Option("P", example="1 MPa")] = ()
    """Pressure behind the metering edge in the closed loop (default: 0 and 1 MPa, or the span that the sensors have
    beside the tested pressure drops). Ramps run at the highest pressure, and failing sensors at each. Repeatable."""
    position_loop: Annotated[Text, Option("T", example=LOOP_WITH_GAIN, read=read_position_loop)] = None
    """Lag, delay and velocity gain of a position loop to try with a firmware of two solenoids (default: none; without a
    gain 80 % of what `design` states)."""
    include: Annotated[Paths, Option("DIR", CHECKS)] = ()
    """Folder of headers for your board files, such as those of your chip. Repeatable."""
    board_code: Annotated[bool, Option(group=CHECKS)] = False
    """Compile and run your own C too, on the model of the device: the files in board/ and the board files that you
    changed. For targets f28335 and f280049c. Use it for code that you trust."""
    machine_code: Annotated[bool, Option(group=CHECKS)] = False
    """Check machine code too. The Cortex-M4 runs every input in QEMU, and the AVR a sample in simavr."""


def verify(arguments: VerifyArguments) -> "Verification | OutputVerification":
    """Verify a firmware: compare every input with the exact law, then run the closed loop. A C compiler is required.

    For another output, such as Structured Text, every input is compared, too.

    Returns
    -------
    Verification or OutputEvidence
        Result of every requirement; ``holds`` is true only if each was checked and holds.

    Raises
    ------
    InputError
        If a file can't be read, or there is no C compiler. A requirement that does not hold is not an error: see
        ``holds``. Code that was edited by hand is not run.
    """
    from dzdesign.verify.folder import holds_output

    with _firmware_folder(arguments.firmware) as folder:
        if holds_output(folder):
            return verify_output_folder(folder, arguments)
        return verify_firmware(replace(arguments, firmware=folder))


def verify_output_folder(
    folder: Path, arguments: VerifyArguments, identified: "ValveModel | None" = None
) -> "OutputVerification":
    """Verify an output other than a C firmware; `identified` is as in `verify_firmware`."""
    from dzdesign.regeneration import regenerated
    from dzdesign.verify.outputs.verification import SCHEMA, check_kind, output_evidence_files, verify_output
    from dzdesign.verify.verification import evidence_manifest

    if arguments.output is not None:
        check_folder_may_be_written(Path(arguments.output), SCHEMA)
    ramps = _ramp_checks(folder, arguments, identified)
    check_kind(folder, [flag_of(name) for name in OF_FIRMWARE if getattr(arguments, name)])
    with stage_progress("designing and generating again"):
        again = regenerated(folder)
    with again.written() as code, stage_progress() as stage:
        verification = verify_output(folder, stage, again, code, partial(ramps, stage) if ramps else None)
    if arguments.output is not None:
        manifest = evidence_manifest(verification.evidence)
        write_folder(Path(arguments.output), output_evidence_files(verification), manifest)
    return verification


def verify_firmware(
    arguments: VerifyArguments, plant_source: str = "", identified: "ValveModel | None" = None
) -> "Verification":
    """Verify a C firmware: what is compiled and run is the text that is generated here and now.

    What this very run has `identified` from the given ramps is not identified again.
    """
    from dzdesign.block_checks import blocks_checked, given_blocks
    from dzdesign.regeneration import regenerated
    from dzdesign.report.valve_report import with_report
    from dzdesign.verify.closed_loop.plant import read_plant
    from dzdesign.verify.closed_loop.position_loop import PositionLoop
    from dzdesign.verify.verification import SCHEMA, Asked, evidence_manifest
    from dzdesign.verify.verification import verify as verify_folder

    loop = read_options(arguments, ["position_loop"])["position_loop"]
    output, plant, digest = None if arguments.output is None else Path(arguments.output), None, None
    if output is not None:
        check_folder_may_be_written(output, SCHEMA)
    with _firmware_folder(arguments.firmware) as folder:
        again = regenerated(folder)
        if arguments.plant is not None:
            plant = read_plant(Path(arguments.plant), say)
            digest = sha256_of(read_bytes(Path(arguments.plant), "plant file"))
            plant_source = plant_source or Path(arguments.plant).name  # how the evidence calls the plant
        ramps = _ramp_checks(folder, arguments, identified)
        blocks = given_blocks(folder, expand(arguments.blocks) if paths_of(arguments.blocks) else [])
        with again.written() as code, stage_progress() as stage:

            def of_blocks(_: bool) -> "list[Check]":
                stage("comparing every input with each of the calibration blocks")
                return blocks_checked(folder, blocks, code)

            asked = Asked(
                position_loop=loop and PositionLoop(lag_s=loop[0], delay_s=loop[1], gain=loop[2]),
                plant=plant,
                plant_source=plant_source,
                plant_sha256=digest,
                backs_MPa=_back_pressures_MPa(texts_of(arguments.back_pressure)),
                include=[Path(place) for place in paths_of(arguments.include)],
                machine_code=arguments.machine_code,
                board_code=arguments.board_code,
                ramps=partial(ramps, stage) if ramps else None,
                blocks=of_blocks if blocks else None,
            )
            verification = verify_folder(folder, asked, again, code, stage, stage.each)
            if output is not None:
                files = with_report(verification, folder, output)
                write_folder(output, files, evidence_manifest(verification.evidence))
    return verification


def _ramp_checks(
    folder: Path, arguments: VerifyArguments, identified: "ValveModel | None"
) -> "Callable[[Callable[[str], None], bool], list[Check]] | None":
    """Return what checks a folder with the recordings that were given, for `say` and whether the core ran."""
    from dzdesign.regeneration import given_files, identified_again, inputs_again
    from dzdesign.verify.folder import read_compensator

    if not paths_of(arguments.ramps):
        return None
    recordings = given_files(arguments.ramps)

    def checks(stage: "Callable[[str], None]", runs: bool) -> "list[Check]":
        stage("identifying again" if identified is None else "comparing with the ramp tests")
        compensator = read_compensator(folder)
        found = [identified_again(compensator, recordings, identified)]
        return found + (inputs_again(compensator, recordings) if runs else [])

    return checks


def _back_pressures_MPa(texts: list[str]) -> list[float] | None:
    """Return the pressures downstream of the edge; None where none were given."""
    if not texts:
        return None
    values = [parse_quantity(text, "pressure", "--back-pressure") / 1e6 for text in texts]
    for text, value in zip(texts, values, strict=True):
        if not 0 <= value <= LARGEST_BACK_MPA:
            raise InputError(f"--back-pressure is {quoted(text)}, expected 0 to {LARGEST_BACK_MPA:g} MPa")
    if len(set(values)) < len(values):
        raise InputError(f"--back-pressure repeats a pressure ({', '.join(texts)}); give each of them once")
    return values


@contextmanager
def _firmware_folder(firmware: "Firmware | Output | AnyPath") -> Iterator[Path]:
    """Give the folder of a firmware; of one that was only generated a temporary one."""
    from dzdesign.codegen.other_targets import Output
    from dzdesign.codegen.project import Firmware

    if not isinstance(firmware, Firmware | Output):
        yield Path(firmware)
        return
    with scratch_folder() as temporary:
        folder = temporary / "firmware"
        write_folder(folder, firmware.contents, firmware.manifest)
        yield folder
