"""A branch of a ramp test: the samples of one direction of the command, gathered in bins."""

import math
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.constants import BIN_WIDTH


@dataclass(frozen=True, slots=True, kw_only=True)
class Branch:
    """Samples of one direction, on one side of zero: command u in V, dp in Pa or None, flow q in m³/s, all (N,).

    `rate` is the pace of the command, V/s, always positive; of several ramps the fastest; NaN if it is not known.
    `counts` are the samples of each ramp, one ramp after the other; none where the branch is of one ramp.
    """

    rising: bool
    u: np.ndarray
    q: np.ndarray
    dp: np.ndarray | None
    rate: float = math.nan
    counts: tuple[int, ...] = ()

    @property
    def ramp_of_samples(self) -> np.ndarray:
        """Number of each sample's ramp, from 0 (N,)."""
        return np.repeat(np.arange(max(len(self.counts), 1)), self.counts or (self.u.size,))

    @property
    def ramps(self) -> list[slice]:
        """Which samples are each ramp's; a ramp without this branch has none."""
        ends = np.cumsum(self.counts or (self.u.size,)).tolist()
        return [slice(start, end) for start, end in zip([0, *ends], ends, strict=False)]


def at_nominal_pressure(branch: Branch, dp: float | None) -> np.ndarray:
    """Return a branch's flow brought to one pressure drop (Pa), m³/s; as it is where the pressure is not known."""
    # Eq. (1): Q grows as sqrt(dP); below a tenth of the nominal pressure the ratio would only carry noise.
    if dp is None or branch.dp is None:
        return branch.q
    flow: np.ndarray = branch.q * np.sqrt(dp / np.maximum(branch.dp, 0.1 * dp))
    return flow


def bin_index(u: np.ndarray, u_max: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of each sample's bin of `BIN_WIDTH` u_max, empty ones not counted, and the samples of each."""
    index = np.floor(u / (BIN_WIDTH * u_max)).astype(int)
    index -= index.min()
    count = np.bincount(index)
    filled = count > 0
    return (index, count) if filled.all() else ((np.cumsum(filled) - 1)[index], count[filled])


def median(values: np.ndarray) -> float:
    """Return the median of one or more numbers, none of them NaN: NumPy's looks for those, at twice the time."""
    half = values.size // 2
    parted = np.partition(values, half)
    upper = float(parted[half])
    return upper if values.size % 2 else (float(parted[:half].max()) + upper) / 2
