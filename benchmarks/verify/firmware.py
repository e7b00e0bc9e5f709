"""The firmware that is verified: the bundled example, identified, designed and generated."""

from pathlib import Path

from example_valve import example_valve

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design


def example_firmware(folder: Path, target: str = "f28335") -> Compensator:
    """Write the example's firmware to `folder` and return what it was made from."""
    compensator = design(example_valve())
    firmware = generate(compensator, target)
    write_folder(folder, firmware.files, firmware.manifest)
    return compensator
