"""Recordings of four ports, of commands in any unit, without a clock, and staircases, as loggers write them.

Each case is a valve's recordings as text, the command line that reads them, and the truth beside them: where each side
opens and closes at the pressure drop of its metering edge. No code shared with the product, which is asked through its
command line. With both folders above on PYTHONPATH ``corpus_units.py FOLDER`` writes all files.
"""

import contextlib
import io
import json
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from bench_loggers import PER_L_MIN, PRESSURE_OF, command_text, german, plain, table, with_units_below
from bench_plant import ramp, staircase
from corpus_faults import print_faults
from four_port_plant import BOTH_WAYS, CLOSES, OPENS, bench

TOLERANCE_V, TOLERANCE_SE, LARGEST_SE_V, SAME_DP = 0.015, 3.0, 0.03, 0.02


@dataclass(frozen=True, kw_only=True)
class Case:
    """One valve's recordings: file name -> text, the options that they need, the pressure drops that are true."""

    name: str
    kind: str
    files: dict[str, str]
    options: Sequence[str] = ()
    pressures: tuple[float, ...] = (1.0,)
    sides: tuple[str, ...] = ("positive",)
    #: What the line of the pressure drop must name.
    dp_from: str = ""
    #: Words of the refusal, where asking back is right; and what must not stand among the warnings.
    asks: str = ""
    not_warned: tuple[str, ...] = ()
    #: Smallest and largest meter floor that is right, L/min.
    floor: tuple[float, float] | None = None
    #: Standard error beyond which a knee is no result, V.
    largest_se: float = LARGEST_SE_V
    #: Units of command, pressure and flow that must be printed, and what the command reads at a voltage.
    shows: tuple[str, str, str] = ("V", "MPa", "L/min")
    reads: Callable[[float], float] = float


# The cases.


def four_ports() -> Iterator[Case]:
    kind, both = "four ports", ("positive", "negative")
    inlet = "pP_MPa - pA_MPa"
    for number, (logger, names, dp_from) in enumerate(
        [
            (plain, ("pP", "pA"), inlet),
            (plain, ("pP", "pA", "pB"), inlet),
            (german, ("pP", "pA", "pB"), "pP [bar] - pA [bar]"),
            (german, ("pB", "pT"), "pB [bar] - pT [bar]"),
            (plain, ("pA", "pB", "pT"), "pB_MPa - pT_MPa"),
            (with_units_below, ("pP", "pA", "pT"), "pP - pA"),
            (with_units_below, ("pB", "pP", "pT"), "pB - pT"),
            (plain, ("dP", "pP", "pA", "pB", "pT"), "dP_MPa"),
        ]
    ):
        texts = {
            f"ports_{number}_{dp:g}.csv": logger(bench(ramp(), edge=dp, seed=number, load_MPa=2 * dp), *names)
            for dp in (1.0, 2.5)
        }
        shows = ("V", PRESSURE_OF[logger.__name__], "L/min")
        yield Case(name=f"ports_{number}", kind=kind, files=texts, dp_from=dp_from, pressures=(1.0, 2.5), shows=shows)
    for number, (logger, names, dp_from) in enumerate(
        [
            (plain, ("pP", "pA", "pB"), "pP_MPa - pB_MPa"),
            (german, ("pA", "pB", "pT"), "pA [bar] - pT [bar]"),
            (plain, ("pP", "pA", "pT"), "pA_MPa - pT_MPa"),
        ]
    ):
        texts = {f"both_{number}.csv": logger(bench(BOTH_WAYS, seed=20 + number, positive=number == 1), *names)}
        shows = ("V", PRESSURE_OF[logger.__name__], "L/min")
        yield Case(name=f"both_{number}", kind=kind, files=texts, sides=both, dp_from=dp_from, shows=shows)
    texts = {"negative.csv": plain(bench(ramp(top=-10.0), seed=30), "pP", "pB")}
    yield Case(name="negative", kind=kind, files=texts, sides=("negative",), dp_from="pP_MPa - pB_MPa")
    every = {
        f"all_{dp:g}.csv": plain(bench(ramp(), edge=dp, seed=31, load_MPa=2 * dp), "pP", "pA", "pB", "pT")
        for dp in (1.0, 5.0)
    }
    yield Case(name="all_asked", kind=kind, files=every, asks='--columns "pP=pP_MPa, pA=pA_MPa, pB=pB_MPa"')
    for number, named in enumerate(("pP=pP_MPa, pA=pA_MPa, pB=pB_MPa", "pA=pA_MPa, pB=pB_MPa, pT=pT_MPa")):
        dp_from = (inlet, "pB_MPa - pT_MPa")[number]
        yield Case(
            name=f"all_named_{number}", kind=kind, files=every, options=("--columns", named), pressures=(1.0, 5.0),
            dp_from=dp_from,
        )  # fmt: skip
    texts = {"one_side.csv": plain(bench(BOTH_WAYS, seed=32), "pP", "pA")}
    yield Case(name="one_side", kind=kind, files=texts, dp_from=inlet)
    texts = {"wrong_port.csv": plain(bench(ramp(), seed=33), "pP", "pB")}
    yield Case(name="wrong_port", kind=kind, files=texts, asks="pP and pA")
    rows = bench(ramp(), seed=34)
    rows["thermometer"] = np.full(rows["t"].size, 41.3)
    text = table({
        "time_s": (rows["t"], 3), "u_V": (rows["u"], 4), "PT_degC": (rows["thermometer"], 1),
        "dP_MPa": (rows["dP"], 5), "Q_Lmin": (rows["Q"], 3),
    })  # fmt: skip
    yield Case(name="thermometer", kind=kind, files={"thermometer.csv": text}, dp_from="dP_MPa")


