"""Designs from the words of an engineer, and their firmware on disk, as `dzdesign design` and `codegen` make them."""

from collections.abc import Callable
from pathlib import Path

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_files import write_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions, options_of
from dzdesign.identify.valve.model import ValveModel

BOTH_SIGNS = "-10..10 V x 0.15 + 1.5 V"
#: Three ways to declare a machine; a controlled current with its supply measured.
CURRENT = {
    "drive": "current",
    "coil": "3.5 ohm 40 mH",
    "rated_current": "1 A",
    "supply": "18..32 V",
    "current_signal": "0..1.2 A on 2 ohm + 0.15 V",
}
MEASURED = CURRENT | {"supply_signal": "0..36 V x 0.075"}
MACHINES = {
    "duty": {"coil_temperature": "-20..80 degC", "supply": "18..32 V"},
    "amplifier": {"amplifier": "1 %"},
    "current": CURRENT,
}


def options(target: str = "f28335", **texts: str) -> DesignOptions:
    """Return the options that texts are for a target."""
    return options_of(texts, target_named(target).inputs())


def designed(valve: ValveModel, target: str = "f28335", **texts: str) -> Compensator:
    """Design a valve's compensator."""
    return design(valve, options(target, **texts))


def written(
    compensator: Compensator, folder: Path, target: str = "f28335", edit: Callable[[str], str] = str, of: str = ""
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
