"""The engineer's choices for `design`."""

from dataclasses import dataclass, field
from fractions import Fraction
from math import ceil, floor

from dzdesign.core.dither import HIGHEST_HZ, LARGEST_PEAK, LOWEST_HZ
from dzdesign.core.errors import InputError, nearest
from dzdesign.design.current.drive import CurrentDrive, CurrentRequest, design_current_drive
from dzdesign.design.design_choices import ABOVE, BELOW_DP0, Above, BelowDp0, DesignRequest, NegativeDp
from dzdesign.design.drive_functions import MOST_FAULT_SAMPLES, RAMP_UNIT, DriveFunctions
from dzdesign.design.machine.machine import Machine
from dzdesign.design.signals import Signals
from dzdesign.design.target_inputs import Converter
from dzdesign.design.zero_band import LEAST_TRANSITION, LEAST_TRANSITION_NOISE, CommandError, command_error_of
from dzdesign.identify.valve.guard_curve import GUARDS, Guard

#: The transition where nothing is said; largest transition and dither, of full command or drive.
TRANSITION = Fraction(1, 100)
LARGEST_TRANSITION = Fraction(1, 10)
LARGEST_DITHER = Fraction(repr(LARGEST_PEAK))
#: Frequencies that a proportional valve's dither has, Hz.
DITHER_HZ = (LOWEST_HZ, HIGHEST_HZ)
LONGEST_RAMP_S = 600.0
#: Samples that a fault must be over for, where nothing is said: 4 ms at 1.25 kHz.
FAULT_SAMPLES = 5
#: Beyond any flow that a valve of a control passes.
MOST_L_MIN = 1e6
#: What a design is refused for unless it is accepted: a warning of `identify`, and what its signals hide.
ACCEPTABLE = ("branch-order", "broken-sensor")


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignOptions:
    """Options of the design.

    Attributes
    ----------
    law : str
        ``paper`` (Eq. 18) or ``target`` (meets Eq. 16).
    signals : Signals
        Scalings of the converter and the PWM.
    negative_dp : {"recorded", "same", "swapped", "wired"} or None
        Pressure drop at negative commands. None: as `signals` states it.
    guard : {"closing", "mean", "opening"}
        Threshold that the certificate must protect. Zero command comes after closing. A valve without a recorded
        falling branch is therefore refused, unless the guard is "opening".
    below_dp0 : {"hold", "extend"}
        Beta at dP <= dP0: held at 1 as in the paper (Eq. 7), or following the tests there, with beta above 1.
    above : {"hold", "lower", "release"}
        Offset above the highest tested pressure drop: held, lowered with the continued bound, or released.
    transition : Fraction or None
        Share of full command, after the zero band, over which the drive runs from the closing to the opening threshold.
        0: no transition and no zero band. None: `TRANSITION`, or as many codes as the noise requires.
    command_error : CommandError or None
        Error of the command's code at zero, which sets the zero band. None: that of the F28335's converter.
    ramp_up_s, ramp_down_s : tuple of float
        Time of the command from zero to full and back, s, for positive and negative commands. 0: no limit.
    dither_Hz, dither_peak : float, Fraction
        Frequency of the square-wave dither in Hz, and its peak (half its height) over full drive. 0: no dither.
    play : bool
        Whether a falling command is driven lower than a rising one, by the valve's hysteresis.
    output_max : Fraction
        Largest drive over full drive.
    fault_samples : int
        Consecutive valid samples that end a fault.
    fault_latch : bool
        Whether a fault of that many samples lasts until a reset.
    interlock : bool
        Whether the drive waits for zero command after a reset or an invalid command.
    reading_flow_L_min : float or None
        Flow at which dead zones are read, in addition to the onset. None selects the meter's floor, or the noise level
        of a meter without one.
    full_command_V : Fraction or None
        Full command that the signal states, V.
    accept : tuple of str
        Codes of `ACCEPTABLE` that do not lead to a refusal.
    current : CurrentRequest or None
        Coil, supply and sensor of a current-controlled drive. None: the law's output is the PWM's duty.
    machine : Machine or None
        Declared differences between machine and bench. None: the certificate covers only the valve as recorded.
    request : DesignRequest or None
        Target and option texts from which these options were read, to be kept in compensator.json.
    """

    law: str = "paper"
    signals: Signals = field(default_factory=Signals)
    negative_dp: NegativeDp | None = None
    guard: Guard = "closing"
    below_dp0: BelowDp0 = "hold"
    above: Above = "lower"
    transition: Fraction | None = None
    command_error: CommandError | None = None
    ramp_up_s: tuple[float, float] = (0.0, 0.0)
    ramp_down_s: tuple[float, float] = (0.0, 0.0)
    dither_Hz: float = 0.0
    dither_peak: Fraction = Fraction(0)
    play: bool = False
    output_max: Fraction = Fraction(1)
    fault_samples: int = FAULT_SAMPLES
    fault_latch: bool = False
    interlock: bool = True
    reading_flow_L_min: float | None = None
    full_command_V: Fraction | None = None
    accept: tuple[str, ...] = ()
    current: CurrentRequest | None = None
    machine: Machine | None = None
    request: DesignRequest | None = None

    def __post_init__(self) -> None:
        for what, given, known in (
            ("guard", self.guard, GUARDS),
            ("choice below dP0", self.below_dp0, BELOW_DP0),
            ("choice above the tests", self.above, ABOVE),
        ):
            if given not in known:
                raise InputError(
                    f"the {what} is '{given}'{nearest(given, known)}, expected {', '.join(known[:-1])} or {known[-1]}"
                )
        for code in self.accept:
            if code not in ACCEPTABLE:
                raise InputError(
                    f"what to accept is '{code}'{nearest(code, ACCEPTABLE)}, expected {' or '.join(ACCEPTABLE)}: "
                    "nothing else can be accepted"
                )
        for what, share, limit in (
            ("transition", self.transition or Fraction(0), LARGEST_TRANSITION),
            ("dither", self.dither_peak, LARGEST_DITHER),
        ):
            if not 0 <= share <= limit:
                raise InputError(f"the {what} is {float(share):.3%}, expected 0 to {float(limit):.0%}")
        if not 0 < self.output_max <= 1:
            raise InputError(f"the largest output is {float(self.output_max):.3%}, expected more than 0, up to 100 %")
        if not 1 <= self.fault_samples <= MOST_FAULT_SAMPLES:
            raise InputError(
                f"--fault-debounce is {self.fault_samples} samples, expected 1 to {MOST_FAULT_SAMPLES}, "
                f"{1e3 / self.signals.sample_Hz:g} ms to {MOST_FAULT_SAMPLES / self.signals.sample_Hz:g} s"
            )
        if self.reading_flow_L_min is not None and not 0 < self.reading_flow_L_min <= MOST_L_MIN:
            expected = "more than zero" if self.reading_flow_L_min <= 0 else f"at most {MOST_L_MIN:g} L/min"
            raise InputError(
                f"the reading flow is {self.reading_flow_L_min:g} L/min, expected {expected}, such as '0.6 L/min'"
            )
        if bool(self.dither_Hz) != bool(self.dither_peak):
            raise InputError("a dither needs both, a frequency and a peak, such as '150 Hz 1 %'")
        if self.dither_Hz and not DITHER_HZ[0] <= self.dither_Hz <= DITHER_HZ[1]:
            raise InputError(
                f"the dither's frequency is {self.dither_Hz:g} Hz, expected {DITHER_HZ[0]:g} to {DITHER_HZ[1]:g} Hz"
            )
        if self.play and self.transition == 0:
            raise InputError("--hysteresis play begins in the transition, but --transition is off; leave out one")
        for seconds in self.ramp_up_s + self.ramp_down_s:
            if not 0 <= seconds <= LONGEST_RAMP_S or 0 < seconds < 1 / self.signals.sample_Hz:
                raise InputError(
                    f"a ramp takes {seconds:g} s, expected 0 (none), or from one sample, "
                    f"{1 / self.signals.sample_Hz:g} s, to {LONGEST_RAMP_S:g} s"
                )

    def transition_codes(self) -> int:
        """Return the codes of the transition: the largest power of two within its share of the shorter command.

        A narrower one than the command's noise allows is refused; where nothing is said the least that it allows.
        """
        if self.transition == 0:
            return 0
        span = min(self.signals.command.span(sign) for sign in self.signals.signs)
        least = self.error.least_transition
        codes = int((TRANSITION if self.transition is None else self.transition) * span)
        if self.transition is None:
            codes = max(codes, 1 << (least - 1).bit_length())
        codes = 1 << (codes.bit_length() - 1) if codes else 0
        if codes < least:
            needed = Fraction(1 << (least - 1).bit_length(), span)
            raise InputError(
                f"a transition of {float(self.transition or 0):.3%} is {codes} codes of the command, a power of two, "
                f"expected {LEAST_TRANSITION} or more and {LEAST_TRANSITION_NOISE} times the noise's peak of "
                f"{self.error.noise_codes}; give --transition {float(needed) + 5e-6:.3%} or more, or off"
            )
        if (taken := codes + self.error.zero_band_codes) > span // 10:
            raise InputError(
                f"a zero band of {self.error.zero_band_codes} codes and a transition of {codes} take {taken} of the "
                f"command's {span} codes, expected a tenth at most; give a --command-signal over more of the "
                "converter, a smaller --command-error, or --transition off"
            )
        return codes

    @property
    def dither_text(self) -> str:
        """The dither as `--dither` takes it."""
        return f"{self.dither_Hz:g} Hz {100 * float(self.dither_peak):g} %"

    @property
    def error(self) -> CommandError:
        """The command's error: what was declared, or that of the F28335's converter."""
        return self.command_error or command_error_of("", Converter(), self.signals.command)

    def current_drive(self) -> CurrentDrive | None:
        """Return the current control that is asked for, its loop chosen."""
        if self.current is None:
            return None
        if len(self.signals.signs) == 2:
            raise InputError("--drive current is for one solenoid, but the command has both signs; give --drive duty")
        converter = self.request.target.converter if self.request else Converter()
        dither = (self._dither_counts(), self._dither_ticks())
        return design_current_drive(self.current, converter, self.signals.compare_max, dither)

    def drive_functions(self, transition_codes: int) -> DriveFunctions:
        """Return what the drive does around the law, in the firmware's integers."""
        signals, command = self.signals, self.signals.command
        spans = tuple(command.span(sign) if sign in signals.signs else 0 for sign in (1, -1))
        both = len(signals.signs) == 2
        return DriveFunctions(
            leave_zero_codes=self.error.leave_zero_codes if both or transition_codes else 0,
            ramp_up=self._ramp(self.ramp_up_s, spans),
            ramp_down=self._ramp(self.ramp_down_s, spans),
            dither_counts=self._dither_counts(),
            dither_ticks=self._dither_ticks(),
            compare_limit=int(self.output_max * signals.compare_max),
            fault_samples=self.fault_samples,
            fault_latch=self.fault_latch,
            interlock_codes=self.error.zero_band_codes if self.interlock else None,
        )

    def _dither_counts(self) -> int:
        counts = round(self.dither_peak * self.signals.compare_max)
        if self.dither_peak and not counts:
            raise InputError(
                f"a dither of {float(self.dither_peak):.4%} is less than half a count of the PWM, "
                f"1/{self.signals.compare_max}; give more, or leave it out"
            )
        return counts

    def _dither_ticks(self) -> int:
        """Return the PWM periods of half a wave: the nearest frequency within `DITHER_HZ`."""
        if not self.dither_Hz:
            return 1
        half = self.signals.tick_Hz / 2
        slowest, fastest = floor(half / DITHER_HZ[0]), ceil(half / DITHER_HZ[1])
        if fastest > slowest:
            raise InputError(
                f"no whole number of PWM periods, {self.signals.tick_Hz} a second, makes a dither of "
                f"{DITHER_HZ[0]:g} to {DITHER_HZ[1]:g} Hz; leave it out"
            )
        return min(max(round(half / self.dither_Hz), fastest), slowest)

    def _ramp(self, seconds: tuple[float, float], spans: tuple[int, ...]) -> tuple[int, int]:
        """Return the steps per sample; at least one unit, so that a ramp never stands still."""
        positive, negative = (
            max(1, round(RAMP_UNIT * span / (time * self.signals.sample_Hz))) if time and span else 0
            for time, span in zip(seconds, spans, strict=True)
        )
        return positive, negative