def units() -> Iterator[Case]:
    kind, both = "units of the command", ("positive", "negative")
    for number, (label, unit, scale, declared, reads) in enumerate(
        [
            ("duty", "duty", lambda u: 0.09 * u, "0..0.9 = 0..100 %", None),
            ("PWM (counts)", "counts", lambda u: 400 * u, "0..4000 = 0..100 %", None),
            ("AO raw", "AO raw", lambda u: 2764.8 * u, "0..27648 = 0..10 V", None),
            ("I_cmd_mA", "mA", lambda u: 4 + 1.6 * u, "4..20 mA = 0..10 V", None),
            ("I_coil [A]", "A", lambda u: 0.08 * u, "0..0.8 A = 0..100 %", None),
            ("set (%)", "%", lambda u: 10 * u, "", None),
            ("set", "%", lambda u: 10 * u, "%", None),
            ("set %", "%", lambda u: 100 - 10 * u, "100..0 % = 0..10 V", None),
            # Behind its wiring a signal reads as at the wire, and volts that stand for others as what they stand for.
            ("AI3 (V)", "mA", lambda u: 0.15 * (4 + 1.6 * u), "4..20 mA on 150 ohm = 0..10 V", lambda u: 4 + 1.6 * u),
            ("AI3 (mV)", "mA", lambda u: 150 * (4 + 1.6 * u), "4..20 mA on 150 ohm = 0..100 %", lambda u: 4 + 1.6 * u),
            ("AI4 (V)", "V", lambda u: 0.4 * u, "0..4 V = 0..10 V", float),
            ("AI4 (mV)", "%", lambda u: 400 * u, "0..4000 mV = 0..100 %", lambda u: 10 * u),
        ]
    ):
        digits, flow = (6 if label in ("duty", "I_coil [A]") else 4), list(PER_L_MIN)[number % 4]
        rows = {f"unit_{number}_{dp:g}.csv": bench(ramp(), edge=dp, seed=40 + number) for dp in (1.0, 2.5)}
        files = {name: command_text(each, label, scale(each["u"]), digits, flow=flow) for name, each in rows.items()}
        yield Case(
            name=f"unit_{number}", kind=kind, files=files, options=_named(label, declared), pressures=(1.0, 2.5),
            shows=(unit, "bar", flow.replace("Lmin", "L/min")), reads=reads or scale,
        )  # fmt: skip
    for number, (label, unit, scale, declared, reads) in enumerate(
        [
            ("I_cmd_mA", "mA", lambda u: 12 + 0.8 * u, "4..20 mA = -10..10 V", None),
            (
                "AI3 (V)", "mA", lambda u: 0.15 * (12 + 0.8 * u), "4..20 mA on 150 ohm = -10..10 V",
                lambda u: 12 + 0.8 * u,
            ),
            ("duty", "duty", lambda u: 0.5 + 0.04 * u, "0,1..0,9 = -100..100 %", None),
            ("set (%)", "%", lambda u: 10 * u, "", None),
        ]
    ):  # fmt: skip
        each = bench(BOTH_WAYS, seed=60 + number, positive=False)
        files = {f"bipolar_{number}.csv": command_text(each, label, scale(each["u"]), 6)}
        yield Case(
            name=f"bipolar_{number}", kind=kind, files=files, options=_named(label, declared), sides=both,
            shows=(unit, "bar", "L/min"), reads=reads or scale,
        )  # fmt: skip
    each = bench(ramp(), seed=70)
    text = {"no_unit.csv": command_text(each, "duty", 0.09 * each["u"], 6)}
    yield Case(name="no_unit", kind=kind, files=text, options=("--columns", "u=duty"), asks="u=duty:0..1 = 0..100 %")
    # A file that is not in the units of the others: what all have is shown as it is, the rest in V, MPa and L/min.
    rows = [bench(ramp(), edge=dp, seed=71) for dp in (1.0, 2.5)]
    files = {"one.csv": plain(rows[0], "dP"), "other.csv": command_text(rows[1], "u_V", rows[1]["u"], flow="gpm")}
    yield Case(name="mixed", kind=kind, files=files, pressures=(1.0, 2.5))


