"""Recordings in the forms that people complain of in public, small: one simulated bench, written in many ways.

The valve opens at 5.35 V - 0.05 V/MPa dP and closes 0.2 V lower; beyond, Q = 3 sqrt(dP/MPa) (u - threshold) L/min.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

PLAY = 0.2
PRESSURES = (1.0, 3.0, 5.0)
RATE_HZ = 20.0


def opening(dp_MPa: float) -> float:
    return 5.35 - 0.05 * dp_MPa


def closing(dp_MPa: float) -> float:
    return opening(dp_MPa) - PLAY


@dataclass(frozen=True, kw_only=True)
class Bench:
    """One recording as the bench sees it: s, V, MPa, L/min."""

    dp_MPa: float = 1.0
    seed: int = 0
    seconds: float = 60.0
    noise: float = 0.03
    command: Callable[["Bench"], np.ndarray] | None = None
    time: np.ndarray = field(init=False)
    u: np.ndarray = field(init=False)
    dp: np.ndarray = field(init=False)
    q: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        true_u = (self.command or triangle)(self)
        random = np.random.default_rng([self.seed, round(1000 * self.dp_MPa)])
        time = np.arange(true_u.size) / RATE_HZ
        dp = self.dp_MPa + 0.003 * random.standard_normal(time.size)
        knee = opening(self.dp_MPa) - PLAY / 2
        spool, at = np.empty(true_u.size), float(true_u[0])
        for row, command in enumerate(true_u):
            at = min(max(at, command - PLAY / 2), command + PLAY / 2)
            spool[row] = at
        size = np.maximum(np.abs(spool) - knee, 0)
        q = 3 * np.sqrt(dp) * np.sign(spool) * size + self.noise * random.standard_normal(time.size)
        rows = {"time": time, "u": true_u, "dp": dp, "q": q}
        for name, values in rows.items():
            object.__setattr__(self, name, values)

    def signals(self) -> dict[str, np.ndarray]:
        return {"u_V": self.u, "dP_MPa": self.dp, "Q_Lmin": self.q}


def triangle(bench: Bench) -> np.ndarray:
    """Two seconds of rest, up to 10 V, down again, two of rest."""
    rest, up = np.zeros(int(2 * RATE_HZ)), np.linspace(0, 10, int(bench.seconds * RATE_HZ / 2))
    return np.concatenate([rest, up, up[::-1], rest])


def both_sides(bench: Bench) -> np.ndarray:
    one = triangle(bench)
    return np.concatenate([one, -one])


def series(pressures: Sequence[float] = PRESSURES, repeats: int = 1, **changes) -> list[Bench]:
    return [Bench(dp_MPa=dp, seed=seed, **changes) for dp in pressures for seed in range(repeats)]


def csv(columns: Mapping[str, Sequence], separator: str = ",", digits: int = 4, above: str = "") -> bytes:
    """Return a table of text; numbers with so many digits, texts as they are, cells behind a column's end blank."""
    texts = [
        [cell if isinstance(cell, str) else f"{cell:.{digits}f}" for cell in column] for column in columns.values()
    ]
    longest = max(map(len, texts))
    rows = zip(*([*column, *[""] * (longest - len(column))] for column in texts), strict=True)
    lines = [separator.join(label.partition("\0")[0] for label in columns), *(separator.join(row) for row in rows)]
    return (above + "\n".join(lines) + "\n").encode()


def write(
    folder: Path, benches: Sequence[Bench], form: Callable[[Bench], Mapping[str, Sequence] | bytes], suffix: str = "csv"
) -> list[str]:
    """Write a recording each, as `form` gives it; return their names."""
    names = []
    for bench in benches:
        content = form(bench)
        names.append(f"r{bench.dp_MPa:g}_{bench.seed}.{suffix}")
        (folder / names[-1]).write_bytes(content if isinstance(content, bytes) else csv(content))
    return names


def plain(bench: Bench) -> dict[str, Sequence]:
    return {"time_s": bench.time, **bench.signals()}


def shifted(bench: Bench, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and values of a flow channel that was sampled on a clock of its own, so much later."""
    time = bench.time[bench.time + seconds <= bench.time[-1]] + seconds
    return time, np.interp(time, bench.time, bench.q)


def mat(variables: Mapping[str, object]) -> bytes:
    import io

    from scipy.io import savemat

    out = io.BytesIO()
    savemat(out, dict(variables))
    return out.getvalue()
