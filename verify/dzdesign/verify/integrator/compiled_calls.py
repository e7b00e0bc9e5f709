"""The compiled core and the compiled current controller, called from Python sample by sample and period by period."""

from importlib.resources import files
from pathlib import Path

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.verify.closed_loop.coil_in_loop import CoilAtSupply
from dzdesign.verify.current.state_check import tick_macro
from dzdesign.verify.toolchain.bound_block import core_sources
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function

#: Of programs/core_calls.c, and those that only a drive by current has.
OF_DRIVE = (
    Function("core_bytes", (), "uint32_t"),
    Function("core_periods_per_sample", (), "uint32_t"),
    Function("core_init", ("both",)),
    Function("core_samples", ("both", "in", "uint32_t", "out")),
)
OF_CONTROLLER = (
    Function("controller_bytes", (), "uint32_t"),
    Function("controller_init", ("both", "uint16_t")),
    Function("controller_tick", ("both", "uint16_t", "uint16_t", "uint16_t"), "uint32_t"),
)
#: Most octets that a state of theirs can have, and most ticks from a sample to the next: designs have far fewer.
MOST_OCTETS, MOST_TICKS = 2**16, 2**16


def compiled_core(firmware: Path, coil: CoilAtSupply | None) -> CompiledLibrary:
    """Return the core of a firmware folder, compiled, with the functions of programs/core_calls.c."""
    sources = core_sources(firmware)
    text = files(__package__).joinpath("programs").joinpath("core_calls.c").read_text(encoding="utf-8")
    options: tuple[str, ...] = ()
    functions: tuple[Function, ...] = OF_DRIVE
    if coil is not None:
        sources["tick.h"] = tick_macro(coil.around.loop)
        options, functions = ("-DWITH_CURRENT",), (*OF_DRIVE, *OF_CONTROLLER)
    return CompiledLibrary({**sources, "core_calls.c": text}, functions, "the core", options)


class CompiledDrive:
    """One drive on its way: the functions of dz_drive.h."""

    def __init__(self, library: CompiledLibrary, sign: int) -> None:
        self._library, self._sign = library, sign
        self._memory = _memory(library, "core_bytes")
        #: PWM periods from one sample to the next.
        self.periods_per_sample = _counted(library, "core_periods_per_sample", MOST_TICKS)
        library.call("core_init", self._memory)

    def samples(self, codes: np.ndarray) -> np.ndarray:
        """Give it codes of command and sensors A and B, (N, 3), with the ticks of each sample behind them.

        For every tick: compare values of solenoids A and B, that of the law, and the side, (N * periods_per_sample, 4).
        """
        shown = np.zeros((len(codes) * self.periods_per_sample, 4), dtype=np.int32)
        given = np.ascontiguousarray(codes, dtype=np.uint16)
        self._library.call("core_samples", self._memory, given, len(given), shown)
        return shown

    def compare_values(self, codes: np.ndarray, *, without_dither: bool) -> list[int]:
        """Do the same; return the compare value of the solenoid, or of the law without the dither, for every tick."""
        a, b, law, side = self.samples(codes).T
        of_side = a if self._sign > 0 else b
        values: list[int] = (np.where(side == self._sign, law, 0) if without_dither else of_side).tolist()
        return values


class CompiledController:
    """One current controller on its way: the functions of dz_current.h."""

    def __init__(self, library: CompiledLibrary, sum_of_no_current: int) -> None:
        self._library = library
        self._memory = _memory(library, "controller_bytes")
        library.call("controller_init", self._memory, sum_of_no_current)

    def tick(self, set_point: int, total: int, supply_code: int) -> int:
        """Let its interrupt come; return the compare value of the next period."""
        return self._library.call("controller_tick", self._memory, set_point, total, supply_code)


def _memory(library: CompiledLibrary, name: str) -> np.ndarray:
    """Return room for a state, whose size one of the functions tells."""
    return np.zeros(_counted(library, name, MOST_OCTETS), dtype=np.uint8)


def _counted(library: CompiledLibrary, name: str, most: int) -> int:
    """Return a size that the code itself tells; one that no code has is an error, before it is anything's size."""
    count = library.call(name)
    if not 0 < count <= most:
        raise RequirementError(f"the core: {name}() returned {count}, expected 1 to {most}")
    return count
