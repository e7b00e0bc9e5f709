"""`verify`: a firmware folder in, evidence out: `REQUIREMENTS` is the one list, and it runs.

An output other than a C firmware has a list of its own, in `outputs.verification`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_types import THIS_TOOL, Artefact, SourceFile, as_document, schema_of, to_json_bytes
from dzdesign.core.display import NOT_ASKED_FOR, NOT_CHECKED, ShownInNotebooks
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.design.pressure_inputs import not_covered
from dzdesign.verify import requirements
from dzdesign.verify.closed_loop.against_cvodes import compare_with_cvodes
from dzdesign.verify.closed_loop.compensation import compensates
from dzdesign.verify.closed_loop.firmware_loop import FirmwareLoop, Watch, close_the_loop
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.position_loop import PositionLoop, comes_to_rest
from dzdesign.verify.closed_loop.ramps import Curves, LoopComparison, csv_of, loop_curves
from dzdesign.verify.closed_loop.scene import Scene, scenes_of
from dzdesign.verify.compilation import board_compiles, check_include, compiles_strictly, fits_target_int
from dzdesign.verify.current.current_checks import CurrentChecks, current_checks
from dzdesign.verify.evidence import Evidence, InputCheck
from dzdesign.verify.exhaustive.all_inputs import every_input, input_checks, lot_checked
from dzdesign.verify.exhaustive.asked_functions import functions_asked_for
from dzdesign.verify.exhaustive.block_check import own_block_accepted
from dzdesign.verify.exhaustive.drive_check import drive_follows
from dzdesign.verify.exhaustive.machine_code import machine_code_checks
from dzdesign.verify.folder import (
    USER_FOLDER,
    Regenerated,
    as_generated,
    changed_board_files,
    differing_files,
    read_compensator,
    read_firmware_manifest,
    reproduced,
    user_files,
)
from dzdesign.verify.hardware.board_values import BOARD_FILE, beside_values, board_of, read_board_values
from dzdesign.verify.hardware.checks import hardware_checks
from dzdesign.verify.hardware.model import DEVICES, Bench
from dzdesign.verify.requirements import EVERY_RUN, OF_SOME, Check, Requirement, Tried, checks_of
from dzdesign.verify.toolchain.host_compiler import host_compiler

SCHEMA = schema_of(Evidence)
#: Of a file of the user's: nothing that was generated is there to compare it with.
REVIEW = "review it, and try it on the machine"
#: What the front door checks, which may ask `identify` and `codegen`; given whether the core was tried.
FrontDoor = Callable[[bool], Sequence[Check]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What of a firmware is to be tried, and with what."""

    #: In the closed loop; without one the recorded characteristic stands in for the valve.
    plant: Plant | None = None
    #: Name and hash of its file, for the evidence.
    plant_source: str = ""
    plant_sha256: str | None = None
    #: The command over time, and the pressures downstream of the edge.
    sequence: RampSequence = field(default_factory=RampSequence)
    backs_MPa: Sequence[float] | None = None
    #: A position loop around valve and firmware.
    position_loop: PositionLoop | None = None
    #: Folders with headers of the user's board files.
    include: Sequence[Path] = ()
    machine_code: bool = False
    #: The user's own C is compiled and run with the firmware, on the model of its device.
    board_code: bool = False
    #: With the ramp tests, and with the calibration blocks of other valves.
    ramps: FrontDoor | None = None
    blocks: FrontDoor | None = None


@dataclass(slots=True, kw_only=True)
class Firmware:
    """A firmware that is being verified: as it is given, and what was found up to now, for what is tried next."""

    folder: Path
    #: As it is generated now; without it the folder is not compared.
    again: Regenerated | None
    #: What is compiled and run.
    code: Path
    manifest: FirmwareManifest
    compensator: Compensator
    asked: Asked
    #: Called before each stage; and given the pieces of a long one and their number, to yield each when it is done.
    say: Callable[[str], None]
    watch: Watch
    same: Check | None = None
    scenes: "Future[tuple[Scene, ...]] | None" = None
    inputs: tuple[InputCheck, ...] = ()
    curves: dict[str, Curves] = field(default_factory=dict)
    current: CurrentChecks = field(default_factory=CurrentChecks)
    loop: FirmwareLoop = field(default_factory=FirmwareLoop)
    board_not_compiled: str = ""
    #: Files of the user's that ran on the model of the device.
    board_ran: tuple[str, ...] = ()

    def is_as_generated(self) -> bool:
        """Tell whether more is tried than its text: of a folder that differs nothing else is."""
        return as_generated(self.again, self.same)

    def runs(self) -> bool:
        """Tell whether its core compiles, and every input could be tried."""
        return bool(self.inputs)


