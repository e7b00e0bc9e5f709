"""`simulate`: ramp tests as a bench would record them, from the plant; always marked as simulated."""

import datetime
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from msgspec import Meta

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_types import THIS_TOOL, Artefact, SourceFile, quantity
from dzdesign.core.dither import Dither
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import InputError
from dzdesign.design.signals import Signals
from dzdesign.identify.reading.ramp_files import SIMULATED_MARK, ramp_file_bytes
from dzdesign.verify.closed_loop.loop import RECORD_S, ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant
from dzdesign.verify.folder import check_firmware_inside, read_compensator

#: Beginning of a series, in its time stamps; any day serves, and the same day gives the same bytes.
SERIES_BEGINS = datetime.datetime(2026, 1, 1, 8)
#: Between two ramps of a series: the pressure is set, s.
PAUSE_S = 60.0
MOST_REPEATS = 100
#: A valve that scatters by more than this share of u_max has no threshold to speak of.
LARGEST_SCATTER = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """The sensors and the recorder of a bench."""

    rate_Hz: Annotated[float, quantity("Hz", "Sampling rate.")] = 25.0
    meter_lag_s: Annotated[float, quantity("s", "First-order lag of the flow meter.", ge=0, le=1e6)] = 0.1
    meter_floor_L_min: Annotated[float, quantity("L/min", "Flow below which it reads zero.", ge=0, le=1e6)] = 0.6
    meter_noise_L_min: Annotated[float, quantity("L/min", "Standard deviation of the flow noise.", ge=0, le=1e6)] = 0.08
    command_noise_V: Annotated[float, quantity("V", "Standard deviation of the command noise.", ge=0, le=1e6)] = 0.002
    pressure_noise_MPa: Annotated[float, quantity("MPa", "Standard deviation of the pressure noise.", ge=0, le=1e6)] = (
        0.01
    )
    seed: Annotated[int, Meta(description="Random seed of the noise; the same seed gives the same bytes.")] = 1

    def __post_init__(self) -> None:
        if not 1 <= self.rate_Hz <= 1 / RECORD_S:
            raise InputError(f"the rate is {self.rate_Hz:g} Hz, expected 1 to {1 / RECORD_S:g} Hz")


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """Ramps at every pressure drop, each by itself, in random order, and by how much the valve scatters over them."""

    repeats: Annotated[int, Meta(description="Number of ramps at each pressure drop.")] = 1
    scatter_V: Annotated[
        float, quantity("V", "Standard deviation of the threshold from ramp to ramp.", ge=0, le=1e6)
    ] = 0.0

    def __post_init__(self) -> None:
        if not 1 <= self.repeats <= MOST_REPEATS:
            raise InputError(f"{self.repeats} ramps at each pressure drop were asked for, expected 1 to {MOST_REPEATS}")


