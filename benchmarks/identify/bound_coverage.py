"""2 and 3. Failures of the simultaneous lower bound, over-compensation anywhere, and the residual dead zone."""

import numpy as np
from bench_model import L_MIN, SHAPES, Bench
from replicates import options_for, run_replicates
from scoreboard import Row, print_rows, say, share_interval

NOISES = {"white": 0.0, "AR(1) 0.9": 0.9, "AR(1) 0.99": 0.99}
RATES_Hz = (100.0, 25.0)
CASES = {f"{name}, {rate:g} Hz": {"ar": ar, "rate_Hz": rate} for rate in RATES_Hz for name, ar in NOISES.items()}
#: Readings drop out in runs, of a logger that is busy or a wire that is loose.
CASES["white, 100 Hz, 5 % drop out, ten in a row"] = {"drop_outs": 0.05}
CASES["white, 100 Hz, 1 % drop out, 50 in a row, twice the noise"] = {"drop_outs": 0.01, "run": 50, "noise_L_min": 0.3}
LIMIT, RESIDUAL_LIMIT = 1.0, 0.8
#: The worst meter zero inside the declared budget: it hides flow, so that the threshold seems higher, L/min.
BUDGET = 0.15


def print_coverage(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 2a; each as it comes, since all of them take an hour and a half."""
    count = 40 if quick else 3000
    rows = []
    for name, changes in CASES.items():
        say(f"coverage: {name}, {count} replicates")
        rows.append(_failures(f"{name}: bound above the truth", Bench(**changes), count, seed))
        say(f"coverage: {rows[-1].what}: {rows[-1].value:.2g} %; {rows[-1].note}")
    print_rows(f"2a. Simultaneous 99 % lower bound fails (seed {seed}; correlation is per sample)", rows)
    return rows


def print_over_compensation(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 2b."""
    count = 20 if quick else 500
    rows = []
    for name, shape in SHAPES.items():
        bench = Bench(threshold_V=shape, zero_L_min=-BUDGET)
        say(f"over-compensation: {name}, {count} replicates")
        outcomes = run_replicates(bench, count, seed, options_for(bench, meter_zero=BUDGET * L_MIN))
        done = outcomes.offset_excess.size
        failures = int((outcomes.offset_excess > 0).sum())
        rows.append(
            Row(
                what=f"{name}: open at zero command",
                value=100 * failures / done,
                limit=LIMIT,
                unit="%",
                note=f"{share_interval(failures, done)}; worst {1e3 * outcomes.offset_excess.max():+.1f} mV; residual "
                f"{100 * outcomes.residual_volts.mean():.2f} % of u_max; {_trends(outcomes.trends)}",
            )
        )
    print_rows(
        f"2b. Offset above the closing threshold anywhere, meter zero {-BUDGET:g} L/min, declared (seed {seed})", rows
    )
    return rows


def print_residual(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 3."""
    bench, count = Bench(), 30 if quick else 200
    say(f"residual dead zone: {count} replicates")
    rows = []
    outcomes = run_replicates(bench, count, seed, options_for(bench))
    for label, values, limit in (
        ("closing threshold less offset, over u_max", outcomes.residual_volts, RESIDUAL_LIMIT),
        ("the same as a share of the command's range", outcomes.residual, None),
    ):
        note = f"mean of {count}; largest {100 * values.max():.2f} %; worst place of the interval 0.5-5 MPa"
        rows.append(Row(what=label, value=100 * values.mean(), limit=limit, unit="%", note=note))
    step = float(np.max(-np.diff(bench.closing_V(np.array(bench.pressures_MPa))))) / 10
    rows.append(Row(what="of which one step of the true staircase, over u_max", value=100 * step, unit="%"))
    print_rows(f"3. Residual dead zone beyond the hysteresis, white noise (seed {seed})", rows)
    return rows


def _failures(label: str, bench: Bench, count: int, seed: int) -> Row:
    outcomes = run_replicates(bench, count, seed, options_for(bench))
    done = outcomes.bound_excess.size
    failures = int((outcomes.bound_excess > 0).sum())
    opened = int((outcomes.offset_excess > 0).sum())
    claimed = np.sqrt(np.mean(outcomes.closing_se**2)) / np.sqrt(np.mean(outcomes.closing**2))
    return Row(
        what=label,
        value=100 * failures / done,
        limit=LIMIT,
        unit="%",
        note=f"{share_interval(failures, done)}; {opened} over-compensate; claimed s.e. over rmse "
        f" {claimed:.2f}; refused {len(outcomes.refusals)}; {_trends(outcomes.trends)}",
    )


def _trends(trends: dict[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in sorted(trends.items()))
