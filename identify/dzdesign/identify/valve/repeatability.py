"""`Repeatability`: what was found, or taken, to differ from ramp to ramp; part of what the lower bounds rest on."""

from dataclasses import dataclass
from typing import Annotated, Literal

from dzdesign.core.artefact_types import quantity
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.valve.quantity_types import Voltage, VoltageError

Origin = Literal["repeats", "declared", "assumed"]
NoDrift = Literal["", "one pressure drop", "order unknown", "order of pressure"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeatability:
    """Scatter of the guarded threshold from ramp to ramp, and its drift through the series of ramps."""

    sd_V: VoltageError
    """Standard deviation of the threshold from ramp to ramp."""
    origin: Origin
    """Origin of the standard deviation: measured on repeats, declared by --repeatability, or assumed by dzdesign."""
    degrees_of_freedom: Annotated[float, quantity("1", gt=0, le=1e9)] | None
    """Degrees of freedom of a measured standard deviation; null if it was not measured."""
    drift_V: Voltage | None
    """Change of the threshold from the first ramp of the series to the last; null if the model has no drift. The
    thresholds refer to the middle of the series, and the bounds hold at both ends."""
    drift_se_V: VoltageError | None
    """Standard error of drift_V."""
    no_drift: NoDrift
    """Reason why the model has no drift; empty if it has one."""

    def in_words(self, units: RecordedUnits) -> str:
        """Return by how much the guarded threshold scatters from ramp to ramp, and drifts, and how that is known."""
        how = {
            "repeats": f"from repeated ramps, {self.degrees_of_freedom or 0:.0f} degrees of freedom",
            "declared": "declared",
            "assumed": "assumed, too few repeated ramps",
        }
        drift = (
            f"drift from the first ramp to the last: {units.number(1e3 * self.drift_V, '+.1f mV')} ± "
            f"{units.text(1e3 * self.drift_se_V, '.1f mV')}"
            if self.drift_V is not None and self.drift_se_V is not None
            else f"no drift in the model ({self.no_drift})"
        )
        return (
            f"standard deviation {units.text(1e3 * self.sd_V, '.1f mV')} ({how[self.origin]}), included in "
            f"the bounds; {drift}"
        )
