"""`Knees`: knees and slopes of all ramp tests, by each branch's own line."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.knees.branch_shape import BranchShape


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