def _named(label: str, declared: str) -> tuple[str, str]:
    return ("--columns", f"u={label}:{declared}" if declared else f"u={label}")


def without_a_clock() -> Iterator[Case]:
    kind = "no column of time"
    for number, rate in enumerate((50.0, 10.0, 1000.0)):
        each = bench(ramp(20.0), seed=80 + number, rate_Hz=rate)
        text = {f"no_time_{rate:g}.csv": command_text(each, "u_V", each["u"], clock=False)}
        yield Case(
            name=f"no_time_{rate:g}", kind=kind, files=text, options=("--sample-rate", f"{rate:g} Hz"),
            shows=("V", "bar", "L/min"),
        )  # fmt: skip
    each = bench(ramp(), seed=83)
    hot = {"T_degC": (np.full(each["t"].size, 44.0), 1), "u_V": (each["u"], 4), "dP_MPa": (each["dP"], 5)}
    text = {"thermometer_no_time.csv": table({**hot, "Q_Lmin": (each["Q"], 3)})}
    yield Case(name="thermometer_no_time", kind=kind, files=text, options=("--sample-rate", "50 Hz"))
    yield Case(name="no_time_asked", kind=kind, files=text, asks="--sample-rate")
    text = {"both_clocks.csv": plain(each, "dP")}
    yield Case(name="both_clocks", kind=kind, files=text, options=("--sample-rate", "50 Hz"), asks="leave one of them")


#: What must not be said of a staircase: its steps are no holes, its transients no outliers.
NOT_OF_STAIRS = ("gap", "outliers", "stick-slip", "noise", "bend")


