"""5. Ramp tests that the project did not make: simulated benches with a known truth, and published measurements."""

import json
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from bench_model import L_MIN
from scoreboard import Row, print_rows

from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.reading.ramp_test import RampTest

SHARED = Path(os.environ.get("DZDESIGN_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data"))
LIMIT_mV = 15.0


def print_measured(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 5; skipped with a reason where the data are not at hand."""
    if not SHARED.is_dir():
        print(f"5. skipped: the shared measurements are not at {SHARED} (set DZDESIGN_SHARED_DATA)")
        return []
    truth = json.loads((SHARED / "truth.json").read_text())
    rows = []
    for valve in ("a", "e"):
        tests = [read_ramp_file(path) for path in sorted((SHARED / f"valve_{valve}").glob("*.csv.gz"))]
        known = {test.source: truth[test.source.removesuffix(".csv.gz")] for test in tests}
        lags = [entry["meter_lag_s"] for entry in known.values()]
        for lag in (0.0, sum(lags) / len(lags)):
            rows += _valve_rows(f"valve {valve.upper()}, lag taken as {lag:g} s", tests, known, lag)
    print_rows("5. Valves A and E: error of the knee (15-50 % truth), mV", rows)
    real = _real_rows()
    print_rows("5. Published measurements: knee outside its bracket by, V", real)
    return rows + real


def _valve_rows(label: str, tests: list, known: dict, lag: float) -> list[Row]:
    side = identify(tests, IdentifyOptions(meter_lag=lag)).positive
    rows = []
    for branch in ("rising", "falling"):
        errors = [
            1e3 * (getattr(test, f"u_knee_{branch}_V") - known[test.source]["pos"][f"u_knee_{branch}_15_50pct"])
            for test in side.tests
        ]
        pairs = zip(side.tests, errors, strict=True)
        note = "at " + ", ".join(f"{test.dp_MPa:.1f}: {error:+.1f}" for test, error in pairs)
        rows.append(Row(what=f"{label}, {branch}", value=max(map(abs, errors)), limit=LIMIT_mV, unit="mV", note=note))
    change = f"{1e3 * side.trend_change_V:+.1f} ± {1e3 * side.trend_change_se_V:.1f} mV over the tests"
    truths = [entry["pos"]["u_knee_falling_15_50pct"] for entry in known.values()]
    rows.append(
        Row(
            what=f"{label}, trend's change",
            value=1e3 * side.trend_change_V,
            unit="mV",
            note=f"verdict {side.trend} ({change}); truth {1e3 * (truths[-1] - truths[0]):+.1f} mV",
        )
    )
    worst = max(1e3 * (test.u_guard_lower_V - known[test.source]["pos"]["u_close_falling"]) for test in side.tests)
    rows.append(Row(what=f"{label}, bound less closing edge", value=worst, unit="mV", note="largest over the tests"))
    return rows


def _real_rows() -> list[Row]:
    folder = SHARED / "real"
    if not folder.is_dir():
        return [Row(what="skipped", value=float("nan"), note=f"no folder {folder}")]
    brackets = json.loads((folder / "brackets.json").read_text())
    rows = []
    for name, test_, bracket in _real_tests(folder, brackets):
        try:
            side = identify([test_], IdentifyOptions(u_max=max(10.0, float(test_.u.max())))).positive
        except InputError as error:
            rows.append(Row(what=name, value=float("nan"), note=f"refused: {error}"))
            continue
        (test,) = side.tests
        for what, found, ends in _comparisons(test, bracket):
            if found is None:
                continue
            outside = max(ends[0] - found, found - ends[1], 0.0)
            # An onset may lie one level of the command outside its bracket; a knee's bracket is wide enough as it is.
            level = float(np.median(np.diff(np.unique(np.round(test_.u, 6))))) if what.startswith("onset") else 0.0
            text = f"found {found:.3f} V, bracket {ends[0]:g} to {ends[1]:g} V"
            rows.append(Row(what=f"{name}, {what}", value=outside, limit=level, unit="V", note=text))
    return rows


def _real_tests(folder: Path, brackets: dict) -> Iterator[tuple[str, RampTest, dict]]:
    """Yield name, ramp test and bracket; of a bipolar velocity each side by itself, cm/s standing for L/min."""
    for name, bracket in brackets.items():
        if "pos_bracket_u" not in bracket:
            yield name, read_ramp_file(folder / name), bracket
            continue
        time, u, velocity = np.loadtxt(folder / name, delimiter=",", skiprows=1).T
        for sign, key in ((1, "pos_bracket_u"), (-1, "neg_bracket_u")):
            mine = np.flatnonzero(sign * u > 0)[::sign]
            test = RampTest(source=name, sha256="0" * 64, time=np.sort(time[mine]), u=sign * u[mine],
                            q=sign * velocity[mine] * L_MIN, dp=None)  # fmt: skip
            yield f"{name} ({key[:3]})", test, {"onset_bracket": sorted(sign * end for end in bracket[key])}


def _comparisons(test, bracket: dict):
    """Yield what is compared, what was found and the interval; a knee's interval is 0.1 V either side."""
    for branch in ("rising", "falling"):
        knee, onset = getattr(test, f"u_knee_{branch}_V"), getattr(test, f"u_onset_{branch}_V")
        for key, value in bracket.items():
            mine = branch in key or (branch == "rising" and "falling" not in key and "rising" not in key)
            if not mine:
                continue
            if key.startswith("linear_knee"):
                yield f"knee {branch}", knee, (value - 0.1, value + 0.1)
            elif key.startswith("onset_bracket"):
                yield f"onset {branch}", onset, tuple(value)
