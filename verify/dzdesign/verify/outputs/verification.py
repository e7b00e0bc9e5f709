"""`verify` of an output other than a C firmware: its folder in, evidence out, by the list of its requirements."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_types import THIS_TOOL, schema_of, to_json_bytes
from dzdesign.core.display import ShownInNotebooks
from dzdesign.core.errors import InputError, nearest, quoted
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import OutputManifest
from dzdesign.design.pressure_inputs import not_covered
from dzdesign.verify import requirements
from dzdesign.verify.evidence import OutputChecks, OutputEvidence, TriedInputs
from dzdesign.verify.folder import Regenerated, as_generated, read_compensator, read_output_manifest, reproduced
from dzdesign.verify.outputs import amplifier, fmu, texts
from dzdesign.verify.requirements import Check, Tried, checks_of
from dzdesign.verify.verification import FrontDoor, manifest_source

SCHEMA = schema_of(OutputEvidence)
Say = Callable[[str], None]


@dataclass(slots=True, kw_only=True)
class Given:
    """An output that is being verified, and what was found up to now."""

    folder: Path
    again: Regenerated | None
    #: What is read, compiled and run.
    code: Path
    manifest: OutputManifest
    compensator: Compensator
    ramps: FrontDoor | None
    say: Say
    same: Check | None = None
    inputs: list[TriedInputs] = field(default_factory=list)
    #: Tool that a check used, to its version.
    versions: dict[str, str] = field(default_factory=dict)

    def run_by(self, checks: Callable[[Path, OutputManifest, Compensator, Say], OutputChecks]) -> Sequence[Check]:
        """Run the checks of one kind of output."""
        found = checks(self.code, self.manifest, self.compensator, self.say)
        self.inputs += found.inputs
        self.versions |= found.versions
        return found.checks


def _same(output: Given) -> list[Check]:
    output.same = reproduced(output.folder, output.again)
    return [output.same]


def _is_a(target: str) -> Callable[[Given], bool]:
    return lambda output: output.manifest.target == target and as_generated(output.again, output.same)


OF_TEXTS = (requirements.EXACT_LAW, requirements.FALLBACK, requirements.STATES, requirements.ZERO_COMMAND)
OF_FMUS = (
    requirements.FMU_LAW, requirements.FMU_DRIVE, requirements.FMU_UNITS, requirements.FMU_CLOSED_LOOP,
)  # fmt: skip
OF_AMPLIFIERS = (requirements.READ_BACK, requirements.SAFE, requirements.DEAD_ZONES)
#: Target, as the manifest names it, to what its checks are of, and the checks.
KINDS = {
    "iec61131": ((*OF_TEXTS, requirements.DEBOUNCE, requirements.OVERFLOW), texts.block_checks),
    "fmu": ((requirements.FMU_VALID, *requirements.OF_INPUTS, *OF_FMUS), fmu.checks),
    "matlab": ((*OF_TEXTS, *requirements.OF_INPUTS), texts.function_checks),
    "amplifier": (OF_AMPLIFIERS, amplifier.checks),
}
#: Every requirement on such an output, in the order of its evidence.
REQUIREMENTS: tuple[Tried[Given], ...] = (
    Tried((requirements.REPRODUCED,), _same, lambda _: True),
    *(
        Tried(needed, lambda output, checks=checks: output.run_by(checks), _is_a(target))  # type: ignore[misc]
        for target, (needed, checks) in KINDS.items()
    ),
    Tried(
        (requirements.RAMPS, requirements.PRESSURE_INPUTS),
        lambda output: output.ramps(bool(output.inputs)) if output.ramps else (),
        lambda output: as_generated(output.again, output.same),
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class OutputVerification(ShownInNotebooks):
    """The evidence about one output."""

    #: Every requirement that was tried; stored as evidence.json.
    evidence: OutputEvidence

    @property
    def holds(self) -> bool:
        """True if every requirement that was tried holds."""
        return self.evidence.holds

    @property
    def verdict(self) -> str:
        """In words: what does not hold takes precedence over what could not be checked."""
        return self.evidence.verdict


def check_kind(folder: Path, options: Sequence[str] = ()) -> OutputManifest:
    """Return the manifest of an output; refuse a kind that nobody knows, and options for a C firmware alone."""
    manifest, source = read_output_manifest(folder), f"'{folder / MANIFEST_NAME}'"
    if manifest.target not in KINDS:
        known = ", ".join(KINDS)
        raise InputError(f"{source}: target {quoted(manifest.target)} is unknown{nearest(manifest.target, KINDS)}; "
                         f"known: {known}")  # fmt: skip
    for flag in options:
        raise InputError(f"{flag} is for a C firmware, and '{folder}' is an output for {manifest.target}; leave it out")
    return manifest


def verify_output(
    folder: Path,
    say: Say = lambda _: None,
    again: Regenerated | None = None,
    code: Path | None = None,
    ramps: FrontDoor | None = None,
) -> OutputVerification:
    """Verify the folder of an output, made by `dzdesign codegen`.

    `again` is the output as it is generated now; of a folder that differs nothing else is tried. What is read, compiled
    and run is taken from `code`, by default the folder itself. `say` is told each stage before it begins. `ramps` are
    the front door's checks with the recordings.
    """
    output = Given(
        folder=folder, again=again, code=code or folder, manifest=check_kind(folder), ramps=ramps, say=say,
        compensator=read_compensator(folder),
    )  # fmt: skip
    checks = checks_of(REQUIREMENTS, output)
    return OutputVerification(
        evidence=OutputEvidence(
            tool=THIS_TOOL,
            made_from=manifest_source(folder),
            target=output.manifest.target,
            settings=output.manifest.settings,
            origin=output.manifest.origin,
            checks=checks,
            inputs=tuple(output.inputs),
            versions=output.versions,
            not_covered=not_covered(output.compensator),
        )
    )


def output_evidence_files(verification: OutputVerification) -> dict[str, bytes]:
    """Return the files of the evidence folder."""
    return {OutputEvidence.FILE_NAME: to_json_bytes(verification.evidence)}
