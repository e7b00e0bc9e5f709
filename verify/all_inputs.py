"""Every input of the compiled core against the exactly rounded law, and the properties that make it safe."""

import json
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from dzdesign.verify.compiled_core import CompiledCore
from dzdesign.verify.reference import ExactLaw

#: Commands at which all pairs of pressure codes are tried, beside the two pairs a difference that all commands get.
CUBE_COMMANDS = (0, 0.5, 1)
#: Codes beyond the converter's range: the largest that 16 bits hold.
OUTSIDE = 65535
#: The law's own change from one pressure code to the next counts as a direction from this on, in counts.
DIRECTION = 1e-9
#: More than a pressure of doubles is wrong by; widens the pressures that a code may stand for.
FLOAT_ERROR_MPA = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class InputCheck:
    """What checking every input of one side found; every count but `inputs` must be zero.

    Attributes
    ----------
    sign : int
        Of the commands that the side is for.
    inputs : int
        Pairs of command code and difference of pressure codes, each compared with the exact law.
    wrong : int
        Pairs whose compare value is not the exactly rounded law.
    largest_error : int
        Largest difference in counts.
    out_of_range, not_monotone_in_u, not_monotone_in_dp : int
        Compare values above the limit; falls with rising command; steps in dP against the law's own direction.
    over_compensated : int
        Pressure codes of the tested interval whose zero-command drive lies above the threshold's lower bound.
    odd_pairs : int
        Pairs of pressure codes that give another value than their difference does.
    bad_fallbacks, bad_status : int
        Codes that are not sound and do not fall back to the safe value; status words that say something else.
    smallest_margin_V : float
        Smallest distance from the zero-command drive to the threshold's lower bound; negative if it is exceeded.
    core_sha256 : str
        Hash of the C that was compiled.
    first_wrong : str or None
        The first failure, in words.
    """

    sign: int
    inputs: int
    wrong: int
    largest_error: int
    out_of_range: int
    not_monotone_in_u: int
    not_monotone_in_dp: int
    over_compensated: int
    odd_pairs: int
    bad_fallbacks: int
    bad_status: int
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
                self.bad_status,
            )
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Places:
    """Every difference that sound pressure codes make, and the lowest and highest pair of codes that make it.

    Attributes
    ----------
    differences : (D,) array
        Differences, rising.
    low, high : (2, D) array
        Codes of sensors A and B.
    of_pair : (N, N) array
        Position in `differences` of each pair of codes; D for a pair that is not sound.
    """

    differences: np.ndarray
    low: np.ndarray
    high: np.ndarray
    of_pair: np.ndarray


def _places(exact: ExactLaw) -> Places:
    codes = np.arange(exact.code_max + 1)
    p_a, p_b = codes[:, None], codes[None, :]
    difference = exact.difference(p_a, p_b)
    sound = exact.sound_pressures(p_a, p_b)
    lowest = int(difference[sound].min())
    from_lowest = difference - lowest
    pairs = np.flatnonzero(sound)
    first = np.full(int(from_lowest[sound].max()) + 1, -1)
    last = first.copy()
    # The last assignment stays: of pairs in their order the highest, of pairs in reverse the lowest.
    last[from_lowest.flat[pairs]] = pairs
    first[from_lowest.flat[pairs[::-1]]] = pairs[::-1]
    made = np.flatnonzero(first >= 0)
    position = np.full(first.size, made.size)
    position[made] = np.arange(made.size)
    of_pair = np.full(difference.shape, made.size, dtype=np.int32)
    of_pair.flat[pairs] = position[from_lowest.flat[pairs]]
    low, high = (np.stack(np.unravel_index(ends[made], difference.shape)) for ends in (first, last))
    return Places(differences=made + lowest, low=low, high=high, of_pair=of_pair)


