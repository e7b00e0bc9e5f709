"""`DescribedTests`: ramp tests made comparable and described, as fits, warnings and plots take them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.knees.between_ramps import BetweenRamps
from dzdesign.identify.knees.gated_line import BranchShape
from dzdesign.identify.knees.meter import MeterLag
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.left_out import LeftOut


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribedTest:
    """One ramp test."""

    test: RampTest
    #: Nominal pressure drop, Pa; None if it is unknown.
    dp: float | None
    #: Of its rising and its falling branch; None where there is none.
    shapes: tuple[BranchShape | None, BranchShape | None]
    #: Largest flow, m³/s.
    q_max: float
    ramps: tuple[str, ...]
    #: When each ramp was recorded, s on a clock common to all; NaN if that is not known.
    when: tuple[float, ...]
    #: Source and SHA-256 of every file in it.
    files: tuple[tuple[str, str], ...]
    left_out: tuple[LeftOut, ...]

    @property
    def branches(self) -> list[BranchShape]:
        """The branches that there are."""
        return [shape for shape in self.shapes if shape]

    def branch(self, column: int) -> BranchShape:
        """Return the rising (0) or falling (1) branch; a ValueError if there is none."""
        shape = self.shapes[column]
        if shape is None:
            raise ValueError(f"'{self.test.source}' has no {('rising', 'falling')[column]} branch")
        return shape

    @property
    def closing_branch(self) -> BranchShape:
        """The falling branch, or the rising one where there is no other: the one that a certificate guards."""
        return self.branches[-1]


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribedTests:
    """All ramp tests of a valve, in the order of rising pressure drop, all with the same branches."""

    tests: tuple[DescribedTest, ...]
    #: Of the meter, given or found, m³/s.
    floor: float
    lag: MeterLag
    #: Source -> flow read at zero command, where it is not zero; it has been subtracted.
    zero_L_min: dict[str, float]
    #: Largest zero error of the meter that readings at rest hide, m³/s; 0 where they tell the zero.
    hidden_zero: float
    #: Standard error of what was subtracted from each of `tests`, as of white noise, m³/s; 0 where nothing was.
    zero_se: tuple[float, ...]
    #: Leak that was subtracted from each of `tests`, m³/s; 0 where there is none.
    leak: tuple[float, ...]
    #: What the shut valve itself may pass of all that was subtracted from each of `tests`, and its standard error.
    at_rest: tuple[tuple[float, float], ...]
    #: What differs from ramp to ramp, of the rising and of the falling branch; None where there is none.
    between_ramps: tuple[BetweenRamps | None, BetweenRamps | None]

    @property
    def noise_level(self) -> float:
        """The largest of the branches' noise levels, m³/s: flow below which there is none."""
        return max(shape.dead_zone.noise_level for item in self.tests for shape in item.branches)

    def between(self, column: int) -> BetweenRamps:
        """Return what differs from ramp to ramp on the rising (0) or falling (1) branch; ValueError without it."""
        found = self.between_ramps[column]
        if found is None:
            raise ValueError(f"there is no {('rising', 'falling')[column]} branch")
        return found

    def rates(self, column: int) -> np.ndarray:
        """Return the pace of the command on that branch of each test, V/s (T,); NaN where it is unknown."""
        shapes = [item.shapes[column] for item in self.tests]
        return np.array([shape.prepared.branch.rate if shape else math.nan for shape in shapes])


@dataclass(frozen=True, slots=True, kw_only=True)
class Knees:
    """Arrays (T, 2), columns rising and falling, NaN where a branch is missing."""

    #: Knees and their standard errors, coloured noise counted, V.
    knee: np.ndarray
    knee_se: np.ndarray
    #: At the nominal pressure drop, m³/(s V).
    slope: np.ndarray

    @classmethod
    def of(cls, shapes: Sequence[tuple[BranchShape | None, BranchShape | None]]) -> "Knees":
        """Gather what the tests' rising and falling branches, in the order of rising pressure drop, say."""
        knee, knee_se, slope = (np.full((len(shapes), 2), np.nan) for _ in range(3))
        for row, pair in enumerate(shapes):
            for column, shape in enumerate(pair):
                if shape is not None:
                    knee[row, column] = shape.knee
                    knee_se[row, column] = shape.line.knee_se
                    slope[row, column] = shape.slope
        return cls(knee=knee, knee_se=knee_se, slope=slope)
