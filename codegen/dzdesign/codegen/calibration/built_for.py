"""`BuiltFor`: what a firmware of block form is compiled for, and every block that it takes must be of."""

from dataclasses import dataclass

from dzdesign.codegen.calibration.layout import SHAPE_BITS
from dzdesign.design.compensator import Compensator


@dataclass(frozen=True, slots=True, kw_only=True)
class BuiltFor:
    """Wiring, outputs, converter and rates: with the target all that the C of such a firmware depends on."""

    #: Bits of `SHAPE_BITS`.
    shape: int
    code_max: int
    compare_max: int
    sample_Hz: int
    tick_Hz: int
    #: Codes between two nodes of beta, a power of two.
    beta_step: int
    #: Codes of the current in a sum; 0 without current control.
    samples: int

    def has(self, name: str) -> bool:
        """Tell whether the shape has a bit of `SHAPE_BITS`."""
        return bool(self.shape >> list(SHAPE_BITS).index(name) & 1)


def built_for(compensator: Compensator) -> BuiltFor:
    """Return what the firmware of a compensator's block is compiled for."""
    signals, drive = compensator.signals, compensator.current_drive
    return BuiltFor(
        shape=shape_of(compensator),
        code_max=signals.code_max,
        compare_max=signals.compare_max,
        sample_Hz=signals.sample_Hz,
        tick_Hz=signals.tick_Hz,
        beta_step=compensator.beta_step_codes,
        samples=drive.loop.samples if drive else 0,
    )


def shape_of(compensator: Compensator) -> int:
    """Return what a compensator's firmware must be compiled for, the bits of `SHAPE_BITS`."""
    drive = compensator.current_drive
    holds = {
        "BIPOLAR": compensator.negative is not None,
        "FALLING": compensator.signals.command.direction(1) < 0,
        "SWAPPED": compensator.signals.swapped and compensator.negative is not None,
        "CURRENT": drive is not None,
        "SUPPLY": drive is not None and drive.loop.supply is not None,
    }
    return sum(holds[name] << place for place, name in enumerate(SHAPE_BITS))
