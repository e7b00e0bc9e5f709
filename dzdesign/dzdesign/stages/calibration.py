"""`calibration`: Compensator -> the calibration block of one valve as a file, and back."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dzdesign.block_checks import of_another_valve, other_numbers
from dzdesign.core.artefact_files import check_file_may_be_written, write_file
from dzdesign.core.errors import InputError, nearest, quoted
from dzdesign.core.options import AnyPath, Option, Text
from dzdesign.stages.design import given_compensator, refuse_underived

if TYPE_CHECKING:
    from dzdesign.codegen.calibration.layout import CalibrationBlock
    from dzdesign.codegen.calibration.packing import Place
    from dzdesign.codegen.calibration.reading import CalibrationReading
    from dzdesign.core.recorded_units import RecordedUnits
    from dzdesign.design.compensator import Compensator


@dataclass(frozen=True)
class CalibrationArguments:
    """Arguments of `calibration`."""

    compensator: Annotated["Compensator | AnyPath", Option("COMPENSATOR.json")]
    """The compensator.json of the valve. Its numbers are first derived again."""
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option("FILE", short="-o")] = None
    """File to write. Its ending selects the format: .hex Intel HEX, .bin raw octets."""
    target: Annotated[Text, Option("NAME")] = None
    """Microcontroller whose addresses the file states (default: that of the design)."""
    address: Annotated[Text, Option("N", example="0x330000")] = None
    """Address of the block, in units of the target (default: 0x330000 for f28335, 0x98000 for f280049c, else 0). The
    unit is a word of 16 bits on f28335 and f280049c, and an octet elsewhere."""
    serial: Annotated[Text, Option("TEXT")] = None
    """Serial number, at most 24 octets (default: the entry serial of the test record)."""
    record: Annotated[Text, Option("TEXT")] = None
    """Reference to the valve's test record, at most 48 octets (default: the entry record of the test record)."""


@dataclass(frozen=True)
class ReadCalibrationArguments:
    """Arguments of `read_calibration`, on the command line `calibration --read`."""

    file: Annotated[AnyPath, Option("FILE")]
    """File written by `calibration`."""
    compensator: Annotated["Compensator | AnyPath | None", Option("COMPENSATOR.json")] = None
    """The compensator.json to compare the block with, or a firmware folder that holds one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationImage:
    """A calibration block as the content of a file; `address` is in the target's units, None if the format has none."""

    content: bytes
    block: "CalibrationBlock"
    format: str
    target: str
    address: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadCalibration:
    """The content of a block, and whether it belongs to the given compensator; None if none was given."""

    reading: "CalibrationReading"
    #: Where the file has a programmer write the block; empty of a raw file, which does not say.
    placed: str
    compared_with: str
    belongs: bool | None
    #: Why it is not.
    difference: str
    #: Of the recordings, where the compensator that it belongs to is known.
    units: "RecordedUnits"


def calibration(arguments: CalibrationArguments) -> CalibrationImage:
    """Write the calibration block of a compensator for one valve; the same input gives the same octets.

    Returns
    -------
    CalibrationImage
        The content of the file, with format and address.

    Raises
    ------
    InputError
        If the compensator can't be read, a number in it can't be derived, or it does not fit into a block. Also if the
        file can't be written, or dzdesign did not create it.
    """
    from dzdesign.codegen.calibration.block import block_of
    from dzdesign.codegen.calibration.packing import OCTETS, image_of, pack, unpack

    output = None if arguments.output is None else Path(arguments.output)
    form = _format_of(output)
    if output is not None:
        _check_output(output, form)
    if arguments.address is not None and form == "bin":
        raise InputError("--address is given, but a file of format bin states none; leave it out")
    compensator, digest, source = given_compensator(arguments.compensator)
    target = _target_of(compensator, arguments.target)
    place = _place(target, arguments.address, OCTETS)
    refuse_underived(compensator, source, of_file=compensator is not arguments.compensator)
    if fault := of_another_valve(arguments.serial or "", compensator):
        raise InputError(f"--serial: {fault}; leave it out, or give the compensator.json of that valve")
    octets = pack(block_of(compensator, digest, serial=arguments.serial, record=arguments.record))
    made = CalibrationImage(
        content=image_of(octets, form, place),
        block=unpack(octets),
        format=form,
        target=target,
        address=None if form == "bin" else place.address,
    )
    if output is not None:
        write_file(output, made.content)
    return made


