"""The hash of the self-test on a microcontroller, in Python from the exact law: no code of the generated C."""

from functools import cache

from dzdesign.design.compensator import Compensator

FNV_OFFSET, FNV_PRIME = 0x811C9DC5, 0x01000193
SAMPLE = ("sample", 273, 195)
GRID = ("grid", 13, 61)


def codes(step: int, largest: int) -> list[int]:
    """The codes of the grid, as dz_selftest.h states them."""
    return [0, 1, *range(step, largest, step), largest, largest + 1, 65535]


def exact_line(compensator: Compensator, grid: tuple[str, int, int]) -> str:
    """The line that the self-test must print, by the law in rational numbers."""
    name, command_step, pressure_step = grid
    signals = compensator.signals
    failed = -compensator.reverse_codes - 1

    @cache
    def compare(command: int, dp_code: int) -> int:
        return compensator.compare(command, dp_code)

    value = FNV_OFFSET
    pressures = codes(pressure_step, signals.code_max)
    for command in codes(command_step, signals.code_max):
        for p_a in pressures:
            for p_b in pressures:
                possible = all(
                    sensor.valid_codes[0] <= code <= sensor.valid_codes[1]
                    for sensor, code in ((signals.pressure_a, p_a), (signals.pressure_b, p_b))
                )
                answer = compare(command, max(signals.pair(1).difference(p_a, p_b), failed) if possible else failed)
                if command > signals.code_max:
                    answer = 0
                for byte in (answer & 0xFF, answer >> 8):
                    value = (value ^ byte) * FNV_PRIME & 0xFFFFFFFF
    return f"dz_comp {name} FNV-1a-32 {value:08X}"
