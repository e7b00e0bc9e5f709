"""`BuiltFor`: what a firmware is compiled for; of block form every block that it takes must be of the same."""

from dataclasses import dataclass

from dzdesign.codegen.calibration.layout import BLOCK_SIZES, SHAPE_BITS, Sizes
from dzdesign.design.compensator import Compensator


@dataclass(frozen=True, slots=True, kw_only=True)
class BuiltFor:
    """Wiring, outputs, converter and rates: with the target all that the C of the core depends on, but for numbers."""

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
    #: Those of a block, unless the numbers of a valve stand in the firmware.
    sizes: Sizes = BLOCK_SIZES
    #: Whether the numbers of a valve stand in the firmware, `struct dz_calibration` without what only a block has.
    fixed: bool = False

    def has(self, name: str) -> bool:
        """Tell whether the shape has a bit of `SHAPE_BITS`."""
        return bool(self.shape >> list(SHAPE_BITS).index(name) & 1)


def built_for(compensator: Compensator, *, fixed: bool = False) -> BuiltFor:
    """Return what the firmware of a compensator's block is compiled for, or the one with its numbers in it."""
    signals, drive = compensator.signals, compensator.current_drive
    return BuiltFor(
        shape=shape_of(compensator),
        code_max=signals.code_max,
        compare_max=signals.compare_max,
        sample_Hz=signals.sample_Hz,
        tick_Hz=signals.tick_Hz,
        beta_step=compensator.beta_step_codes,
        samples=drive.loop.samples if drive else 0,
        sizes=sizes_for(compensator) if fixed else BLOCK_SIZES,
        fixed=fixed,
    )


def sizes_for(compensator: Compensator) -> Sizes:
    """Return the arrays that the numbers of a compensator take."""
    functions, drive, signs = compensator.drive_functions, compensator.current_drive, compensator.signals.signs
    play = max(len(functions.play_counts[place]) for place in range(len(signs))) if functions.has_play else 0
    supply = len(drive.loop.supply.nodes) if drive and drive.loop.supply else 0
    return Sizes(
        sides=len(signs),
        # The fallback stands at the mask, behind every node of the table.
        node_mask=_all_ones(max(len(compensator.side(sign).beta) for sign in signs)),
        play_mask=_all_ones(play - 2),
        supply_mask=_all_ones(supply - 2),
    )


def _all_ones(least: int) -> int:
    """Return the smallest mask, all ones, that is no less; 0 of a negative number."""
    return (1 << max(least, 0).bit_length()) - 1


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
