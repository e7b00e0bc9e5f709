"""The wave about a direct command, beside that of the compiled drive's own tick.

The rule that both keep: the wave begins with its upper half at the first period; there is none about a command of
zero, and it stays within the PWM's range.
"""

import numpy as np

from dzdesign.verify.closed_loop.loop import LoopRun
from dzdesign.verify.integrator.compiled_calls import CompiledDrive
from dzdesign.verify.integrator.windows import REST_S, Course, Window
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary

#: A standing command, as a share of full command, and for how long the drive has it beyond its own ramps, s.
STANDING, STANDS_S = 0.5, 0.2


def unlike_direct_values(window: Window, library: CompiledLibrary, course: Course, compensated: LoopRun) -> int:
    """Return in how many PWM periods the native loop's direct command has another wave than the drive gives it.

    `course` has a value for each period, and `compensated` is the native run through it, whose pressures are real ones.
    None is compared where the recordings had no dither, or where the plant is these recordings and has it in it.
    """
    loop, compensator = window.scene.loop, window.scene.compensator
    signals = compensator.signals
    if loop.is_stand_in or compensator.valve.dither is None:
        return 0
    run = loop.run(course.command, course.supply_MPa, back_MPa=course.back_MPa, periods_per_record=1)
    wave = _wave_of_drive(window, library, (int(compensated.code_a[-1]), int(compensated.code_b[-1])))
    direct = np.floor(course.command * signals.compare_max + 0.5)
    about = direct + wave[np.arange(direct.size) % wave.size]
    expected = np.where(direct > 0, np.clip(about, 0, signals.compare_max), 0)
    return int(np.count_nonzero(run.compare != expected))


def _wave_of_drive(window: Window, library: CompiledLibrary, pressures: tuple[int, int]) -> np.ndarray:
    """Return what the compiled drive adds to its law over one wave, from the first period of its upper half on, (P,).

    Of a drive that adds nothing it is a zero.
    """
    scene, loop = window.scene, window.scene.loop
    command, drive = scene.compensator.signals.command, CompiledDrive(library, scene.sign)
    rate_Hz = scene.compensator.signals.tick_Hz
    rest, ramp, stands = (round(time * rate_Hz) for time in (loop.waits_s + REST_S, loop.slowest_ramp_s, STANDS_S))
    standing = command.zero_code + round(STANDING * command.direction(scene.sign) * command.span(scene.sign))
    periods = rest + ramp + stands
    samples = range(0, periods, drive.periods_per_sample)
    codes = [(command.zero_code if k < rest else standing, *pressures) for k in samples]
    a, b, law, _ = drive.samples(np.array(codes))[:periods].T
    wave = ((a if scene.sign > 0 else b) - law)[-stands:]
    begins = np.flatnonzero((wave[1:] > 0) & (wave[:-1] <= 0)) + 1
    return wave[begins[0] : begins[1]] if begins.size > 1 else np.zeros(1)