# ---- what runs ----


def _same(firmware: Firmware) -> list[Check]:
    firmware.same = reproduced(firmware.folder, firmware.again)
    return [firmware.same]


def _compiles(firmware: Firmware) -> Iterator[Check]:
    firmware.say("compiling the core with every warning an error")
    asked, compensator = firmware.asked, firmware.compensator
    # A compiler's time, not ours.
    building = ThreadPoolExecutor(1).submit(scenes_of, firmware.code, compensator, asked.plant, asked.backs_MPa)
    compiles = compiles_strictly(firmware.code, firmware.manifest)
    firmware.scenes = building if compiles.holds else None
    yield compiles


def _hardware(firmware: Firmware) -> Iterator[Check]:
    firmware.say("running the firmware on a model of its device")
    board = board_of(firmware.folder, firmware.code, firmware.manifest, with_code=firmware.asked.board_code)
    if board is None:
        name = f"{firmware.manifest.target}/{BOARD_FILE}"
        there = (firmware.folder / name).read_text(encoding="utf-8", errors="replace")
        if read_board_values(there) is not None:
            return  # code of the user's keeps it from running: said as what is not tried
        found = beside_values(there)
        text = f"{name}, {found} is no value of the board; keep values alone there, and what is yours in board/"
        yield requirements.HARDWARE_COMPILES.check(holds=None, text=text)
        return
    firmware.board_ran = board.taken
    checks = list(hardware_checks(lambda: Bench(firmware.code, firmware.manifest, firmware.compensator, board)))
    yield from checks
    if board.code:
        holds = all(check.holds for check in checks)
        found = "all of the device holds with it" if holds else "see what does not hold of the device"
        text = f"{', '.join(board.taken)}: {found}"
        yield requirements.BOARD_CODE.check(holds=holds, text=text)


def _every_input(firmware: Firmware) -> list[Check]:
    firmware.say("comparing every input with the exact law")
    compensator = firmware.compensator
    signs, units = compensator.signals.signs, compensator.valve.recorded_units
    try:
        tried = [every_input(firmware.code, sign, compensator) for sign in signs]
    except RequirementError as error:
        return [requirements.EXACT_LAW.check(holds=False, text=str(error))]
    firmware.inputs = tuple(found for found, _ in tried)
    firmware.curves |= {name: columns for _, curves in tried for name, columns in curves.items()}
    return [check for each in firmware.inputs for check in input_checks(each, units, both_signs=len(signs) > 1)]


def _current(firmware: Firmware) -> Sequence[Check]:
    firmware.current = current_checks(firmware.code, firmware.compensator, firmware.say)
    return firmware.current.checks


def _closed_loop(firmware: Firmware) -> Iterator[Check]:
    asked = firmware.asked
    scenes = firmware.scenes.result() if firmware.scenes else ()
    firmware.loop = close_the_loop(
        scenes, firmware.compensator, asked.plant, asked.sequence, firmware.say, firmware.watch
    )
    firmware.curves = {**loop_curves(firmware.loop.loops), **firmware.curves}
    yield from firmware.loop.checks
    results, given = [loop.result for loop in firmware.loop.loops], asked.plant is not None
    yield compensates(results, firmware.curves, firmware.compensator, plant_given=given)
    yield compare_with_cvodes(scenes, firmware.say)


def _position_loop(firmware: Firmware) -> list[Check]:
    if firmware.asked.position_loop is None:
        return []
    firmware.say("closing the position loop")
    return [comes_to_rest(firmware.asked.position_loop, firmware.loop.scenes)]


def _board(firmware: Firmware) -> Sequence[Check]:
    board = board_compiles(firmware.folder, firmware.manifest, firmware.asked.include)
    firmware.board_not_compiled = board.not_compiled
    return board.checks


def _machine_code(firmware: Firmware) -> list[Check]:
    firmware.say("comparing the machine code of other processors with the exact law, in simulators")
    return machine_code_checks(firmware.code, firmware.inputs)


def _asks(name: str) -> Callable[[Firmware], bool]:
    return lambda firmware: firmware.is_as_generated() and bool(getattr(firmware.asked, name))


