"""11. A corpus of recordings as benches make them: none refused without need, none misread, no side dropped.

Each case is one or more recordings from `corpus_plant`, as text, and the truth beside them: the commands at which each
side opens and closes at each pressure drop. A case is misread where a side, a pressure drop or a branch is missing, or
where a knee lies off the truth by more than 15 mV and 3 standard errors. With both folders above on PYTHONPATH
``corpus.py FOLDER`` writes all files, and truth.json beside them.
"""

import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import bench_loggers as loggers
import numpy as np
from bench_plant import duration, hold, ramp
from corpus_faults import print_faults
from corpus_plant import Bench, drifting, levels, pump_off, pump_on, steady, with_dip

TOLERANCE_V, TOLERANCE_SE, LARGEST_SE_V = 0.015, 3.0, 0.03
#: A test is at a pressure drop of the truth within this share of it.
SAME_DP = 0.015
BOTH = ("positive", "negative")
UP, DOWN = "rising", "falling"


@dataclass(frozen=True, kw_only=True)
class Case:
    """One valve's recordings; `branches` are those that must be found, others may be."""

    name: str
    kind: str
    benches: tuple[Bench, ...]
    pressures: tuple[float, ...] = (1.0,)
    sides: tuple[str, ...] = ("positive",)
    branches: tuple[str, ...] = (UP, DOWN)
    logger: Callable[[loggers.Rows], str] = loggers.plain
    edit: Callable[[np.ndarray], np.ndarray] | None = None
    options: dict[str, float] = field(default_factory=dict)

    @property
    def truth(self) -> dict[str, list[dict[str, float]]]:
        """Per side and pressure drop: where it opens and closes, V."""
        valve = self.benches[0].valve
        return {
            side: [
                {"dp_MPa": dp, **dict(zip((UP, DOWN), np.round(valve.knees(dp, side), 6).tolist(), strict=True))}
                for dp in self.pressures
            ]
            for side in self.sides
        }

    def files(self, seed: int) -> dict[str, str]:
        """Return the recordings as text, by file name."""
        found = {}
        for number, bench in enumerate(self.benches):
            rows = bench.readings(1000 * seed + number)
            columns = zip(("t", "u", "dP", "Q"), self.edit(rows) if self.edit else rows, strict=True)
            found[f"{self.name}_{number + 1}.csv"] = self.logger(dict(columns))
        return found


def write(case: Case, seed: int, folder: Path) -> list[Path]:
    """Write a case's recordings and return where."""
    paths = []
    for name, text in case.files(seed).items():
        (folder / name).write_text(text, encoding="utf-8")
        paths.append(folder / name)
    return paths


def fault_of(case: Case, seed: int, folder: Path) -> str:
    """Return what the product makes wrong of a case, "" for nothing; it begins with "refused" or "misread"."""
    from dzdesign.core.errors import InputError
    from dzdesign.identify.identification import identify
    from dzdesign.identify.options import IdentifyOptions
    from dzdesign.identify.reading.ramp_files import read_ramp_file

    try:
        valve = identify([read_ramp_file(path) for path in write(case, seed, folder)], IdentifyOptions(**case.options))
    except InputError as error:
        return f"refused: {error}"
    faults = list(_misread(case, valve.sides))
    return f"misread: {'; '.join(faults)}" if faults else ""


def _misread(case: Case, sides) -> Iterator[str]:
    for name, truth in case.truth.items():
        if name not in sides:
            yield f"the {name} side is dropped"
            continue
        for known in truth:
            if not any(abs(test.dp_MPa - known["dp_MPa"]) <= SAME_DP * known["dp_MPa"] for test in sides[name].tests):
                yield f"no test at {known['dp_MPa']:g} MPa on the {name} side"
        for test in sides[name].tests:
            known = min(truth, key=lambda known: abs(known["dp_MPa"] - test.dp_MPa))
            if abs(test.dp_MPa - known["dp_MPa"]) > 2 * SAME_DP * known["dp_MPa"]:
                yield f"a test at {test.dp_MPa:.3f} MPa on the {name} side"
                continue
            for branch in (UP, DOWN):
                knee, se = getattr(test, f"u_knee_{branch}_V"), getattr(test, f"u_knee_{branch}_se_V")
                if knee is None:
                    if branch in case.branches:
                        yield f"no {branch} branch at {test.dp_MPa:.3f} MPa, {name}"
                    continue
                off = knee - known[branch]
                if se > LARGEST_SE_V or abs(off) > max(TOLERANCE_V, TOLERANCE_SE * se):
                    at = f"{test.dp_MPa:.3f} MPa, {name}"
                    yield f"{branch} knee at {at}: off by {1e3 * off:+.0f} mV (se {1e3 * se:.1f})"


