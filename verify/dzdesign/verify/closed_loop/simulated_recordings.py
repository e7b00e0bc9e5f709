"""`simulate`: ramp tests as a bench would record them, from the plant; always marked as simulated."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from msgspec import Meta

from dzdesign.core.artefact_files import MANIFEST_NAME, sha256_of
from dzdesign.core.artefact_types import THIS_TOOL, Artefact, SourceFile, quantity
from dzdesign.core.errors import InputError
from dzdesign.identify.reading.ramp_files import SIMULATED_MARK, ramp_file_bytes
from dzdesign.verify.closed_loop.loop import RECORD_S, ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.firmware.folder import check_firmware_inside, read_compensator


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """The sensors and the recorder of a bench."""

    rate_Hz: Annotated[float, quantity("Hz", "Rows per second.")] = 25.0
    meter_lag_s: Annotated[float, quantity("s", "First-order lag of the flow meter.", ge=0, le=1e6)] = 0.1
    meter_floor_L_min: Annotated[float, quantity("L/min", "Flow below which it reads zero.", ge=0, le=1e6)] = 0.6
    meter_noise_L_min: Annotated[float, quantity("L/min", "Standard deviation of its noise.", ge=0, le=1e6)] = 0.08
    command_noise_V: Annotated[float, quantity("V", "Standard deviation of the command's noise.", ge=0, le=1e6)] = 0.002
    pressure_noise_MPa: Annotated[
        float, quantity("MPa", "Standard deviation of the pressures' noise.", ge=0, le=1e6)
    ] = 0.01
    seed: Annotated[int, Meta(description="Of the noise; the same seed gives the same bytes.")] = 1

    def __post_init__(self) -> None:
        if not 1 <= self.rate_Hz <= 1 / RECORD_S:
            raise InputError(f"the rate is {self.rate_Hz:g} Hz, expected 1 to {1 / RECORD_S:g} Hz")


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulationManifest(Artefact):
    """A folder of simulated ramp tests; made from the compensator of the firmware that drove the valve, if any."""

    FILE_NAME: ClassVar[str] = MANIFEST_NAME
    schema: Annotated[Literal["dzdesign.simulation/1"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.simulation/1"
    )
    simulated: Annotated[Literal[True], Meta(description="No measurement.")] = True
    plant: Annotated[Plant, Meta(description="The valve.")]
    bench: Annotated[Bench, Meta(description="What recorded it.")]


def simulate_ramp(
    loop: ClosedLoop, plant: Plant, dp_MPa: float, bench: Bench, sequence: RampSequence, mode: str = "direct"
) -> dict[str, np.ndarray]:
    """Record one ramp test of the plant, without compensator ("direct") or with it ("compensated"), as columns."""
    from scipy.signal import lfilter

    run = loop.run(sequence.no_faster_than(loop.slowest_ramp_s).command(), dp_MPa, mode)
    share = 1 - np.exp(-RECORD_S / bench.meter_lag_s) if bench.meter_lag_s > 0 else 1.0
    with_core = mode != "direct"
    # Of a dither a meter sees the mean.
    metered = lfilter([share], [1, share - 1], run.q_mean_L_min if with_core else run.q_L_min)
    rows = np.round(np.arange(0, run.time[-1], 1 / bench.rate_Hz) / RECORD_S).astype(int)
    # One stream of numbers per pressure drop, so that adding a test changes none of the others.
    stream = [bench.seed, round(dp_MPa * 1e6), *([1] if with_core else [])]
    noise = np.random.default_rng(stream).standard_normal((3, rows.size))
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
) -> tuple[dict[str, bytes], SimulationManifest]:
    """Simulate one ramp test per pressure drop, up and down; with a firmware folder, of the compensated valve.

    Each file is a gzipped CSV, marked as simulated in its first lines; the manifest is that of the folder.
    """
    if not 1 <= ramp_s <= 1000:
        raise InputError(f"the ramp time is {ramp_s:g} s, expected 1 to 1000 s")
    loop, made_from = (ClosedLoop(plant), ()) if firmware is None else _loop_of(plant, firmware)
    name, mode = ("ramp", "direct") if firmware is None else ("compensated", "compensated")
    sequence = RampSequence(ramp=ramp_s)
    contents = {}
    for dp_MPa in pressures_MPa:
        if not 0.01 <= dp_MPa <= 18:
            raise InputError(f"a pressure drop of {dp_MPa:g} MPa can't be simulated, expected 0.01 to 18 MPa")
        say(f"simulating {dp_MPa:g} MPa")
        comments = (
            f"{SIMULATED_MARK} by dzdesign simulate; not a measurement.",
            f"pressure drop {dp_MPa:g} MPa at no flow; 0-{plant.u_max_V:g} V in {ramp_s:g} s and back",
            f"meter: floor {bench.meter_floor_L_min:g} L/min, lag {bench.meter_lag_s:g} s, "
            f"noise {bench.meter_noise_L_min:g} L/min; seed {bench.seed}",
            *(["with the compensator; u is its command"] if firmware else []),
        )
        columns = simulate_ramp(loop, plant, dp_MPa, bench, sequence, mode)
        contents[f"{name}_dP{dp_MPa:g}.csv.gz"] = ramp_file_bytes(columns, comments, compress=True)
    return contents, SimulationManifest(tool=THIS_TOOL, made_from=made_from, plant=plant, bench=bench)


def _loop_of(plant: Plant, firmware: Path) -> tuple[ClosedLoop, tuple[SourceFile, ...]]:
    """Return the loop of a plant with a firmware's core, and the compensator's file."""
    check_firmware_inside(firmware)
    compensator = read_compensator(firmware)
    digest = sha256_of((firmware / "compensator.json").read_bytes())
    return ClosedLoop(plant, firmware, compensator), (SourceFile(source="compensator.json", sha256=digest),)
