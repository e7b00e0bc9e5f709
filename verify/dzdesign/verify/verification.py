"""`verify`: a firmware folder in, evidence out: strict compilation, every input, closed loop."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

from dzdesign.core.artefact_files import MANIFEST_NAME, sha256_of
from dzdesign.core.artefact_types import THIS_TOOL, Artefact, SourceFile, as_document, schema_of, to_json_bytes
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.result_display import ShownInNotebooks
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.design.pressure_inputs import not_covered
from dzdesign.verify.closed_loop.against_cvodes import compare_with_cvodes
from dzdesign.verify.closed_loop.firmware_loop import FirmwareLoop, Watch, close_the_loop
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.population import NOT_DECLARED, Tolerances
from dzdesign.verify.closed_loop.ramps import Curves, LoopComparison, csv_of, loop_curves
from dzdesign.verify.closed_loop.scene import scenes_of
from dzdesign.verify.current.current_checks import CurrentChecks, current_checks
from dzdesign.verify.evidence import Evidence, InputCheck
from dzdesign.verify.exhaustive.all_inputs import every_input, input_checks
from dzdesign.verify.exhaustive.drive_check import drive_follows
from dzdesign.verify.exhaustive.lot_check import lot_checked
from dzdesign.verify.firmware.compilation import BoardCompiled, board_compiles, check_include, compiles_strictly
from dzdesign.verify.firmware.folder import read_compensator, read_firmware_manifest
from dzdesign.verify.firmware.own_block import own_block_accepted
from dzdesign.verify.firmware.reproduced import (
    Regenerated,
    changed_board_files,
    differing_files,
    reproduced,
    user_files,
)
from dzdesign.verify.loop_results import PlantComparison
from dzdesign.verify.requirements import EXACT_LAW, Check
from dzdesign.verify.toolchain.host_compiler import host_compiler

SCHEMA = schema_of(Evidence)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Verification(ShownInNotebooks):
    """The evidence about one firmware folder, with the runs and maps for its figures."""

    #: Every requirement that was tried, with its figures; stored as verification.json.
    evidence: Evidence
    #: The numbers of the figures by the names of their files: the core's answers over its inputs, and the ramps.
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

    def with_checks(self, *checks: Check) -> "Verification":
        """Return the verification with further requirements."""
        return replace(self, evidence=self.evidence.with_checks(*checks))


def verify(
    folder: Path,
    plant: Plant | None = None,
    plant_source: str = "",
    plant_sha256: str | None = None,
    sequence: RampSequence | None = None,
    tolerances: Tolerances | None = None,
    backs_MPa: Sequence[float] | None = None,
    include: Sequence[Path] = (),
    again: Regenerated | None = None,
    code: Path | None = None,
    say: Callable[[str], None] = lambda _: None,
    watch: Watch = lambda items, _: items,
) -> Verification:
    """Verify a firmware folder made by `dzdesign codegen`.

    Without a `plant` the recorded characteristic stands in for the valve in the closed loop. `plant_source` and
    `plant_sha256` are the name and hash of its file, for the evidence. `tolerances` say how many machines are drawn
    from the declared budget.

    `sequence` is the command over time, by default 0-10 V in 100 s and back. `backs_MPa` are the pressures downstream
    of the edge. `include` lists folders with headers of the user's board files.

    `again` is the firmware as it is generated now; without it the folder is not compared. Of a folder that differs
    nothing else is tried. The code to compile and run is taken from `code`, by default the folder itself. `say` is
    called before each stage. `watch` receives the pieces of a long stage and their number, and yields each piece when
    it is done.

    Raises
    ------
    InputError
        If the folder is not a firmware, or the machine has no C compiler.
    """
    manifest, compensator = _read(folder, tolerances, include)
    host_compiler()
    code = code or folder
    same = None if again is None else reproduced(folder, again)
    run, block, board = _Run(), tuple[Check, ...](), BoardCompiled()
    if again is None or same is None or (again.files and same.holds is not False):
        say("compiling the core with every warning an error")
        given = (plant, sequence or RampSequence(), tolerances, backs_MPa)
        run = _run_core(code, manifest, compensator, given, say, watch)
        block, board = own_block_accepted(code, manifest), board_compiles(folder, manifest, include)
    core, current, loop = run.core, run.current, run.loop
    of_text = (same,) if same else ()
    checks = (*of_text, *block, *core.checks, *current.checks, *loop.checks, *run.of_plant, *board.checks)
    evidence = Evidence(
        tool=THIS_TOOL,
        made_from=(_manifest_source(folder),),
        target=manifest.target,
        changed_board_files=changed_board_files(folder, manifest),
        user_files=user_files(folder, manifest.files),
        differing_files=differing_files(folder, manifest),
        board_not_compiled=board.not_compiled,
        checks=checks,
        inputs=core.inputs,
        closed_loop=loop.result(plant, plant_source, plant_sha256, run.compared),
        scenarios=loop.scenarios,
        population=loop.population,
        current_loop=current.result,
        mutants=None,
        not_covered=not_covered(compensator),
    )
    return Verification(
        evidence=evidence,
        curves={**loop_curves(loop.loops), **core.curves},
        loops=loop.loops,
        derived=compensator if same and same.holds else None,
    )


def _read(
    folder: Path, tolerances: Tolerances | None, include: Sequence[Path]
) -> tuple[FirmwareManifest, Compensator]:
    """Read the firmware's manifest and compensator, and refuse what does not go with them."""
    manifest = read_firmware_manifest(folder)
    check_include(include, manifest)
    compensator = read_compensator(folder)
    if tolerances and compensator.machine is None:
        raise InputError(NOT_DECLARED)
    return manifest, compensator


