"""What both C2000 targets have alike: files, integers for registers, limits, and the times about a PWM period."""

from collections.abc import Mapping, Sequence
from fractions import Fraction

from dzdesign.codegen.target import FlashSector, Target
from dzdesign.codegen.telemetry.frame import Link
from dzdesign.core.errors import DzdesignError, InputError, nearest
from dzdesign.design.current.circuit import CurrentSampling
from dzdesign.design.target_inputs import Converter

PWM_HZ = 2_500  # section 3 of the paper
SAMPLE_HZ = 1_250  # section 4.1 of the paper
ISR_DELAY_S = Fraction(20, 10**6)  # from the start of conversion to the interrupt
SAMPLE_TIMEOUT_S = Fraction(32, 10**4)  # four sample periods
WATCHDOG_COUNTS = 512 * 256  # clock / 512 into eight bits, no further divider
ADC_BITS, CHANNELS = 12, 3
#: Conversions of each sequence that are not used: TI reports a first code of FFFh, which would be full drive.
DISCARDED = 1
#: What the converter reads, and the channel of each where none is declared.
ROLES = {
    "command": "A0", "pressure_a": "A1", "pressure_b": "A2", "pressure_c": "A6", "current": "A3", "current_b": "A5",
    "supply": "A4",
}  # fmt: skip
#: With current control: as many codes in a period as there are results beside those of the sample. The interrupt comes
#: so late that all but one of them are of this period, and its value acts from the next one on.
CURRENT = CurrentSampling(tick_Hz=PWM_HZ, samples=8, before=7)
CURRENT_ISR_S = Fraction(330, 10**6)  # from CTR = 0 to the interrupt
CURRENT_READ_S = Fraction(10, 10**6)  # that the interrupt may take to read the codes, latency included
#: What the projects of both build with, and where TI's Windows installer puts C2000Ware: the user changes this one line
#: of the projectspec.
TOOLS = {"cgt_version": "22.6.3.LTS", "c2000ware_default": "C:/ti/c2000/C2000Ware_26_01_00_00"}
#: The C of every project whose template is its own, the rest of it, and what builds it, which both targets share.
OF_THE_DEVICE = ("main.c", "dz_hardware.c", "dz_hardware.h", "dz_board.h")
OF_BOTH = ("dz_isr.c", "dz_isr.h", "dz_user.h", "dzdesign.projectspec", "Makefile")
#: The user's code, called by main(); beside it, in the same folder, may lie more of it.
USER_CODE = "board/dz_user.c"


def c2000_target(
    name: str,
    description: str,
    context: Mapping[str, str],
    *,
    converter: Converter,
    known_channels: Mapping[str, int],
    channels: Sequence[str] = (),
    inputs: Sequence[str] = (),
    crystal_hz: int | None = None,
    sources: tuple[str, ...] = (),
    block_sources: tuple[str, ...] = (),
    sector: FlashSector,
    link: Link | None = None,
) -> Target:
    """Return the target whose figures, printed, are `context`.

    `sources` is the C that only it has, `block_sources` what it has besides in block form. For `channels`, `inputs`
    and `crystal_hz` see `Target.on_board`; `known_channels` has the number of each channel that is a pin.
    """
    own = (*OF_THE_DEVICE, *OF_BOTH[:3], *sources)
    templates = {file: f"{file}.jinja" for file in (*own, "README.md")}
    templates |= {file: f"c2000/{file}.jinja" for file in OF_BOTH}
    listed = {
        f"own_{kind}": " ".join(file for file in own if file.endswith(ending))
        for kind, ending in (("sources", ".c"), ("headers", ".h"))
    }
    return Target(
        name=name,
        description=description,
        compare_max=int(context["compare_max"]),
        converter=converter,
        sample_Hz=SAMPLE_HZ,
        tick_Hz=PWM_HZ,
        current_sampling=CURRENT,
        templates={f"{name}/{file}": template for file, template in templates.items()}
        | {USER_CODE: "c2000/dz_user.c.jinja"},
        block_templates={f"{name}/{file}": f"{file}.jinja" for file in block_sources},
        # Where the user's C2000Ware lies, what is wired to the device, and what else it does.
        board=frozenset({f"{name}/dzdesign.projectspec", f"{name}/dz_board.h", USER_CODE}),
        context={**context, **TOOLS, **listed, **_channels(name, known_channels, channels, inputs)},
        crystal_Hz=crystal_hz,
        channels=tuple(channels),
        sector=sector,
        link=link,
    )


def _channels(
    name: str, known: Mapping[str, int], declared: Sequence[str], inputs: Sequence[str]
) -> dict[str, str]:
    """Return name and number of the channel of each role, printed; of those that are not declared one that is free."""
    for channel in declared:
        if channel not in known:
            hint = nearest(channel, known)
            raise InputError(f"--channels: {name} has no channel '{channel}'{hint}; it has {', '.join(known)}")
    of_roles = dict(zip(inputs or ROLES, declared, strict=False))
    for role, usual in ROLES.items():
        free = (channel for channel in (usual, *ROLES.values(), *known) if channel not in of_roles.values())
        of_roles[role] = of_roles.get(role) or next(free)
    names = {f"{role}_channel": f"ADCIN{channel}" for role, channel in of_roles.items()}
    return names | {f"{role}_number": str(known[channel]) for role, channel in of_roles.items()}


