"""The drive around the law: the generated C on the host against `drive_model`, and what an engineer asks of it."""

import ctypes
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from dzdesign.codegen.project import generate
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions
from dzdesign.design.side_law import Sides
from dzdesign.design.signal_text import command_signal, parse_signal, pressure_signal
from dzdesign.design.target_inputs import CommandError, Converter
from dzdesign.verify.exhaustive.drive_check import drive_samples as sequence
from dzdesign.verify.exhaustive.exact_drive import STEP_UNIT, DriveModel
from tests.support.c_library import load_library
from tests.support.golden_firmware import FULL, GOLDENS, full_options, golden_compensator, golden_valve
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler


def drive_type(pairs: int) -> type[ctypes.Structure]:
    """Return `struct dz_drive` with so many pairs of pressures, each remembered by itself."""
    fields = [
        *((name, ctypes.c_uint16) for name in ("compare_a", "compare_b", "status", "law")),
        ("side", ctypes.c_int16),
        ("ticks", ctypes.c_uint16),
        ("at_rest", ctypes.c_uint16),
        ("rising", ctypes.c_uint16),
        ("played", ctypes.c_int16),
        ("ramped", ctypes.c_int32),
        *(
            (f"{kind}_{of}", ctypes.c_uint16)
            for kind in ("valid", "faulty")
            for of in ("commands", "pressures", *(["other_pressures"] if pairs == 2 else []))
        ),
    ]
    return type("Drive", (ctypes.Structure,), {"_fields_": fields})


class Firmware:
    """The generated drive, compiled for the host, at rest."""

    def __init__(self, compensator: Compensator, edit=lambda text: text) -> None:
        files = generate(compensator, "f28335").files
        sources = {path.removeprefix("core/"): text for path, text in files.items() if path.startswith("core/")}
        sources["dz_drive.c"] = edit(sources["dz_drive.c"])
        self._library = load_library(sources, "the drive")
        self.state = drive_type(len(compensator.signals.pressures) - 1)()
        self._library.dz_drive_init(ctypes.byref(self.state))

    def sample(self, *codes: int) -> None:
        self._library.dz_drive_sample(ctypes.byref(self.state), *map(ctypes.c_uint16, codes))

    def tick(self) -> None:
        self._library.dz_drive_tick(ctypes.byref(self.state))

    @property
    def outputs(self) -> tuple[int, int, int]:
        return self.state.compare_a, self.state.compare_b, self.state.status


def turned(text: str):
    return command_signal(parse_signal(text, "--command-signal"), Converter(), inverted=True)


#: Where a fault is over with the next sample, and no zero command is waited for.
FOLLOWS_AT_ONCE = {"fault_samples": 1, "fault_latch": False, "interlock": False}


def option_sets() -> dict[str, DesignOptions]:
    """Return sets of options, each with something that the others lack."""
    watched = full_options()
    full = replace(watched, **FOLLOWS_AT_ONCE)
    plain = DesignOptions(
        signals=replace(full.signals, command=DesignOptions().signals.command, negative_pair="AB"), **FOLLOWS_AT_ONCE
    )
    return {
        "everything": full,
        "two solenoids alone": DesignOptions(signals=full.signals, **FOLLOWS_AT_ONCE),
        "turned, same pressures": replace(
            full,
            signals=replace(full.signals, command=turned("-10..10 V x 0.15 + 1.5 V"), negative_pair="AB"),
            negative_dp="wired",
        ),
        "one solenoid alone": plain,
        "one solenoid, ramps": replace(plain, ramp_up_s=(0.3, 0.0), ramp_down_s=(0.9, 0.0)),
        "one solenoid, turned, live zero, dither": replace(
            plain,
            signals=replace(plain.signals, command=turned("4..20 mA on 140 ohm")),
            ramp_down_s=(0.2, 0.0),
            dither_Hz=250.0,
            dither_peak=Fraction(3, 100),
            output_max=Fraction(3, 4),
        ),
        "quick ramps, small error": replace(
            full,
            command_error=CommandError(offset_codes=0, noise_codes=1),
            ramp_up_s=(0.001, 0.02),
            ramp_down_s=(0.0, 0.003),
        ),
        "two solenoids, play": DesignOptions(signals=full.signals, play=True, **FOLLOWS_AT_ONCE),
        "two solenoids, no transition": DesignOptions(signals=full.signals, transition=Fraction(0), **FOLLOWS_AT_ONCE),
        "two solenoids, interlock and latch": DesignOptions(signals=full.signals, fault_samples=3, fault_latch=True),
        "one solenoid, interlock": replace(plain, fault_samples=5, interlock=True),
        "one solenoid, no transition, latch": replace(plain, transition=Fraction(0), fault_samples=4, fault_latch=True),
        "everything, watched": watched,
        "three pressures": three(full, "AC"),
        "three pressures, watched": three(watched, "AC"),
        "three pressures, play": replace(three(full, "CB"), dither_Hz=0.0, dither_peak=Fraction(0), play=True),
        "three pressures, latch": three(replace(watched, fault_samples=3, fault_latch=True), "BC"),
        "three pressures, C ahead of A": three(watched, "CA"),
    }


