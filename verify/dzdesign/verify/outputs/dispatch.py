"""`verify` of an output: what is checked of each, and which room checks the rest of its kind."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from types import MappingProxyType

from dzdesign.core.artefact_files import MANIFEST_NAME, sha256_of
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile, schema_of, to_json_bytes
from dzdesign.core.errors import InputError, nearest, quoted
from dzdesign.core.result_display import ShownInNotebooks
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import OutputManifest
from dzdesign.design.pressure_inputs import not_covered
from dzdesign.verify.firmware.folder import read_compensator
from dzdesign.verify.firmware.reproduced import Regenerated, reproduced
from dzdesign.verify.integers.every_pair import Program
from dzdesign.verify.output_evidence import OutputChecks, OutputEvidence
from dzdesign.verify.outputs.folder import read_output_manifest

SCHEMA = schema_of(OutputEvidence)
Say = Callable[[str], None]
#: What a room of one kind offers, as ``checks(folder, manifest, compensator, say)``.
CheckOutput = Callable[[Path, OutputManifest, Compensator, Say], OutputChecks]


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputKind:
    """One kind of output, and where its checks stand."""

    #: Module with a `CheckOutput`, and its name there; one with a name of its own takes the generator's forms, too.
    module: str
    checks: str = ""


#: Target, as the manifest names it, to its checks.
KINDS: Mapping[str, OutputKind] = {
    "iec61131": OutputKind(module="dzdesign.verify.integers.checks", checks="block_checks"),
    "fmu": OutputKind(module="dzdesign.verify.fmu.checks"),
    "matlab": OutputKind(module="dzdesign.verify.integers.checks", checks="function_checks"),
    "amplifier": OutputKind(module="dzdesign.verify.amplifier.output_checks"),
}


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


def kind_of(manifest: OutputManifest, source: str) -> OutputKind:
    """Return how an output is checked; one of a kind that nobody knows is an `InputError`."""
    if manifest.target not in KINDS:
        known = ", ".join(KINDS)
        raise InputError(f"{source}: target {quoted(manifest.target)} is unknown{nearest(manifest.target, KINDS)}; "
                         f"known: {known}")  # fmt: skip
    return KINDS[manifest.target]


def kind_for(folder: Path, options: Sequence[str] = ()) -> OutputKind:
    """Return how the output in a folder is checked; options that make sense for a C firmware alone are `InputError`."""
    manifest = read_output_manifest(folder)
    kind = kind_of(manifest, f"'{folder / MANIFEST_NAME}'")
    for flag in options:
        raise InputError(f"{flag} is for a C firmware, and '{folder}' is an output for {manifest.target}; leave it out")
    return kind


def verify_output(
    folder: Path,
    options: Sequence[str] = (),
    say: Say = lambda _: None,
    again: Regenerated | None = None,
    code: Path | None = None,
    forms: Mapping[str, Program] = MappingProxyType({}),
) -> OutputVerification:
    """Verify the folder of an output, made by `dzdesign codegen`.

    `options` are the flags that were given for a C firmware alone; any is an `InputError`, and so is a folder that is
    no output. `again` is the output as it is generated now; of a folder that differs nothing else is
    tried, and without it the folder is not compared. What is read, compiled and run is taken from `code`, by default
    the folder itself. `say` is told each stage before it begins. `forms` are the generator's evaluations of
    an output's texts, by the names of their files: functions of arrays of inputs.
    """
    kind, manifest = kind_for(folder, options), read_output_manifest(folder)
    compensator = read_compensator(folder)
    same = None if again is None else reproduced(folder, again)
    found: list[OutputChecks] = []
    if again is None or same is None or (again.files and same.holds is not False):
        room = getattr(import_module(kind.module), kind.checks or "checks")
        check: CheckOutput = partial(room, forms=forms) if kind.checks else room
        found.append(check(code or folder, manifest, compensator, say))
    digest = sha256_of((folder / MANIFEST_NAME).read_bytes())
    return OutputVerification(
        evidence=OutputEvidence(
            tool=THIS_TOOL,
            made_from=(SourceFile(source=f"{folder.name}/{MANIFEST_NAME}", sha256=digest),),
            target=manifest.target,
            settings=manifest.settings,
            origin=manifest.origin,
            checks=(*((same,) if same else ()), *(check for each in found for check in each.checks)),
            inputs=tuple(tried for each in found for tried in each.inputs),
            versions={tool: version for each in found for tool, version in each.versions.items()},
            not_covered=not_covered(compensator),
        )
    )


def output_evidence_files(verification: OutputVerification) -> dict[str, bytes]:
    """Return the files of the evidence folder."""
    return {OutputEvidence.FILE_NAME: to_json_bytes(verification.evidence)}
