"""Every input of the compiled core against the exactly rounded law, and the properties that make it safe."""

import ctypes
import json
from dataclasses import dataclass
from fractions import Fraction
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from dzdesign.core.artefacts import sha256_of
from dzdesign.core.errors import InputError
from dzdesign.verify.host_compiler import load_library
from dzdesign.verify.reference import ExactLaw

#: Commands at which all pairs of pressure codes are tried, beside the two pairs a difference that all commands get.
CUBE_COMMANDS = (0, 0.5, 1)
#: Codes beyond the converter's range: just outside, and the largest that 16 bits hold.
OUTSIDE = 65535


@dataclass(frozen=True, slots=True, kw_only=True)
class InputCheck:
    """What checking every input found; every count but `inputs` must be zero.

    Attributes
    ----------
    inputs : int
        Pairs of command code and difference of pressure codes, each compared with the exact law.
    wrong : int
        Pairs whose compare value is not the exactly rounded law.
    largest_error : int
        Largest difference in counts.
    out_of_range, not_monotone_in_u, not_monotone_in_dp : int
        Compare values above the range; falls with rising command; steps in dP against the law's own direction.
    over_compensated : int
        Pressure codes of the tested interval whose zero-command drive lies above the threshold's lower bound.
    odd_pairs : int
        Pairs of pressure codes that give another value than their difference does.
    bad_fallbacks : int
        Impossible codes that do not fall back to the safe value.
    smallest_margin_V : float
        Smallest distance from the zero-command drive to the threshold's lower bound; negative if it is exceeded.
    core_sha256 : str
        Hash of the C that was compiled.
    first_wrong : str or None
        The first failure, in words.
    """

    inputs: int
    wrong: int
    largest_error: int
    out_of_range: int
    not_monotone_in_u: int
    not_monotone_in_dp: int
    over_compensated: int
    odd_pairs: int
    bad_fallbacks: int
    smallest_margin_V: float
    core_sha256: str
    first_wrong: str | None

    @property
    def holds(self) -> bool:
        """True if nothing was found."""
        return not any(
            (
                self.wrong,
                self.out_of_range,
                self.not_monotone_in_u,
                self.not_monotone_in_dp,
                self.over_compensated,
                self.odd_pairs,
                self.bad_fallbacks,
            )
        )


class CompiledCore:
    """The generated core, compiled for the host as a black box.

    Parameters
    ----------
    folder : Path
        Firmware folder with ``core/dz_comp.c`` and ``core/dz_comp.h``.
    pressure_max : int
        Largest pressure code.
    """

    def __init__(self, folder: Path, pressure_max: int) -> None:
        # Whatever was edited in is compiled as it stands: a comment in another encoding is no reason to stop.
        core = {
            name: (folder / "core" / name).read_text(encoding="utf-8", errors="surrogateescape")
            for name in ("dz_comp.c", "dz_comp.h")
        }
        driver = files("dzdesign.verify").joinpath("fill_inputs.c").read_text(encoding="utf-8")
        self._library = load_library({**core, "fill_inputs.c": driver}, "the core dz_comp.c")
        self._library.dz_count_odd_pairs.restype = ctypes.c_int64
        self.pressure_max = pressure_max
        self.sha256 = sha256_of("".join(core.values()).encode(errors="surrogateescape"))

    def row(self, command: int, *, high: bool) -> np.ndarray:
        """Return the compare values at one command for all differences of pressure codes, lowest first."""
        out = np.empty(2 * self.pressure_max + 1, dtype=np.uint16)
        self._library.dz_fill_row(ctypes.c_uint16(command), self.pressure_max, int(high), _pointer(out))
        return out

    def column(self, p_a: int, p_b: int, commands: int) -> np.ndarray:
        """Return the compare values at one pair of pressure codes for commands 0, 1, ..."""
        out = np.empty(commands, dtype=np.uint16)
        self._library.dz_fill_column(ctypes.c_uint16(p_a), ctypes.c_uint16(p_b), commands, _pointer(out))
        return out

    def odd_pairs(self, command: int, row: np.ndarray) -> int:
        """Return how many of all pairs of pressure codes give another value than `row` has for their difference."""
        row = np.ascontiguousarray(row, dtype=np.uint16)
        return self._library.dz_count_odd_pairs(ctypes.c_uint16(command), self.pressure_max, _pointer(row))


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