def three(options: DesignOptions, pair: str) -> DesignOptions:
    """Return the options with a third sensor, unlike the others, and these inputs at negative commands."""
    third = pressure_signal(parse_signal("0.5..2.5 V = 30 MPa", "--pressure-c"), Converter(), Fraction(20))
    return replace(options, signals=replace(options.signals, negative_pair=pair, pressure_c=third))


SETS = option_sets()


@cache
def compensator_named(name: str) -> Compensator:
    valve = golden_valve(FULL)
    if name.startswith("three"):  # of recordings that show no direction
        sides = {side: replace(model, recorded_drop=None) for side, model in valve.sides.items()}
        valve = replace(valve, sides=sides)
    return design(valve, SETS[name])


def first_difference(firmware, model: DriveModel, samples: list[tuple[int, ...]]) -> str:
    """Run both, two ticks a sample; the first tick where they differ in words, or nothing."""
    for number, codes in enumerate(samples):
        firmware.sample(*codes)
        model.sample(*codes)
        for tick in range(2):
            firmware.tick()
            model.tick()
            if firmware.outputs[0] and firmware.outputs[1]:
                return "both solenoids at once"
            if firmware.outputs != model.outputs:
                return f"sample {number} {codes}, tick {tick}: {firmware.outputs} and not {model.outputs}"
    return ""


@pytest.mark.slow
@pytest.mark.parametrize("name", SETS)
def test_the_firmware_does_what_the_model_does(name):
    compensator = compensator_named(name)
    samples = sequence(compensator, seed=11, count=6000)
    assert first_difference(Firmware(compensator), DriveModel(compensator), samples) == ""


ONE_SIDE = "one solenoid, turned, live zero, dither"
FAULTS = [
    ("(command > leave)", "(command >= leave)", "everything"),
    ("(codes - block->leave_zero)", "(codes - (block->leave_zero - 1u))", "two solenoids alone"),
    ("(codes - block->leave_zero)", "(codes - block->zero_band)", "two solenoids alone"),
    ("(codes - block->zero_band)", "(codes - block->leave_zero)", "two solenoids alone"),
    ("away = (drive->side < 0) ? -command : command", "away = command", "two solenoids alone"),
    (" & (at_rest - 1u)", "", "two solenoids alone"),
    ("(codes - block->zero_band)", "(codes - block->leave_zero)", "one solenoid, ramps"),
    ("towards - noise,", "towards,", "two solenoids, play"),
    ("(uint32_t)fallen", "(uint32_t)rising", "two solenoids, play"),
    ("0, codes);", "0, codes - 1);", "two solenoids, play"),
    ("within(towards - (int32_t)block->zero_band", "within(towards", "two solenoids, play"),
    (
        "side = (drive->side < 0) ? &block->sides[1]",
        "side = (drive->side < 0) ? &block->sides[0]",
        "two solenoids, play",
    ),
    ("place & (step - 1u)", "0u", "two solenoids, play"),
    (" || (drive->side != driven)", "", "two solenoids, play"),
    ("drive->ticks < block->dither_ticks", "drive->ticks <= block->dither_ticks", "everything"),
    ("(drive->side < 0) ? (uint16_t)compare : 0u", "(uint16_t)compare", "everything"),
    ("block->sides[1].ramp_up", "block->sides[0].ramp_up", "everything"),
    ("to) & ~gone)", "to))", "everything"),
    ("        drive->side = 0;\n    } else", "    } else", "everything"),
    (" | (gone & 1u)", "", "one solenoid alone"),
    (", held) & ~gone)", ", held))", "one solenoid alone"),
    ("compare = lesser(compare, block->compare_limit);", "", "everything"),
    ("if (compare == 0u)", "if (compare == 1u)", ONE_SIDE),
    ("compare -= block->dither_counts;", ";", ONE_SIDE),
    ("to & ~is_negative(to)", "to", "everything"),
    ("sides[1], p_b_adc, p_a_adc), held)", "sides[1], p_b_adc, p_a_adc), 0u)", "everything"),
    ("dz_status_of_negative(", "dz_status_of(", "everything"),
    ("sides[1], p_b_adc, p_a_adc)", "sides[1], p_a_adc, p_b_adc)", "everything"),
    ("sides[1], p_b_adc, p_a_adc)", "sides[0], p_b_adc, p_a_adc)", "everything"),
    # Pressures of the other side, or in each other's place; and what is remembered of them.
    ("sides[1], p_a_adc, p_c_adc)", "sides[1], p_a_adc, p_b_adc)", "three pressures"),
    ("sides[1], p_a_adc, p_c_adc)", "sides[1], p_c_adc, p_a_adc)", "three pressures"),
    ("sides[0], p_a_adc, p_b_adc)", "sides[0], p_a_adc, p_c_adc)", "three pressures"),
    ("negative(block, u_adc, p_a_adc, p_c_adc)", "negative(block, u_adc, p_a_adc, p_b_adc)", "three pressures"),
    ("        status = sensed_negative;\n", "", "three pressures"),
    ("        others = sensed;\n", "", "three pressures"),
    ("    others &= ", "    others |= ", "three pressures, watched"),
    ("    status |= others;\n", "", "three pressures"),
    ("(uint32_t)towards - block->zero_band", "(uint32_t)towards", ONE_SIDE),
]