def cases() -> list[Case]:
    """Return the corpus."""
    return [case for kind in KINDS for case in kind()]


ONCE, AT_1_MPa = ramp(), steady()


def _one(kind: str, name: str, command=ONCE, supply=AT_1_MPa, **changes) -> Case:
    """Return a case of one recording; what is a field of `Bench` goes there."""
    of_bench = {key: changes.pop(key) for key in list(changes) if key in Bench.__dataclass_fields__}
    return Case(name=name, kind=kind, benches=(Bench(command=command, supply=supply, **of_bench),), **changes)


def command_noise() -> Iterator[Case]:
    for noise in (0.001, 0.02):
        yield _one("command noise", f"noise_{1e3 * noise:.0f}mV", command_noise_V=noise)
    yield _one("command noise", "noise_12_bit", bits=12, command_noise_V=0.003, logger=loggers.semicolons)
    steps = Bench(command=ramp(), supply=steady(2.0), command_noise_V=0.01)
    benches = (Bench(command=ramp(), supply=steady(1.0), command_noise_V=0.01), steps)
    yield Case(name="noise_two_files", kind="command noise", benches=benches, pressures=(1.0, 2.0))


def pump_in_the_first_hold() -> Iterator[Case]:
    for at in (0.1, 0.5, 1.0, 1.5, 2.0, 2.6):
        logger = loggers.LOGGERS[round(10 * at) % 4]
        yield _one("pump started in the first hold", f"pump_{at:g}s", supply=pump_on(at), logger=logger)
    late = ramp(before=30.0)
    yield _one("pump started in the first hold", "pump_long_hold", late, pump_on(20.0, settles_s=1.5))
    yield _one("pump started in the first hold", "pump_noise_free", supply=pump_on(1.5), command_noise_V=0.0)


def odd_first_sample() -> Iterator[Case]:
    for name, value in (("zero", 0.0), ("negative", -0.3), ("high", 9.9)):
        yield _one("odd first sample", f"first_dp_{name}", edit=_first_dp(value))
    yield _one("odd first sample", "first_dp_zero_bipolar", BIPOLAR, sides=BOTH, edit=_first_dp(0.0))


def _first_dp(value: float) -> Callable[[np.ndarray], np.ndarray]:
    def edit(rows: np.ndarray) -> np.ndarray:
        rows = rows.copy()
        rows[2, 0] = value
        return rows

    return edit


def drifting_supply() -> Iterator[Case]:
    once, thrice = ramp(), 3 * ramp(20.0)
    for share in (0.025, -0.025):
        middle = (1 + share / 2,)
        name = "up" if share > 0 else "down"
        yield _one("drifting supply", f"drift_{name}", once, drifting(share, duration(once)), pressures=middle)
        supply = drifting(share, duration(thrice))
        yield _one("drifting supply", f"drift_{name}_three", thrice, supply, pressures=middle, logger=loggers.stamped)


def repeats() -> Iterator[Case]:
    kind, third = "repeats in one file", duration(ramp(20.0))
    thrice = 3 * ramp(20.0)
    for name, dp in (("rising", (1.0, 1.03, 1.06)), ("mixed", (1.06, 1.0, 1.03)), ("series", (1.0, 2.0, 4.0))):
        supply = levels((0, dp[0]), (third - 1.0, dp[1]), (2 * third - 1.0, dp[2]))
        yield _one(kind, f"repeats_{name}", thrice, supply, pressures=tuple(sorted(dp)))
    yield _one(kind, "repeats_same", thrice, logger=loggers.two_ports)


