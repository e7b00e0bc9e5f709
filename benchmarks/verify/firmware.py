"""The firmware that is verified: the bundled example, identified, designed and generated."""

from importlib.resources import files
from pathlib import Path

from dzdesign.codegen.project import generate
from dzdesign.core.artefacts import to_json, write_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.compensator_file import compensator_document
from dzdesign.design.designing import design
from dzdesign.identify.identification import identify
from dzdesign.identify.ramp_files import read_ramp_file


def example_firmware(folder: Path, target: str = "f28335") -> Compensator:
    """Write the example's firmware to `folder` and return what it was made from."""
    ramps = Path(str(files("dzdesign.example"))) / "ramps"
    compensator = design(identify([read_ramp_file(ramp) for ramp in sorted(ramps.glob("*.csv.gz"))]))
    firmware = generate(compensator, target, to_json(compensator_document(compensator)).encode())
    write_folder(folder, firmware.files, firmware.manifest)
    return compensator