def exact(quantity: Fraction, what: str, largest: int) -> int:
    """Return a number of counts or periods as the integer from 1 to `largest` that its register takes.

    Examples
    --------
    >>> exact(Fraction(150_000_000, 2_500), "counts per PWM period", 65536)
    60000
    """
    if quantity.denominator != 1 or not 0 < quantity <= largest:
        raise DzdesignError(f"{what} must be an integer from 1 to {largest}, got {quantity}")
    return quantity.numerator


def within(quantity: Fraction, least: Fraction | int, most: Fraction | int, what: str) -> Fraction:
    """Return `quantity` if it lies from `least` to `most`, all in the unit that `what` names for the message."""
    if not least <= quantity <= most:
        raise DzdesignError(f"{what} must lie from {float(least):g} to {float(most):g}, got {float(quantity):g}")
    return quantity


def printed(quantity: Fraction) -> str:
    """Print `quantity` for a comment: exactly if it is an integer, else with three significant digits.

    Examples
    --------
    >>> printed(Fraction(113, 25))
    '4.52'
    """
    return str(quantity.numerator) if quantity.denominator == 1 else f"{float(quantity):.3g}"


def pwm_timing(clock_hz: Fraction | int, watchdog_hz: int, prescale_max: int) -> dict[str, str]:
    """Return the figures of PWM, interrupt and time-outs, printed; a figure that no register holds is an error.

    The PWM counts `clock_hz`; two starts of conversion are at most `prescale_max` PWM periods apart.
    """
    # The compare value must reach period + 1 (100 % duty), so the period is limited to 65535 counts, not 65536.
    period = exact(Fraction(clock_hz) / PWM_HZ, "counts per PWM period", 0xFFFF)
    delay = exact(clock_hz * ISR_DELAY_S, "counts of the interrupt delay", period - 1)
    ticks_per_sample = exact(Fraction(PWM_HZ, SAMPLE_HZ), "PWM periods per sample", prescale_max)
    timeout = exact(SAMPLE_TIMEOUT_S * PWM_HZ, "PWM periods of the sample time-out", 0xFFFF)
    if timeout < 2 * ticks_per_sample:
        raise DzdesignError(f"a time-out of {timeout} PWM periods would trip on one late sample")
    watchdog_s = within(Fraction(WATCHDOG_COUNTS, watchdog_hz), Fraction(2, PWM_HZ), 1, "the watchdog's time in s")
    return {
        "pwm_hz": str(PWM_HZ),
        "sample_hz": str(SAMPLE_HZ),
        "period_us": printed(Fraction(10**6, PWM_HZ)),
        "compare_max": str(period),
        "tbprd": str(period - 1),
        "cmpb": str(delay),
        "isr_delay_us": printed(ISR_DELAY_S * 10**6),
        "ticks_per_sample": str(ticks_per_sample),
        "sample_timeout_ticks": str(timeout),
        "sample_timeout_ms": printed(SAMPLE_TIMEOUT_S * 1000),
        "watchdog_ms": printed(watchdog_s * 1000),
    }


def current_timing(clock_hz: Fraction | int, held_s: Fraction, result_s: Fraction) -> dict[str, str]:
    """Return the figures of the counter that starts the conversions of the current, printed.

    It counts `clock_hz`, in step with the PWM; a code is held `held_s` after its start, and read from `result_s` on.
    """
    apart_s = Fraction(1, PWM_HZ * CURRENT.samples)
    counts = exact(Fraction(clock_hz) * apart_s, "counts between two conversions of the current", 0xFFFF)
    # The code is held in the middle of its part of the period, so the start comes before.
    start_s = apart_s / 2 - held_s
    start = exact(Fraction(round(clock_hz * start_s)), "counts to the first conversion of the current", counts - 1)
    read = exact(clock_hz * CURRENT_ISR_S, "counts to the interrupt with current control", 0xFFFF)
    last_s = start_s + (CURRENT.before - 1) * apart_s + result_s
    within(CURRENT_ISR_S, last_s, start_s + CURRENT.before * apart_s - CURRENT_READ_S, "the interrupt's time in s")
    rest_s = Fraction(1, PWM_HZ) - CURRENT_ISR_S
    return {
        "current_apart_us": printed(apart_s * 10**6),
        "current_tbprd": str(counts - 1),
        "current_start": str(start),
        "current_start_us": f"{float(start_s * 10**6):.2f}",
        "current_cmpb": str(read),
        "current_isr_us": printed(CURRENT_ISR_S * 10**6),
        "current_rest_us": printed(rest_s * 10**6),
        "current_rest_cycles": printed(rest_s * clock_hz),
    }
