"""The engineer's choices for `design`: read from their texts, with the bounds that hold between them."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from math import ceil, floor
from typing import cast

from dzdesign.core.dither import HIGHEST_HZ, LARGEST_PEAK, LOWEST_HZ, parted
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import arguments_of, flag_of
from dzdesign.core.units import parse_quantity
from dzdesign.design.current.drive import CurrentDrive, CurrentRequest, design_current_drive
from dzdesign.design.current.texts import current_request
from dzdesign.design.design_choices import DEFAULTS, Above, BelowDp0, DesignChoices, DesignRequest, NegativeDp
from dzdesign.design.drive_functions import MOST_FAULT_SAMPLES, RAMP_UNIT, DriveFunctions
from dzdesign.design.machine.machine import Machine
from dzdesign.design.machine.texts import machine_of
from dzdesign.design.signal_text import (
    command_signal,
    full_command_V,
    live_zero_signal,
    parse_signal,
    pressure_signal,
)
from dzdesign.design.signals import Signals
from dzdesign.design.target_inputs import Converter, TargetInputs
from dzdesign.design.zero_band import LEAST_TRANSITION, LEAST_TRANSITION_NOISE, CommandError, command_error_of
from dzdesign.identify.constants import L_MIN
from dzdesign.identify.valve.guard_curve import GUARDS, Guard
from dzdesign.identify.valve.model import DECIMALS

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
    """Options of the design, as values; `DesignChoices` says what each means."""

    law: str = "paper"
    signals: Signals = field(default_factory=Signals)
    #: None: as `signals` states it.
    negative_dp: NegativeDp | None = None
    guard: Guard = "closing"
    below_dp0: BelowDp0 = "hold"
    above: Above = "lower"
    #: Share of full command. 0: no transition and no zero band. None: `TRANSITION`, or what the noise requires.
    transition: Fraction | None = None
    #: None: that of the F28335's converter.
    command_error: CommandError | None = None
    #: Of positive and negative commands; 0: no limit.
    ramp_up_s: tuple[float, float] = (0.0, 0.0)
    ramp_down_s: tuple[float, float] = (0.0, 0.0)
    #: 0: no dither. The peak is half the wave's height over full drive.
    dither_Hz: float = 0.0
    dither_peak: Fraction = Fraction(0)
    #: Whether a falling command is driven lower than a rising one, by the valve's hysteresis.
    play: bool = False
    output_max: Fraction = Fraction(1)
    fault_samples: int = FAULT_SAMPLES
    fault_latch: bool = False
    interlock: bool = True
    #: None: the meter's floor, or the noise level of a meter without one.
    reading_flow_L_min: float | None = None
    #: Full command that the signal states, V.
    full_command_V: Fraction | None = None
    #: Of `ACCEPTABLE`.
    accept: tuple[str, ...] = ()
    #: None: the law's output is the PWM's duty.
    current: CurrentRequest | None = None
    #: None: the certificate covers only the valve as recorded.
    machine: Machine | None = None
    #: Target and texts from which these options were read, to be kept in compensator.json.
    request: DesignRequest | None = None

    def __post_init__(self) -> None:
        for name in ("guard", "below_dp0", "above"):
            _check_word(name, getattr(self, name))
        for word in self.accept:
            _check_word("accept", word)
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

#: Words that an option takes where its declaration names a place to import them from.
PLACED = {"guard": GUARDS, "accept": ACCEPTABLE}
#: Words that an option takes, by its name.
WORDS: Mapping[str, tuple[str, ...]] = {
    argument.name: words
    for argument in arguments_of(DesignChoices)
    if isinstance(words := PLACED.get(argument.name, argument.option.choices), tuple)
}


def _check_word(name: str, word: str) -> None:
    if word not in (known := WORDS[name]):
        *most, last = known
        raise InputError(
            f"{flag_of(name)} is '{word}'{nearest(word, known)}, expected {', '.join(most)} or {last}"
        )


def options_of(texts: Mapping[str, str], target: TargetInputs) -> DesignOptions:
    """Return the engineer's choices, each from its text; the default stands for one that is missing or empty."""
    text = {name: texts.get(name) or default for name, default in DEFAULTS.items()}
    for name in ("negative_dp", "polarity", "hysteresis", "fault_latch", "interlock", "drive"):
        _check_word(name, text[name])
    converter = target.converter
    full_V = float(converter.full_V)
    text["command_signal"] = text["command_signal"] or f"0..10 V x {full_V / 10:.12g}"
    for name in ("pressure_a", "pressure_b"):
        text[name] = text[name] or live_zero_signal(converter)
    span = Fraction(round(parse_quantity(text["pressure_span"], "pressure", "--pressure-span")), 10**6)
    if span <= 0:
        raise InputError(f"--pressure-span is '{text['pressure_span']}', expected more than zero")
    sensors = {
        name: pressure_signal(parse_signal(text[name], flag_of(name)), converter, span)
        for name in ("pressure_a", "pressure_b")
    }
    signal = parse_signal(text["command_signal"], "--command-signal")
    command = command_signal(signal, converter, inverted=text["polarity"] == "inverted")
    dither_Hz, dither_peak = _dither(text["dither"])
    signals = Signals(
        code_max=converter.code_max,
        compare_max=target.compare_max,
        sample_Hz=target.sample_Hz,
        tick_Hz=target.tick_Hz,
        command=command,
        pressure_a=sensors["pressure_a"],
        pressure_b=sensors["pressure_b"],
    )
    current = current_request(text, target)
    return DesignOptions(
        law=text["law"],
        signals=signals,
        negative_dp=cast(NegativeDp, text["negative_dp"]),
        guard=cast(Guard, text["guard"]),
        below_dp0=cast(BelowDp0, text["below_dp0"]),
        above=cast(Above, text["above"]),
        transition=_transition(text["transition"]),
        command_error=command_error_of(text["command_error"], converter, command),
        ramp_up_s=_seconds(text["ramp_up"], "--ramp-up"),
        ramp_down_s=_seconds(text["ramp_down"], "--ramp-down"),
        dither_Hz=dither_Hz,
        dither_peak=dither_peak,
        play=text["hysteresis"] == "play",
        output_max=_share(text["output_max"], "--output-max"),
        fault_samples=_samples(text["fault_debounce"], target.sample_Hz),
        fault_latch=text["fault_latch"] == "on",
        interlock=text["interlock"] == "on",
        reading_flow_L_min=_flow_L_min(text["reading_flow"], "--reading-flow") if text["reading_flow"] else None,
        full_command_V=full_command_V(signal),
        accept=tuple(text["accept"].replace(",", " ").split()),
        current=current,
        machine=machine_of(text, target, signals, current),
        request=DesignRequest(target=target, options=text),
    )


