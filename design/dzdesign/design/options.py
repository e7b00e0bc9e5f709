"""The engineer's choices for `design` as values: what each text means for the target, and what holds between them."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from math import ceil, floor

from dzdesign.core.dither import HIGHEST_HZ, LARGEST_PEAK, LOWEST_HZ, parted
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import arguments_of, flag_of, read_options
from dzdesign.core.units import parse_quantity
from dzdesign.design.current.drive import CurrentDrive, design_current_drive
from dzdesign.design.current.responses import CurrentRequest
from dzdesign.design.declared import current_request, machine_of
from dzdesign.design.design_choices import DEFAULTS, Above, BelowDp0, DesignChoices, NegativeDp, share
from dzdesign.design.drive_functions import MOST_FAULT_SAMPLES, RAMP_UNIT, DriveFunctions
from dzdesign.design.machine import Machine
from dzdesign.design.signal_text import (
    command_error_of,
    command_signal,
    full_command_V,
    live_zero_signal,
    parse_signal,
    pressure_signal,
)
from dzdesign.design.signals import PressureSignal, Signals
from dzdesign.design.target_inputs import (
    LEAST_TRANSITION,
    LEAST_TRANSITION_NOISE,
    CommandError,
    Converter,
    TargetInputs,
)
from dzdesign.identify.valve.guard_curve import GUARDS, Guard

#: The transition where nothing is said.
TRANSITION = Fraction(1, 100)
LONGEST_RAMP_S = 600.0
#: Samples that a fault must be over for, where nothing is said: 4 ms at 1.25 kHz.
FAULT_SAMPLES = 5
#: What a design is refused for unless it is accepted: a warning of `identify`, and what its signals hide.
ACCEPTABLE = ("branch-order", "broken-sensor")


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignOptions:
    """Options of the design, as values: `DesignChoices` says what each means, `options_of` reads and checks them."""

    law: str = "paper"
    signals: Signals = field(default_factory=Signals)
    #: Of a third sensor, which `signals` get where the drop at negative commands needs it.
    pressure_c: PressureSignal = field(default_factory=PressureSignal)
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
    target: TargetInputs | None = None
    texts: Mapping[str, str] | None = None

    def check_channels(self) -> None:
        """Refuse declared channels of another number than the inputs."""
        channels = self.target.channels if self.target else ()
        supply = self.current is not None and self.current.sensor.supply_divider > 0
        expected = 1 + len(self.signals.pressures) + (self.current.shunts if self.current else 0) + supply
        if channels and len(channels) != expected:
            raise InputError(f"--channels names {len(channels)} channels, expected {expected} of these inputs")

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
        dither = (self._dither_counts(), self._dither_ticks())
        return design_current_drive(self.current, self.signals.compare_max, dither)

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
        """Return the PWM periods of half a wave: the nearest frequency that a dither may have."""
        if not self.dither_Hz:
            return 1
        half = self.signals.tick_Hz / 2
        slowest, fastest = floor(half / LOWEST_HZ), ceil(half / HIGHEST_HZ)
        if fastest > slowest:
            raise InputError(
                f"no whole number of PWM periods, {self.signals.tick_Hz} a second, makes a dither of "
                f"{LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz; leave it out"
            )
        return min(max(round(half / self.dither_Hz), fastest), slowest)

    def _ramp(self, seconds: tuple[float, float], spans: tuple[int, ...]) -> tuple[int, int]:
        """Return the steps per sample; at least one unit, so that a ramp never stands still."""
        positive, negative = (
            max(1, round(RAMP_UNIT * span / (time * self.signals.sample_Hz))) if time and span else 0
            for time, span in zip(seconds, spans, strict=True)
        )
        return positive, negative


#: Words that an option takes, by its name; some options' declarations name a place to import them from.
WORDS: Mapping[str, tuple[str, ...]] = {"guard": GUARDS, "accept": ACCEPTABLE} | {
    argument.name: argument.option.choices
    for argument in arguments_of(DesignChoices)
    if isinstance(argument.option.choices, tuple) and argument.option.choices and argument.name != "law"
}


def options_of(texts: Mapping[str, str], target: TargetInputs) -> DesignOptions:
    """Return the engineer's choices, each from its text; the default stands for one that is missing or empty."""
    text = {name: texts.get(name) or default for name, default in DEFAULTS.items()}
    for name, known in WORDS.items():
        for word in text[name].replace(",", " ").split() if name == "accept" else [text[name]]:
            if word not in known:
                words = f"{', '.join(known[:-1])} or {known[-1]}"
                raise InputError(f"{flag_of(name)} is '{word}'{nearest(word, known)}, expected {words}")
    read = read_options(DesignChoices(**{name: value or None for name, value in text.items()}), DEFAULTS)
    converter, sample_Hz = target.converter, target.sample_Hz
    text["command_signal"] = text["command_signal"] or f"0..10 V x {float(converter.full_V) / 10:.12g}"
    span = Fraction(round(read["pressure_span"]), 10**6)
    if span <= 0:
        raise InputError(f"--pressure-span is '{text['pressure_span']}', expected more than zero")
    sensors = []
    for name in ("pressure_a", "pressure_b"):
        text[name] = text[name] or live_zero_signal(converter)
    for name in ("pressure_a", "pressure_b", "pressure_c"):
        sensors.append(pressure_signal(parse_signal(text[name] or text["pressure_a"], flag_of(name)), converter, span))
    signal = parse_signal(text["command_signal"], "--command-signal")
    command = command_signal(signal, converter, inverted=text["polarity"] == "inverted")
    signals = Signals(
        code_max=converter.code_max,
        compare_max=target.compare_max,
        sample_Hz=sample_Hz,
        tick_Hz=target.tick_Hz,
        command=command,
        pressure_a=sensors[0],
        pressure_b=sensors[1],
    )
    dither_Hz, dither_peak = _dither(text["dither"])
    for seconds in (*read["ramp_up"], *read["ramp_down"]):
        if not 0 <= seconds <= LONGEST_RAMP_S or 0 < seconds < 1 / sample_Hz:
            raise InputError(
                f"a ramp takes {seconds:g} s, expected 0 (none), or from one sample, {1 / sample_Hz:g} s, to "
                f"{LONGEST_RAMP_S:g} s"
            )
    if text["hysteresis"] == "play" and read["transition"] == 0:
        raise InputError("--hysteresis play begins in the transition, but --transition is off; leave out one")
    current = current_request(text, read, target, signals)
    return DesignOptions(
        **{name: read[name] for name in ("law", "negative_dp", "guard", "below_dp0", "above", "transition")},
        signals=signals,
        pressure_c=sensors[2],
        command_error=command_error_of(text["command_error"], converter, command),
        ramp_up_s=read["ramp_up"],
        ramp_down_s=read["ramp_down"],
        dither_Hz=dither_Hz,
        dither_peak=dither_peak,
        play=text["hysteresis"] == "play",
        output_max=read["output_max"],
        fault_samples=_fault_samples(text["fault_debounce"], sample_Hz),
        fault_latch=text["fault_latch"] == "on",
        interlock=text["interlock"] == "on",
        reading_flow_L_min=read["reading_flow"],
        full_command_V=full_command_V(signal),
        accept=tuple(text["accept"].replace(",", " ").split()),
        current=current,
        machine=machine_of(text, read, target, sensors, current),
        target=target,
        texts=text,
    )