def check_all_inputs(folder: Path, sign: int = 1) -> InputCheck:
    """Compare one side of the compiled core with the exact law on every pair of command and pressure difference.

    The core has three inputs, 2^36 triples; it may depend on the two pressures by their difference only. That is itself
    checked: every pair (command, difference) is tried with the lowest and with the highest pair of pressures that has
    the difference, and at `CUBE_COMMANDS` all pairs of pressures are.

    Parameters
    ----------
    folder : Path
        Firmware folder: ``core/`` and ``compensator.json``.
    sign : {1, -1}
        Sign of the commands that the side is for.
    """
    document = json.loads((folder / "compensator.json").read_bytes())
    exact = ExactLaw(document, sign)
    core = CompiledCore(folder, sign)
    places = _places(exact)
    betas = [exact.betas(int(code)) for code in places.differences] + [exact.betas(None)]
    corners = np.array([[float(counts) for _, counts in exact.corners(pair)] for pair in betas])
    at_codes = [code for code, _ in exact.corners(betas[0])]
    forward = places.differences[:-1] >= 0  # the direction is the law's from no pressure drop on
    wrong = largest = out_of_range = falls = against = odd = 0
    first = previous = None
    cube = {round(share * exact.span) for share in CUBE_COMMANDS}
    rows, reached = exact.rows(betas), -1
    commands = range(exact.code_max + 1)
    for command in sorted(commands, key=exact.from_zero):
        while reached < exact.from_zero(command):
            row, reached = next(rows), reached + 1
        sound = command in exact.sound_commands
        expected = row if sound else np.zeros_like(row)
        low, high = (core.row(command, *pair).astype(np.int64) for pair in (places.low, places.high))
        error = np.abs(low - expected[:-1])
        wrong += int(np.count_nonzero(error))
        largest = max(largest, int(error.max()))
        if first is None and error.any():
            place = int(np.flatnonzero(error)[0])
            first = (
                f"command code {command}, pressure-difference code {places.differences[place]}: "
                f"compare value {low[place]}, expected {expected[place]}"
            )
        out_of_range += int(np.count_nonzero(low > exact.compare_limit))
        odd += int(np.count_nonzero(low != high))
        if sound and reached in cube:
            cube.discard(reached)
            odd += core.odd_pairs(command, exact.code_max, places.of_pair, np.append(low, expected[-1]))
        if sound:
            if previous is not None:
                falls += int(np.count_nonzero(low < previous))
            law = _between(at_codes, corners, reached)[:-1]
            runs = np.sign(np.where(np.abs(np.diff(law)) > DIRECTION, np.diff(law), 0.0))
            against += int(np.count_nonzero((np.diff(low) * runs < 0) & forward))
            previous = low
    margins = _margins(document, exact, core, places)
    return InputCheck(
        sign=sign,
        inputs=places.differences.size * len(commands),
        wrong=wrong,
        largest_error=largest,
        out_of_range=out_of_range,
        not_monotone_in_u=falls,
        not_monotone_in_dp=against,
        over_compensated=sum(margin < 0 for margin in margins),
        odd_pairs=odd,
        bad_fallbacks=_bad_fallbacks(core, exact),
        bad_status=_bad_status(core, exact) if sign > 0 else 0,
        smallest_margin_V=float(min(margins)),
        core_sha256=core.sha256,
        first_wrong=first,
    )


def _between(codes: list[int], corners: np.ndarray, at: int) -> np.ndarray:
    """Return the law in counts at one command, before rounding, from its corners."""
    part = min(max(np.searchsorted(codes, at, side="right") - 1, 0), len(codes) - 2)
    share = (at - codes[part]) / (codes[part + 1] - codes[part])
    return corners[:, part] * (1 - share) + corners[:, part + 1] * share


def _margins(document: dict[str, Any], exact: ExactLaw, core: CompiledCore, places: Places) -> list[Fraction]:
    """Return, per pressure code of the tested interval, the threshold's lower bound less the zero-command drive, in V.

    The bound is argued from the ramp tests anew: by monotonicity a threshold that falls with dP is at least the bound
    of any test at a higher dP, one that rises at least that of any test at a lower dP, and of a flat one only the
    lowest bound is known. A code stands for all pressures that may have made it; a dither's peak counts as drive.
    """
    side = document["valve"]["sides"][exact.side]
    tests = [(Fraction(repr(test["dp_MPa"])), Fraction(repr(test["u_guard_lower_V"]))) for test in side["tests"]]
    first, last = min(tests)[0], max(tests)[0]
    u_max, peak = Fraction(*document["u_max_V"]), document["amplifier"]["dither_counts"]
    lowest, highest = _pressure_drops(exact, places)
    margins = []
    for low, high, compare in zip(lowest, highest, core.row(exact.zero, *places.low), strict=True):
        low, high = max(low, first), min(high, last)
        if high < first or low > last:
            continue
        if side["trend"] == "decreasing":
            bound = max(value for dp, value in tests if dp >= high)
        elif side["trend"] == "increasing":
            bound = max(value for dp, value in tests if dp <= low)
        else:
            bound = min(value for _, value in tests)
        margins.append(bound - u_max * (int(compare) + peak) / exact.compare_max)
    return margins


