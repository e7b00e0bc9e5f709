"""A valve's firmware on disk, as `dzdesign design` and `codegen` make it, for what is compiled and run from there."""

from collections.abc import Callable
from pathlib import Path

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_files import write_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import options_of

TARGET = "f28335"


def designed(valve, target: str = TARGET, **texts: str) -> Compensator:
    """The compensator of a valve with these options."""
    return design(valve, options_of(texts, target_named(target).inputs()))


def written(
    compensator: Compensator, folder: Path, target: str = TARGET, edit: Callable[[str], str] = str, of: str = ""
) -> Path:
    """The folder of its firmware, in which one file may be edited."""
    made = generate(compensator, target)
    files = {**made.files, of: edit(made.files[of])} if of else made.files
    write_folder(folder, files, made.manifest)
    return folder


def replaced(*pairs: tuple[str, str]) -> Callable[[str], str]:
    """An edit that replaces texts, each of which stands once."""

    def edit(text: str) -> str:
        for right, wrong in pairs:
            assert text.count(right) == 1, right
            text = text.replace(right, wrong)
        return text

    return edit
