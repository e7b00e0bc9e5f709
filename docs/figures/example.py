"""The bundled example through the product, once for all figures."""

import tempfile
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path

import numpy as np

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions
from dzdesign.example import example_folder
from dzdesign.identify.identification import identify_sides
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.side import Identification
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.verify.closed_loop.loop import ClosedLoop, LoopRun, RampSequence
from dzdesign.verify.closed_loop.plant import Plant, read_plant

#: Shorter than a bench's, so that all figures are drawn in seconds; the simulated meter has no lag.
RAMP = RampSequence(rest=1.0, ramp=20.0, top=1.0)


@dataclass(frozen=True)
class Example:
    """The identified valve, its plant, and the compensators designed for it."""

    found: Identification
    plant: Plant

    @property
    def side(self) -> SideModel:
        """The side of positive commands."""
        return self.found.model.positive

    @cached_property
    def compensator(self) -> Compensator:
        """The default design."""
        return design(self.found.model)

    @cached_property
    def without_transition(self) -> Compensator:
        """The same with neither zero band nor transition."""
        return design(self.found.model, DesignOptions(transition=Fraction(0)))

    @cached_property
    def loop(self) -> ClosedLoop:
        """The plant driven by the generated C."""
        firmware = generate(self.compensator, "host")
        with tempfile.TemporaryDirectory(prefix="dzdesign-") as scratch:
            folder = Path(scratch) / "firmware"
            write_folder(folder, firmware.files, firmware.manifest)
            return ClosedLoop(self.plant, folder, self.compensator)

    def ramp(self, dp_MPa: float, mode: str) -> LoopRun:
        """Return a ramp up and down; without beta the core is shown the reference pressure."""
        return self.loop.run(RAMP.command(), dp_MPa, mode, dp_frozen_MPa=self.side.reference.dp_MPa)

    def offset_V(self, dp_MPa: np.ndarray) -> np.ndarray:
        """Return the drive at zero command over the pressure drop, with its beta as the integers have it."""
        codes = [int(self.compensator.signals.pair(1).dp_code(Fraction(float(each)))) for each in dp_MPa]
        return np.array([float(self.compensator.drive(0, code)) for code in codes]) * self.found.model.u_max_V


def read_example() -> Example:
    """Identify the bundled example."""
    folder = example_folder()
    tests = [read_ramp_file(path) for path in sorted((folder / "ramps").glob("*.csv.gz"))]
    return Example(found=identify_sides(tests), plant=read_plant(folder / "plant.toml"))