def staircases() -> Iterator[Case]:
    kind = "staircases"
    for number, (step, dwell, rise_s, floor) in enumerate(
        [
            (0.05, 1.0, 0.1, 0.6), (0.05, 1.0, 0.3, 0.0), (0.1, 1.0, 0.3, 0.0), (0.1, 2.0, 0.1, 0.6),
            (0.1, 5.0, 0.3, 0.6), (0.2, 1.0, 0.3, 0.0), (0.2, 2.0, 0.3, 0.6), (0.2, 5.0, 0.1, 0.6),
            (0.25, 2.0, 0.3, 0.0),
            (0.25, 10.0, 0.3, 0.0), (0.5, 2.0, 0.3, 0.0), (0.5, 5.0, 0.1, 0.0), (0.5, 10.0, 0.3, 0.0),
        ]
    ):  # fmt: skip
        logger = (plain, german, with_units_below)[number % 3]
        rows = bench(staircase(step, dwell), seed=90 + number, rate_Hz=20.0, rise_s=rise_s, floor=floor)
        yield Case(
            name=f"stairs_{number}", kind=kind, files={f"stairs_{number}.csv": logger(rows, "dP")},
            not_warned=NOT_OF_STAIRS, floor=(floor, 1.2 * floor),
            shows=("V", PRESSURE_OF[logger.__name__], "L/min"),
        )  # fmt: skip
    command = staircase(0.2, 2.0)
    rows = {f"two_{dp:g}.csv": bench(command, edge=dp, seed=110, rise_s=0.1) for dp in (1.0, 2.5)}
    files = {name: plain(each, "dP") for name, each in rows.items()}
    yield Case(name="stairs_two", kind=kind, files=files, pressures=(1.0, 2.5), not_warned=NOT_OF_STAIRS)
    files = {"again.csv": german(bench((*command, *command), seed=111, rise_s=0.2, rate_Hz=20.0), "dP")}
    in_bar = ("V", "bar", "L/min")
    yield Case(name="stairs_again", kind=kind, files=files, not_warned=NOT_OF_STAIRS, shows=in_bar)
    both = (*command, *((seconds, -at, -to) for seconds, at, to in command))
    files = {"both.csv": plain(bench(both, seed=112, rise_s=0.1, rate_Hz=20.0, positive=False), "dP")}
    yield Case(name="stairs_both", kind=kind, files=files, sides=("positive", "negative"), not_warned=NOT_OF_STAIRS)
    each = bench(staircase(0.25, 3.0), seed=113, rise_s=0.3, rate_Hz=100.0)
    files = {"duty.csv": command_text(each, "duty", 0.09 * each["u"], 5)}
    yield Case(
        name="stairs_duty", kind=kind, files=files, options=("--columns", "u=duty:0..0.9 = 0..100 %"),
        shows=("duty", "bar", "L/min"), reads=lambda u: 0.09 * u,
    )  # fmt: skip
    # No staircase: a ramp whose command was recorded in coarse steps, and one with holds.
    each = bench(ramp(100.0), seed=114, command_noise=0.0)
    files = {"coarse.csv": command_text(each, "u_V", np.round(each["u"] / 0.05) * 0.05)}
    yield Case(name="coarse_ramp", kind=kind, files=files, shows=in_bar)
    held = [(4.0, level, level) if part else (4.0, level - 1.0, level) for level in range(1, 11) for part in (0, 1)]
    down = [(seconds, to, at) for seconds, at, to in reversed(held)]
    files = {"holds.csv": plain(bench([(3.0, 0, 0), *held, *down, (3.0, 0, 0)], seed=115, rise_s=0.05), "dP")}
    yield Case(name="ramp_with_holds", kind=kind, files=files)


KINDS: tuple[Callable[[], Iterator[Case]], ...] = (four_ports, units, without_a_clock, staircases)


def cases() -> list[Case]:
    """Return all."""
    return [case for kind in KINDS for case in kind()]


# What the product makes of them.


def fault_of(case: Case, folder: Path) -> str:
    """Return what the product makes wrong of a case, "" for nothing; it begins with "refused" or "misread"."""
    from dzdesign.command_line.cli import main

    paths = []
    for name, text in case.files.items():
        (folder / name).write_text(text, encoding="utf-8")
        paths.append(str(folder / name))
    output = folder / "valve.json"
    output.unlink(missing_ok=True)
    out, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        status = main(["-v", "identify", *paths, *case.options, "-o", str(output)])
    if case.asks:
        right = status == 2 and case.asks in errors.getvalue()
        return "" if right else f"misread: not asked for '{case.asks}': {errors.getvalue() or out.getvalue()}"
    if status:
        return f"refused: {errors.getvalue()}"
    valve = json.loads(output.read_text())
    faults = [*_misread(case, valve, " ".join(out.getvalue().split())), *_misprinted(case, valve, out.getvalue())]
    return f"misread: {'; '.join(faults)}" if faults else ""


def _misread(case: Case, valve: dict, printed: str) -> Iterator[str]:
    line = printed.partition("pressure drop")[2]  # of one side, or a line for each
    if case.dp_from and case.dp_from not in line:
        yield f"the pressure drop is said to be {line[:60]}"
    codes = {warning["code"] for warning in valve["warnings"]}
    yield from (f"warning {code}" for code in case.not_warned if code in codes)
    floor = valve["meter"]["floor_L_min"]
    if case.floor and not case.floor[0] <= floor <= case.floor[1]:
        yield f"a floor of {floor:.3g} L/min"
    for name in case.sides:
        tests = valve["sides"].get(name, {}).get("tests", [])
        if len(tests) != len(case.pressures):
            yield f"{len(tests)} tests on the {name} side"
            continue
        for test, dp in zip(tests, case.pressures, strict=True):
            if abs(test["dp_MPa"] / dp - 1) > SAME_DP:
                yield f"{test['dp_MPa']:.3f} MPa for {dp:g}"
            for branch, truth in (("rising", OPENS[name]), ("falling", CLOSES[name])):
                knee, se = (test[f"u_knee_{branch}_{key}V"] for key in ("", "se_"))
                if knee is None:
                    yield f"no {branch} branch at {dp:g} MPa, {name}"
                elif se > case.largest_se or abs(knee - truth) > max(TOLERANCE_V, TOLERANCE_SE * se):
                    off = 1e3 * (knee - truth)
                    yield f"{branch} knee at {dp:g} MPa, {name}: off by {off:+.0f} mV (se {1e3 * se:.1f})"


