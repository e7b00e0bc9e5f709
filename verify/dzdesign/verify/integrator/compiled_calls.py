"""The compiled core and the compiled current controller, called from Python sample by sample and period by period."""

import ctypes
from importlib.resources import files
from pathlib import Path

from dzdesign.verify.closed_loop.coil_in_loop import CoilAtSupply
from dzdesign.verify.current.state_check import tick_macro
from dzdesign.verify.toolchain.bound_block import core_sources
from dzdesign.verify.toolchain.host_compiler import load_library


def compiled_core(firmware: Path, coil: CoilAtSupply | None) -> ctypes.CDLL:
    """Return the core of a firmware folder, compiled, with the functions of programs/core_calls.c."""
    sources = core_sources(firmware)
    text = files(__package__).joinpath("programs").joinpath("core_calls.c").read_text(encoding="utf-8")
    options: tuple[str, ...] = ()
    if coil is not None:
        sources["tick.h"] = tick_macro(coil.around.loop)
        options = ("-DWITH_CURRENT",)
    return load_library({**sources, "core_calls.c": text}, "the core", options)


class CompiledDrive:
    """One drive on its way: the functions of dz_drive.h."""

    def __init__(self, library: ctypes.CDLL, sign: int) -> None:
        self._library, self._sign = library, sign
        self._memory = (ctypes.c_uint64 * (library.core_bytes() // 8 + 1))()
        self._shown = (ctypes.c_int32 * 4)()
        #: PWM periods from one sample to the next.
        self.periods_per_sample = int(library.core_periods_per_sample())
        #: What the law gave at the last tick.
        self.law = 0
        library.core_init(self._memory)

    def sample(self, codes: tuple[int, int, int]) -> None:
        """Give it new codes of command and sensors A and B."""
        self._library.core_sample(self._memory, *map(ctypes.c_uint16, codes))

    def tick(self, *, without_dither: bool) -> int:
        """Let a PWM period pass; return the compare value of the solenoid, or of the law without the dither."""
        self._library.core_tick(self._memory, self._shown)
        a, b, law, side = self._shown
        self.law = law
        if without_dither:
            return law if side == self._sign else 0
        return a if self._sign > 0 else b


class CompiledController:
    """One current controller on its way: the functions of dz_current.h."""

    def __init__(self, library: ctypes.CDLL, sum_of_no_current: int) -> None:
        self._library = library
        self._memory = (ctypes.c_uint64 * (library.controller_bytes() // 8 + 1))()
        library.controller_init(self._memory, ctypes.c_uint16(sum_of_no_current))

    def tick(self, set_point: int, total: int, supply_code: int) -> int:
        """Let its interrupt come; return the compare value of the next period."""
        given = map(ctypes.c_uint16, (set_point, total, supply_code))
        return int(self._library.controller_tick(self._memory, *given))
