"""Recordings in the forms of public complaints: the right thresholds, or the right refusal or warning.

No bound lies above the true threshold in any of them, and none ends in a traceback.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from dzdesign.command_line.cli import main
from tests.identify import public_forms as forms
from tests.identify.public_forms import Bench, closing, csv, from_zero, levels, opening, plain, series, stamped, write

#: A knee is right within so many volts, or three of its standard errors.
NEAR = 0.015
LAG = ("--meter-lag", "0 s +- 0.01 s")


@dataclass(frozen=True, kw_only=True)
class Form:
    """Recordings, the options they are read with, and what is right.

    `write` writes them into the current folder and returns their names. `refused` holds what a message must name, such
    as a column or the option that helps; empty: the branches are measured on the sides, at thresholds that lie by
    `shift` V higher, with the warnings of `codes` and none of `never`.
    """

    write: Callable[[], Sequence[str]]
    options: Sequence[str] = ()
    lag: Sequence[str] = LAG
    refused: Sequence[str] = ()
    branches: Sequence[str] = ("rising", "falling")
    sides: Sequence[str] = ("positive",)
    shift: float = 0.0
    codes: Sequence[str] = ()
    never: Sequence[str] = ()
    drive_range: tuple[float, float] | None = None
    near: float = NEAR


def one(form, suffix="csv", benches=None, **changes) -> Callable[[], Sequence[str]]:
    """Return what writes a series in a form."""
    return lambda: write(Path(), series(**changes) if benches is None else benches, form, suffix)


def check(form: Form, capsys) -> None:
    names = form.write()
    status = main(["-q", "identify", *names, *form.options, *form.lag, "-o", "valve.json"])
    printed = capsys.readouterr()
    assert "Traceback" not in printed.err
    if form.refused:
        assert status == 2, printed.out
        message = printed.err
        for place in form.refused:
            assert place in message, message
        assert not Path("valve.json").exists()
        return
    assert status == 0, printed.err
    valve = json.loads(Path("valve.json").read_text())
    codes = {warning["code"] for warning in valve["warnings"]}
    assert set(form.codes) <= codes and not set(form.never) & codes, codes
    for side in form.sides:
        tests = valve["sides"][side]["tests"]
        assert len(tests) == len({round(test["dp_MPa"]) for test in tests})
        for test in tests:
            nominal = round(test["dp_MPa"])
            assert test["dp_MPa"] == pytest.approx(nominal, abs=0.02)
            true = {"rising": opening(nominal) + form.shift, "falling": closing(nominal) + form.shift}
            for branch, threshold in true.items():
                knee = test.get(f"u_knee_{branch}_V")
                assert (knee is not None) == (branch in form.branches), (branch, knee)
                if knee is not None:
                    near = max(form.near, 3 * test[f"u_knee_{branch}_se_V"])
                    assert knee == pytest.approx(threshold, abs=near), (branch, nominal)
            guarded = "falling" if "falling" in form.branches else "rising"
            assert test["u_guard_lower_V"] <= true[guarded]
    if form.drive_range:
        least, most = form.drive_range
        assert least <= valve["sides"]["positive"]["k_x_max_over_u_max"] <= most


# Each channel has a clock of its own.


def ended_early(bench: Bench, share: float):
    """The flow's rows are laid one after the other, though its samples are further apart: its column ends first."""
    kept = np.round(np.linspace(0, bench.q.size - 1, int(share * bench.q.size))).astype(int)
    return csv({**plain(bench), "Q_Lmin": bench.q[kept]})


def filled_up(bench: Bench, share: float, value: float | None):
    """The same, and the logger filled the column up to the end: with a number, or the last value."""
    kept = np.round(np.linspace(0, bench.q.size - 1, int(share * bench.q.size))).astype(int)
    tail = np.full(bench.q.size - kept.size, bench.q[kept[-1]] if value is None else value)
    return {**plain(bench), "Q_Lmin": np.concatenate([bench.q[kept], tail])}


def own_times(bench: Bench, late_s: float, labels: Sequence[str]):
    """A column of time before each quantity; equal labels are told apart behind a NUL, which is not written."""
    time_q, q = forms.shifted(bench, late_s)
    columns = (bench.time, bench.u, bench.time, bench.dp, time_q, q)
    return csv(
        {f"{label}\0{number}": column for number, (label, column) in enumerate(zip(labels, columns, strict=True))}
    )