@pytest.mark.parametrize(("old", "new", "name"), FAULTS)
def test_a_seeded_fault_of_the_drive_is_found(old, new, name):
    def edit(text: str) -> str:
        assert text.count(old) == 1, old
        return text.replace(old, new)

    compensator = compensator_named(name)
    samples = sequence(compensator, seed=11, count=6000)
    assert first_difference(Firmware(compensator, edit), DriveModel(compensator), samples) != ""


PRESSURES = (2400, 1500)  # sound on both sensors


@pytest.mark.parametrize("side", [1, -1])
def test_noise_inside_the_window_never_changes_the_side(side):
    """A zero command with noise up to the band's outer end, after each of the sides has been driven."""
    compensator = compensator_named("two solenoids alone")
    window, zero = compensator.drive_functions.leave_zero_codes, compensator.signals.command.zero_code
    assert window == 15 + 15 + 4 + 4 + 1  # offset, half the gain error, noise; another noise and a code
    firmware, rng = Firmware(compensator), np.random.default_rng(2)
    firmware.sample(zero + side * 500, *PRESSURES)
    for noise in (*rng.integers(-window, window + 1, 5000), window, -window):
        firmware.sample(zero + int(noise), *PRESSURES)
        firmware.tick()
        assert firmware.state.side == side and (firmware.outputs[0] > 0) == (side > 0)
    firmware.sample(zero - side * (window + 1), *PRESSURES)
    assert firmware.state.side == -side, "one code more is a command"


def test_from_rest_noise_drives_neither():
    compensator = compensator_named("two solenoids alone")
    firmware, window = Firmware(compensator), compensator.drive_functions.leave_zero_codes
    for noise in range(-window, window + 1):
        firmware.sample(compensator.signals.command.zero_code + noise, *PRESSURES)
        firmware.tick()
        assert firmware.outputs[:2] == (0, 0)


@pytest.mark.parametrize(("sign", "seconds"), [(1, (0.5, 0.4)), (-1, (0.8, 0.0))], ids=["positive", "negative"])
def test_a_ramp_takes_its_time_to_a_sample(sign, seconds):
    """Zero to full and back: to a sample more, by the rounding of the step (at most a 1/2 of 2^-16 codes a sample)."""
    compensator = compensator_named("everything")
    signals = compensator.signals
    span, full = signals.command.span(sign), signals.command.zero_code + sign * signals.command.span(sign)
    firmware = Firmware(compensator)
    for goal, time_s in ((full, seconds[0]), (signals.command.zero_code, seconds[1])):
        taken, end = 0, STEP_UNIT * (goal - signals.command.zero_code)
        while firmware.state.ramped != end:
            before = firmware.state.ramped
            firmware.sample(goal, *PRESSURES)
            taken += 1
            if time_s:
                assert abs(firmware.state.ramped - before) <= STEP_UNIT * span / (time_s * signals.sample_Hz) + 1
        assert abs(taken - max(time_s * signals.sample_Hz, 1)) <= 1


