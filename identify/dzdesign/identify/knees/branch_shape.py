"""`BranchShape`: one branch of a ramp test, described by its straight part, its tail and its noise."""

from dataclasses import dataclass

from dzdesign.identify.knees.gated_line import GatedLine, PreparedBranch
from dzdesign.identify.ramps.branches import Bins


@dataclass(frozen=True, slots=True)
class Tail:
    """What the meter sees of the edge: a line through the first flows that count.

    Attributes
    ----------
    zero, zero_se : float
        Its zero and the standard error, V.
    slope : float
        m³/(s V).
    at_level, at_level_se : float
        Command at which it reaches the flow that counts as flow, and the standard error, V.
    hole : tuple of float or None
        Commands between which rows are missing, if flow begins there, V: then `zero` is the lower of them.
    """

    zero: float
    zero_se: float
    slope: float
    at_level: float
    at_level_se: float
    hole: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BranchShape:
    """One branch of one ramp test, described.

    Attributes
    ----------
    rising : bool
        Direction of the command.
    bins : Bins
        Sufficient statistics of the knee window, outliers left out (V, m³/s at the nominal pressure drop).
    y_max : float
        Largest flow at the nominal pressure drop, m³/s.
    slope, knee : float
        Start values: the straight line over the knee window, m³/(s V), and its zero, V.
    sigma : float
        Robust standard deviation of one sample about the line, m³/s.
    variance_inflation : float
        Long-run variance over variance of one sample (1 for white noise, more for coloured noise or a bent line).
    window : tuple of float
        Flows between which the characteristic was found straight, over the largest flow.
    level : float
        Flow that counts as flow, m³/s: the meter's floor, its noise or `USEFUL_FLOW`, whichever is largest.
    tail : Tail
        The first flows that count.
    onset, onset_se : float
        Where the valve opens (or closes), as far as the meter shows it, and the standard error, V.
    saturates : bool
        True if the flow at full command lies clearly below the straight line.
    outliers : int
        Samples gated out of the window.
    dropped : float
        Share of the samples that drop out: that read below the floor where no flow below it is credible.
    prepared : PreparedBranch
        The samples that all this was found from.
    line : GatedLine
        Which of them the straight line rests on.
    """

    rising: bool
    bins: Bins
    y_max: float
    slope: float
    knee: float
    sigma: float
    variance_inflation: float
    window: tuple[float, float]
    level: float
    tail: Tail
    onset: float
    onset_se: float
    saturates: bool
    outliers: int
    dropped: float
    prepared: PreparedBranch
    line: GatedLine