TIMES_ALIKE = ("Time (s)", "u (V)", "Time (s)", "dP (MPa)", "Time (s)", "Q (L/min)")
TIMES_NAMED = ("time_u (s)", "u (V)", "time_dP (s)", "dP (MPa)", "time_Q (s)", "Q (L/min)")


def twincat(bench: Bench) -> bytes:
    """TwinCAT Scope's CSV: a block of properties and a timeline in ms for each channel."""
    late = {"uCmd": 0, "fFlow": 7, "fDeltaP": 3}
    signals = {"uCmd": bench.u, "fFlow": bench.q, "fDeltaP": bench.dp}
    pairs = {"Name": "{}", "NetId": "5.1.2.3.1.1", "Port": "851", "SampleTime[ms]": "50", "SymbolName": "MAIN.{}",
             "Data-Type": "REAL32"}  # fmt: skip
    lines = [
        "Name\tScope01",
        "File\tC:\\x\\ramp.tcscope",
        "StartRecord\t133800000000000000\tMontag, 3. Februar 2026\t13:08:42",
        "",
    ]
    lines += ["\t".join(f"{key}\t{text.format(name)}" for name in signals) for key, text in pairs.items()] + [""]
    measured = {name: np.interp(bench.time + late[name] / 1e3, bench.time, values) for name, values in signals.items()}
    for row, time in enumerate(bench.time):
        cells = [f"{round(1e3 * time) + late[name]}\t{measured[name][row]:.5f}" for name in signals]
        lines.append("\t".join(cells).replace(".", ","))
    return "\n".join(lines).encode()


def another_time(bench: Bench, late_s: float, label: str, rate: float = 1.0, zero: float = 0.0):
    """Two times in a row, of which the second is the flow's, or another count of the first."""
    time, q = forms.shifted(bench, late_s)
    first = {name: values[: time.size] for name, values in plain(bench).items()}
    return {**first, label: time * rate + zero, "Q_Lmin": q}


