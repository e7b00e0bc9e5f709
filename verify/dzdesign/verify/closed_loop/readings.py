"""What the core reads: codes of command and pressures, right ones and wrong ones."""

from dataclasses import dataclass

import numpy as np

from dzdesign.design.signals import Signals


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingErrors:
    """What the converter, and the sensors before it, read wrong; of command, sensor A and sensor B, (3,) each.

    The noise is white: whole codes from minus its peak to plus it, drawn again at every sample of the core.
    """

    offset_codes: tuple[float, float, float] = (0.0, 0.0, 0.0)
    #: At the converter's largest code.
    gain_codes: tuple[float, float, float] = (0.0, 0.0, 0.0)
    #: Peak.
    noise_codes: tuple[int, int, int] = (0, 0, 0)
    #: Of the noise.
    seed: int = 1

    @property
    def table(self) -> np.ndarray:
        """The errors as loop.c has them, one row per channel."""
        return np.array([self.offset_codes, self.gain_codes, self.noise_codes], dtype=float).T.copy()


NO_ERRORS = ReadingErrors()


class Channels:
    """The converter's channels of one sign of command: command, sensor A, sensor B."""

    def __init__(self, signals: Signals, sign: int) -> None:
        command, sensors = signals.command, (signals.pressure_a, signals.pressure_b)
        full = command.zero_code + command.direction(sign) * command.span(sign)
        #: Codes at zero, (3,), and at the span, which is 1, MPa and MPa.
        self.zeros = np.array([command.zero_code, *(sensor.zero_code for sensor in sensors)], dtype=np.int32)
        self.fulls = np.array([full, *(sensor.full_code for sensor in sensors)], dtype=np.int32)
        self.spans = np.array([1.0, *(float(sensor.span_MPa) for sensor in sensors)])
        self.code_max = signals.code_max
        #: Whether sensor B stands upstream of the edge.
        self.swapped = sign < 0 and signals.swapped

    @property
    def converted_per_unit(self) -> np.ndarray:
        """Codes for one of what each channel measures, as a converter rounds: a span of n codes has n + 1 of them."""
        codes: np.ndarray = (self.fulls - self.zeros + np.sign(self.fulls - self.zeros)) / self.spans
        return codes

    @property
    def codes_per_MPa(self) -> tuple[float, float]:
        """Codes of sensors A and B for 1 MPa."""
        a, b = map(float, ((self.fulls - self.zeros) / self.spans)[1:])
        return a, b

    def command_of_codes(self, codes: np.ndarray) -> np.ndarray:
        """Return the commands, shares of full, that the converter reads as so many codes from zero, (N,) whole numbers.

        They may lie below zero: then the command is one of the other sign, or none that the signal has.
        """
        zero, full = int(self.zeros[0]), int(self.fulls[0])
        span, way = abs(full - zero), 1 if full > zero else -1
        middle: np.ndarray = (codes + 0.5 * way) / (span + 1)  # of the code: it is rounded down, whichever way it runs
        return middle

    def pressure_codes(self, dp_MPa: float | np.ndarray, back_MPa: float | np.ndarray) -> np.ndarray:
        """Return the codes of sensors A and B at a pressure drop and a pressure downstream of the edge, (..., 2)."""
        back = np.asarray(back_MPa, dtype=float)
        ahead = back + dp_MPa
        values = np.stack([back, ahead] if self.swapped else [ahead, back], axis=-1)
        codes = np.floor(self.zeros[1:] + values * (self.fulls[1:] - self.zeros[1:] + 1) / self.spans[1:])
        whole: np.ndarray = np.clip(codes, 0, self.code_max).astype(np.int32)
        return whole
