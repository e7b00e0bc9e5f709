"""The generated core, compiled for the host as a black box."""

import ctypes
from importlib.resources import files
from pathlib import Path

import numpy as np

from dzdesign.core.artefacts import sha256_of
from dzdesign.verify.host_compiler import load_library

#: Source and function of each sign of command; the status word stands with the first.
SOURCES = {1: ("dz_comp.c", "dz_comp"), -1: ("dz_comp_negative.c", "dz_comp_negative")}


class CompiledCore:
    """One side of the core.

    Parameters
    ----------
    folder : Path
        Firmware folder with ``core/dz_comp.c`` and ``core/dz_comp.h``.
    sign : {1, -1}
        Sign of the command.
    """

    def __init__(self, folder: Path, sign: int = 1) -> None:
        source, function = SOURCES[sign]
        # Whatever was edited in is compiled as it stands: a comment in another encoding is no reason to stop.
        core = {
            name: (folder / "core" / name).read_text(encoding="utf-8", errors="surrogateescape")
            for name in (source, "dz_comp.h")
        }
        driver = files("dzdesign.verify").joinpath("fill_inputs.c").read_text(encoding="utf-8")
        defines = f"#define DZ_CORE {function}\n" + ("#define DZ_STATUS\n" if sign > 0 else "")
        self._library = load_library({**core, "fill_inputs.c": defines + driver}, f"the core {source}")
        self._library.dz_count_odd_pairs.restype = ctypes.c_int64
        self.sha256 = sha256_of("".join(core.values()).encode(errors="surrogateescape"))

    def row(self, command: int, p_a: np.ndarray, p_b: np.ndarray) -> np.ndarray:
        """Return the compare values of one command code at pairs of pressure codes."""
        out = np.empty(len(p_a), dtype=np.uint16)
        a, b = (np.ascontiguousarray(p, dtype=np.uint16) for p in (p_a, p_b))
        self._library.dz_fill_row(ctypes.c_uint16(command), len(a), _pointer(a), _pointer(b), _pointer(out))
        return out

    def column(self, p_a: int, p_b: int, commands: int) -> np.ndarray:
        """Return the compare values at one pair of pressure codes for commands 0, 1, ..."""
        out = np.empty(commands, dtype=np.uint16)
        self._library.dz_fill_column(ctypes.c_uint16(p_a), ctypes.c_uint16(p_b), commands, _pointer(out))
        return out

    def odd_pairs(self, command: int, code_max: int, place: np.ndarray, value: np.ndarray) -> int:
        """Return how many of all pairs of pressure codes give another value than `value` has at their place."""
        place, value = np.ascontiguousarray(place, dtype=np.int32), np.ascontiguousarray(value, dtype=np.uint16)
        return self._library.dz_count_odd_pairs(ctypes.c_uint16(command), code_max, _pointer(place), _pointer(value))

    def status(self, command: np.ndarray, p_a: np.ndarray, p_b: np.ndarray) -> np.ndarray:
        """Return the status words at triples of codes; of the positive side only."""
        out = np.empty(len(command), dtype=np.uint16)
        inputs = [np.ascontiguousarray(codes, dtype=np.uint16) for codes in (command, p_a, p_b)]
        self._library.dz_fill_status(len(out), *map(_pointer, inputs), _pointer(out))
        return out


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)