CLOCKS = {
    "tdms-start-time": Form(write=one(lambda bench: forms.tdms(bench, 0.24), "tdms", repeats=3)),
    "tdms-start-early": Form(write=one(lambda bench: forms.tdms(bench, 1.5), "tdms")),
    "tdms-start-offset": Form(write=one(lambda bench: forms.tdms(bench, 0.5, by="wf_start_offset"), "tdms")),
    "tdms-other-increment": Form(write=one(lambda bench: forms.tdms(bench, step=2.0), "tdms")),
    "hdf5-time-each": Form(write=one(lambda bench: forms.hdf5(bench, 0.24), "h5")),
    "mat-time-each": Form(
        write=one(
            lambda bench: forms.mat(
                {"t_u_s": bench.time, "u_V": bench.u, "t_dP_s": bench.time, "dP_MPa": bench.dp}
                | dict(zip(("t_Q_s", "Q_Lmin"), forms.shifted(bench, 0.24), strict=True))
            ),
            "mat",
        )
    ),
    "csv-times-alike": Form(write=one(lambda bench: own_times(bench, 0.24, TIMES_ALIKE))),
    "csv-times-named": Form(write=one(lambda bench: own_times(bench, 0.24, TIMES_NAMED))),
    **{
        f"csv-times-{label}": Form(
            write=one(lambda bench, label=label: another_time(bench, 0.24, label)),
            refused=("r1_0.csv", "Q_Lmin", label),
        )
        for label in ("time2_s", "sensor_time_s", "elapsed_s", "elapsed time [s]")
    },
    "mat-times-lone-t": Form(
        write=one(lambda bench: forms.mat(another_time(bench, 0.24, "t")), "mat"), refused=("r1_0.mat", "Q_Lmin", "'t'")
    ),
    "csv-times-chosen": Form(
        write=one(lambda bench: another_time(bench, 0.0, "cpu_time_s", 0.3)), options=("--columns", "time=time_s")
    ),
    "csv-times-from-another-zero": Form(write=one(lambda bench: another_time(bench, 0.0, "uptime_s", zero=5e3))),
    "csv-times-and-temperature": Form(write=one(lambda bench: another_time(bench, 0.0, "T_oil_degC", 0.01, zero=40.0))),
    "csv-times-and-count": Form(write=one(lambda bench: another_time(bench, 0.0, "t", forms.RATE_HZ))),
    "csv-times-rounded": Form(write=one(lambda bench: another_time(bench, 0.0, "elapsed_s", zero=0.002))),
    "csv-column-shorter": Form(write=one(lambda bench: ended_early(bench, 0.995)), refused=("r1_0.csv", "Q_Lmin")),
    "csv-column-much-shorter": Form(write=one(lambda bench: ended_early(bench, 0.8)), refused=("r1_0.csv", "Q_Lmin")),
    "csv-column-filled-with-zeros": Form(
        write=one(lambda bench: filled_up(bench, 0.99, 0.0)), refused=("r1_0.csv", "Q_Lmin")
    ),
    "csv-column-filled-with-its-last": Form(
        write=one(lambda bench: filled_up(bench, 0.99, None)), refused=("r1_0.csv", "Q_Lmin")
    ),
    "csv-column-filled-amid-flow": Form(
        write=one(lambda bench: filled_up(bench, 0.8, None)), refused=("r1_0.csv", "Q_Lmin")
    ),
    "twincat-scope": Form(
        write=one(twincat), options=("--columns", "u=uCmd:V,Q=fFlow:L/min,dP=fDeltaP:MPa")
    ),
    "lvm-one": Form(write=one(lambda bench: forms.lvm(bench, "One"), "lvm")),
    "lvm-multi": Form(write=one(lambda bench: forms.lvm(bench, "Multi"), "lvm")),
    "lvm-no": Form(write=one(lambda bench: forms.lvm(bench, "No"), "lvm")),
    "lvm-default-names": Form(
        write=one(lambda bench: forms.lvm(bench, "One", ["Volts"] * 3, ("Voltage_0", "Voltage_1", "Voltage_2")), "lvm"),
        options=("--columns", "u=Voltage_0:V,dP=Voltage_1:MPa,Q=Voltage_2:L/min"),
    ),
    "lvm-segments": Form(write=one(lambda bench: forms.lvm(bench, "One", segments=4), "lvm")),
    "lvm-segments-restart": Form(write=one(lambda bench: forms.lvm(bench, "One", segments=4, restart=True), "lvm")),
}  # fmt: skip

# Steps.

UP = list(np.linspace(4.6, 10, 28))
RANDOM = list(np.random.default_rng(5).permutation(UP))

STEPS = {
    "steps-from-zero": Form(
        write=one(plain, command=levels(from_zero(UP))), branches=("rising",), codes=("one-branch",), lag=()
    ),
    "steps-from-zero-falling-levels": Form(
        write=one(plain, command=levels(from_zero(UP[::-1]))), branches=("rising",), codes=("one-branch",), lag=()
    ),
    "steps-from-below-the-threshold": Form(
        write=one(plain, command=levels(from_zero(UP, base=2.0))), branches=("rising",), codes=("one-branch",), lag=()
    ),
    "steps-from-full-command": Form(
        write=one(plain, command=levels(from_zero(UP[:-1], base=10.0))), branches=("falling",), codes=("one-branch",),
        lag=(),
    ),
    "levels-in-no-order": Form(write=one(plain, command=levels([0, *RANDOM, 0])), refused=("r1_0.csv",), lag=()),
    "staircase": Form(write=one(plain, command=levels([0, *UP, *UP[-2::-1], 0])), lag=()),
    "alternating-steps": Form(
        write=one(plain, command=levels([level for value in UP for level in (value, -value)])),
        branches=("rising",), sides=("positive", "negative"), codes=("one-branch",), lag=(),
    ),
}  # fmt: skip

# Flow: the end of a range, two populations, the wrong quantity.


def clipped(bench: Bench, most: float):
    return {**plain(bench), "Q_Lmin": np.minimum(bench.q, most)}


def in_mA(bench: Bench, full: float = 12.0):
    q_mA = np.minimum(4 + 16 * bench.q / full, 20.0)
    return {"time_s": bench.time, "u_V": bench.u, "dP_MPa": bench.dp, "Q_mA": q_mA}


