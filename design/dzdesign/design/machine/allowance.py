"""What the offset's ceiling keeps free under the certified curve: pressures it may be, factors, counts.

Each is kept by its component, so that the budget can leave one out and see what it costs.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil, prod

from dzdesign.core.dither import Dither, DrivenDither
from dzdesign.core.errors import InputError
from dzdesign.core.units import measures, si_factor
from dzdesign.design.current.drive import CurrentDrive
from dzdesign.design.machine.budget import Component
from dzdesign.design.machine.machine import Machine
from dzdesign.design.signals import Signals
from dzdesign.identify.valve.model import ValveModel

#: Reading of the command that may be a coil's current and no signal of 0..20 mA, A.
LEAST_COIL_A = 0.05
#: Two currents are one to this share: the rounding of units.
SAME_CURRENT = 1e-6


def recorded_full_A(valve: ValveModel) -> float | None:
    """Return the coil's current at full command where the command was recorded as one; else None.

    A command with a live zero, such as 4..20 mA, or of no more than 20 mA is a signal.
    """
    command = valve.recorded_units.command
    if command.at_zero != 0 or not measures(command.unit, "current"):
        return None
    ampere = abs(command.factor) * valve.u_max_V * si_factor(command.unit, "current")
    return ampere if ampere >= LEAST_COIL_A else None


def check_bench_current(valve: ValveModel, rated_A: float, declared_A: float | None) -> None:
    """Refuse a rated current that is not the one of full command on the bench.

    The law's output is a share of the rated current, the recorded thresholds are shares of the bench's full command.
    The budget has that one's error, which is about the rated current: a distance between the two would not be in it.
    """
    recorded_A = recorded_full_A(valve)
    known = {"--bench-current": declared_A, "the recorded command": recorded_A}
    for what, ampere in known.items():
        if ampere is not None and abs(ampere / rated_A - 1) > SAME_CURRENT:
            raise InputError(
                f"--rated-current is {rated_A:g} A, but full command was {ampere:.9g} A on the bench by {what}, so the "
                f"recorded thresholds are not the same shares of it; give --rated-current '{ampere:.9g} A'"
            )


def premise_of_bench_current(valve: ValveModel, rated_A: float, declared_A: float | None) -> str:
    """Return what is taken for granted where nothing tells the bench's current; else nothing."""
    if declared_A is not None or recorded_full_A(valve) is not None:
        return ""
    unit = valve.recorded_units.command.unit
    return (
        f"the command was recorded in {unit}, which does not tell the coil's current: full command is taken as the "
        f"rated current of {rated_A:g} A, as an amplifier that controls the current makes it; of ramps recorded by "
        "duty it is the supply over a resistance that nobody knows while the coil heats up. Declare --bench-current, "
        "or record the current"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Allowance:
    """Of one side: what rounding, dither and, where one was declared, the machine take."""

    signals: Signals
    sign: int
    #: Half-widths of the pressure drop, which add up.
    pressures_MPa: Mapping[Component, Fraction]
    #: The threshold on the machine over that on the bench, which multiply.
    factors: Mapping[Component, Fraction]
    #: Shares of full drive that are subtracted.
    shares: Mapping[Component, Fraction]
    #: Whether the rounding of pressures to codes counts, as it always does in a ceiling.
    rounds: bool = True

    @property
    def window(self) -> tuple[int, int]:
        """Differences of codes, from and to, that the pressure drop may be away from the one that is read."""
        half_width_MPa = sum(self.pressures_MPa.values(), start=Fraction(0))
        if self.rounds:
            return self.signals.difference_error(self.sign, half_width_MPa)
        codes = ceil(half_width_MPa / self.signals.pressure_a.per_code_MPa)
        return -codes, codes

    @property
    def factor(self) -> Fraction:
        """The least threshold over that on the bench."""
        return prod(self.factors.values(), start=Fraction(1))

    @property
    def kept(self) -> Fraction:
        """Share of full drive that is subtracted."""
        return sum(self.shares.values(), start=Fraction(0))

    def only(self, component: Component) -> "Allowance":
        """Return the allowance of one component alone."""
        return self._with(lambda name: name == component)

    def without(self, component: Component) -> "Allowance":
        """Return the allowance where one component is zero."""
        return self._with(lambda name: name != component)

    def _with(self, counts: Callable[[Component], bool]) -> "Allowance":
        parts = (self.pressures_MPa, self.factors, self.shares)
        pressures, factors, shares = (
            {name: value for name, value in part.items() if counts(name)} for part in parts
        )
        return replace(
            self,
            pressures_MPa=pressures,
            factors=factors,
            shares=shares,
            rounds=counts("rounding of pressures"),
        )


def allowance_of(
    signals: Signals, machine: Machine | None = None, *, sign: int = 1, dither_counts: int = 0
) -> Allowance:
    """Return what the offset of a side must leave free; so many counts of the dither are kept."""
    full = signals.compare_max
    # Half a count, because the compare value may be rounded up.
    shares: dict[Component, Fraction] = {"rounding of the drive": Fraction(1, 2 * full)}
    if dither_counts:
        shares["dither"] = Fraction(dither_counts, full)
    if machine is None:
        return Allowance(signals=signals, sign=sign, pressures_MPa={}, factors={}, shares=shares)
    if machine.current_rest_error:
        shares["current's rest"] = Fraction(repr(machine.current_rest_error))
    # An offset of the converter may be of either sign on each channel: they do not cancel.
    per_code = signals.pressure_a.per_code_MPa + signals.pressure_b.per_code_MPa
    pressures: dict[Component, Fraction] = {
        "bench pressure drop": Fraction(repr(machine.bench_pressure_error_MPa)),
        "pressure sensor A": Fraction(repr(machine.pressure_error_a_MPa)),
        "pressure sensor B": Fraction(repr(machine.pressure_error_b_MPa)),
        "pressure converter offset": machine.pressure_offset_codes * per_code,
        "pressure converter gain": machine.pressure_gain_codes * per_code,
        "pressure converter noise": machine.pressure_noise_codes * per_code,
    }
    return Allowance(
        signals=signals, sign=sign, pressures_MPa=pressures, factors=machine.least_factors, shares=shares
    )


def dither_reserve(
    driven: DrivenDither,
    recorded: Dither | None,
    machine: Machine | None = None,
    current_drive: CurrentDrive | None = None,
) -> int:
    """Return by how many counts the offset stays lower for the dither.

    Where the ramps were recorded with it, its peak on a machine that gives more current for a drive is larger than on
    the bench by as much as the threshold is smaller, and by that difference the valve passes flow earlier.

    A controlled current overshoots the set point's wave, or stays short of it: what counts is the current's peak, of
    ramps that were recorded with the wave any other one than theirs.
    """
    reserve = driven.reserve(recorded)
    if current_drive is not None:
        above, below = current_drive.dither_above_counts, current_drive.dither_below_counts
        reserve += above if recorded is None else max(above, below)
    if machine is None or recorded is None:
        return reserve
    return reserve + ceil(driven.counts * (1 - machine.least_factor))
