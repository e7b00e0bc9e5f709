"""`BranchShape`: one branch of a ramp test, described by its straight part, its tail and its noise."""

from dataclasses import dataclass

from dzdesign.identify.knees.dead_zone import DeadZone
from dzdesign.identify.knees.gated_line import GatedLine, PreparedBranch


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
