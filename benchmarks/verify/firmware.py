"""The firmware that is verified: the bundled example, identified, designed and generated."""

from pathlib import Path

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.example import example_folder
from dzdesign.identify.identification import identify
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.valve.model import ValveModel


def example_valve() -> ValveModel:
    """Return the bundled example, identified."""
    ramps = example_folder() / "ramps"
    return identify([read_ramp_file(ramp) for ramp in sorted(ramps.glob("*.csv.gz"))])


def example_firmware(folder: Path, target: str = "f28335") -> Compensator:
    """Write the example's firmware to `folder` and return what it was made from."""
    compensator = design(example_valve())
    firmware = generate(compensator, target, to_json_bytes(compensator))
    write_folder(folder, firmware.files, firmware.manifest)
    return compensator
