"""`Compensator`: the law on converter codes with exact rational coefficients, the artefact compensator.json."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import Artefact, RuleError, as_document, quantity, schema_of
from dzdesign.core.display import ShownInNotebooks
from dzdesign.core.documents import sha256_of, to_json
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.derivation.law import law
from dzdesign.derivation.scaling import (
    Line,
    drive,
    evaluate_law_command,
    evaluate_line,
    evaluate_share,
    evaluate_transition,
)
from dzdesign.design.current.drive import CurrentDrive
from dzdesign.design.design_choices import Above, BelowDp0
from dzdesign.design.drive_functions import RAMPED_CODES, DriveFunctions
from dzdesign.design.lot_valves import LotValve
from dzdesign.design.machine import Allowance, Machine, allowance_of, dither_reserve
from dzdesign.design.side_law import SideLaw, Sides
from dzdesign.design.signals import Signals
from dzdesign.design.target_inputs import CommandError, TargetInputs
from dzdesign.identify.valve.model import SIDES, ValveModel


@lru_cache(maxsize=64)
def line_in_beta(name: str, kappa: Fraction, u_min0_over_u_max: Fraction, n_adc: int, n_full: int) -> tuple[Line, Line]:
    """Return the law of a name in counts at beta 0, and what a beta of 1 adds; from the law itself at three betas.

    The arguments are those of `evaluate_line`; a law that is not straight in beta is a `RequirementError`.
    """
    at = [
        evaluate_line(
            law(name), beta=beta, kappa=kappa, u_min0_over_u_max=u_min0_over_u_max, n_adc=n_adc, n_full=n_full
        )
        for beta in (0, 1, 2)
    ]
    if any(2 * one != none + two for none, one, two in zip(*at, strict=True)):
        raise RequirementError(f"the law '{name}' is not straight in beta")
    return at[0], Line(slope=at[1].slope - at[0].slope, start=at[1].start - at[0].start)


Codes = Annotated[int, Meta(ge=0, le=65535)]


@dataclass(frozen=True, slots=True, kw_only=True)
class LargestGain:
    """The largest velocity gain of a position loop that comes to rest, at the test of a side where it is least."""

    side: str
    """Side of the valve."""
    dp_MPa: Annotated[float, quantity("MPa")]
    """Pressure drop of that test."""
    gain: Annotated[float, quantity("1/s", ge=0)]
    """Largest gain; 0 if the loop comes to rest at none."""
    linear: Annotated[float, quantity("1/s", ge=0)]
    """Gain at which the loop would swing with a valve without dead zone, play and transition."""


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Compensator(ShownInNotebooks, Artefact):
    """The law u_O = g(dP) u_i + o(dP) on converter codes with exact coefficients, as `dzdesign design` writes it."""

    FILE_NAME: ClassVar[str] = "compensator.json"
    REMEDY: ClassVar[str] = "make it again with `dzdesign design`, a lot's with `dzdesign batch`"
    schema: Literal["dzdesign.compensator/1"] = "dzdesign.compensator/1"
    """Name and version of this schema."""
    target: TargetInputs | None
    """Target of the design; null if it was not recorded."""
    options: Mapping[str, str] | None
    """Options of `design` as entered, defaults included; null if they were not recorded."""
    law: str
    """Compensation law: paper (Eq. 18) or target (meets Eq. 16)."""
    below_dp0: BelowDp0 = "hold"
    """Behaviour at dP <= dP0. hold: beta stays at 1. Otherwise beta follows the tests there."""
    above: Above = "lower"
    """Behaviour above the last test. The offset is held, lowered with the continued bound of valve.json, or released.
    With a single test, `hold` replaces `lower`."""
    u_max_V: Annotated[Fraction, quantity("V")]
    """Full command."""
    signals: Signals
    """Scalings of the command, the pressures and the compare value."""
    beta_denominator: Annotated[int, Meta(ge=1, le=2**30)]
    """Denominator of the nodes of beta, a power of two."""
    beta_step_codes: Annotated[int, Meta(ge=1, le=65535)]
    """Pressure codes between two nodes of beta, a power of two."""
    reverse_codes: Codes
    """Largest negative difference of pressure codes, as a magnitude, that is accepted. Beyond it a sensor is taken as
    failed and the smallest beta is used."""
    transition_codes: Codes = 0
    """Command codes of the transition from the closing to the opening threshold, which starts at the end of the zero
    band. A power of two, or 0 for none."""
    reading_flow_L_min: Annotated[float, quantity("L/min", gt=0, le=1000000.0)]
    """Reading flow: the flow at which dead zones are read, in addition to the onset."""
    zero_band_codes: Codes = 0
    """Largest command code that the law treats as zero; always 0 without a transition."""
    command_error: CommandError
    """Declared error of the command's code at zero."""
    sides: Sides
    """Law for each sign of the command."""
    drive_functions: DriveFunctions = field(default_factory=DriveFunctions)
    """Functions around the law, such as ramps and dither."""
    current_drive: CurrentDrive | None = None
    """Current control of the drive; null if the law's output is the duty of the PWM."""
    machine: Machine | None = None
    """Declared differences between machine and bench. Null: the certificate covers the valve as recorded, without coil,
    supply, sensors, converter, oil or ageing."""
    costs: tuple[str, ...]
    """Cost of each safe choice, in words."""
    position_loop: tuple[LargestGain, ...] | None = None
    """Largest gain of a position loop for each side, with the lag and the delay of that option; null if it was not
    computed."""
    valve: ValveModel
    """Identified valve from which the compensator was designed."""
    lot_sha256: str | None = field(init=False)
    """SHA-256 of `lot` as stored here; null for the setting of a single valve."""
    lot: tuple[LotValve, ...] = ()
    """Valves of the lot that shares this setting, with their bounds; empty for a single valve."""

    def __post_init__(self) -> None:
        law(self.law)
        if len(self.made_from) != 1:
            raise RuleError(f"'made_from' has {len(self.made_from)} files, expected valve.json alone")
        if (self.target is None) != (self.options is None):
            raise RuleError("'target' and 'options' belong together, expected both or neither")
        if self.u_max_V != Fraction(repr(self.valve.u_max_V)):
            raise RuleError(f"'u_max_V' is {float(self.u_max_V):g}, not that of its valve, {self.valve.u_max_V:g} V")
        self._check_codes()
        if self.machine is not None and (self.machine.drive == "current") != (self.current_drive is not None):
            raise RuleError(f"the machine's drive is '{self.machine.drive}', not the one of the compensator")
        if len(self.lot) == 1:
            raise RuleError("the lot has 1 valve, expected none, or two and more")
        if len({valve.name for valve in self.lot}) < len(self.lot):
            raise RuleError("the lot names a valve twice, expected each valve once")
        for sign in self.signals.signs:
            self._check_side(sign)
        lot_json = to_json({"lot": [as_document(valve) for valve in self.lot]}).encode()
        object.__setattr__(self, "lot_sha256", sha256_of(lot_json) if self.lot else None)

    def _check_codes(self) -> None:
        """Check that the whole numbers suit the firmware's arithmetic, and go with each other."""
        powers = ["beta_denominator", "beta_step_codes"] + ["transition_codes"] * bool(self.transition_codes)
        for name in powers:
            value = getattr(self, name)
            if value < 1 or value & (value - 1):
                raise RuleError(f"{name} is {value}, expected a power of two, so that the firmware needs no division")
        driven = {self.valve.side_name(sign) for sign in self.signals.signs}
        if {name for name in SIDES if getattr(self.sides, name)} != driven:
            raise RuleError(
                "a command of both signs needs a law for both sides, one of one sign for the positive side, or for the "
                "negative one of a valve tested with that alone"
            )
        if self.current_drive is not None and self.current_drive.loop.two != self.two_sided:
            raise RuleError("a current loop of two solenoids needs a law for both sides, one of one solenoid for one")
        limit, command = self.drive_functions.compare_limit, self.signals.command
        if limit > self.signals.compare_max:
            raise RuleError(f"the compare limit is {limit}, above full drive, {self.signals.compare_max}")
        longest = max(abs(code - command.zero_code) for code in command.valid_codes)
        if self.drive_functions.has_ramp and longest > RAMPED_CODES:
            raise RuleError(f"a ramp counts up to {RAMPED_CODES} codes of command from zero on; use a shorter signal")

    def _check_side(self, sign: int) -> None:
        """Check that the tables of a side cover every code that the firmware may look up."""
        side, functions, span = self.side(sign), self.drive_functions, self.signals.command.span(sign)
        if len(side.beta) != self.nodes(sign):
            raise RuleError(f"beta has {len(side.beta)} nodes, expected {self.nodes(sign)} for every code")
        if not all(0 < numerator < 2 * self.beta_denominator for numerator in side.law_beta + side.beta):
            raise RuleError("every beta must lie between 0 and 2, exclusive")
        if bool(self.transition_codes) != (side.transition_beta is not None):
            raise RuleError("a transition needs the opening threshold's beta, and its codes of command")
        if bool(self.transition_codes) != bool(self.zero_band_codes):
            raise RuleError("a zero band and a transition belong together, expected both or neither")
        needed = span // functions.play_step_codes + 2
        if functions.has_play and len(nodes := functions.play_counts[0 if sign > 0 else 1]) != needed:
            raise RuleError(f"a play has {len(nodes)} nodes, expected {needed} for every command")

    @property
    def two_sided(self) -> bool:
        """True if the command has both signs and drives two solenoids."""
        return len(self.signals.signs) == 2

    @property
    def positive(self) -> SideLaw | None:
        """The law of the valve's positive side, if that is driven."""
        return self.sides.positive

    @property
    def negative(self) -> SideLaw | None:
        """The law of the valve's negative side, if that is driven."""
        return self.sides.negative

    @property
    def certified_of(self) -> str:
        """What the certificate covers: the valve as recorded, alone or with the declared machine."""
        return "the valve as recorded" if self.machine is None else "the valve as recorded and the declared machine"

    @property
    def valve_json_sha256(self) -> str:
        """SHA-256 of the valve.json from which it was designed."""
        return self.made_from[0].sha256

    def side(self, sign: int = 1) -> SideLaw:
        """Return the law of one sign of command."""
        name = self.valve.side_name(sign)
        side: SideLaw | None = getattr(self.sides, name)
        if side is None:
            raise InputError(f"this compensator has no law for {name} commands")
        return side

    @property
    def dither_reserve_counts(self) -> int:
        """Counts by which the dither lowers the offset; almost none if the ramps were recorded with it."""
        driven = self.drive_functions.dither(self.signals)
        return dither_reserve(driven, self.valve.dither, self.machine, self.current_drive)

    def allowance(self, sign: int) -> Allowance:
        """Return the margin that the offset of a side keeps below the certified curve."""
        return allowance_of(self.signals, self.machine, sign=sign, dither_counts=self.dither_reserve_counts)

    @property
    def transition_end(self) -> int:
        """Command code at which zero band and transition end."""
        return self.zero_band_codes + self.transition_codes

    def nodes(self, sign: int = 1) -> int:
        """Return the number of nodes that beta needs to cover every pressure-code difference."""
        return self.signals.pair(sign).largest_difference // self.beta_step_codes + 2

    def beta(self, dp_code: int, sign: int = 1) -> Fraction:
        """Return the exact certified beta at a pressure-code difference."""
        return self._interpolate(self.side(sign).beta, dp_code)

    def law_beta(self, dp_code: int, sign: int = 1) -> Fraction:
        """Return the beta that the law follows after the transition; without a transition, the certified one."""
        return self._interpolate(self.side(sign).law_beta, dp_code)

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
        """Return the exact compare value of the law at a code pair, before rounding and limiting."""
        side, signals, beta = self.side(sign), self.signals, self.law_beta(dp_code, sign)
        from_zero = signals.command.from_zero(command_code, sign)
        span, u_min0 = signals.command.span(sign), side.u_min0_over_u_max
        none, more = line_in_beta(self.law, side.drive_range_over_u_max, u_min0, span, signals.compare_max)

        def line(code: int | Fraction) -> Fraction:
            return Fraction(none.start + code * none.slope + beta * (more.start + code * more.slope))

        if from_zero >= self.transition_end:
            return line(from_zero)
        share = evaluate_share(from_zero, zero_band=self.zero_band_codes, end=self.transition_end)
        lowered = evaluate_transition(
            beta_opening=beta,
            beta_closing=self.beta(dp_code, sign),
            u_min0_over_u_max=u_min0,
            share_of_transition=share,
            n_full=signals.compare_max,
        )
        return Fraction(line(evaluate_law_command(share, end=self.transition_end)) - lowered)

    def drive(self, command_code: int, dp_code: int, sign: int = 1) -> Fraction:
        """Return the exact u_O/u_max of the law at a code pair, before limiting to 0...1."""
        return Fraction(drive(self.counts(command_code, dp_code, sign), self.signals.compare_max))

    def compare(self, command_code: int, dp_code: int, sign: int = 1) -> int:
        """Return the PWM compare value: the law rounded to the nearest count (half up) and limited to the range."""
        counts = self.counts(command_code, dp_code, sign)
        rounded = (2 * counts.numerator + counts.denominator) // (2 * counts.denominator)
        return min(max(rounded, 0), self.drive_functions.compare_limit)


SCHEMA = schema_of(Compensator)
