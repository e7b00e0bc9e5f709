"""The evidence in a folder, by the hash of what it is of: a manifest, or the octets of a calibration block."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from dzdesign.core.artefact_files import MANIFEST_NAME, parse_document, read_bytes, sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import Artefact, schema_of
from dzdesign.core.errors import InputError
from dzdesign.report.artefact_folder import LARGEST
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.exhaustive.block_check import BlockCheck
from dzdesign.verify.output_evidence import OutputEvidence
from dzdesign.verify.requirements import Check

#: What `verify` and `batch` leave of an output.
KINDS = (Evidence, OutputEvidence, BlockCheck)
#: Verdicts, from the one that counts before all others.
COUNTS_FIRST = (False, None, True)


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundEvidence:
    """What one file of evidence says."""

    #: SHA-256 of what it is of.
    of: str
    #: None if a requirement was not checked, and each of the others holds.
    holds: bool | None
    inputs: int
    place: str
    fault: str = ""


def evidence_in(folders: Iterable[Path], root: Path) -> tuple[dict[str, FoundEvidence], list[str]]:
    """Return the evidence in some folders by the hash of what it is of, and a sentence on each that was not used.

    Of two about the same bytes one that does not hold counts first, then one that was not checked throughout.
    """
    found: dict[str, FoundEvidence] = {}
    unused: list[str] = []
    for path in _files(folders):
        place = path.relative_to(root).as_posix()
        try:
            each = _read(path, place)
        except (InputError, OSError) as error:
            unused.append(f"{place} is not used: {error}")
            continue
        known = found.get(each.of)
        if known is None or COUNTS_FIRST.index(each.holds) < COUNTS_FIRST.index(known.holds):
            found[each.of] = each
    return found, unused


def _files(folders: Iterable[Path]) -> Iterator[Path]:
    for folder in folders:
        for kind in KINDS:
            path = folder / kind.FILE_NAME
            with suppress(OSError):
                if path.is_file() and path.stat().st_size <= LARGEST:
                    yield path


def _read(path: Path, place: str) -> FoundEvidence:
    content = path.read_bytes()
    evidence: Artefact = read_artefact(content, KINDS, place)
    _check_as_written(path, content)
    if isinstance(evidence, BlockCheck):
        fault = "" if evidence.holds else "an input is wrong, or the firmware refuses the block"
        count = sum(each.inputs for each in evidence.inputs)
        return FoundEvidence(of=evidence.block_sha256, holds=evidence.holds, inputs=count, place=place, fault=fault)
    if not evidence.made_from:
        raise InputError("'made_from' is empty, expected the manifest that it is of")
    if isinstance(evidence, Evidence):
        checks, holds = evidence.all_checks, evidence.holds
    elif isinstance(evidence, OutputEvidence):
        checks, holds = evidence.checks, evidence.holds
    else:
        raise InputError(f"it is {schema_of(type(evidence))}, which is no evidence")
    return FoundEvidence(
        of=evidence.made_from[0].sha256,
        holds=holds or (None if _only_open(checks) else False),
        inputs=sum(each.inputs for each in evidence.inputs),
        place=place,
        fault=_first_fault(checks),
    )


def _only_open(checks: Iterable[Check]) -> bool:
    """Tell whether nothing is against it but that something was not checked, such as without Octave."""
    verdicts = {check.holds for check in checks}
    return None in verdicts and False not in verdicts


def _first_fault(checks: Iterable[Check]) -> str:
    """Return the first requirement that does not hold; where each of them does or is open, the first open one."""
    missed = sorted((each for each in checks if not each.holds), key=lambda check: check.holds is None)
    return f"{missed[0].name}: {missed[0].text}" if missed else ""


def _check_as_written(path: Path, content: bytes) -> None:
    """Refuse evidence whose hash is not the one that the manifest beside it states; without a manifest none is refused.
    """
    beside = path.with_name(MANIFEST_NAME)
    if not beside.is_file():
        return
    schemas = (schema_of(Evidence), schema_of(OutputEvidence))
    with suppress(InputError):  # a manifest of something else
        files = parse_document(read_bytes(beside, "manifest"), str(beside), schemas).get("files")
        stated = files.get(path.name) if isinstance(files, dict) else None
        if stated not in (None, sha256_of(content)):
            raise ChangedEvidence(f"it was changed since `dzdesign verify` wrote it (SHA-256 {sha256_of(content)}, the "
                                  f"folder's manifest says {stated})")  # fmt: skip


class ChangedEvidence(OSError):
    """Evidence that is not as it was written."""