ONE_OF_EACH = Series()


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulationManifest(Artefact):
    """A folder of simulated ramp tests; made from the compensator of the firmware that drove the valve, if any."""

    FILE_NAME: ClassVar[str] = MANIFEST_NAME
    schema: Annotated[Literal["dzdesign.simulation/1"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.simulation/1"
    )
    simulated: Annotated[Literal[True], Meta(description="Always true: the recordings are no measurement.")] = True
    plant: Annotated[Plant, Meta(description="Simulated valve.")]
    bench: Annotated[Bench, Meta(description="Simulated sensors and recorder.")]
    series: Annotated[Series, Meta(description="Number of repeats and repeatability.")] = ONE_OF_EACH


def simulate_ramp(
    loop: ClosedLoop,
    plant: Plant,
    dp_MPa: float,
    bench: Bench,
    sequence: RampSequence,
    mode: str = "direct",
    series: Series = ONE_OF_EACH,
    number: int = 1,
) -> dict[str, np.ndarray]:
    """Record one ramp test of the plant, without compensator ("direct") or with it ("compensated").

    `number` tells which ramp of the series it is at this pressure drop, from 1.

    Returns
    -------
    dict
        Columns of a ramp file: time_s, u_V, dP_MPa, Q_Lmin.
    """
    from scipy.signal import lfilter

    with_core = mode != "direct"
    # One stream of numbers per ramp, so that adding a test changes none of the others.
    stream = [bench.seed, round(dp_MPa * 1e6), *([1] if with_core else [])]
    random = np.random.default_rng(stream if number == 1 else [*stream, 0, number])
    # Friction and remanence hold the spool back differently at every ramp, as another preload would.
    scatter_N = series.scatter_V * plant.force_per_volt * np.random.default_rng([*stream, 1, number]).standard_normal()
    loop = loop.with_plant(replace(plant, preload_N=max(plant.preload_N + scatter_N, 0.0)))
    run = loop.run(sequence.for_drive(loop).command(), dp_MPa, mode)
    waves = with_core or loop.wave[0] > 0
    share = 1 - np.exp(-RECORD_S / bench.meter_lag_s) if bench.meter_lag_s > 0 else 1.0
    # Of a dither a meter sees the mean.
    metered = lfilter([share], [1, share - 1], run.q_mean_L_min if waves else run.q_L_min)
    rows = np.round(np.arange(0, run.time[-1], 1 / bench.rate_Hz) / RECORD_S).astype(int)
    noise = random.standard_normal((3, rows.size))
    seen = np.where(metered[rows] < bench.meter_floor_L_min, 0.0, metered[rows])
    return {
        "time_s": run.time[rows],
        "u_V": run.command[rows] * plant.u_max_V + bench.command_noise_V * noise[0],
        "dP_MPa": run.dp_MPa[rows] + bench.pressure_noise_MPa * noise[1],
        "Q_Lmin": seen + bench.meter_noise_L_min * noise[2],
    }


def simulated_files(
    plant: Plant,
    pressures_MPa: list[float],
    ramp_s: float,
    bench: Bench,
    say: Callable[[str], None],
    firmware: Path | None = None,
    series: Series = ONE_OF_EACH,
    dither: Dither | None = None,
) -> tuple[dict[str, bytes], SimulationManifest]:
    """Simulate ramp tests, up and down, at each pressure drop; with a firmware folder, of the compensated valve.

    A series with repeats is in random order, so that a drift of the valve could be told from the pressure drop, and
    its time stamps tell that order. A dither is about the command of the valve without a compensator.

    Returns
    -------
    tuple
        File name -> gzipped CSV, each marked as simulated in its first lines; manifest of the folder.
    """
    if not 1 <= ramp_s <= 1000:
        raise InputError(f"the ramp time is {ramp_s:g} s, expected 1 to 1000 s")
    if not 0 <= series.scatter_V <= LARGEST_SCATTER * plant.u_max_V:
        raise InputError(
            f"the repeatability is {100 * series.scatter_V / plant.u_max_V:.3g} % of full command, expected 0 to "
            f"{100 * LARGEST_SCATTER:g} %"
        )
    if firmware is not None and dither is not None:
        raise InputError("a firmware makes its own dither, the one that `design` was given; leave out --dither")
    name, mode, made_from = "ramp", "direct", tuple[SourceFile, ...]()
    if firmware is None:
        # Counts, and periods of half a wave: the whole number that comes nearest.
        wave = dither and (
            round(dither.peak * Signals().compare_max), round(0.5 / (dither.frequency_Hz * PWM_PERIOD_S)),
        )  # fmt: skip
        loop = ClosedLoop(plant, dither=wave or None)
    else:
        check_firmware_inside(firmware)
        digest = sha256_of((firmware / "compensator.json").read_bytes())
        loop = ClosedLoop(plant, firmware, read_compensator(firmware))
        name, mode, made_from = "compensated", "compensated", (SourceFile(source="compensator.json", sha256=digest),)
    sequence = RampSequence(ramp=ramp_s)
    ramps = [(dp_MPa, number) for dp_MPa in pressures_MPa for number in range(1, series.repeats + 1)]
    if series.repeats > 1:
        ramps = [ramps[place] for place in np.random.default_rng([bench.seed, len(ramps)]).permutation(len(ramps))]
    begins = SERIES_BEGINS
    contents = {}
    for dp_MPa, number in ramps:
        if not 0.01 <= dp_MPa <= 18:
            raise InputError(f"a pressure drop of {dp_MPa:g} MPa can't be simulated, expected 0.01 to 18 MPa")
        say(f"simulating {dp_MPa:g} MPa")
        comments = (
            f"{SIMULATED_MARK} by dzdesign simulate; not a measurement.",
            f"pressure drop {dp_MPa:g} MPa at no flow; 0-{plant.u_max_V:g} V in {ramp_s:g} s and back",
            f"meter: floor {bench.meter_floor_L_min:g} L/min, lag {bench.meter_lag_s:g} s, "
            f"noise {bench.meter_noise_L_min:g} L/min; seed {bench.seed}",
            *(["with the compensator; u is its command"] if firmware else []),
            *([f"under a dither of {dither.in_words()}; u is the command without it"] if dither else []),
        )
        columns = simulate_ramp(loop, plant, dp_MPa, bench, sequence, mode, series, number)
        ramp = f"{name}_dP{dp_MPa:g}"
        if series.repeats > 1:
            ramp, seconds = f"{ramp}_{number}", columns.pop("time_s")
            columns = {"time": _time_stamps(begins, seconds), **columns}
            begins += datetime.timedelta(seconds=round(float(seconds[-1]) + PAUSE_S))
        contents[f"{ramp}.csv.gz"] = ramp_file_bytes(columns, comments, compress=True)
    return contents, SimulationManifest(tool=THIS_TOOL, made_from=made_from, plant=plant, bench=bench, series=series)


def _time_stamps(begins: datetime.datetime, seconds: np.ndarray) -> np.ndarray:
    """Return date and time of each row, as text to the millisecond."""
    times = np.datetime64(begins, "ms") + np.round(1e3 * seconds).astype("timedelta64[ms]")
    return np.char.replace(np.datetime_as_string(times), "T", " ")