def test_reversing_the_command_stops_at_zero_on_the_way():
    compensator = compensator_named("everything")
    firmware, zero = Firmware(compensator), compensator.signals.command.zero_code
    for _ in range(100):
        firmware.sample(4095, *PRESSURES)
    positions = []
    for _ in range(400):
        firmware.sample(0, *PRESSURES)
        positions.append(firmware.state.ramped)
    assert 0 in positions and positions == sorted(positions, reverse=True) and positions[-1] < 0
    assert zero == 2048


@pytest.mark.parametrize("name", ["everything", ONE_SIDE])
def test_the_dither_has_its_frequency_and_its_peak(name):
    compensator = compensator_named(name)
    functions, signals = compensator.drive_functions, compensator.signals
    firmware = Firmware(compensator)
    command = signals.command.zero_code + signals.command.direction(1) * 900
    for _ in range(2000):  # the ramps are over
        firmware.sample(command, *PRESSURES)
    seen = []
    for _ in range(signals.tick_Hz):
        firmware.tick()
        seen.append(firmware.outputs[0])
    law = firmware.state.law
    assert set(seen) == {law + functions.dither_counts, law - functions.dither_counts}
    rises = sum(later > earlier for earlier, later in pairwise(seen))
    asked = SETS[name]
    exact = signals.tick_Hz / (2 * functions.dither_ticks)
    assert abs(rises - exact) <= 1
    assert abs(1 / exact - 1 / asked.dither_Hz) <= 1 / signals.tick_Hz, "to a PWM period"
    assert functions.dither_counts == round(asked.dither_peak * signals.compare_max)
    assert sum(seen[: 2 * functions.dither_ticks]) == 2 * functions.dither_ticks * law, "its mean is the law's"


def test_an_unsound_command_lets_go_at_once_and_starts_from_rest():
    compensator = compensator_named("everything")
    firmware = Firmware(compensator)
    for _ in range(700):
        firmware.sample(4095, *PRESSURES)
    firmware.tick()
    assert firmware.outputs[0] == compensator.drive_functions.compare_limit
    firmware.sample(65535, *PRESSURES)
    firmware.tick()
    above = 16  # these pressures' drop lies above the tests
    assert firmware.outputs == (0, 0, 1 + 32 + above) and firmware.state.ramped == firmware.state.side == 0


def test_the_plain_drive_is_the_law_and_rests_at_zero_until_the_bands_outer_end():
    compensator = golden_compensator("f28335", GOLDENS)
    inner, outer = compensator.zero_band_codes, compensator.drive_functions.leave_zero_codes
    assert (inner, outer) == (19, 24)
    firmware, offset = Firmware(compensator), compensator.compare(0, 500)
    for _ in range(compensator.drive_functions.fault_samples):  # the interlock
        firmware.sample(0, 1500, 1000)
    for command in (*range(0, 4096), *range(4095, -1, -1)):  # up, and down again
        rising = firmware.state.at_rest
        firmware.sample(command, 1500, 1000)
        firmware.tick()
        rests = command <= (outer if rising else inner)
        assert firmware.outputs == (offset if rests else compensator.compare(command, 500), 0, 0)
        assert firmware.state.at_rest == rests


def test_what_the_firmwares_integers_cannot_hold_is_refused(wording):
    plain = golden_compensator("f28335", GOLDENS)
    with wording.refusal(InputError):
        replace(plain.signals, sample_Hz=1200)
    signals = replace(plain.signals, code_max=65535, command=replace(plain.signals.command, valid_codes=(0, 65535)))
    functions = replace(plain.drive_functions, ramp_up=(1, 0))
    nodes = (32768,) * (signals.pair(1).largest_difference // plain.beta_step_codes + 2)
    with wording.refusal(InputError):
        sides = Sides(positive=replace(plain.positive, beta=nodes, transition_beta=nodes))
        replace(plain, signals=signals, drive_functions=functions, sides=sides)