#: Every requirement on a firmware, in the order of the report.
REQUIREMENTS: tuple[Tried[Firmware], ...] = (
    Tried((requirements.REPRODUCED,), _same, lambda _: True),
    Tried(
        (requirements.OWN_BLOCK,),
        lambda each: own_block_accepted(each.code, each.manifest),
        Firmware.is_as_generated,
    ),
    Tried((requirements.COMPILES,), _compiles, Firmware.is_as_generated),
    Tried(
        (requirements.INT_WIDTH,),
        lambda each: [fits_target_int(each.code, each.manifest)],
        Firmware.is_as_generated,
    ),
    Tried(
        (*requirements.OF_HARDWARE, requirements.BOARD_CODE),
        _hardware,
        lambda each: each.scenes is not None and each.manifest.target in DEVICES,
    ),
    Tried(requirements.OF_INPUTS, _every_input, lambda each: each.scenes is not None),
    Tried((requirements.LOT,), lambda each: lot_checked(each.inputs, each.compensator), Firmware.runs),
    Tried((requirements.DRIVE,), lambda each: [drive_follows(each.code, each.compensator)], Firmware.runs),
    Tried(
        (requirements.ASKED_FOR,),
        lambda each: [functions_asked_for(each.compensator)],
        lambda each: each.compensator.options is not None,
    ),
    Tried((*requirements.OF_CURRENT, requirements.CURRENT_SOLENOIDS), _current, Firmware.runs),
    Tried(requirements.OF_LOOP, _closed_loop, Firmware.runs),
    Tried((requirements.POSITION_LOOP,), _position_loop, Firmware.runs),
    Tried((requirements.BOARD_FILES,), _board, Firmware.is_as_generated),
    Tried(requirements.OF_GIVEN_LOOP, lambda _: (), lambda _: False),  # the closed loop's run tells of them
    Tried(
        (requirements.RAMPS, requirements.PRESSURE_INPUTS),
        lambda each: each.asked.ramps(each.runs()) if each.asked.ramps else (),
        _asks("ramps"),
    ),
    Tried(
        (requirements.CALIBRATION_BLOCK,),
        lambda each: each.asked.blocks(each.runs()) if each.asked.blocks else (),
        _asks("blocks"),
    ),
    Tried((requirements.MACHINE_CODE,), _machine_code, _asks("machine_code")),
)  # fmt: skip


# ---- what comes of it ----


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Verification(ShownInNotebooks):
    """The evidence about one firmware folder, with the runs and maps for its figures."""

    #: Every requirement that was tried, with its figures; stored as verification.json.
    evidence: Evidence
    #: The numbers of the figures by the names of their files: the law over its inputs, the drive at zero, the ramps.
    curves: Mapping[str, Curves]
    #: The ramps in closed loop, one a side and tested pressure drop.
    loops: tuple[LoopComparison, ...]
    #: What the firmware was made from, where designing it again gave every number.
    derived: Compensator | None

    @property
    def holds(self) -> bool:
        """True if every requirement that was tried holds."""
        return self.evidence.holds

    @property
    def verdict(self) -> str:
        """The verdict in words: what does not hold, then what was not checked, then what the certificate covers."""
        words = self.evidence.verdict
        if not self.holds or self.derived is None:
            return words
        parts = [words.removesuffix("."), f"the certificate covers {self.derived.certified_of}"]
        return "; ".join([*parts, *filter(None, [self.evidence.reservation])]) + "."


def verify(
    folder: Path,
    asked: Asked | None = None,
    again: Regenerated | None = None,
    code: Path | None = None,
    say: Callable[[str], None] = lambda _: None,
    watch: Watch = lambda items, _: items,
) -> Verification:
    """Verify a firmware folder made by `dzdesign codegen`.

    `again` is the firmware as it is generated now. The code to compile and run is taken from `code`, by default the
    folder itself. For `say` and `watch` see `Firmware`.

    Raises
    ------
    InputError
        If the folder is not a firmware, what is asked for does not go with it, or the machine has no C compiler.
    """
    asked = asked or Asked()
    firmware = Firmware(
        folder=folder, again=again, code=code or folder, manifest=read_firmware_manifest(folder),
        compensator=read_compensator(folder), asked=asked, say=say, watch=watch,
    )  # fmt: skip
    check_include(asked.include, firmware.manifest)
    if asked.board_code and firmware.manifest.target not in DEVICES:
        raise InputError(
            f"--board-code runs your code on a model of {' or '.join(DEVICES)}, and this firmware is for "
            f"{firmware.manifest.target}; leave it out"
        )
    host_compiler()
    checks = checks_of(REQUIREMENTS, firmware)
    manifest = firmware.manifest
    evidence = Evidence(
        tool=THIS_TOOL,
        made_from=manifest_source(folder),
        target=manifest.target,
        changed_board_files=_not_run(firmware, changed_board_files(folder, manifest)),
        user_files=_not_run(firmware, user_files(folder, manifest.files)),
        differing_files=differing_files(folder, manifest),
        board_not_compiled=firmware.board_not_compiled,
        checks=checks,
        inputs=firmware.inputs,
        closed_loop=firmware.loop.result(asked.plant, asked.plant_source, asked.plant_sha256),
        scenarios=firmware.loop.scenarios,
        current_loop=firmware.current.result,
        not_covered=not_covered(firmware.compensator),
    )
    derived = firmware.compensator if firmware.same and firmware.same.holds else None
    return Verification(evidence=evidence, curves=firmware.curves, loops=firmware.loop.loops, derived=derived)