def direction_bit(bench: Bench):
    """An unsigned meter and a direction: the other side opens half a volt later."""
    return {
        "time_s": bench.time, "u_V": np.abs(bench.u), "DIR": np.full(bench.u.size, float(bench.shift_V == 0)),
        "dP_MPa": bench.dp, "Q_Lmin": bench.q,
    }  # fmt: skip


def two_populations() -> list[Bench]:
    return [Bench(dp_MPa=dp, seed=seed, shift_V=0.5 * (seed % 2)) for dp in forms.PRESSURES for seed in range(4)]


def two_columns(bench: Bench):
    return {
        "time_s": bench.time, "uA_V": np.clip(bench.u, 0, None), "uB_V": np.clip(-bench.u, 0, None),
        "dP_MPa": bench.dp, "Q_Lmin": bench.q,
    }  # fmt: skip


def totalled(bench: Bench, per_litre: float = 1.0):
    return np.cumsum(np.clip(bench.q, 0, None)) / RATE_PER_MIN * per_litre


RATE_PER_MIN = 60 * forms.RATE_HZ


def with_column(label: str, values: Callable[[Bench], np.ndarray], instead: str = "Q_Lmin"):
    return lambda bench: {label if name == instead else name: values(bench) if name == instead else column
                          for name, column in plain(bench).items()}  # fmt: skip


def unequal_columns(bench: Bench):
    half = int(0.6 * bench.q.size)
    return csv({**plain(bench), "Q_Lmin": bench.q[:half]})


FLOWS = {
    "flow-clipped": Form(write=one(lambda bench: clipped(bench, 6.0)), codes=("flow-clipped",), drive_range=(0.468, 1)),
    "flow-at-20-mA": Form(
        write=one(in_mA, repeats=2), options=("--columns", "Q=Q_mA:4..20 mA = 0..12 L/min"), codes=("flow-clipped",),
        drive_range=(0.468, 1),
    ),
    "true-stop": Form(write=one(plain, stop_V=8.2), never=("flow-clipped",), drive_range=(0.28, 0.32)),
    # Taken for one, the knee lies between the two; the bound below that of the side that closes first.
    "direction-bit": Form(write=one(direction_bit, benches=two_populations()), codes=("two-groups",), near=0.6),
    "one-solenoid-of-two": Form(
        write=one(two_columns, command=forms.both_sides, repeats=3), options=("--columns", "u=uA_V")
    ),
    "two-solenoids": Form(
        write=one(two_columns, command=forms.both_sides), options=("--columns", "u=uA_V - uB_V"),
        sides=("positive", "negative"),
    ),
    "two-solenoids-not-chosen": Form(write=one(two_columns, command=forms.both_sides), refused=("u=uA_V - uB_V",)),
    "gauge-and-absolute": Form(
        write=one(
            lambda bench: {
                "time_s": bench.time, "u_V": bench.u, "pA [bara]": 10 * bench.dp + 3.013,
                "pB [barg]": np.full(bench.dp.size, 2.0), "Q_Lmin": bench.q,
            }
        ),
        refused=("pA [bara]", "pB [barg]"),
    ),
    # Such a bound is too high by what the warning says: its zero error was below zero, and lost its sign.
    "flow-without-its-sign": Form(
        write=one(with_column("Q_Lmin", lambda bench: np.abs(bench.q - 0.4))), codes=("zero-hidden",), shift=0.27,
        near=0.16,
    ),
    "zero-with-its-sign": Form(
        write=one(with_column("Q_Lmin", lambda bench: np.abs(bench.q + 0.4))), never=("zero-hidden",)
    ),
    "command-late": Form(
        write=one(
            plain,
            benches=[Bench(dp_MPa=dp, seed=seed, seconds=seconds, late=0.3) for dp in forms.PRESSURES
                     for seed, seconds in enumerate((30.0, 60.0))],
        ),
        lag=(), codes=("command-late",),
    ),
    "equal-labels": Form(
        write=one(lambda bench: csv({**plain(bench), "Q_Lmin\0": 1.4 * bench.q})), refused=("Q_Lmin#2",)
    ),
    "equal-labels-chosen": Form(
        write=one(lambda bench: csv({"time_s": bench.time, "u_V": bench.u, "dP_MPa": bench.dp, "Q_Lmin": bench.q + 1,
                                     "Q_Lmin\0": bench.q})),
        options=("--columns", "Q=Q_Lmin#2"),
    ),
    "reversed-valve": Form(
        write=one(with_column("u_V", lambda bench: 10 - bench.u, "u_V")), refused=("u=u_V:10..0 V = 0..10 V",)
    ),
    "reversed-valve-turned": Form(
        write=one(with_column("u_V", lambda bench: 10 - bench.u, "u_V")),
        options=("--columns", "u=u_V:10..0 V = 0..10 V"),
    ),
    "meter-backwards": Form(
        write=one(with_column("Q_Lmin", lambda bench: -bench.q)), refused=("Q=Q_Lmin:0..-1",)
    ),
    "meter-turned": Form(
        write=one(with_column("Q_Lmin", lambda bench: -bench.q)), options=("--columns", "Q=Q_Lmin:0..-1 = 0..1 L/min")
    ),
    "pulse-us": Form(
        write=one(with_column("pulse_us", lambda bench: 1500 + 40 * bench.u, "u_V"), command=forms.both_sides),
        options=("--columns", "u=pulse_us:1100..1900 = -10..10 V"), sides=("positive", "negative"),
    ),
    "speed-mm-per-s": Form(
        write=one(with_column("speed_mm_per_s", lambda bench: bench.q / 0.12)),
        options=("--columns", "Q=speed_mm_per_s:0..100 = 0..12 L/min"),
    ),
    "position": Form(
        write=one(with_column("pos_mm", lambda bench: totalled(bench, 100.0))), options=("--columns", "Q=pos_mm"),
        refused=("pos_mm", "position"),
    ),
    "volume": Form(
        write=one(with_column("Total_L", totalled)), options=("--columns", "Q=Total_L"), refused=("Total_L", "volume")
    ),
    "volume-called-flow": Form(
        write=one(with_column("Total_L", totalled)), options=("--columns", "Q=Total_L:L/min"), refused=("Total_L",)
    ),
    "pulses-called-flow": Form(
        write=one(with_column("pulses", lambda bench: np.floor(totalled(bench, 500)))),
        options=("--columns", "Q=pulses:L/min"), refused=("pulses",),
    ),
    "frequency": Form(
        write=one(with_column("freq_Hz", lambda bench: bench.q * 500 / 60)),
        options=("--columns", "Q=freq_Hz:0..500 Hz = 0..60 L/min"),
    ),
    "unequal-lengths": Form(write=one(unequal_columns), refused=("r1_0.csv", "Q_Lmin")),
    "fraction-called-percent": Form(
        write=one(with_column("u_%", lambda bench: bench.u / 10, "u_V")), refused=("r1_0.csv",)
    ),
    "per-mille": Form(
        write=one(with_column("u [promille]", lambda bench: 100 * bench.u, "u_V")),
        options=("--columns", "u=u [promille]:0..1000 = 0..10 V"),
    ),
}  # fmt: skip