#: What no printed number may carry where the recordings carry another unit, by quantity.
FOREIGN = (r"m?V", r"MPa", r"L/min")
PER_MPA = {"MPa": 1.0, "bar": 10.0, "psi": 145.0377}


def _misprinted(case: Case, valve: dict, printed: str) -> Iterator[str]:
    """Yield what is printed in another unit than that of the recordings, or with a wrong number in it."""
    command, pressure, flow = case.shows
    foreign = [
        re.compile(rf"\d\s?({unit})(?!\w)")
        for unit, shown in zip(FOREIGN, case.shows, strict=True)
        if not re.fullmatch(unit, shown)
    ]
    for line in printed.splitlines():
        # Ranges and options are quoted as they are written.
        said = re.sub(r"'[^']*'|\(\S+\.\.[^)]*\)", "", line)
        for found in filter(None, (each.search(said) for each in foreign)):
            yield f"'{found[0]}' is printed in '{line[:60]}'"
    titles = [line for line in printed.splitlines() if line.startswith("Thresholds (")]
    if titles != [title for title in titles if f"({command})" in title] or len(titles) != len(case.sides):
        yield f"the thresholds are headed {titles}"
    if printed.count(f"dP ({pressure})") + printed.count(f"({pressure})") < len(titles):
        yield f"no pressure drop is in {pressure}"
    rows = [line.split()[-8:] for line in printed.splitlines() if re.search(r"(\s+(-|-?[\d.]+)){8}$", line)]
    tests = [(name, test) for name in case.sides for test in valve["sides"].get(name, {}).get("tests", [])]
    if len(rows) != len(tests):
        yield f"{len(rows)} rows are printed of {len(tests)} tests"
        return
    for row, (name, test) in zip(rows, tests, strict=True):
        sign = -1 if name == "negative" and case.reads(0.0) else 1
        slope = abs(case.reads(1.0) - case.reads(0.0))
        per_L_min = PER_L_MIN[flow.replace("L/min", "Lmin")]
        expected = {
            0: (PER_MPA[pressure] * test["dp_MPa"], 0.02 * PER_MPA[pressure]),
            1: (case.reads(sign * OPENS[name]), slope * max(TOLERANCE_V, 4 * test["u_knee_se_V"])),
            2: (case.reads(sign * CLOSES[name]), slope * max(TOLERANCE_V, 4 * test["u_knee_se_V"])),
            3: (slope * test["u_knee_se_V"], 1e-3 * slope),
            7: (per_L_min * test["q_max_L_min"], 0.01 * per_L_min),
        }
        for place, (right, room) in expected.items():
            if row[place] != "-" and abs(float(row[place]) - right) > room:
                yield f"column {place + 1} says {row[place]}, expected {right:.6g} in {case.shows}"


def print_corpus_of_units(*, quick: bool, seed: int) -> list:
    """Print and return the rows of part 12; each case has a seed of its own, whatever `seed` is."""
    return print_faults("12. Ports, units and staircases: refused or misread", cases()[:: 4 if quick else 1], fault_of)


def main(folder: Path) -> None:
    """Write all recordings, and the options and the truth of each case."""
    folder.mkdir(parents=True, exist_ok=True)
    known = {}
    for case in cases():
        for name, text in case.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        known[case.name] = {
            "files": list(case.files), "options": list(case.options), "dp_MPa": case.pressures, "asks": case.asks,
            "opens_V": {side: OPENS[side] for side in case.sides},
            "closes_V": {side: CLOSES[side] for side in case.sides},
        }  # fmt: skip
    (folder / "truth.json").write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