def _transition(text: str) -> Fraction | None:
    """Read ``auto`` (None), ``off`` (0) or a share."""
    if text == "auto":
        return None
    return Fraction(0) if text == "off" else _share(text, "--transition")


def _share(text: str, option: str) -> Fraction:
    value = parse_quantity(text, "ratio", option)
    return Fraction(round(value * 10**9), 10**9)


def _flow_L_min(text: str, option: str) -> float:
    return round(parse_quantity(text, "flow", option) / L_MIN, DECIMALS)


def _seconds(text: str, option: str) -> tuple[float, float]:
    """Read one time, or two with a slash between: of positive and of negative commands."""
    parts = [parse_quantity(part.strip(), "time", option) for part in text.split("/")]
    if len(parts) > 2:
        raise InputError(f"{option} is '{text}', expected a time, or two such as '0.5 s / 0.8 s'")
    return parts[0], parts[-1]


def _samples(text: str, sample_Hz: int) -> int:
    """Read a number of samples, or a time as the samples that it needs."""
    if match := re.fullmatch(r"(\d{1,9}) ?samples?", text.strip()):
        return int(match[1])
    try:
        seconds = parse_quantity(text, "time", "--fault-debounce")
    except InputError as error:
        raise InputError(f"--fault-debounce is '{text}', expected '5 samples' or a time such as '4 ms'") from error
    return ceil(Fraction(repr(seconds)) * sample_Hz)


def _dither(text: str) -> tuple[float, Fraction]:
    """Read ``off`` or a frequency and the peak of the wave."""
    if text == "off":
        return 0.0, Fraction(0)
    frequency_Hz, peak = parted(text, "--dither", "'off', or ")
    return frequency_Hz, _share(peak, "--dither")
