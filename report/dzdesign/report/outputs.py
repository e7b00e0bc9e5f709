"""The outputs that were made of one compensator.json: their section, and what the verdict says of them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dzdesign.core.artefact_files import MANIFEST_NAME, read_bytes
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import schema_of
from dzdesign.core.documents import family_of
from dzdesign.core.errors import InputError, and_more
from dzdesign.core.folder_contents import board_of, digest_of, manifest_of
from dzdesign.core.verdicts import verdict_words
from dzdesign.design.firmware_manifest import FirmwareManifest, OutputManifest, setting_words
from dzdesign.report.artefacts import Chain
from dzdesign.report.cells import Cell, counted, table_of, verdict, whole
from dzdesign.report.page import Headline, MadeOutput, MadeOutputs, Section
from dzdesign.verify.evidence import Evidence, OutputEvidence

FIRMWARE, OUTPUT = (family_of(schema_of(kind)) for kind in (FirmwareManifest, OutputManifest))
MANIFESTS: tuple[type[FirmwareManifest | OutputManifest], ...] = (FirmwareManifest, OutputManifest)
EVIDENCE: tuple[type[Evidence | OutputEvidence], ...] = (Evidence, OutputEvidence)
#: Verdicts, from the one that counts before all others.
COUNTS_FIRST = (False, None, True)
#: Folders that are looked into, and files that a sentence names.
MOST, NAMED = 500, 5


def outputs_in(root: Path, compensator_json: str) -> MadeOutputs:
    """Return the outputs in the folders of a valve that were made of this compensator.json, with their evidence.

    What can't be read, and what is of another compensator, is a sentence.
    """
    listed: list[MadeOutput] = []
    others: list[str] = []
    folders = sorted(each for each in root.iterdir() if each.is_dir() and not each.name.startswith("."))[:MOST]
    for folder in folders:
        path, header = folder / MANIFEST_NAME, manifest_of(folder)
        if header is None or family_of(header["schema"]) not in (FIRMWARE, OUTPUT):
            continue
        try:
            manifest = read_artefact(read_bytes(path, "manifest"), MANIFESTS, f"{folder.name}/{path.name}")
            output = _with_evidence(_output(folder, manifest), folders)
        except InputError as error:
            others.append(f"'{folder.name}' is not listed: {error}")
            continue
        if manifest.origin.compensator_json == compensator_json:
            listed.append(output)
        else:
            what = f"{output.place} ({output.kind}) was made from another compensator.json"
            others.append(f"{what}, of SHA-256 {manifest.origin.compensator_json}: not listed")
    return MadeOutputs(listed=tuple(listed), others=tuple(others))


def _output(folder: Path, manifest: FirmwareManifest | OutputManifest) -> MadeOutput:
    if isinstance(manifest, FirmwareManifest):
        form = "numbers in a calibration block" if manifest.calibration == "block" else "numbers fixed in the core"
        kind, settings = "C firmware", f"{manifest.target}, {form}"
    else:
        kind, settings = manifest.target, ", ".join(setting_words(manifest.settings))
    digest, changed = digest_of(folder / MANIFEST_NAME), change_in(folder)
    return MadeOutput(kind=kind, settings=settings, place=f"{folder.name}/", sha256=digest, changed=changed)


def change_in(folder: Path) -> str:
    """Return what is not as `codegen` wrote it in the folder of a firmware or another output; empty if nothing is.

    What is the user's to fill in is left out.
    """
    manifest = manifest_of(folder)
    if manifest is None:
        return f"{MANIFEST_NAME} is missing"
    files, board = manifest["files"], board_of(manifest)
    if family_of(manifest["schema"]) == OUTPUT:
        there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
        if added := sorted(there - files.keys() - {MANIFEST_NAME}):
            return f"the manifest does not name {and_more(added, NAMED)}; keep files of your own outside"
    changed = [name for name, digest in files.items() if name not in board and not _is(folder / name, digest)]
    return f"changed or missing: {and_more(changed, NAMED)}" if changed else ""


def _is(path: Path, digest: str) -> bool:
    return path.is_file() and digest_of(path) == digest


def _with_evidence(output: MadeOutput, places: Sequence[Path]) -> MadeOutput:
    """Return an output with what evidence of its manifest says; of two pieces of evidence what is worse counts."""
    said: list[MadeOutput] = []
    for path in (place / kind.FILE_NAME for place in places for kind in EVIDENCE):
        if not path.is_file() or output.sha256.encode() not in path.read_bytes():  # as evidence states what it is of
            continue
        name, manifest = f"{path.parent.name}/{path.name}", manifest_of(path.parent)
        if manifest and not _is(path, manifest["files"].get(path.name, "")):
            raise InputError(f"'{name}' was changed since `dzdesign verify` wrote it; run that again")
        evidence: Evidence | OutputEvidence = read_artefact(read_bytes(path, "evidence"), EVIDENCE, name)
        checks = evidence.checks
        worst = min(checks, key=lambda check: COUNTS_FIRST.index(check.holds))
        inputs = sum(each.inputs for each in evidence.inputs)
        fault = "" if worst.holds else f"{worst.name}: {worst.text}"
        said.append(replace(output, holds=worst.holds, inputs=inputs, evidence=name, fault=fault))
    return min(said, key=lambda one: COUNTS_FIRST.index(one.holds), default=output)


# --- on the page ------------------------------------------------------------------------------------------------------


def outputs_sections(chain: Chain, made: MadeOutputs) -> dict[str, Section]:
    """Return the section by its anchor; none where the firmware that the report is of is all there is."""
    if not (_beside_firmware(made, chain) or made.others):
        return {}
    table = None
    if made.listed:
        table = table_of(
            "Every output made of this compensator.json, with the SHA-256 of its manifest",
            made.listed,
            ("output", lambda each: Cell(text=each.kind, more=each.settings)),
            ("folder", lambda each: each.place),
            ("SHA-256", lambda each: Cell(text=each.sha256, kind="hash")),
            ("check", _check),
        )
    return {"outputs": Section(tables=(table,), groups=(("Not listed here", made.others),))}


def _beside_firmware(made: MadeOutputs, chain: Chain) -> list[MadeOutput]:
    """Return the outputs other than the firmware that the report is of, on which its verdict speaks already."""
    firmware = chain.places.get("firmware")
    return [each for each in made.listed if firmware is None or each.sha256 != firmware.sha256]


def _check(output: MadeOutput) -> Cell:
    if output.changed:
        return Cell(text="✗ CHANGED", kind="bad", more=output.changed)
    if output.holds is None and not output.evidence:
        return Cell(text="? NOT VERIFIED", kind="open")
    tried = f"{whole(output.inputs)} {'input' if output.inputs == 1 else 'inputs'} tried"
    more = "; ".join(filter(None, [output.fault, tried, output.evidence]))
    return replace(verdict(output.holds), more=more)


def with_outputs(headline: Headline, made: MadeOutputs, chain: Chain) -> Headline:
    """Return the verdict of a report, which speaks of a C firmware, with what is to be said of the outputs.

    It is not good if one of them is wrong, or was not verified; each is named. Where there is no C firmware and no
    evidence of one, the verdict is of the outputs.
    """
    others = _beside_firmware(made, chain)
    if wrong := [each for each in others if each.is_wrong]:
        text = headline.text
        if headline.kind != "bad":
            names = ", ".join(each.place for each in wrong)
            text = f"{counted(len(wrong), 'output')} NOT to be used: {names}. {text}"
        return replace(headline, kind="bad", text=text, reasons=(*headline.reasons, *map(_reason, wrong)))
    untried = [each for each in others if each.holds is None]
    reasons = tuple(_reason(each) for each in untried if each.fault)
    if made.listed and not (chain.firmware or chain.evidence):
        held = ", ".join(each.place for each in made.listed if each.holds)
        if not untried:
            return replace(headline, kind="good", text=f"Every requirement holds of {held}; no C firmware is here")
        text = _named(untried) + (f"; every requirement holds of {held}" if held else "")
        return replace(headline, kind="open", text=text, reasons=reasons)
    if headline.kind != "good" or not untried:
        return headline
    return replace(headline, kind="open", text=f"{_named(untried)}. {headline.text}", reasons=reasons)


def _reason(output: MadeOutput) -> str:
    return f"{output.verdict}: {output.place} ({output.kind}): {output.changed or output.fault}"


def _named(untried: Sequence[MadeOutput]) -> str:
    """Return the outputs by their verdict, those without evidence first."""
    by_verdict = {verdict: [each.place for each in untried if each.verdict == verdict]
                  for verdict in ("NOT VERIFIED", verdict_words(None))}  # fmt: skip
    return "; ".join(f"{verdict}: {', '.join(places)}" for verdict, places in by_verdict.items() if places)