def _not_run(firmware: Firmware, names: Sequence[str]) -> tuple[str, ...]:
    return tuple(name for name in names if name not in firmware.board_ran)


def manifest_source(folder: Path) -> tuple[SourceFile]:
    """Return name and hash of a folder's manifest, which has the hashes of all other files."""
    digest = sha256_of((folder / MANIFEST_NAME).read_bytes())
    return (SourceFile(source=f"{folder.name}/{MANIFEST_NAME}", sha256=digest),)


def evidence_manifest(evidence: Artefact) -> Mapping[str, object]:
    """Return what the manifest of the evidence folder says beside the hashes of its files."""
    header = as_document(evidence)
    return {key: header[key] for key in ("schema", "tool", "made_from")}


def evidence_files(verification: Verification) -> dict[str, bytes]:
    """Return the files of the evidence folder: verification.json, and curves to draw."""
    contents = {Evidence.FILE_NAME: to_json_bytes(verification.evidence)}
    return contents | {name: csv_of(columns).encode() for name, columns in verification.curves.items()}


# ---- what was not tried ----


def untried_requirements(evidence: Evidence) -> tuple[Requirement, ...]:
    """Return what can be checked of a firmware and was not tried, and how to have it tried."""
    of_the_user = (*evidence.changed_board_files, *evidence.user_files)
    yours = [f"{name}, which is yours and was changed" for name in evidence.changed_board_files]
    yours += [f"{name}, which is yours" for name in evidence.user_files]
    untried = [Requirement(id="user-file", title=title, how=REVIEW) for title in yours]
    tried, needed = {check.id for check in evidence.checks}, requirements
    #: Whether those are lacking of which no check tells, and that which makes sense of some firmware alone.
    lacking = {
        needed.BOARD_FILES: bool(evidence.board_not_compiled),
        needed.OWN_PLANT: evidence.closed_loop.plant is None,
        needed.LOAD_STEPS: not any(each.is_load_step for each in evidence.scenarios),
        needed.PRESSURE_INPUTS: len(evidence.inputs) > 1 and needed.PRESSURE_INPUTS.id not in tried,
        needed.CALIBRATION_BLOCK: False,
        needed.BOARD_CODE: evidence.target in DEVICES and any(name.endswith((".c", ".h")) for name in of_the_user),
    }
    for each in (each for row in REQUIREMENTS for each in row.requirements):
        if lacking.get(each, each.id not in tried and not each.how.startswith(OF_SOME)):
            own = {needed.BOARD_FILES: evidence.board_not_compiled, needed.BOARD_CODE: _how_to_try(of_the_user)}
            untried.append(replace(each, how=own.get(each) or each.how))
    return tuple(untried)


def _how_to_try(of_the_user: Sequence[str]) -> str:
    has_more = any(PurePosixPath(name).name == BOARD_FILE for name in of_the_user)
    return f"keep values alone in {BOARD_FILE}, and your code in {USER_FOLDER}/" if has_more else ""


def label_of_untried(requirement: Requirement) -> str:
    """Return the words for a requirement that was not tried: only what every `verify` checks was to be."""
    return NOT_CHECKED if requirement.how == EVERY_RUN else NOT_ASKED_FOR


def not_tried(evidence: Evidence) -> tuple[str, ...]:
    """Return the lines of what was not tried, each with the command that would."""
    return tuple(f"{each.title}: {each.how}" for each in untried_requirements(evidence))
