"""The walk of the firmware's self-test through `dzdesign.verify.exhaustive.exact_drive`."""

from fractions import Fraction

from dzdesign.design.compensator import Compensator
from dzdesign.verify.exhaustive.exact_drive import DriveModel
from tests.support.grid_hash import FNV_OFFSET, FNV_PRIME

WALK_TICKS = 20_000


def walk(code_max: int, zero: int):
    """Yield the codes of the samples of the walk, as dz_selftest.h states them."""
    random, at, aim = 1, 0, 0

    def draw(count: int) -> int:
        nonlocal random
        random = (1664525 * random + 1013904223) % 2**32
        return (random >> 16) % count

    for sample in range(WALK_TICKS):
        if sample % 64 == 0:
            aim = draw(code_max + 1)
            aim = zero if aim % 2 else aim
        at += int(Fraction(aim - at, 4))
        command = min(max(at + draw(9) - 4, 0), code_max)
        command = command if draw(256) else 65535
        pressures = []
        for least, count in ((code_max // 3, code_max // 2), (code_max // 4, code_max // 8)):
            sound = least + draw(count)
            pressures.append(sound if draw(32) else draw(code_max + 2))
        yield command, *pressures


def walked_line(compensator: Compensator) -> str:
    """The line that the self-test must print of the walk."""
    signals = compensator.signals
    drive, samples, value = DriveModel(compensator), walk(signals.code_max, signals.command.zero_code), FNV_OFFSET
    for tick in range(WALK_TICKS):
        if tick % (signals.tick_Hz // signals.sample_Hz) == 0:
            drive.sample(*next(samples))
        drive.tick()
        for number in drive.outputs:
            for byte in (number & 0xFF, number >> 8):
                value = (value ^ byte) * FNV_PRIME & 0xFFFFFFFF
    return f"dz_drive walk FNV-1a-32 {value:08X}"
