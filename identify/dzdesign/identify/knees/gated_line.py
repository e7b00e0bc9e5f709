"""`PreparedBranch`: samples; `GatedLine`: a line through those that are no outliers; `BranchShape`: what both tell."""

import math
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.identify.knees.noise import Roughness, variance_inflation
from dzdesign.identify.knees.profile import flow_at_top, smooth_profile
from dzdesign.identify.ramps.branches import Branch, at_nominal_pressure
from dzdesign.identify.ramps.splitting import nominal_dp
from dzdesign.identify.reading.ramp_test import RampTest

#: A sample further than this many robust standard deviations from the line is an outlier.
GATE = 6.0
#: The inflation by one branch's blocks counts if it is so many times the mean of all: 99.9 % of those of one noise are
#: below it.
STANDS_OUT = 2.6
#: Rows without a flow are beyond the meter's range from this share of u_max above all others on.
UNSEEN = 0.01


def straight_line(u: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return slope and zero of the least-squares line; a level one has no zero: the middle of its samples."""
    centre, height = float(u.mean()), float(y.mean())
    du = u - centre
    slope = float(du @ (y - height) / (du @ du))
    return slope, centre - height / slope if slope else centre


@dataclass(frozen=True, slots=True, kw_only=True)
class PreparedBranch:
    """A branch, ready for lines to be laid through it."""

    branch: Branch
    #: Flow of its samples at the nominal pressure drop, (N,), m³/s.
    y: np.ndarray
    #: Smoothed course of that flow, and of the flow as recorded: command (V), flow (m³/s), each (P,).
    profile: tuple[np.ndarray, np.ndarray]
    recorded: tuple[np.ndarray, np.ndarray]
    #: Flow at the largest command, and the meter's floor, m³/s.
    y_max: float
    floor: float
    #: Largest command whose flow the meter could not show, V; 0 if it showed all.
    unseen_top: float
    #: For messages.
    source: str


def prepare_branch(branch: Branch, test: RampTest, *, u_max: float, floor: float) -> PreparedBranch:
    """Bring the flow of a test's branch to its nominal pressure drop, ready for lines; the meter's `floor` in m³/s."""
    y = at_nominal_pressure(branch, nominal_dp(test))
    profile = smooth_profile(branch.u, y, u_max)
    return PreparedBranch(
        branch=branch,
        y=y,
        profile=profile,
        recorded=profile if y is branch.q else smooth_profile(branch.u, branch.q, u_max),
        y_max=flow_at_top(*profile),
        floor=floor,
        unseen_top=test.unseen_top(UNSEEN * u_max),
        source=test.source,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class GatedLine:
    """Straight line through the samples between two flows, outliers left out."""

    #: The two flows over the largest.
    window: tuple[float, float]
    #: Of the line, m³/(s V), and its zero, V.
    slope: float
    knee: float
    #: Variance of the line's value at its zero, for independent samples of unit variance.
    lever: float
    #: Standard deviation of one sample about the line, m³/s.
    sigma: float
    #: Long-run variance over variance of one sample: as the residuals show it, and with what is known of the noise. 1
    #: for white noise, more for coloured noise or a bent line.
    block_inflation: float
    variance_inflation: float
    #: Samples of the branch between the two flows, those of them that the line rests on, and those of them that read
    #: below the meter's floor, each (N,) bool.
    inside: np.ndarray
    kept: np.ndarray
    censored: np.ndarray
    #: Of the residuals.
    roughness: Roughness
    #: Samples gated out.
    outliers: int

    @property
    def knee_se(self) -> float:
        """Standard error of the zero, V."""
        return self.sigma * math.sqrt(self.lever * self.variance_inflation) / self.slope

    def with_shared_noise(self, correlation: float, blocks: float) -> "GatedLine":
        """Return the same line with errors for the noise that all branches share.

        Its correlation is that of neighbouring samples, `blocks` the mean of all branches' `block_inflation`. That of
        one branch, from few blocks, counts where it stands out of the mean: then it has more than noise in it.
        """
        known = variance_inflation(correlation, self.roughness, self.sigma)
        of_this = self.block_inflation if self.block_inflation > STANDS_OUT * blocks else 1.0
        return replace(self, variance_inflation=max(of_this, blocks, known))


@dataclass(frozen=True, slots=True)
class DeadZone:
    """Dead zone of one branch: the noise level, m³/s, and how far below the knee averages still show flow, V."""

    noise_level: float
    depth: float


@dataclass(frozen=True, slots=True)
class Tail:
    """What the meter sees of the edge: a line through the first flows that count; commands in V, slope in m³/(s V)."""

    zero: float
    zero_se: float
    slope: float
    #: Commands between which rows are missing, if flow begins there: then `zero` is the lower of them.
    hole: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BranchShape:
    """One branch of one ramp test, described; commands in V, flows in m³/s at the nominal pressure drop."""

    #: The samples that all this was found from, and the straight line through those in the knee window.
    prepared: PreparedBranch
    line: GatedLine
    #: Of `prepared` and `line`.
    y_max: float
    slope: float
    knee: float
    #: Knee by the line in the window that was asked for, where the straight part is wider; else the same.
    knee_of_window: float
    sigma: float
    variance_inflation: float
    outliers: int
    #: Standard deviation of a reading while the valve is shut, m³/s.
    noise: float
    #: Flow from which a single reading counts as flow: the meter's floor, its noise or `USEFUL_FLOW`, whichever is
    #: largest.
    level: float
    #: What averages over the dead zone show below that.
    dead_zone: DeadZone
    tail: Tail
    #: Where the valve opens (or closes), as far as the meter shows it.
    onset: float
    onset_se: float
    #: Standard deviation of the spool about its mean course, as a command: stick and slip.
    ripple: float
    #: True if the flow at full command lies clearly below the straight line.
    saturates: bool

    @property
    def full_flow(self) -> float:
        """Flow at full command, m³/s: beyond the meter's range that of the straight line, unless a stop is seen."""
        unseen = self.prepared.unseen_top
        return self.slope * (unseen - self.knee) if unseen and not self.saturates else self.y_max