# Cells: no value, spellings of time, other programs' files.

MISSING = ("---", "--", "-----", "OL", "+OVER", "OVER", "Overload", "HI", "N/A", "NA", "NULL", "#N/A", "NaN", "+++++",
           "Bad", "∞", "Inf", "1.#QNAN", "9.9E+37", "3.4E+38", "-9999", "9.91e37")  # fmt: skip


def with_marker(marker: str):
    def form(bench: Bench) -> bytes:
        dp = [f"{value:.4f}" for value in bench.dp]
        for row in range(7, len(dp), 41):
            dp[row] = marker
        return csv({**plain(bench), "dP_MPa": dp})

    return form


def duration(second: float) -> str:
    return f"0 days 00:{int(second // 60):02d}:{second % 60:09.6f}"


def named_month(second: float) -> str:
    day = forms.date(second)
    return f"03-Feb-2026 {day[11:]}"


SPELLINGS = {
    "seconds-with-unit": lambda second: f"{second:.3f} sec",
    "pandas": duration,
    "matlab": named_month,
    "compact": lambda second: forms.date(second).replace("-", "").replace(":", ""),
    "plc": lambda second: f"T#{round(1e3 * second)}ms",
    "plc-date": lambda second: "DT#" + forms.date(second).replace("T", "-"),
    "colon-before-ms": lambda second: forms.date(second)[11:].replace(".", ":"),
    "two-digits": lambda second: "03.02.26 " + forms.date(second)[11:],
    "offset": lambda second: forms.date(second) + "+01:00",
}


