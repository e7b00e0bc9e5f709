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
#: Date of the first row, where a form states one.
START = np.datetime64("2026-02-03T08:00:00.000", "ms")


def opening(dp_MPa: float) -> float:
    return 5.35 - 0.05 * dp_MPa


def closing(dp_MPa: float) -> float:
    return opening(dp_MPa) - PLAY


@dataclass(frozen=True, kw_only=True)
class Bench:
    """One recording as the bench sees it: s, V, MPa, L/min; `late` s is how much later the command's column comes."""

    dp_MPa: float = 1.0
    seed: int = 0
    seconds: float = 60.0
    noise: float = 0.03
    stop_V: float = 20.0
    shift_V: float = 0.0
    late: float = 0.0
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
        knee = opening(self.dp_MPa) + self.shift_V - PLAY / 2
        spool, at = np.empty(true_u.size), float(true_u[0])
        for row, command in enumerate(true_u):
            at = min(max(at, command - PLAY / 2), command + PLAY / 2)
            spool[row] = at
        size = np.clip(np.abs(spool) - knee, 0, self.stop_V - knee)
        q = 3 * np.sqrt(dp) * np.sign(spool) * size + self.noise * random.standard_normal(time.size)
        rows = {"time": time, "u": np.interp(time - self.late, time, true_u), "dp": dp, "q": q}
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


def levels(values: Sequence[float], hold_s: float = 3.0) -> Callable[[Bench], np.ndarray]:
    """Return a command of levels that are held one after the other."""
    return lambda bench: np.repeat(np.asarray(values, dtype=float), int(hold_s * RATE_HZ))


def from_zero(values: Sequence[float], base: float = 0.0) -> list[float]:
    return [level for value in values for level in (base, value)] + [base]


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


def stamped(bench: Bench, spell: Callable[[float], str], label: str = "time") -> bytes:
    """Return a table whose time is spelt, from seconds."""
    return csv({label: [spell(second) for second in bench.time], **bench.signals()}, separator=";")


def date(second: float) -> str:
    """Return date and time as ISO 8601 has them, with milliseconds."""
    return str(START + np.timedelta64(round(1000 * second), "ms"))


def shifted(bench: Bench, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and values of a flow channel that was sampled on a clock of its own, so much later."""
    time = bench.time[bench.time + seconds <= bench.time[-1]] + seconds
    return time, np.interp(time, bench.time, bench.q)


def tdms(bench: Bench, late_s: float = 0.0, by: str = "wf_start_time", step: float = 1.0) -> bytes:
    """Return a TDMS file of waveforms, the flow's with a start, offset or step of its own."""
    import io

    from nptdms import ChannelObject, TdmsWriter

    time = bench.time[bench.time * step + late_s <= bench.time[-1]] * step + late_s
    channels = []
    for name, values in bench.signals().items():
        own = name == "Q_Lmin"
        start = START + np.timedelta64(round(1e3 * late_s) if own and by == "wf_start_time" else 0, "ms")
        properties = {
            "wf_start_time": start.astype("datetime64[us]"),
            "wf_start_offset": late_s if own and by == "wf_start_offset" else 0.0,
            "wf_increment": (step if own else 1.0) / RATE_HZ,
            "unit_string": name.partition("_")[2].replace("Lmin", "L/min"),
        }
        data = np.interp(time, bench.time, values) if own else values
        channels.append(ChannelObject("ramp", name.partition("_")[0], data, properties=properties))
    out = io.BytesIO()
    with TdmsWriter(out) as writer:
        writer.write_segment(channels)
    return out.getvalue()


def hdf5(bench: Bench, late_s: float) -> bytes:
    """Return an HDF5 file with a dataset of time for each quantity."""
    import io

    import h5py

    time_q, q = shifted(bench, late_s)
    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        for name, values in {"t_u_s": bench.time, "u_V": bench.u, "t_dP_s": bench.time, "dP_MPa": bench.dp}.items():
            file[name] = values
        file["t_Q_s"], file["Q_Lmin"] = time_q, q
    return out.getvalue()


def mat(variables: Mapping[str, object]) -> bytes:
    import io

    from scipy.io import savemat

    out = io.BytesIO()
    savemat(out, dict(variables))
    return out.getvalue()


def lvm(
    bench: Bench,
    x_columns: str,
    units: Sequence[str] = ("V", "MPa", "L/min"),
    names: Sequence[str] = ("u", "dP", "Q"),
    segments: int = 1,
    restart: bool = False,
) -> bytes:
    """Return a LabVIEW measurement file: X_Columns No, One or Multi, a header for each segment."""
    head = [
        "LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab", "Decimal_Separator\t,",
        f"Multi_Headings\t{'Yes' if segments > 1 else 'No'}", f"X_Columns\t{x_columns}", "Time_Pref\tRelative",
        "Operator\tuser", "Date\t2026/02/03", "Time\t08:00:00,0", "***End_of_Header***", "\t",
    ]  # fmt: skip
    between = "\t\t" if x_columns == "Multi" else "\t"
    rows_each = -(-bench.time.size // segments)
    for first in range(0, bench.time.size, rows_each):
        rows = slice(first, first + rows_each)
        begin = bench.time[first] if restart else 0.0
        start = f"08:{int(begin // 60):02d}:{begin % 60:09.6f}".replace(".", ",")
        sizes = [str(bench.time[rows].size)] * 3
        head += [
            f"Channels\t3{between}", *(f"{key}\t{between.join(values)}" for key, values in {
                "Samples": sizes, "Date": ["2026/02/03"] * 3, "Time": [start] * 3, "Y_Unit_Label": units,
                "X_Dimension": ["Time"] * 3, "X0": ["0,0"] * 3, "Delta_X": [f"{1 / RATE_HZ:.6f}".replace(".", ",")] * 3,
            }.items()), "***End_of_Header***",
        ]  # fmt: skip
        head.append("\t".join(["X_Value", names[0], *(["X_Value"] if x_columns == "Multi" else []), names[1],
                               *(["X_Value"] if x_columns == "Multi" else []), names[2], "Comment"]))  # fmt: skip
        time = [f"{value:.6f}" for value in bench.time[rows] - begin]
        x = [""] * len(time) if x_columns == "No" else time
        columns = [[f"{value:.6f}" for value in values[rows]] for values in (bench.u, bench.dp, bench.q)]
        parts = [x, columns[0], *([time] if x_columns == "Multi" else []), columns[1],
                 *([time] if x_columns == "Multi" else []), columns[2]]  # fmt: skip
        head += ["\t".join(row).replace(".", ",") for row in zip(*parts, strict=True)]
    return ("\r\n".join(head) + "\r\n").encode()
