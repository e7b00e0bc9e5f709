"""A production lot on paper: ramp tests of many valves that scatter about one design, and ten that are broken."""

from pathlib import Path

import numpy as np
from bench_model import Bench, readings

from dzdesign.identify.reading.ramp_files import ramp_file_bytes
from dzdesign.identify.reading.ramp_test import RampTest

L_MIN, MPA = 1e-3 / 60, 1e6
PRESSURES_MPa = (1.0, 2.5, 5.0)
#: Ten rows a second of 60 s each way: what an end-of-line bench has time for.
RATE_Hz, RAMP_s = 10.0, 60.0
#: The lag of the bench's meter, for `batch --config`.
LOT_TOML = Path(__file__).with_name("lot.toml")


def lot_bench(number: int, seed: int) -> Bench:
    """Return one valve of the lot: thresholds, trend, hysteresis and gain scatter."""
    rng = np.random.default_rng([seed, number])
    dead_zone, drift = rng.normal(5.45, 0.12), rng.normal(-0.055, 0.01)
    return Bench(
        threshold_V=lambda dp: dead_zone + drift * dp,
        hysteresis_V=abs(rng.normal(0.12, 0.03)),
        slope_L_min_V=rng.normal(3.0, 0.1),
        noise_L_min=0.05,
        floor_L_min=0.3,
        rate_Hz=RATE_Hz,
        ramp_s=RAMP_s,
        pressures_MPa=PRESSURES_MPa,
    )


def _columns(test: RampTest) -> dict[str, np.ndarray]:
    return {"time_s": test.time, "u_V": test.u, "dP_MPa": test.dp / MPA, "Q_Lmin": test.q / L_MIN}


def _file(columns: dict[str, np.ndarray]) -> bytes:
    return ramp_file_bytes(columns, ("SIMULATED; not a measurement.",), compress=False)


def recordings(number: int, seed: int) -> dict[str, bytes]:
    """Return the ramp files of one valve."""
    (tests,) = readings(lot_bench(number, seed), 1, seed + number)
    return {f"ramp_dP{dp:g}.csv": _file(_columns(test)) for dp, test in zip(PRESSURES_MPa, tests, strict=True)}


def _without(files: dict[str, bytes], column: int) -> dict[str, bytes]:
    def cut(line: bytes) -> bytes:
        cells = line.split(b",")
        return line if line.startswith(b"#") else b",".join(cells[:column] + cells[column + 1 :])

    return {name: b"\n".join(map(cut, content.splitlines())) + b"\n" for name, content in files.items()}


def _dead_meter(files: dict[str, bytes]) -> dict[str, bytes]:
    def zero(line: bytes) -> bytes:
        return line if line[:1] in b"#t" else b",".join([*line.split(b",")[:3], b"0"])

    return {name: b"\n".join(map(zero, content.splitlines())) + b"\n" for name, content in files.items()}


def _lines(content: bytes, change) -> bytes:
    lines = content.splitlines()
    return b"\n".join(change(lines)) + b"\n"


def _with_first(files: dict[str, bytes], change) -> dict[str, bytes]:
    first = next(iter(files))
    return {**files, first: change(files[first])}


#: What is wrong -> the files made wrong.
BROKEN = {
    "no recording": lambda files: {},
    "no flow": lambda files: _without(files, 3),
    "no pressure drop": lambda files: _without(files, 2),
    "a word for a number": lambda files: _with_first(
        files, lambda content: _lines(content, lambda lines: [*lines[:200], b"20,overload,1,0", *lines[200:]])
    ),
    "ended early": lambda files: _with_first(files, lambda content: _lines(content, lambda lines: lines[:15])),
    "the same twice": lambda files: {**files, "again.csv": files["ramp_dP1.csv"]},
    "a photograph": lambda files: {**files, "ramp_dP7.csv": b"\xff\xd8\xff\xe0" + bytes(range(256)) * 40},
    "the meter is dead": _dead_meter,
    "time goes back": lambda files: _with_first(
        files, lambda content: _lines(content, lambda lines: [*lines[:2], *lines[600:800], *lines[2:600]])
    ),
    "an unknown unit": lambda files: _with_first(files, lambda content: content.replace(b"Q_Lmin", b"Q_Lmni", 1)),
}


def write_lot(folder: Path, count: int, broken: int, seed: int) -> dict[str, str]:
    """Write a subfolder a valve, and return the names of the broken ones with what is wrong.

    They stand at even distances among the others.
    """
    kinds = list(BROKEN)[:broken]
    at = {(2 * place + 1) * count // (2 * len(kinds)): kind for place, kind in enumerate(kinds)}
    names = {}
    for number in range(count):
        files = recordings(number, seed)
        kind = at.get(number)
        name = f"V{number:04d}"
        if kind is not None:
            files = BROKEN[kind](files)
            names[name] = kind
        (folder / name).mkdir(parents=True)
        for file, content in files.items():
            (folder / name / file).write_bytes(content)
    return names


def lot_options(folder: Path, text: str) -> list[str]:
    """Return the words for `batch` that give every valve the lot's lag and the options of a text."""
    path = folder / "options.toml"
    path.write_text(f"{LOT_TOML.read_text()}{text}\n", encoding="utf-8")
    return ["--config", str(path)]