def dips() -> Iterator[Case]:
    end = duration(ramp(after=6.0))
    for name, at, to in (("first_hold", 1.5, 0.3), ("last_hold", end - 3.0, 0.05), ("top", 44.0, 0.5)):
        command = ramp(after=6.0, at_top=3.0) if name == "top" else ramp(after=6.0)
        yield _one("dip in a hold", f"dip_{name}", command, with_dip(steady(), at, to))
    between = duration(ramp(20.0))
    yield _one("dip in a hold", "dip_between", 2 * ramp(20.0), with_dip(steady(), between - 0.5, 0.2))


BIPOLAR = (hold(2.0, -10.0), (60.0, -10.0, 10.0), hold(1.0, 10.0), (60.0, 10.0, -10.0), hold(2.0, -10.0))
FROM_ZERO = (hold(3.0), (30.0, 0.0, 10.0), (60.0, 10.0, -10.0), (30.0, -10.0, 0.0), hold(3.0))
FROM_THE_TOP = (hold(2.0, 10.0), (60.0, 10.0, -10.0), hold(1.0, -10.0), (60.0, -10.0, 10.0), hold(2.0, 10.0))


def both_sides() -> Iterator[Case]:
    kind = "both sides"
    for name, noise in (("noisy", 0.004), ("noise_free", 0.0)):
        yield _one(kind, f"bipolar_{name}", BIPOLAR, sides=BOTH, command_noise_V=noise)
        yield _one(kind, f"from_zero_{name}", FROM_ZERO, sides=BOTH, command_noise_V=noise, logger=loggers.semicolons)
    yield _one(kind, "from_the_top", FROM_THE_TOP, sides=BOTH, logger=loggers.stamped)
    yield _one(kind, "bipolar_signed_dp", BIPOLAR, sides=BOTH, signed_dp=True)
    yield _one(kind, "bipolar_unsigned_flow", BIPOLAR, sides=BOTH, signed_flow=False, sag=0.15)
    benches = tuple(Bench(command=BIPOLAR, supply=steady(dp), sag=0.1) for dp in (1.0, 3.0))
    yield Case(name="bipolar_two_files", kind=kind, benches=benches, pressures=(1.0, 3.0), sides=BOTH)
    yield _one(kind, "bipolar_pump", (hold(5.0, -10.0), *BIPOLAR), pump_on(3.0), sides=BOTH)


def from_the_top() -> Iterator[Case]:
    down_up = (hold(3.0, 10.0), (40.0, 10.0, 0.0), hold(2.0), (40.0, 0.0, 10.0), hold(3.0, 10.0))
    yield _one("start at full command", "top_sagging", down_up, sag=0.15)
    yield _one("start at full command", "top_sagging_no_hold", down_up[1:4], sag=0.15, command_noise_V=0.01)
    twice = (*down_up, *down_up[1:])
    yield _one("start at full command", "top_twice", twice, levels((0, 1.0), (44.0, 1.0)), sag=0.25)
    drop = duration(down_up)
    supply = drifting(-0.04, drop)
    yield _one("start at full command", "top_drifting", down_up, supply, sag=0.1, pressures=(0.98,))


def rests() -> Iterator[Case]:
    kind, once = "rests and moving pressure", ramp(20.0)
    end = duration(once)
    pause = (*once, hold(30.0), *once)
    supply = levels((0, 1.0), (end + 2.0, 0.0), (end + 22.0, 1.0))
    yield _one(kind, "rest_pump_off_between", pause, supply)
    slow = levels((0, 1.0), (end, 2.0), (2 * end + 30.0, 4.0), settles_s=4.0)
    yield _one(kind, "rest_levels_between", (*once, *(hold(30.0), *once) * 2), slow, pressures=(1.0, 2.0, 4.0))
    yield _one(kind, "rest_pump_off_after", (*ramp(), hold(20.0)), pump_off(duration(ramp()) - 1.0))
    yield _one(kind, "rest_set_by_hand", (hold(25.0), *ramp()), _set_by_hand, logger=loggers.semicolons)
    jog = (hold(2.0), (2.0, 0.0, 2.5), (2.0, 2.5, 0.0))
    yield _one(kind, "jog_before", (*jog, *ramp()))
    yield _one(kind, "jog_between", (*once, *jog, *once), logger=loggers.two_ports)
    exercise = (hold(2.0), (5.0, 0.0, 10.0), (5.0, 10.0, 0.0))
    yield _one(kind, "exercise_before_the_pump", (*exercise, hold(6.0), *ramp()), pump_on(15.0))
    blips = levels((0, 1.0), (end, 0.3), (end + 3.0, 1.6), (end + 6.0, 1.0))
    yield _one(kind, "rest_pressure_wanders", (*once, hold(10.0), *once), blips)


