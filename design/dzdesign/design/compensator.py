"""`Compensator`: the law on converter codes with exact rational coefficients, and the certificate that goes with it."""

from dataclasses import dataclass, field
from fractions import Fraction

from dzdesign.core.errors import InputError
from dzdesign.core.result_display import ShownInNotebooks
from dzdesign.derivation.law import law
from dzdesign.derivation.scaling import drive, evaluate_line
from dzdesign.derivation.transition import evaluate_transition
from dzdesign.design.drive import RAMPED_CODES, Amplifier
from dzdesign.design.lot import LotValve
from dzdesign.design.request import DesignRequest
from dzdesign.design.signals import Signals
from dzdesign.identify.fitting.guard_curve import GUARDS

#: What to do below the reference pressure drop: beta = 1 as in Eq. (7), or what the tests there say.
BELOW_REFERENCE = ("hold", "extend")


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """What is proved about the offset of one side, on the integers.

    Attributes
    ----------
    confidence : float
        With which the threshold's lower bounds hold together.
    guard : {"closing", "mean", "opening"}
        The threshold that they bound.
    level_L_min : float
        Flow that counted as flow when the thresholds were identified.
    dp_MPa : tuple of Fraction
        Interval of the pressure drop on which it holds.
    smallest_margin_V : Fraction
        Smallest distance from the offset to the lower bound, over every pressure code of the interval.
    mean_loss_V, largest_loss_V : float
        By how much the table's offset stays under the certified curve, over the same codes: the price of few nodes,
        rounding, the converter's error and the dither.
    """

    confidence: float
    guard: str
    level_L_min: float
    dp_MPa: tuple[Fraction, Fraction]
    smallest_margin_V: Fraction
    mean_loss_V: float
    largest_loss_V: float

    def __post_init__(self) -> None:
        if self.guard not in GUARDS:
            raise InputError(f"the guard is {self.guard[:40]!r}, expected {', '.join(GUARDS[:-1])} or {GUARDS[-1]}")