def _fault_samples(text: str, sample_Hz: int) -> int:
    """Read a number of samples, or a time as the samples that it needs."""
    if match := re.fullmatch(r"(\d{1,9}) ?samples?", text.strip()):
        samples = int(match[1])
    else:
        try:
            seconds = parse_quantity(text, "time", "--fault-debounce")
        except InputError as error:
            raise InputError(f"--fault-debounce is '{text}', expected '5 samples' or a time such as '4 ms'") from error
        samples = ceil(Fraction(repr(seconds)) * sample_Hz)
    if not 1 <= samples <= MOST_FAULT_SAMPLES:
        raise InputError(
            f"--fault-debounce is {samples} samples, expected 1 to {MOST_FAULT_SAMPLES}, {1e3 / sample_Hz:g} ms to "
            f"{MOST_FAULT_SAMPLES / sample_Hz:g} s"
        )
    return samples


def _dither(text: str) -> tuple[float, Fraction]:
    """Read ``off`` or a frequency and the peak of the wave, half its height over full drive."""
    if text == "off":
        return 0.0, Fraction(0)
    frequency_Hz, peak_text = parted(text, "--dither", "'off', or ")
    peak = share(Fraction(repr(LARGEST_PEAK)))(peak_text, "--dither")
    if not (frequency_Hz and peak):
        raise InputError("a dither needs both, a frequency and a peak, such as '150 Hz 1 %'")
    if not LOWEST_HZ <= frequency_Hz <= HIGHEST_HZ:
        raise InputError(f"the dither's frequency is {frequency_Hz:g} Hz, expected {LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz")
    return frequency_Hz, peak