def set_back(second: float) -> str:
    """Return local time on the night of the end of summer time."""
    return f"25.10.2026 02:{59 if second < 30 else 0:02d}:{(second + 30) % 60:06.3f}"


def excel_dates(bench: Bench) -> bytes:
    months = ("Jan", "Feb", "Mrz", "Apr", "Mai", "Jun", "Jul", "Aug", "Sep", "Okt", "Nov", "Dez")
    texts = []
    for value in bench.q:
        whole, part = f"{abs(value):.2f}".split(".")
        texts.append(
            f"{int(whole):02d}. {months[int(part) - 1]}" if 1 <= int(part) <= 12 else f"{value:.2f}".replace(".", ",")
        )
    return csv({**plain(bench), "Q_Lmin": texts}, separator=";")


def long_format(bench: Bench) -> bytes:
    rows = [(f"{time:.3f}", f"plc.{name}", f"{values[row]:.4f}") for row, time in enumerate(bench.time)
            for name, values in bench.signals().items()]  # fmt: skip
    return csv(dict(zip(("timestamp", "path", "value"), zip(*rows, strict=True), strict=True)), separator=";")


def mixed_units(bench: Bench) -> bytes:
    texts = [f"{value:.4f} L/min" if value > 1 else f"{1e3 * value:.1f} mL/min" for value in bench.q]
    return csv({**plain(bench), "Q_Lmin": texts})


FIRST_BYTES = {
    "MDF": b"MDF     4.10    ", "SQLite": b"SQLite format 3\0", "BLF": b"LOGG\x90\0\0\0", "DXD": b"DEWESoft\0\0",
    "imc": b"|CF,2,1,1;|CK,1,3,1,1;",
}  # fmt: skip


def simulink(bench: Bench) -> bytes:
    """Simulink's "structure with time"."""
    values = np.column_stack([bench.u, bench.dp, bench.q])
    return forms.mat({"out": {"time": bench.time[:, None], "signals": {"values": values, "dimensions": 3}}})


CELLS = {
    **{f"missing-{marker}": Form(write=one(with_marker(marker), pressures=(3.0,)), codes=("missing-samples",))
       for marker in MISSING if marker not in ("NaN", "#N/A", "---", "--", "-----")},
    **{f"blank-{marker}": Form(write=one(with_marker(marker), pressures=(3.0,)))
       for marker in ("NaN", "#N/A", "---", "--", "-----")},
    "missing-declared": Form(
        write=one(with_marker("kaputt"), pressures=(3.0,)), options=("--missing", "kaputt"), codes=("missing-samples",)
    ),
    "missing-undeclared": Form(write=one(with_marker("kaputt"), pressures=(3.0,)), refused=("kaputt", "--missing")),
    **{f"time-{name}": Form(write=one(lambda bench, spell=spell: stamped(bench, spell), pressures=(3.0,)))
       for name, spell in SPELLINGS.items()},
    "clock-set-back": Form(write=one(lambda bench: stamped(bench, set_back)), refused=("r1_0.csv", "daylight saving")),
    "excel-dates": Form(write=one(excel_dates), refused=("r1_0.csv", "Q_Lmin", "date")),
    "long-format": Form(write=one(long_format), refused=("r1_0.csv",)),
    "units-in-cells": Form(write=one(mixed_units), refused=("r1_0.csv", "Q_Lmin")),
    **{f"format-{name}": Form(write=one(lambda bench, start=start: start + bytes(4096), "dat"), refused=("r1_0.dat",))
       for name, start in FIRST_BYTES.items()},
    "simulink-structure": Form(write=one(simulink, "mat"), refused=("r1_0.mat", "signals.values")),
    "units-spelt-otherwise": Form(
        write=one(
            lambda bench: {
                "Zeit [Sekunden]": bench.time, "u_V": bench.u, "dP [kg/cm2]": bench.dp / 0.0980665,
                "Q [Liter/min]": bench.q,
            }
        ),
        options=("--columns", "time=Zeit [Sekunden]"),
    ),
}  # fmt: skip

FORMS = CLOCKS | STEPS | FLOWS | CELLS


@pytest.mark.parametrize("name", FORMS)
def test_form(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    check(FORMS[name], capsys)