def read_calibration(arguments: ReadCalibrationArguments) -> ReadCalibration:
    """Read a calibration block back in engineering units and compare it with a compensator.

    Returns
    -------
    ReadCalibration
        The content of the block; ``belongs`` states whether it is the block of the compensator.

    Raises
    ------
    InputError
        If the file is not a calibration block, is damaged, or holds numbers that every firmware refuses. A block of
        another compensator is not an error: see ``belongs``.
    """
    from dzdesign.codegen.calibration.packing import read_block_file, unpack
    from dzdesign.codegen.calibration.reading import reading_of
    from dzdesign.codegen.project import targets
    from dzdesign.core.recorded_units import AS_COMPUTED

    path = Path(arguments.file)
    octets, place = read_block_file(path)
    sectors = {target.name: target.block_place for target in targets() if target.sector}
    block, placed = unpack(octets, f"'{path}'"), place.in_words(sectors) if place else ""
    reading = reading_of(block, f"'{path}'")
    if arguments.compensator is None:
        return ReadCalibration(
            reading=reading, placed=placed, compared_with="", belongs=None, difference="", units=AS_COMPUTED
        )
    compensator, digest, source = given_compensator(arguments.compensator)
    difference = _difference(block, reading, compensator, digest)
    return ReadCalibration(
        reading=reading,
        placed=placed,
        compared_with=source,
        belongs=not difference,
        difference=difference,
        units=AS_COMPUTED if difference else compensator.valve.recorded_units,
    )


def _format_of(output: Path | None) -> str:
    """Return the format that the ending of a file says; octets where there is no file."""
    from dzdesign.codegen.calibration.packing import FORMATS as KNOWN

    ending = output.suffix.lower().removeprefix(".") if output is not None else "bin"
    if ending not in KNOWN:
        what = f"ends with '{output.suffix}'{nearest(ending, KNOWN)}" if ending and output else "has no ending"
        raise InputError(f"'{output}' {what}, expected {' or '.join(f'.{name}' for name in KNOWN)}; choose another -o")
    return ending


def _check_output(output: Path, form: str) -> None:
    """Refuse to write over what is not a calibration block."""
    from dzdesign.codegen.calibration.layout import MAGIC
    from dzdesign.codegen.calibration.packing import read_block_file

    check_file_may_be_written(output)
    if not output.exists() or not output.stat().st_size:
        return
    try:
        is_block = read_block_file(output, form)[0].startswith(MAGIC)
    except InputError:
        is_block = False
    if not is_block:
        raise InputError(
            f"'{output}' exists and is no calibration block of dzdesign, so it is left alone; choose another name "
            "with -o"
        )


def _target_of(compensator: "Compensator", given: str | None) -> str:
    """Return the target whose firmware takes the block; one that counts otherwise is refused as `codegen` does."""
    from dzdesign.codegen.project import DEFAULT_TARGET, target_named

    designed_for = compensator.target
    target = target_named(given or (designed_for.name if designed_for else DEFAULT_TARGET))
    target.check_signals(compensator.signals)
    if designed_for:
        target.check_designed_for(designed_for)
    if compensator.current_drive is not None:
        target.check_current_control(compensator.current_drive.sampling)
    return target.name


def _place(target: str, address: str | None, octets: int) -> "Place":
    from dzdesign.codegen.project import target_named

    place = target_named(target).block_place
    if address is None:
        return place
    try:
        return place.at(int(address, 0), octets)
    except ValueError as error:
        raise InputError(f"--address is {quoted(address)}, expected a whole number such as 0x330000") from error


def _difference(
    block: "CalibrationBlock", reading: "CalibrationReading", compensator: "Compensator", digest: str
) -> str:
    """Say why a block is not that of a compensator: another file, or numbers that do not follow from it."""
    if reading.compensator_sha256 != digest:
        return f"its compensator.json has the SHA-256 {digest}, the block names {reading.compensator_sha256}"
    return other_numbers(block, compensator, digest) or of_another_valve(reading.serial, compensator)
