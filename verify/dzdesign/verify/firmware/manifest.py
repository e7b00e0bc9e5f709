"""The firmware's manifest against the firmware: the law, the target, and where all is from."""

import re
from collections.abc import Iterator
from pathlib import Path

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.artefact_types import SourceFile
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.verify.requirements import MANIFEST, Check

BANNER = re.compile(r"Compensator SHA-256: (\w+)")
#: In the target's folder: the calibration block as C.
BLOCK_SOURCE = "dz_block.c"


def manifest_follows(folder: Path, manifest: FirmwareManifest, compensator: Compensator) -> Check:
    """Tell whether the manifest says what is in the folder; its words on a constant are not read."""
    faults = [*_faults_of_origin(folder, manifest, compensator)]
    if faults:
        more = f", and {len(faults) - 1} more" if len(faults) > 1 else ""
        return MANIFEST.check(holds=False, text=f"{faults[0]}{more}; make the firmware again with `dzdesign codegen`")
    text = "law, target and hashes agree with it"
    if compensator.target and compensator.target.name != manifest.target:  # both may count alike
        text += f"; the compensator was designed for {compensator.target.name}, this is for {manifest.target}"
    return MANIFEST.check(holds=True, text=text)


def _faults_of_origin(folder: Path, manifest: FirmwareManifest, compensator: Compensator) -> Iterator[str]:
    """Yield what the manifest says of the compensator and the valve, and is otherwise."""
    digest = sha256_of((folder / "compensator.json").read_bytes())
    if manifest.law != compensator.law:
        yield f"the manifest's law is {manifest.law}, the compensator's {compensator.law}"
    targets = {name.partition("/")[0].replace("_", "-") for name in manifest.files if "/" in name} - {"core"}
    if targets != {manifest.target}:
        there = " and ".join(sorted(targets)) or "no target"
        yield f"the manifest's target is {manifest.target}, but the files are those of {there}"
    for key, stated, value in (
        ("made_from", manifest.made_from, (SourceFile(source="compensator.json", sha256=digest),)),
        ("origin.compensator_json", manifest.origin.compensator_json, digest),
        ("origin.valve_json", manifest.origin.valve_json, compensator.valve_json_sha256),
        ("origin.ramp_tests", manifest.origin.ramp_tests, compensator.valve.made_from),
    ):
        if stated != value:
            yield f"the manifest's {key} is not that of compensator.json"
    # The core in block form is the same for every valve: the file with its block names the compensator.
    block = [name for name in manifest.files if name.endswith(f"/{BLOCK_SOURCE}")]
    for name in block if manifest.calibration == "block" else manifest.core:
        written = BANNER.search(_text(folder / name))
        if written is None or written[1] != digest:
            yield f"{name} does not name this compensator.json in its first lines"


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