def _manifest_source(folder: Path) -> SourceFile:
    """Return name and hash of the manifest, which has the hashes of all other files."""
    digest = sha256_of((folder / MANIFEST_NAME).read_bytes())
    return SourceFile(source=f"{folder.name}/{MANIFEST_NAME}", sha256=digest)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Core:
    """What trying the core showed; of one that does not compile nothing more."""

    checks: tuple[Check, ...] = ()
    inputs: tuple[InputCheck, ...] = ()
    curves: Mapping[str, Curves] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Run:
    """What the compiled core did: by itself, with its current controller, in the closed loop and beside CasADi."""

    core: _Core = field(default_factory=_Core)
    current: CurrentChecks = field(default_factory=CurrentChecks)
    loop: FirmwareLoop = field(default_factory=FirmwareLoop)
    compared: tuple[PlantComparison, ...] = ()
    of_plant: tuple[Check, ...] = ()


def _run_core(
    folder: Path,
    manifest: FirmwareManifest,
    compensator: Compensator,
    given: tuple[Plant | None, RampSequence, Tolerances | None, Sequence[float] | None],
    say: Callable[[str], None],
    watch: Watch,
) -> _Run:
    """Try the core, then the closed loop around it: of a firmware folder only what lies in core/ counts here."""
    plant, sequence, tolerances, backs_MPa = given
    # A compiler's time, not ours.
    building = ThreadPoolExecutor(1).submit(scenes_of, folder, compensator, plant, backs_MPa)
    core = _try_core(folder, manifest, compensator, say)
    if not core.inputs:
        return _Run(core=core)
    current, scenes = current_checks(folder, compensator, say), building.result()
    loop = close_the_loop(scenes, compensator, plant, sequence, tolerances, say, watch)
    compared, native_plant = compare_with_cvodes(scenes, say)
    return _Run(core=core, current=current, loop=loop, compared=compared, of_plant=(native_plant,))


def _try_core(folder: Path, manifest: FirmwareManifest, compensator: Compensator, say: Callable[[str], None]) -> _Core:
    """Compile the core; then compare every input with the exact law, and the drive with its model."""
    compiles = compiles_strictly(folder, manifest)
    if not compiles.holds:
        return _Core(checks=(compiles,))
    say("comparing every input with the exact law")
    signs, units = compensator.signals.signs, compensator.valve.recorded_units
    try:
        tried = [every_input(folder, sign, compensator) for sign in signs]
    except RequirementError as error:
        return _Core(checks=(compiles, EXACT_LAW.check(holds=False, text=str(error))))
    inputs = tuple(found for found, _ in tried)
    return _Core(
        checks=(
            compiles,
            *(check for each in inputs for check in input_checks(each, units, both_signs=len(inputs) > 1)),
            *lot_checked(inputs, compensator),
            drive_follows(folder, compensator),
        ),
        inputs=inputs,
        curves={name: columns for _, curves in tried for name, columns in curves.items()},
    )


def evidence_manifest(evidence: Artefact) -> Mapping[str, object]:
    """Return what the manifest of the evidence folder says beside the hashes of its files."""
    header = as_document(evidence)
    return {key: header[key] for key in ("schema", "tool", "made_from")}


def evidence_files(verification: Verification) -> dict[str, bytes]:
    """Return the files of the evidence folder: verification.json, and curves to draw."""
    contents = {Evidence.FILE_NAME: to_json_bytes(verification.evidence)}
    return contents | {name: csv_of(columns).encode() for name, columns in verification.curves.items()}