def _pressure_drops(exact: ExactLaw, places: Places) -> tuple[list[Fraction], list[Fraction]]:
    """Return the least and the largest pressure drop, MPa, that may have made each difference: over all its pairs."""
    pressures, errors = [], []
    for sensor in (exact.a, exact.b):
        unit = Fraction(*sensor["span_MPa"]) / (sensor["full_code"] - sensor["zero_code"])
        pressures.append(np.array([float((code - sensor["zero_code"]) * unit) for code in range(exact.code_max + 1)]))
        errors.append([Fraction(*end) for end in sensor["error_MPa"]])
    drop = exact.turn * (pressures[0][:, None] - pressures[1][None, :])
    least, most = np.full(places.differences.size + 1, np.inf), np.full(places.differences.size + 1, -np.inf)
    np.minimum.at(least, places.of_pair.ravel(), drop.ravel())
    np.maximum.at(most, places.of_pair.ravel(), drop.ravel())
    ends = sorted(exact.turn * error for error in (errors[0][0] - errors[1][1], errors[0][1] - errors[1][0]))
    return (
        [Fraction(float(value) - FLOAT_ERROR_MPA) + ends[0] for value in least[:-1]],
        [Fraction(float(value) + FLOAT_ERROR_MPA) + ends[1] for value in most[:-1]],
    )


def _bad_fallbacks(core: CompiledCore, exact: ExactLaw) -> int:
    """Count codes that are not sound and do not give the safe value: command 0, or the smallest beta."""
    rows = [row[0] for row in exact.rows([exact.betas(None)])]
    everything = range(OUTSIDE + 1)
    safe = np.array([rows[exact.from_zero(code)] if code in exact.sound_commands else 0 for code in everything])
    bad = 0
    inside = {}
    outside = {}
    for name, sensor in (("a", exact.a), ("b", exact.b)):
        low, high = sensor["valid_codes"]
        inside[name] = (low, (low + high) // 2, high)
        outside[name] = tuple(code for code in (low - 1, high + 1, OUTSIDE) if code >= 0)
    pairs = [(a, b) for a in outside["a"] for b in inside["b"] + outside["b"]]
    pairs += [(a, b) for a in inside["a"] for b in outside["b"]]
    for pair in pairs:
        bad += int(np.count_nonzero(core.column(*pair, OUTSIDE + 1) != safe))
    unsound = np.array([code not in exact.sound_commands for code in everything])
    for a in inside["a"]:
        for b in inside["b"]:
            bad += int(np.count_nonzero(core.column(a, b, OUTSIDE + 1)[unsound]))
    return bad


def _bad_status(core: CompiledCore, exact: ExactLaw) -> int:
    """Count wrong status words, along every code of each input with the others at the ends of their sound codes."""
    everything = np.arange(OUTSIDE + 1)
    sound_u, sound_a, sound_b = (
        (low, high)
        for low, high in (
            (exact.sound_commands[0], exact.sound_commands[-1]),
            exact.a["valid_codes"],
            exact.b["valid_codes"],
        )
    )
    bad = 0
    for moving in range(3):
        for fixed in [(u, a, b) for u in sound_u for a in sound_a for b in sound_b]:
            u, a, b = (everything if place == moving else np.full(everything.size, fixed[place]) for place in range(3))
            expected = 1 * ((u < sound_u[0]) | (u > sound_u[1])) + 2 * ((a < sound_a[0]) | (a > sound_a[1]))
            expected += 4 * ((b < sound_b[0]) | (b > sound_b[1])) + 8 * (exact.difference(a, b) < -exact.reverse)
            bad += int(np.count_nonzero(core.status(u, a, b) != expected))
    return bad