def check_all_inputs(folder: Path) -> InputCheck:
    """Compare the compiled core with the exact law on every pair of command code and pressure-difference code.

    The core has three inputs, 2^36 triples; it may depend on the two pressures by their difference only. That is itself
    checked: every pair (command, difference) is tried with the lowest and with the highest pair of pressures that has
    the difference, and at `CUBE_COMMANDS` all pairs of pressures are.

    Parameters
    ----------
    folder : Path
        Firmware folder: ``core/`` and ``compensator.json``.
    """
    document = json.loads((folder / "compensator.json").read_bytes())
    exact = ExactLaw(document)
    core = CompiledCore(folder, exact.pressure_max)
    differences = range(-exact.pressure_max, exact.pressure_max + 1)
    betas = [exact.beta(code) for code in differences]
    zero = exact.pressure_max  # position of difference 0 in a row
    without, whole = exact.line(Fraction(0)), exact.line(Fraction(1))
    beta_rises = np.sign([float(right - left) for left, right in zip(betas[zero:], betas[zero + 1 :], strict=False)])
    wrong = largest = out_of_range = falls = against = odd = 0
    first = None
    previous = None
    cube = {round(share * exact.command_max) for share in CUBE_COMMANDS}
    for command, expected in enumerate(exact.rows(betas)):
        low, high = (core.row(command, high=side).astype(np.int64) for side in (False, True))
        error = np.abs(low - expected)
        wrong += int(np.count_nonzero(error))
        largest = max(largest, int(error.max()))
        if first is None and error.any():
            place = int(np.flatnonzero(error)[0])
            first = (
                f"command code {command}, pressure-difference code {differences[place]}: "
                f"compare value {low[place]}, expected {expected[place]}"
            )
        out_of_range += int(np.count_nonzero(low > exact.compare_max))
        odd += int(np.count_nonzero(low != high))
        if command in cube:
            odd += core.odd_pairs(command, low)
        if previous is not None:
            falls += int(np.count_nonzero(low < previous))
        # The law is affine in beta: what it gains from beta = 0 to 1 tells which way it runs with dP (Eq. 18).
        gained = float((whole.slope - without.slope) * command + whole.start - without.start)
        against += int(np.count_nonzero(np.diff(low[zero:]) * beta_rises * np.sign(gained) < 0))
        previous = low
    margins = _margins(document, core.row(0, high=False)[zero:].astype(int))
    return InputCheck(
        inputs=len(betas) * (exact.command_max + 1),
        wrong=wrong,
        largest_error=largest,
        out_of_range=out_of_range,
        not_monotone_in_u=falls,
        not_monotone_in_dp=against,
        over_compensated=sum(margin < 0 for margin in margins),
        odd_pairs=odd,
        bad_fallbacks=_bad_fallbacks(core, exact),
        smallest_margin_V=float(min(margins)),
        core_sha256=core.sha256,
        first_wrong=first,
    )


def _margins(document: dict[str, Any], zero_command: np.ndarray) -> list[Fraction]:
    """Return, per pressure code of the tested interval, the threshold's lower bound less the zero-command drive, in V.

    The bound is argued from the ramp tests anew: by monotonicity a threshold that falls with dP is at least the bound
    of any test at a higher dP, one that rises at least that of any test at a lower dP, and of a flat one only the
    lowest bound is known. A code stands for pressures within one code of it.
    """
    side = document["valve"]["sides"]["positive"]
    signals = document["signals"]
    code_MPa = Fraction(*signals["pressure_span_MPa"]) / signals["pressure_code_max"]
    bounds = _bounds_of(side, document["certificate"]["guard"])
    tests = [
        (Fraction(repr(test["dp_MPa"])), Fraction(repr(bound)))
        for test, bound in zip(side["tests"], bounds, strict=True)
    ]
    first, last = min(tests)[0], max(tests)[0]
    u_max = Fraction(*document["u_max_V"])
    margins = []
    for code, compare in enumerate(zero_command):
        low, high = max((code - 1) * code_MPa, first), min((code + 1) * code_MPa, last)
        if high < first or low > last:
            continue
        if side["trend"] == "decreasing":
            bound = max(value for dp, value in tests if dp >= high)
        elif side["trend"] == "increasing":
            bound = max(value for dp, value in tests if dp <= low)
        else:
            bound = min(value for _, value in tests)
        margins.append(bound - u_max * int(compare) / signals["compare_max"])
    return margins


def _bounds_of(side: dict[str, Any], guard: str) -> list[float]:
    """Return the lower bounds of the threshold that the compensator was certified for, V."""
    if guard == side["certificate"]["guard"]:
        return [test["u_guard_lower_V"] for test in side["tests"]]
    if guard not in side.get("guards", {}):
        raise InputError(
            f"the certificate guards the {guard} threshold, of which its valve has no bounds; make the compensator "
            "again with `dzdesign design`"
        )
    return side["guards"][guard]["u_lower_V"]


def _bad_fallbacks(core: CompiledCore, exact: ExactLaw) -> int:
    """Count impossible codes that do not give the safe value: command 0, or the smallest beta."""
    commands = exact.command_max + 1
    (safe,) = np.stack(list(exact.rows([exact.beta(-exact.pressure_max)])), axis=1)
    bad = 0
    for outside in (exact.pressure_max + 1, OUTSIDE):
        for inside in (0, 1, exact.pressure_max // 2, exact.pressure_max):
            for pair in ((outside, inside), (inside, outside)):
                bad += int(np.count_nonzero(core.column(*pair, commands).astype(np.int64) != safe))
        bad += int(np.count_nonzero(core.column(outside, outside, commands).astype(np.int64) != safe))
    for pair in ((0, 0), (exact.pressure_max, 0), (0, exact.pressure_max), (exact.pressure_max, exact.pressure_max)):
        bad += int(np.count_nonzero(core.column(*pair, OUTSIDE + 1)[commands:]))
    return bad
