"""What the firmware must do at the pins of its device, from reset through start, samples, trips and watchdog.

What a pin must do follows from the exact law and the exact drive, from the voltages on the declared channels.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from math import ceil

from dzdesign.core.errors import RequirementError
from dzdesign.design.current.circuit import CurrentLoop
from dzdesign.verify import requirements
from dzdesign.verify.exhaustive.exact_drive import STEP_UNIT, DriveModel
from dzdesign.verify.hardware.exact_current import ExactCurrent
from dzdesign.verify.hardware.model import HIGH, LOW, Bench, Due, Step, Trace
from dzdesign.verify.hardware.serial_line import line_fault, load_begins, load_fault
from dzdesign.verify.requirements import Check, Requirement

#: A trip acts without a clock, and lost samples are seen within these times.
TRIP_S, SAMPLE_LOSS_S = 1e-6, 5e-3
#: For so long an output must stay low that nothing may release.
STAYS_LOW_US = 12_000.0
#: For so long more a firmware is followed with code of the user's, which may do something of its own then.
LATER_US = 2e6
#: Bits of the faults, as dz_hardware.h states them.
NO_SAMPLE, TRIP_INPUT, WATCHDOG, CLOCK, NO_CURRENT = 1, 2, 4, 8, 16
#: Of what programs/scenario.c says of a current.
HELD_PER_A = 1e4
#: PWM periods of each compare value that is written.
WRITTEN_PERIODS = 4
#: PWM periods after which an output is released at the latest, once the trip input is high.
RELEASE_PERIODS = 6
#: PWM periods for which a load is followed, a frame and the reply: fewer than it waits for its next request.
LOADED_PERIODS = 15
#: Least and most samples of each set of codes; in between so many that a ramp goes this share of the command.
SAMPLES_OF_CODES, RAMPED = (5, 200), 0.06
#: Codes, of the command and of each pressure.
Codes = tuple[int, ...]


@dataclass
class HardwareRuns:
    """The runs of a firmware on its device, each once."""

    bench: Bench

    def __post_init__(self) -> None:
        self.signals, self.compensator = self.bench.compensator.signals, self.bench.compensator
        self.drive = self.compensator.current_drive
        self.period_us, self.sample_us = 1e6 / self.signals.tick_Hz, 1e6 / self.signals.sample_Hz
        wait = self.drive.rest_ticks + self.drive.loop.offset_ticks if self.drive else 0
        #: When the output is released at the latest, after the start.
        self.released_us = (wait + 2) * self.period_us + 2 * self.sample_us

    # ---- what is on the channels ----

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """What carries the codes: roles of the channels."""
        return ("COMMAND", *(f"PRESSURE_{name}" for name in self.signals.pressures))

    @cached_property
    def pressures(self) -> list[Codes]:
        """Valid codes, no two differences alike, and none of them its own mirror image; with C no drop below zero."""
        third = {"BC": (0.1, 0.02, 0.17), "CA": (0.8, 0.45, 0.7)}.get(self.signals.negative_pair, (0.4, 0.22, 0.35))
        shares = zip((0.6, 0.3, 0.5), (0.2, 0.1, 0.25), third, strict=True)
        ends = [sensor.valid_codes for sensor in self.signals.pressures.values()]
        return [
            tuple(low + round(share * (high - low)) for share, (low, high) in zip(each, ends, strict=False))
            for each in shares
        ]

    @cached_property
    def followed(self) -> list[tuple[float, Codes]]:
        """What the inputs are from which time on: zero command, then commands of each sign with other pressures."""
        command = self.signals.command
        zero = (command.zero_code, *self.pressures[0])
        functions = self.compensator.drive_functions
        at_us = self.released_us + (functions.fault_samples + 2.5) * self.sample_us
        least, most = SAMPLES_OF_CODES
        if self.drive and self.drive.loop.two:  # longer than a change from one solenoid to the other
            least += ceil(self.drive.change_s * self.signals.sample_Hz)
        slowest = min((step for step in functions.ramp_up + functions.ramp_down if step), default=0)
        ramped = ceil(RAMPED * command.span(1) * STEP_UNIT / slowest) if slowest else least
        self.set_us = min(max(ramped, least), most) * self.sample_us
        found: list[tuple[float, Codes]] = [(-1.0, zero)]
        for sign in (*self.signals.signs, self.signals.signs[0]):
            for share, pressures in zip((0.3, 0.6, 1.0), self.pressures, strict=True):
                found.append(
                    (
                        at_us,
                        (command.zero_code + command.direction(sign) * round(share * command.span(sign)), *pressures),
                    )
                )
                at_us += self.set_us
        found.append((at_us, zero))
        return found

    def codes(self, at_us: float, codes: Codes) -> list[Step]:
        """Return the steps that put codes on the declared channels."""
        channels = [self.bench.channels[role] for role in self.inputs]
        return [Step(at_us, "code", channel, code) for channel, code in zip(channels, codes, strict=True)]

    def at_rest(self) -> list[Step]:
        """Return the steps for valid codes, and no current."""
        steps = self.codes(-1.0, self.followed[0][1])
        currents = [Step(-1.0, "code", channel, self.zero_current) for channel in self.bench.shunts]
        return steps + currents + self.supply()

    @property
    def zero_current(self) -> int:
        """Code of the current's sensor without current."""
        return round(self.drive.loop.offset_nominal / self.drive.loop.samples) if self.drive else 0

    def supply(self) -> list[Step]:
        """Return the step for the supply's code, at its nominal voltage."""
        if not (self.drive and self.drive.loop.supply):
            return []
        return [Step(-1.0, "code", self.bench.channels["SUPPLY"], self.supply_code)]

    @property
    def supply_code(self) -> int:
        """Code of the nominal supply."""
        low, high = self.drive.loop.supply.valid_codes if self.drive and self.drive.loop.supply else (0, 0)
        return (low + high) // 2

    @property
    def codes_per_A(self) -> float:
        """Codes of the current's sensor for a current."""
        converter = self.compensator.target.converter if self.compensator.target else None
        codes_per_V = float(converter.levels / converter.full_V) if converter else 4096 / 3
        return self.drive.sensor.V_per_A * codes_per_V if self.drive else 0.0

    def coil(self) -> list[Step]:
        """Return the steps for the declared solenoid, through which the rated current flows at first."""
        if self.drive is None:
            return []
        circuit = self.drive.circuit
        return [
            *(
                Step(-1.0, "coil", self.bench.shunts[output % len(self.bench.shunts)], gpio)
                for output, gpio in enumerate(self.bench.pins)
            ),
            Step(-1.0, "sensor", self.codes_per_A, self.zero_current + 0.5),
            Step(-1.0, "winding", circuit.nominal.resistance_ohm, circuit.nominal.inductance_H),
            Step(-1.0, "supply", circuit.nominal.supply_V, circuit.freewheel_V),
            Step(-1.0, "flows", circuit.rated_A),
        ]

    # ---- the runs ----

    @cached_property
    def following(self) -> Trace:
        """Commands and pressures one after another."""
        steps = [step for at_us, codes in self.followed for step in self.codes(at_us, codes)]
        driven_us = self.followed[2][0] + self.sample_us
        steps += [*self.coil(), *self.supply(), *load_begins(self.bench, driven_us)]
        later_us = LATER_US if self.bench.runs_user_code else 0.0
        return self.bench.run(steps, self.followed[-1][0] + self.set_us + later_us)

    @cached_property
    def asked_us(self) -> float:
        """When a load begins at zero command: just after an interrupt, and no frame is under way."""
        trace, period_us = self.following, self.period_us
        sent = [1e3 * trace.ms_of(at) for at in trace.times("octet")]
        interrupts = (1e3 * trace.ms_of(at) for at in trace.times("interrupt"))
        return 1 + next(
            at_us
            for at_us in interrupts
            if at_us > self.followed[1][0] and not any(-1 < (end - at_us) / period_us < 3 for end in sent)
        )

    @cached_property
    def loading(self) -> Trace:
        """Zero command, at which a load begins."""
        steps = [*self.codes(-1.0, self.followed[0][1]), *self.coil(), *self.supply()]
        steps += load_begins(self.bench, self.asked_us)
        return self.bench.run(steps, self.asked_us + LOADED_PERIODS * self.period_us)

    @cached_property
    def written(self) -> list[tuple[float, int, int]]:
        """Compare values that are written, from which time on: of each output alone, with 0 after the largest."""
        full, made = self.signals.compare_max, list[tuple[float, int, int]]()
        at_us = self.released_us
        for output in range(len(self.bench.pins)):
            for value in (full // 4, 0, full, 0, 1, full - 1, 0, full // 2):
                made.append((at_us, value if output == 0 else 0, value if output else 0))
                at_us += WRITTEN_PERIODS * self.period_us
        return made

    @cached_property
    def writing(self) -> Trace:
        """Compare values one after another."""
        steps = [Step(*each[:1], "compare", *each[1:]) for each in self.written]
        return self.bench.run([*self.at_rest(), *steps], self.written[-1][0] + WRITTEN_PERIODS * self.period_us)

    def half_driven(self, output: int, *steps: Step) -> Trace:
        """Return a run with half the duty of an output from the release on, and with more that happens."""
        half = self.signals.compare_max // 2
        driven = Step(self.released_us, "compare", 0 if output else half, half if output else 0)
        return self.bench.run([*self.at_rest(), driven, *steps], self.happens_us + SAMPLE_LOSS_S * 1e6 + STAYS_LOW_US)

    @property
    def happens_us(self) -> float:
        """A time at which the output is high, in a run that is half driven."""
        return self.released_us + 6.25 * self.period_us

    # ---- what is found ----

    def channel_words(self, codes: Codes) -> str:
        """Name the codes of a sample with their channels."""
        return ", ".join(f"{code} on {self.bench.names[role]}" for role, code in zip(self.inputs, codes, strict=True))

    def period(self, trace: Trace) -> int:
        """Return the counts of a PWM period at the clock of the device."""
        return round(trace.clock_Hz / self.signals.tick_Hz)

    def frames(self, trace: Trace) -> list[int]:
        """Return when a PWM period begins after each interrupt: the pins rise at the beginning of one."""
        period = self.period(trace)
        first = next((at for gpio in self.bench.pins for at in trace.pin(gpio).rises()), 0)
        return [at + (first - at) % period for at in trace.times("interrupt")]

    @cached_property
    def due(self) -> list[Due]:
        """What each interrupt must leave while commands and pressures follow one another."""
        trace, found = self.following, list[Due]()
        times = [(trace.count_at(at_us) if at_us > 0 else 0, codes) for at_us, codes in self.followed]
        current = ExactCurrent(self.drive, self.supply_code) if self.drive else None
        model, codes, fresh = None, self.followed[0][1], False
        for each in trace.events:
            if each.word == "hold" and each.one in self.bench.shunts and current:
                current.take(each.two, self.bench.shunts.index(each.one))
            elif each.word == "hold":
                fresh, codes = True, [given for at, given in times if at <= each.at][-1]
            elif each.word == "interrupt":
                if model is None and (current is None or current.is_calibrated()) and fresh:
                    model = DriveModel(self.compensator)
                if model and fresh:
                    model.sample(*codes)
                if model:
                    model.tick()
                a, b, status = model.outputs if model else (0, 0, 0)
                compares = current.tick(a, b) if current else (a, b)
                found.append(Due(codes, compares, model.side if model else 0, status, model is not None))
                fresh = False
        return found


def _low(trace: Trace, pins: Sequence[int], begin: int, end: int, when: str) -> str:
    """Tell which of some pins is not low all the time, or nothing."""
    for gpio in pins:
        at = trace.pin(gpio).not_low_from(begin, end)
        if at is not None:
            level = "high" if trace.pin(gpio).level_at(at) in (LOW, HIGH) else "not driven"  # it may be so for no time
            return f"GPIO{gpio} is {level} {when}, {trace.ms_of(at):.2f} ms after the start"
    return ""


def _faults(trace: Trace, expected: int, when: str) -> str:
    """Tell whether the firmware says another fault than the one that is there, or nothing."""
    said = trace.faults
    return "" if said == expected else f"dz_state.fault is 0x{said:04X} {when}, expected 0x{expected:04X}"


def _switches(runs: HardwareRuns) -> str:
    """Return what is wrong with the pins, their frequency or their duty at written compare values."""
    trace, signals = runs.writing, runs.signals
    clock = f"at a clock of {trace.clock_Hz / 1e6:g} MHz"
    for gpio in runs.bench.pins:
        rises = trace.pin(gpio).rises()
        if len(rises) < 3:
            others = ", ".join(f"GPIO{each}" for each in trace.pins_that_switch() if each != gpio)
            return f"GPIO{gpio} does not switch" + (f", but {others} does" if others else "")
        shortest = min(later - at for at, later in pairwise(rises))
        if shortest * signals.tick_Hz != trace.clock_Hz:
            return f"GPIO{gpio} switches at {trace.clock_Hz / shortest:.1f} Hz {clock}, expected {signals.tick_Hz} Hz"
    period, interrupts, frames = runs.period(trace), trace.times("interrupt"), runs.frames(trace)
    pins = [(gpio, trace.pin(gpio)) for gpio in runs.bench.pins]
    for at, frame in zip(interrupts, frames, strict=True):
        given = [each[1:] for each in runs.written if trace.count_at(each[0]) <= at]
        if not given or frame + period > trace.end:
            continue
        for (gpio, pin), value in zip(pins, given[-1], strict=False):
            high = pin.high_counts(frame, frame + period)
            if high != min(value * period // signals.compare_max, period):
                return f"GPIO{gpio} is high for {high} of {period} counts at compare value {value}"
    return ""


def _starts_low(runs: HardwareRuns) -> str:
    trace = runs.following
    before = [each for each in trace.early if each.word == "pin" and each.one in runs.bench.pins and each.two != LOW]
    if before:
        return f"GPIO{before[0].one} is not low before the clock is set"
    first = next((each.at for each in trace.events if each.word == "hold"), trace.end)
    if found := _low(trace, runs.bench.pins, 0, first, "before the first sample"):
        return found
    for each in (*trace.early, *(event for event in trace.events if event.at < first)):
        if each.word == "free" and each.one in runs.bench.pins:
            return f"GPIO{each.one} is its PWM's before the first sample, and the trip zone does not hold it"
    for words, fault, options in (
        ("after a reset by the watchdog", WATCHDOG, {"after_watchdog": True}),
        ("without the crystal", CLOCK, {"no_crystal": True}),
    ):
        half = Step(runs.released_us, "compare", runs.signals.compare_max // 2, runs.signals.compare_max // 2)
        run = runs.bench.run([*runs.at_rest(), half], runs.released_us + STAYS_LOW_US, **options)
        if found := _low(run, runs.bench.pins, 0, run.end, words) or _faults(run, fault, words):
            return found
    return ""


def _reaches(runs: HardwareRuns) -> str:
    """Return where a pin does not do what the exact law and drive make of the codes on the declared channels."""
    trace = runs.following
    period, held = runs.period(trace), {each.one for each in trace.events if each.word == "hold"}
    for role, channel in runs.bench.channels.items():
        used = role in runs.inputs or channel in runs.bench.shunts or (runs.drive and runs.drive.loop.supply)
        if used and channel not in held:
            return f"{runs.bench.names[role]}, declared for the {role.lower().replace('_', ' ')}, is never converted"
    pins = [(gpio, trace.pin(gpio)) for gpio in runs.bench.pins]
    for frame, due in zip(runs.frames(trace), runs.due, strict=True):
        for (gpio, pin), compare in zip(pins, due.compares, strict=False):
            high = pin.high_counts(frame, frame + period)
            if frame + period <= trace.end and high != compare:
                given = runs.channel_words(due.codes)
                return f"with codes {given}, GPIO{gpio} is high for {high} of {period} counts, expected {compare}"
    return _faults(trace, 0, "with valid codes")


def _switched_off(runs: HardwareRuns, within_s: float, fault: int, cause: str, *steps: Step) -> str:
    """Tell whether what happens to each output while it is high does not switch it off until a reset."""
    for output, gpio in enumerate(runs.bench.pins):
        trace = runs.half_driven(output, *steps)
        at = trace.count_at(runs.happens_us)
        if trace.pin(gpio).level_at(at - 1) != HIGH:
            return f"GPIO{gpio} is not driven before {cause}"
        after = f"after {cause}"
        late = _low(trace, runs.bench.pins, at + round(within_s * trace.clock_Hz), trace.end, after)
        if found := late or _faults(trace, fault, after):
            return found
    return ""


def _trips(runs: HardwareRuns) -> str:
    for name, words in {"TRIP_GPIO": "the trip input", "OVER_CURRENT_GPIO": "the over-current input"}.items():
        if name not in runs.bench.board:
            continue
        gpio, at_us = runs.bench.board[name], runs.happens_us
        wired = [Step(-1.0, "wire", gpio, HIGH), Step(at_us, "wire", gpio, LOW), Step(at_us + 1000, "wire", gpio, HIGH)]
        if found := _switched_off(runs, TRIP_S, TRIP_INPUT, f"{words}, GPIO{gpio}, went low", *wired):
            return found
        if found := _waits_for_trip(runs, gpio, f"{words}, GPIO{gpio},"):
            return found
    return ""


def _waits_for_trip(runs: HardwareRuns, gpio: int, words: str) -> str:
    """Start with a trip input low, then high, and low again when nothing has a clock any more."""
    lost_us = runs.happens_us + RELEASE_PERIODS * runs.period_us
    held = runs.half_driven(
        0, Step(-1.0, "wire", gpio, LOW), Step(runs.happens_us, "wire", gpio, HIGH), Step(lost_us, "clock", 0),
        Step(lost_us + 1, "wire", gpio, LOW),
    )  # fmt: skip
    high, lost, late = (held.count_at(at_us) for at_us in (runs.happens_us, lost_us, lost_us + 1 + 1e6 * TRIP_S))
    early = _low(held, runs.bench.pins, 0, high, f"while {words} is low")
    if found := early or _faults(held, 0, f"after a start with {words} low"):
        return found
    if held.pin(runs.bench.pins[0]).level_at(lost) != HIGH:
        return f"GPIO{runs.bench.pins[0]} is not driven after {words} went high"
    return _low(held, runs.bench.pins, late, held.end, f"after {words} went low without a clock")


def _halts(runs: HardwareRuns) -> str:
    for output, gpio in enumerate(runs.bench.pins):
        trace = runs.half_driven(output, Step(runs.happens_us, "halt", 0))
        stopped = trace.count_at(runs.happens_us + runs.period_us)
        if found := _low(trace, [gpio], stopped, trace.end, "after a debugger halted the processor"):
            return found
    return ""


def _tells(runs: HardwareRuns) -> str:
    if fault := line_fault(runs.bench, runs.following, runs.due):
        return fault
    return load_fault(runs.bench, runs.loading, runs.asked_us) if runs.bench.block else ""


def _loses_samples(runs: HardwareRuns) -> str:
    sampled = [channel for role, channel in runs.bench.channels.items() if not role.startswith("CURRENT")]
    for cause, fault, channels in (
        ("samples were lost", NO_SAMPLE, sampled),
        ("codes of the current were lost", NO_CURRENT, runs.bench.shunts),
    ):
        if not channels:
            continue
        again_us = runs.happens_us + SAMPLE_LOSS_S * 1e6
        steps = [
            Step(at_us, "converter", hears, channel)
            for channel in channels
            for at_us, hears in ((runs.happens_us, 0), (again_us, 1))
        ]
        if found := _switched_off(runs, SAMPLE_LOSS_S, fault, cause, *steps):
            return found
    return ""


def _watched(runs: HardwareRuns) -> str:
    allowed_us = 1e6 * runs.bench.watchdog_s
    stop_us = max(2.3 * allowed_us, 10 * runs.period_us)
    for word, stopped, other in (
        ("interrupts", "the interrupt", "the interrupt runs"),
        ("turns", "the main loop", "the main loop turns"),
    ):
        end_us = stop_us + 2 * allowed_us + runs.period_us
        trace = runs.bench.run([*runs.at_rest(), Step(stop_us, word, 0)], end_us)
        resets, stop = trace.times("reset"), trace.count_at(stop_us)
        if not resets:
            return f"no reset within {2 * allowed_us / 1000:.1f} ms after {stopped} stopped"
        if resets[0] < stop:
            return f"the watchdog resets {trace.ms_of(resets[0]):.1f} ms after the start, though {other}"
        taken_us = 1e6 * (resets[0] - stop) / trace.clock_Hz
        if taken_us > allowed_us * 1.001:
            taken, stated = f"{taken_us / 1000:.1f} ms", f"{allowed_us / 1000:.1f} ms"
            return f"the watchdog resets {taken} after {stopped} stopped, stated are {stated}"
    return ""


def _at_its_rate(runs: HardwareRuns) -> str:
    trace, signals = runs.following, runs.signals
    apart = {later - at for at, later in pairwise(trace.times("interrupt"))}
    if {Fraction(trace.clock_Hz, counts) for counts in apart} != {Fraction(signals.tick_Hz)}:
        rates = ", ".join(f"{trace.clock_Hz / counts:.1f}" for counts in sorted(apart)[:3])
        return f"interrupts come at {rates or 0} Hz, expected {signals.tick_Hz} Hz"
    holds, command = trace.times("hold", runs.bench.channels["COMMAND"]), list[int]()
    for at, later in zip(holds, [*holds[1:], trace.end], strict=False):
        command += [at] if later - at > runs.period(trace) // 2 else []
    apart = {later - at for at, later in pairwise(command)}
    if {Fraction(trace.clock_Hz, counts) for counts in apart} != {Fraction(signals.sample_Hz)}:
        rates = ", ".join(f"{trace.clock_Hz / counts:.1f}" for counts in sorted(apart)[:3])
        return f"samples come at {rates or 0} Hz, expected {signals.sample_Hz} Hz"
    if trace.times("acknowledged"):
        return "the interrupt acknowledges those of other groups too, which then come in between"
    return ""


def _never_both(runs: HardwareRuns) -> str:
    one, other = runs.bench.pins
    for trace in (runs.following, runs.writing):
        first, second = trace.pin(one), trace.pin(other)
        for at in sorted({*first.times, *second.times}):
            if first.level_at(at) != LOW and second.level_at(at) != LOW:
                return f"GPIO{one} and GPIO{other} are high at once, {trace.ms_of(at):.2f} ms after the start"
    return _held_off(runs, runs.drive.loop, runs.following) if runs.drive else ""


def _held_off(runs: HardwareRuns, loop: CurrentLoop, trace: Trace) -> str:
    """Return when a pin goes high while a current flows in the other one's solenoid."""
    allowed_A, start = (loop.open_sum / loop.samples + 1) / runs.codes_per_A, trace.start
    for each in trace.events:
        if each.word == "held" and each.at > start and each.two > HELD_PER_A * allowed_A:
            return (
                f"{each.two / HELD_PER_A:.3f} A flow in the solenoid of GPIO{each.one} as the other one is switched on "
                f"{trace.ms_of(each.at):.2f} ms after the start, expected {allowed_A:.3f} at most"
            )
    return ""


def _samples_the_current(runs: HardwareRuns) -> str:
    """Return where a code of the current is not taken at the middle of its part of a period, or not in time."""
    trace, sampling = runs.following, runs.drive.sampling if runs.drive else None
    if sampling is None:
        return ""
    period, parts = runs.period(trace), sampling.samples
    begins, interrupts = sorted(set(runs.frames(trace))), trace.times("interrupt")
    shunts = runs.bench.shunts
    holds = [each.at for each in trace.events if each.word == "hold" and each.one in shunts]
    for begin in begins[1:-1]:
        taken = [at - begin for at in holds[bisect_left(holds, begin) : bisect_left(holds, begin + period)]]
        wanted = [(2 * part + 1) * period // (2 * parts) for part in range(parts)]
        if len(taken) != parts or any(abs(at - due) > 2 for at, due in zip(taken, wanted, strict=True)):
            places = ", ".join(f"{1e6 * at / trace.clock_Hz:.1f}" for at in taken) or "none"
            return (
                f"the current is sampled {places} us after a period began, expected the middles of {parts} equal parts"
            )
        interrupt = next((at - begin for at in interrupts[bisect_left(interrupts, begin) :][:1]), 0)
        before = sum(at < interrupt for at in taken)
        if before != sampling.before:
            return f"{before} codes of the current come before the interrupt, expected {sampling.before}"
    return ""


#: What is tried: returns what is wrong, or nothing; and what was found otherwise.
TRIED: tuple[tuple[Requirement, Callable[[HardwareRuns], str], str], ...] = (
    (requirements.HARDWARE_PWM, _switches, "{pins} at {tick_Hz} Hz; low at compare value 0, high throughout at {full}"),
    (requirements.HARDWARE_START, _starts_low, "{pins} low; also after a watchdog reset, and without the crystal"),
    (requirements.HARDWARE_CHANNELS, _reaches, "{sets} sets of codes on {names}: the exact duty in every PWM period"),
    (requirements.HARDWARE_TRIP, _trips, f"low within {1e6 * TRIP_S:g} us of GPIO{{trip}}, and until a reset"),
    (requirements.HARDWARE_SAMPLE_LOSS, _loses_samples, f"low within {1e3 * SAMPLE_LOSS_S:g} ms, and until a reset"),
    (requirements.HARDWARE_WATCHDOG, _watched, "within {watchdog_ms:.2f} ms, or the main loop; not before"),
    (requirements.HARDWARE_RATES, _at_its_rate, "interrupts at {tick_Hz} Hz, samples at {sample_Hz} Hz"),
    (requirements.HARDWARE_SOLENOIDS, _never_both, "{pins} are never high at once"),
    (requirements.HARDWARE_HALT, _halts, "{pins} low from the end of the period on"),
    (requirements.HARDWARE_TELEMETRY, _tells, "each frame on GPIO{line} says what the exact law and drive give"),
    (requirements.HARDWARE_CURRENT, _samples_the_current, "{parts} codes in a PWM period, at the middles of its parts"),
)  # fmt: skip


def hardware_checks(make: Callable[[], Bench]) -> Iterator[Check]:
    """Yield the checks of a firmware's hardware files; of one that does not compile the first alone."""
    try:
        runs = HardwareRuns(make())
    except RequirementError as error:
        yield requirements.HARDWARE_COMPILES.check(holds=False, text=str(error))
        return
    yield requirements.HARDWARE_COMPILES.check(holds=True, text="with stand-ins for the headers of the device")
    bench, signals = runs.bench, runs.signals
    figures = {
        "pins": " and ".join(f"GPIO{gpio}" for gpio in bench.pins), "tick_Hz": signals.tick_Hz,
        "sample_Hz": signals.sample_Hz, "full": signals.compare_max, "sets": len(runs.followed),
        "names": ", ".join(bench.names[role] for role in runs.inputs), "watchdog_ms": 1e3 * bench.watchdog_s,
        "trip": bench.board["TRIP_GPIO"], "line": bench.board.get("SCI_TX_GPIO"),
        "parts": runs.drive.sampling.samples if runs.drive else 0,
    }  # fmt: skip
    applies = {
        requirements.HARDWARE_SOLENOIDS: bench.two,
        requirements.HARDWARE_HALT: bench.device.halts_low,
        requirements.HARDWARE_TELEMETRY: "SCI_TX_GPIO" in bench.board,
        requirements.HARDWARE_CURRENT: runs.drive is not None,
    }
    for requirement, tried, found in TRIED:
        if applies.get(requirement, True):
            try:
                fault = tried(runs)
            except RequirementError as error:
                fault = str(error)
            said = f"{fault}{bench.undeclared}" if fault else found.format(**figures)
            yield requirement.check(holds=not fault, text=said)
