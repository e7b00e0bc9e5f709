"""A valve in plain floating point, from what it is: a threshold, an edge that opens, a stop. No formula of the account.

The numbers are in units that keep them near 1. Commands and thresholds are sums of powers of two, so that what lies on
a boundary lies there exactly.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainValve:
    """A valve without a sensor at its spool."""

    name: str
    dP0: float
    dP1: float
    #: Command per opening beyond the threshold, and the opening that the paper calls the largest.
    k: float
    x_max: float
    #: Whether a stop holds the spool at `x_max`; otherwise the command alone limits the opening.
    has_stop: bool
    #: Threshold at dP0, and by how much it falls when the pressure drop doubles.
    u_min0: float
    fall: float
    u_max: float = 10.0
    C_d: float = 0.75
    W: float = 1.25
    rho: float = 3.0
    #: The meter shows nothing below this flow.
    Q_floor: float = 0.0625
    #: Travel of the spool that opens nothing.
    x_ov: float = 0.375
    #: Of converter and PWM behind it: codes and volts at full scale; conversion coefficient over what (32) asks for.
    n_adc: float = 4096.0
    V_adc: float = 3.0
    n_full: float = 1024.0
    K_c_share: float = 1.0
    #: Of the other valve that flow alone can't tell from this one.
    scale: float = 1.5

    def threshold(self, dP: float) -> float:
        return self.u_min0 - self.fall * math.log2(dP / self.dP0)

    def opening(self, u: float, dP: float) -> float:
        """Opening of the edge at a command to the valve, the same for both directions."""
        x = max(0.0, (abs(u) - self.threshold(dP)) / self.k)
        return min(x, self.x_max) if self.has_stop else x

    def flow(self, u: float, dP: float) -> float:
        speed = math.sqrt(2 * dP / self.rho)
        return math.copysign(self.C_d * self.W * self.opening(u, dP) * speed, u)

    def command_for(self, flow: float, dP: float) -> float:
        """Least command at which a flow, zero or more, passes."""
        return self.threshold(dP) if flow == 0 else bisect(lambda u: self.flow(u, dP) >= flow, 0.0, 4 * self.u_max)


def bisect(is_reached: Callable[[float], bool], low: float, high: float) -> float:
    """Return the least argument for which something holds that holds for all above."""
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (low, middle) if is_reached(middle) else (middle, high)
    return high


#: With a stop, that fixes x_max; without, full command is the limit and k x_max = u_max - u_min0.
VALVES = (
    PlainValve(name="a stop", dP0=1.0, dP1=4.0, k=4.0, x_max=0.75, has_stop=True, u_min0=5.5, fall=0.25),
    PlainValve(name="no stop", dP0=1.0, dP1=4.0, k=4.0, x_max=1.125, has_stop=False, u_min0=5.5, fall=0.25),
    PlainValve(name="a stop, dP1 < dP0", dP0=2.0, dP1=1.0, k=3.0, x_max=1.25, has_stop=True, u_min0=4.5, fall=0.375),
    PlainValve(name="no stop, dP1 < dP0", dP0=4.0, dP1=1.0, k=2.0, x_max=3.0, has_stop=False, u_min0=4.0, fall=0.125),
    PlainValve(name="a stop, one threshold", dP0=1.0, dP1=4.0, k=4.0, x_max=0.75, has_stop=True, u_min0=5.5, fall=0.0),
    PlainValve(name="one threshold", dP0=1.0, dP1=4.0, k=4.0, x_max=1.125, has_stop=False, u_min0=5.5, fall=0.0),
)
