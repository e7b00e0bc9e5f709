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
from tests.identify.public_forms import Bench, closing, csv, opening, plain, series, write

#: A knee is right within so many volts, or three of its standard errors.
NEAR = 0.015
LAG = ("--meter-lag", "0 s +- 0.01 s")


@dataclass(frozen=True, kw_only=True)
class Form:
    """Recordings, the options they are read with, and what is right.

    `write` writes them into the current folder and returns their names. `refused` holds what a message must name, such
    as a column or the option that helps; empty: both branches are measured on the sides, at thresholds that lie by
    `shift` V higher, with the warnings of `codes` and none of `never`.
    """

    write: Callable[[], Sequence[str]]
    options: Sequence[str] = ()
    refused: Sequence[str] = ()
    sides: Sequence[str] = ("positive",)
    shift: float = 0.0
    codes: Sequence[str] = ()
    never: Sequence[str] = ()
    near: float = NEAR


def one(form, suffix="csv", **changes) -> Callable[[], Sequence[str]]:
    """Return what writes a series in a form."""
    return lambda: write(Path(), series(**changes), form, suffix)


def check(form: Form, capsys) -> None:
    names = form.write()
    status = main(["-q", "identify", *names, *form.options, *LAG, "-o", "valve.json"])
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
                near = max(form.near, 3 * test[f"u_knee_{branch}_se_V"])
                assert test[f"u_knee_{branch}_V"] == pytest.approx(threshold, abs=near), (branch, nominal)
            assert test["u_guard_lower_V"] <= true["falling"]


# Each channel has a clock of its own.


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


TIMES_NAMED = ("time_u (s)", "u (V)", "time_dP (s)", "dP (MPa)", "time_Q (s)", "Q (L/min)")


def another_time(bench: Bench, late_s: float, label: str, rate: float = 1.0, zero: float = 0.0):
    """Two times in a row, of which the second is the flow's, or another count of the first."""
    time, q = forms.shifted(bench, late_s)
    first = {name: values[: time.size] for name, values in plain(bench).items()}
    return {**first, label: time * rate + zero, "Q_Lmin": q}


CLOCKS = {
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
    "csv-column-filled-with-zeros": Form(
        write=one(lambda bench: filled_up(bench, 0.99, 0.0)), refused=("r1_0.csv", "Q_Lmin")
    ),
    "csv-column-filled-with-its-last": Form(
        write=one(lambda bench: filled_up(bench, 0.99, None)), refused=("r1_0.csv", "Q_Lmin")
    ),
    "csv-column-filled-amid-flow": Form(
        write=one(lambda bench: filled_up(bench, 0.8, None)), refused=("r1_0.csv", "Q_Lmin")
    ),
}  # fmt: skip


# Flow: one side of two, a lost sign, the wrong quantity.


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


FLOWS = {
    "one-solenoid-of-two": Form(
        write=one(two_columns, command=forms.both_sides, repeats=3), options=("--columns", "u=uA_V")
    ),
    # Such a bound is too high by what the warning says: its zero error was below zero, and lost its sign.
    "flow-without-its-sign": Form(
        write=one(with_column("Q_Lmin", lambda bench: np.abs(bench.q - 0.4))), codes=("zero-hidden",), shift=0.27,
        near=0.16,
    ),
    "zero-with-its-sign": Form(
        write=one(with_column("Q_Lmin", lambda bench: np.abs(bench.q + 0.4))), never=("zero-hidden",)
    ),
    "pulse-us": Form(
        write=one(with_column("pulse_us", lambda bench: 1500 + 40 * bench.u, "u_V"), command=forms.both_sides),
        options=("--columns", "u=pulse_us:1100..1900 = -10..10 V"), sides=("positive", "negative"),
    ),
    "position": Form(
        write=one(with_column("pos_mm", lambda bench: totalled(bench, 100.0))), options=("--columns", "Q=pos_mm"),
        refused=("pos_mm", "position"),
    ),
    "volume": Form(
        write=one(with_column("Total_L", totalled)), options=("--columns", "Q=Total_L"), refused=("Total_L", "volume")
    ),
    "fraction-called-percent": Form(
        write=one(with_column("u_%", lambda bench: bench.u / 10, "u_V")), refused=("r1_0.csv",)
    ),
}  # fmt: skip

# Files of other programs.


def long_format(bench: Bench) -> bytes:
    rows = [(f"{time:.3f}", f"plc.{name}", f"{values[row]:.4f}") for row, time in enumerate(bench.time)
            for name, values in bench.signals().items()]  # fmt: skip
    return csv(dict(zip(("timestamp", "path", "value"), zip(*rows, strict=True), strict=True)), separator=";")


def simulink(bench: Bench) -> bytes:
    """Simulink's "structure with time"."""
    values = np.column_stack([bench.u, bench.dp, bench.q])
    return forms.mat({"out": {"time": bench.time[:, None], "signals": {"values": values, "dimensions": 3}}})


CELLS = {
    "long-format": Form(write=one(long_format), refused=("r1_0.csv",)),
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

FORMS = CLOCKS | FLOWS | CELLS


@pytest.mark.parametrize("name", FORMS)
def test_form(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    check(FORMS[name], capsys)