@dataclass(frozen=True, slots=True, kw_only=True)
class SideLaw:
    """The law of one sign of command.

    Attributes
    ----------
    k_x_max_over_u_max, u_min0_over_u_max : Fraction
        Coefficients, integers over a power of two; k x_max counts from the law's offset u_min0 on, not from the knee.
    beta_numerators : tuple of int
        Nodes of beta at zero command, certified, at pressure codes 0, step, 2 step, ...; straight between them.
    edge_numerators : tuple of int or None
        With an edge: nodes of the opening threshold's beta, that the law follows beyond it; none below the certified.
    certificate : Certificate
        What is proved.
    """

    k_x_max_over_u_max: Fraction
    u_min0_over_u_max: Fraction
    beta_numerators: tuple[int, ...]
    edge_numerators: tuple[int, ...] | None = None
    certificate: Certificate

    def __post_init__(self) -> None:
        if not 0 < self.u_min0_over_u_max < 1:
            raise InputError(f"u_min0 is {float(self.u_min0_over_u_max):.3f} of u_max, expected between 0 and 1")
        if not 0 < self.k_x_max_over_u_max <= 10**3:
            raise InputError("k x_max/u_max must be positive")
        if self.edge_numerators is not None:
            if len(self.edge_numerators) != len(self.beta_numerators):
                raise InputError("the edge's beta must have as many nodes as the certified one")
            if any(e < b for e, b in zip(self.edge_numerators, self.beta_numerators, strict=True)):
                raise InputError("the edge's beta lies below the certified one, expected the opening threshold above")

    @property
    def law_numerators(self) -> tuple[int, ...]:
        """Nodes of the beta that the law follows beyond the edge; without one the certified beta itself."""
        return self.beta_numerators if self.edge_numerators is None else self.edge_numerators


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Compensator(ShownInNotebooks):
    """The law ``u_O = g(dP) u_i + o(dP)`` on codes, every coefficient an exact rational number.

    Attributes
    ----------
    law_name : str
        ``paper`` (Eq. 18) or ``target`` (meets Eq. 16).
    below_reference : {"hold", "extend"}
        What beta does for dP <= dP0.
    signals : Signals
        Scalings of command, pressures and compare value.
    u_max_V : Fraction
        Full command.
    positive : SideLaw
        For positive commands.
    negative : SideLaw or None
        For negative commands, of a valve with two solenoids.
    beta_denominator, beta_step_codes : int
        Of the nodes of beta: their unit, and the pressure codes between two of them; powers of two.
    reverse_codes : int
        Differences of pressure codes below ``-reverse_codes`` are taken as a failed sensor: the smallest beta is used.
    edge_codes : int
        Codes of command over which the drive runs from the closing to the opening threshold, a power of two; 0: none.
    amplifier : Amplifier
        Ramps, dither and the like.
    costs : tuple of str
        What the safe choices cost, in a person's words.
    valve_document, valve_sha256 : str
        The valve.json it was designed from, whole, and its hash: provenance, and the plant for the closed loop.
    request : DesignRequest or None
        Target and options that it was designed with; None where nobody wrote them down.
    common_valves : int
        Of one setting for many valves: how many; 0 of a valve's own.
    lot : tuple of LotValve
        These valves and their bounds; empty of a valve's own setting, and in a file from before they were kept.
    """

    law_name: str
    below_reference: str = "hold"
    signals: Signals
    u_max_V: Fraction
    positive: SideLaw
    negative: SideLaw | None = None
    beta_denominator: int
    beta_step_codes: int
    reverse_codes: int
    edge_codes: int = 0
    amplifier: Amplifier = field(default_factory=Amplifier)
    costs: tuple[str, ...]
    valve_document: str
    valve_sha256: str
    request: DesignRequest | None = None
    common_valves: int = 0
    lot: tuple[LotValve, ...] = ()

    def __post_init__(self) -> None:
        law(self.law_name)
        if self.below_reference not in BELOW_REFERENCE:
            raise InputError(f"below_dp0 is '{self.below_reference}', expected {' or '.join(BELOW_REFERENCE)}")
        powers = ["beta_denominator", "beta_step_codes"] + ["edge_codes"] * bool(self.edge_codes)
        for name in powers:
            value = getattr(self, name)
            if value < 1 or value & (value - 1):
                raise InputError(f"{name} is {value}, expected a power of two, so that the firmware needs no division")
        if not 0 <= self.reverse_codes <= self.signals.code_max // 20:
            raise InputError(f"reverse_codes is {self.reverse_codes}, expected noise about zero: up to 5 % of the span")
        if not 0 < self.u_max_V <= 10**4:
            raise InputError(f"u_max is {float(self.u_max_V):g} V, expected a positive command")
        if (self.negative is None) != (len(self.signals.signs) == 1):
            raise InputError("a command of both signs needs a law for both sides, one of one sign for one")
        if self.amplifier.compare_limit > self.signals.compare_max:
            raise InputError(
                f"the compare limit is {self.amplifier.compare_limit}, above full drive, {self.signals.compare_max}"
            )
        command = self.signals.command
        if (
            self.amplifier.has_ramp
            and max(abs(code - command.zero_code) for code in command.valid_codes) > RAMPED_CODES
        ):
            raise InputError(f"a ramp counts up to {RAMPED_CODES} codes of command from zero on; use a shorter signal")
        if self.common_valves == 1:
            raise InputError("common_valves is 1, expected 0 of a valve's own setting, and two or more of a common one")
        if self.lot and len(self.lot) != self.common_valves:
            raise InputError(f"the lot has {len(self.lot)} valves, expected {self.common_valves} as common_valves says")
        if len({valve.name for valve in self.lot}) < len(self.lot):
            raise InputError("the lot names a valve twice, expected each valve once")
        for sign in self.signals.signs:
            self._check_side(sign)

    def _check_side(self, sign: int) -> None:
        side = self.side(sign)
        nodes = self.nodes(sign)
        if len(side.beta_numerators) != nodes:
            raise InputError(f"beta has {len(side.beta_numerators)} nodes, expected {nodes} for every code")
        if not all(
            0 < numerator < 2 * self.beta_denominator for numerator in side.law_numerators + side.beta_numerators
        ):
            raise InputError("every beta must lie between 0 and 2, exclusive")
        if bool(self.edge_codes) != (side.edge_numerators is not None):
            raise InputError("an edge needs the opening threshold's beta, and its codes of command")
        if self.edge_codes > self.signals.command.span(sign) // 10:
            raise InputError(f"the edge takes {self.edge_codes} codes, expected at most a tenth of the command")

    def side(self, sign: int = 1) -> SideLaw:
        """Return the law of one sign of command."""
        if sign < 0 and self.negative is None:
            raise InputError("this compensator has no law for negative commands")
        return self.positive if sign > 0 else self.negative

    def nodes(self, sign: int = 1) -> int:
        """Return how many nodes beta needs for every difference of pressure codes."""
        return self.signals.largest_difference(sign) // self.beta_step_codes + 2

    def beta(self, dp_code: int, sign: int = 1) -> Fraction:
        """Return the certified beta at a difference of pressure codes, exactly."""
        return self._interpolate(self.side(sign).beta_numerators, dp_code)

    def law_beta(self, dp_code: int, sign: int = 1) -> Fraction:
        """Return the beta that the law follows beyond the edge; the certified one without an edge."""
        return self._interpolate(self.side(sign).law_numerators, dp_code)

    def _interpolate(self, numerators: tuple[int, ...], dp_code: int) -> Fraction:
        """Return a table at a difference; below ``-reverse_codes`` its smallest value: the safe one."""
        if dp_code < -self.reverse_codes:
            return Fraction(min(numerators), self.beta_denominator)
        index, past = divmod(max(dp_code, 0), self.beta_step_codes)
        left, right = numerators[index], numerators[index + 1]
        return Fraction(
            left * (self.beta_step_codes - past) + right * past, self.beta_denominator * self.beta_step_codes
        )

    def counts(self, command_code: int, dp_code: int, sign: int = 1) -> Fraction:
        """Return the compare value of the law at a code pair, exactly: not rounded, not limited."""
        side, signals = self.side(sign), self.signals
        from_zero = signals.command.from_zero(command_code, sign)
        beta = self.law_beta(dp_code, sign)
        line = evaluate_line(
            law(self.law_name),
            beta=beta,
            kappa=side.k_x_max_over_u_max,
            u_min0_over_u_max=side.u_min0_over_u_max,
            n_adc=signals.command.span(sign),
            n_full=signals.compare_max,
        )
        counts = line.slope * from_zero + line.start
        if from_zero < self.edge_codes:
            counts -= evaluate_transition(
                beta_opening=beta,
                beta_closing=self.beta(dp_code, sign),
                u_min0_over_u_max=side.u_min0_over_u_max,
                share_of_transition=Fraction(from_zero, self.edge_codes),
                n_full=signals.compare_max,
            )
        return counts

    def drive(self, command_code: int, dp_code: int, sign: int = 1) -> Fraction:
        """Return u_O/u_max of the law at a code pair, exactly and before it is limited to 0...1."""
        return drive(self.counts(command_code, dp_code, sign), self.signals.compare_max)

    def compare(self, command_code: int, dp_code: int, sign: int = 1) -> int:
        """Return the PWM compare value: the law rounded to the nearest count (a half goes up), limited to the range."""
        counts = self.counts(command_code, dp_code, sign)
        rounded = (2 * counts.numerator + counts.denominator) // (2 * counts.denominator)
        return min(max(rounded, 0), self.amplifier.compare_limit)
