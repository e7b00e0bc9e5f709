"""The goldens: what every target's files were from one small compensator.json, and how they are made anew."""

import difflib
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from dzdesign.codegen.project import generate, target_named, targets
from dzdesign.core.artefacts import to_json
from dzdesign.design.compensator import Compensator
from dzdesign.design.compensator_file import compensator_document, compensator_from_document
from dzdesign.design.designing import design
from dzdesign.identify.valve_file import valve_from_document

GOLDENS = Path(__file__).parent / "goldens"
#: Not compared: it is what goes in.
INPUT = "compensator.json"
LINES_SHOWN = 60


def golden_compensator(target_name: str) -> Compensator:
    """The fixed compensator, with the scalings of a target that has its own."""
    target = target_named(target_name)
    compensator = compensator_from_document((GOLDENS / INPUT).read_bytes(), INPUT)
    if target.takes_any_signals:
        return compensator
    return replace(
        compensator,
        signals=replace(compensator.signals, compare_max=target.compare_max),
        amplifier=replace(compensator.amplifier, compare_limit=target.compare_max),
    )


def golden_files(target_name: str) -> dict[str, str]:
    """Generate a target's files from the fixed compensator."""
    compensator = golden_compensator(target_name)
    files = dict(generate(compensator, target_name, to_json(compensator_document(compensator)).encode()).files)
    del files[INPUT]
    return files


def differences(folder: Path, files: Mapping[str, str]) -> str:
    """Return what a person wants to know about files that are not those of the folder; empty if they are."""
    kept = {path.relative_to(folder).as_posix(): path for path in sorted(folder.rglob("*")) if path.is_file()}
    said = [f"{folder.name}/{name}: no golden\n" for name in sorted(files.keys() - kept.keys())]
    said += [f"{folder.name}/{name}: a golden that is not generated\n" for name in sorted(kept.keys() - files.keys())]
    for name in sorted(files.keys() & kept.keys()):
        golden = kept[name].read_text(encoding="utf-8")
        label = f"{folder.name}/{name}"
        diff = difflib.unified_diff(
            golden.splitlines(True), files[name].splitlines(True), f"golden {label}", f"generated {label}"
        )
        said += list(diff)
    if len(said) > LINES_SHOWN:
        said = [*said[:LINES_SHOWN], f"... and {len(said) - LINES_SHOWN} lines more\n"]
    return "".join(said)


def update() -> None:
    """Design the compensator anew from goldens/valve.json, and write every target's files."""
    content = (GOLDENS / "valve.json").read_bytes()
    document = compensator_document(design(valve_from_document(content, "valve.json"), None, content))
    (GOLDENS / INPUT).write_text(to_json(document), encoding="utf-8", newline="\n")
    for folder in GOLDENS.iterdir():
        if folder.is_dir():
            shutil.rmtree(folder)
    for target in targets():
        for name, text in golden_files(target.name).items():
            path = GOLDENS / target.name / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8", newline="\n")
