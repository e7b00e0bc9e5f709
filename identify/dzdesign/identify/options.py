"""Choices of the engineer for an identification."""

from dataclasses import dataclass

from dzdesign.core.dither import DeclaredDither
from dzdesign.core.errors import InputError, quoted
from dzdesign.identify.constants import MPA, PREMISES, Premise

#: Curvatures beyond this, V/Pa², are a wrong unit: the slope would change by 1 V/MPa within a kilopascal.
LARGEST_CURVATURE = 1e3 / MPA**2
#: Standard deviation of the thresholds from ramp to ramp, over u_max, taken where nothing tells it: data sheets of
#: valves without a position sensor state a repeatability of about 1 %, as a band of two standard deviations each way.
ASSUMED_REPEATABILITY = 2.5e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifyOptions:
    """Options of the identification, in SI units.

    Attributes
    ----------
    u_max : float
        Full command, V.
    dp0 : float or None
        Reference pressure drop, Pa; None selects the test nearest to 1 MPa.
    meter_floor : float or None
        Flow below which the meter reads zero, m³/s; None determines it from the data.
    meter_lag : float or None
        Lag of the flow meter, s. None determines it from ramps of two rates, and assumes 0 without them.
    meter_lag_tolerance : float or None
        Largest error of a declared lag, s; None assumes 20 % of it, and at least 0.05 s.
    noise_level : float or None
        Smallest flow that counts as flow, m³/s, if the recordings resolve it. None selects the flow that averages over
        the dead zone resolve, and at least 0.5 % of the largest flow.
    zero_flow : float or None
        Flow that is allowed at zero command, leak included, m³/s; the command that passes it is guarded. None guards
        the first flow seen.
    meter_zero : float
        Bound of the meter's zero error, m³/s, which the certificate allows for.
    x_max : float or None
        Stroke, m. With it k is stated in V/mm.
    confidence : float
        Joint confidence level of all lower bounds.
    knee_window : tuple of float
        Range in which the characteristic is taken as straight, as shares of the largest flow. The lower end is 12 %.
        It shifts the knee of a bent characteristic, but not that of a straight one.
    flat_below : float
        Change of the threshold over the tested range, as a share of u_max, that systematic errors may cause. A smaller
        change is not a trend, however significant it is.
    repeatability : float or None
        Standard deviation of the threshold from ramp to ramp, as a share of u_max. None measures it on repeated ramps,
        and assumes 0.25 % without them.
    curve : {"line", "smooth", "monotone"} or None
        Premise about the threshold between the tests. None selects `smooth`, from three pressure drops on; of two
        nothing is then certified between them.
    curvature : float or None
        Bound M of `smooth`: the largest second divided difference of the threshold, V/Pa². None limits the bends to
        those that the tests show.
    dithered : DeclaredDither or None
        Dither that the drive superimposed on the command of every recording. None: no dither, and `design` assumes none
        in the recordings.
    """

    u_max: float = 10.0
    dp0: float | None = None
    meter_floor: float | None = None
    meter_lag: float | None = None
    meter_lag_tolerance: float | None = None
    noise_level: float | None = None
    zero_flow: float | None = None
    meter_zero: float = 0.0
    x_max: float | None = None
    confidence: float = 0.99
    knee_window: tuple[float, float] = (0.12, 0.5)
    flat_below: float = 1e-3
    repeatability: float | None = None
    curve: Premise | None = None
    curvature: float | None = None
    dithered: DeclaredDither | None = None

    def __post_init__(self) -> None:
        if not self.u_max > 0:
            raise InputError(f"u_max is {self.u_max} V, expected a positive command")
        if not 0.5 <= self.confidence < 1:
            raise InputError(f"the confidence is {self.confidence}, expected 0.5 to below 1, such as 0.99")
        if not 0 < self.knee_window[0] < self.knee_window[1] <= 1:
            raise InputError(f"the knee window is {self.knee_window}, expected two rising shares such as '12-50 %'")
        if self.repeatability is not None and not 0 <= self.repeatability < 0.1:
            raise InputError(
                f"the repeatability is {100 * self.repeatability:.3g} % of full command, expected 0 to below 10 %: one "
                "standard deviation of the threshold from ramp to ramp"
            )
        if self.curve not in (*PREMISES, None):
            raise InputError(f"the curve is {quoted(self.curve)}, expected one of {', '.join(PREMISES)}")
        if self.curvature is not None and not 0 <= self.curvature <= LARGEST_CURVATURE:
            raise InputError(
                f"the curvature is {1e3 * MPA * (MPA * self.curvature):.6g} mV/MPa², expected zero or more, at most "
                f"{1e3 * MPA * (MPA * LARGEST_CURVATURE):g}, such as '20 mV/MPa^2'"
            )
        if self.curvature is not None and self.curve not in ("smooth", None):
            raise InputError(f"a curvature is declared beside the curve '{self.curve}', expected it beside 'smooth'")
        if not 0 <= self.flat_below < 1:
            raise InputError(f"the change that counts as flat is {self.flat_below}, expected a share of u_max")
        for name in ("meter_floor", "meter_lag", "meter_lag_tolerance", "noise_level", "meter_zero"):
            if (getattr(self, name) or 0) < 0:
                raise InputError(f"{name} is negative, expected zero or more")
        for name in ("dp0", "x_max", "zero_flow"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise InputError(f"{name} is {value}, expected a positive number")

    @property
    def scatter_V(self) -> tuple[float | None, float]:
        """Standard deviation from ramp to ramp as declared, None where it is not, and as assumed if nothing tells."""
        declared = None if self.repeatability is None else self.repeatability * self.u_max
        return declared, ASSUMED_REPEATABILITY * self.u_max