def _set_by_hand(time: np.ndarray) -> np.ndarray:
    """Return a relief valve that is turned up from 0.5 to 1 MPa, with overshoot, within 20 s."""
    return np.interp(time, [0, 4, 9, 14, 17, 20], [0.5, 0.5, 0.8, 1.15, 0.95, 1.0])


def within_the_sweep() -> Iterator[Case]:
    kind, falling, rising = "pump within a sweep", (DOWN,), (UP,)
    for at_V, branches in ((1.5, (UP, DOWN)), (4.0, (UP, DOWN)), (7.0, falling)):
        supply = pump_on(3.0 + 4.0 * at_V)
        yield _one(kind, f"pump_on_at_{at_V:g}V", supply=supply, branches=branches)
    for at_V, branches in ((2.0, (UP, DOWN)), (8.0, rising)):
        supply = pump_off(84.0 - 4.0 * at_V)
        yield _one(kind, f"pump_off_at_{at_V:g}V", supply=supply, branches=branches)
    twice = 2 * ramp(20.0)
    yield _one(kind, "pump_on_in_ramp_1_of_2", twice, pump_on(3.0 + 2.0 * 6.0), logger=loggers.stamped)
    yield _one(kind, "logger_late_and_early", ramp()[1:4], edit=lambda rows: rows[:, 400:-300])


def at_the_top() -> Iterator[Case]:
    kind = "hold at the top"
    yield _one(kind, "top_hold_twice", 2 * ramp(20.0, at_top=20.0), logger=loggers.semicolons)
    yield _one(kind, "top_hold_long", ramp(at_top=60.0), sag=0.1)
    yield _one(kind, "top_hold_pump", 2 * ramp(20.0, at_top=15.0), pump_on(1.5), command_noise_V=0.01)


def saw_teeth() -> Iterator[Case]:
    kind, up, down = "saw-teeth", (UP,), (DOWN,)
    tooth, tooth_down = (hold(2.0), (20.0, 0.0, 10.0)), (hold(2.0), (20.0, 10.0, 0.0))
    for name, noise in (("noisy", 0.004), ("noise_free", 0.0)):
        yield _one(kind, f"teeth_{name}", (*4 * tooth, hold(2.0)), branches=up, command_noise_V=noise)
    yield _one(kind, "teeth_down", (*4 * tooth_down, hold(2.0)), branches=down)
    supply = levels((0, 1.0), (22.1, 2.0), (44.1, 4.0), settles_s=0.2)
    yield _one(kind, "teeth_levels", (*3 * tooth, hold(2.0)), supply, branches=up, pressures=(1.0, 2.0, 4.0))


def rates() -> Iterator[Case]:
    for rate in (10.0, 200.0, 1000.0):
        command = ramp(20.0 if rate > 100 else 60.0)
        yield _one("sampling rates", f"rate_{rate:g}Hz", command, pump_on(1.2), rate_Hz=rate)
    options = {"meter_lag": 0.1}
    yield _one("sampling rates", "rate_500Hz_lag", ramp(20.0), pump_on(1.2), rate_Hz=500.0, lag_s=0.1, options=options)


KINDS: tuple[Callable[[], Iterator[Case]], ...] = (
    command_noise, pump_in_the_first_hold, odd_first_sample, drifting_supply, repeats, dips, both_sides, from_the_top,
    rests, within_the_sweep, at_the_top, saw_teeth, rates,
)  # fmt: skip


def print_corpus(*, quick: bool, seed: int) -> list:
    """Print and return the rows of part 11."""
    title = f"11. Recordings as benches make them: refused or misread (seed {seed})"
    return print_faults(title, cases()[:: 4 if quick else 1], lambda case, folder: fault_of(case, seed, folder))


def main(folder: Path, seed: int = 909) -> None:
    """Write all recordings and their truth into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    truth = {}
    for case in cases():
        truth |= {path.name: case.truth for path in write(case, seed, folder)}
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
