"""`simulate`: plant -> ramp tests, marked as simulated."""

from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.artefact_files import check_folder_may_be_written, write_folder
from dzdesign.core.dither import read_dithered
from dzdesign.core.errors import InputError
from dzdesign.core.option_readers import percent, quantity, whole_number
from dzdesign.core.options import AnyPath, Option, Text, Texts, read_options, texts_of
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.core.units import parse_quantity
from dzdesign.terminal.progress import say, stage_progress

if TYPE_CHECKING:
    from dzdesign.verify.closed_loop.simulated_recordings import SimulationManifest

PRESSURE_DROPS = ("0.5 MPa", "1 MPa", "2 MPa", "3 MPa", "4 MPa", "5 MPa")


@dataclass(frozen=True, kw_only=True)
class SimulateArguments:
    """Arguments of `simulate`."""

    output: Annotated[AnyPath | None, Option("DIR", command_default="ramps", short="-o")] = None
    """Folder for the recordings."""
    plant: Annotated[AnyPath | None, Option("PLANT.toml")] = None
    """File with the plant (default: that of the paper's valve)."""
    firmware: Annotated[AnyPath | None, Option("DIR")] = None
    """Folder made by `dzdesign codegen`. Its compensator then drives the valve."""
    dp: Annotated[Texts, Option("P", example="1 MPa")] = ()
    """Pressure drop of a ramp test (default: 0.5, 1, 2, 3, 4 and 5 MPa). Repeatable."""
    repeats: Annotated[int | str, Option("N", read=whole_number("a whole number such as 3", least=1, digits=3))] = "1"
    """Number of ramps at each pressure drop, one file each. From 2 on they are in random order, with date and time."""
    repeatability: Annotated[Text, Option("S", example="0.1 %", read=percent("0.1 %"))] = None
    """Standard deviation of the threshold from ramp to ramp, in percent of full command (default: 0)."""
    ramp_time: Annotated[str, Option("T", example="100 s", read=quantity("time"))] = "100 s"
    """Time from zero to full command."""
    dither: Annotated[Text, Option("D", example="150 Hz 1 %", read=read_dithered)] = None
    """Dither on the command of the ramps, for `identify --dithered` (default: none)."""
    seed: Annotated[
        int | str, Option("N", read=whole_number("a whole number of zero or more, such as 1", digits=18))
    ] = "1"
    """Random seed of the measurement noise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedRamps:
    """Ramp tests of a simulated valve: content of each file by name, and the manifest of their folder."""

    files: Mapping[str, bytes]
    manifest: "SimulationManifest"


def simulate(arguments: SimulateArguments) -> SimulatedRamps:
    """Simulate ramp tests of a valve; the recordings are marked as simulated.

    Returns
    -------
    SimulatedRamps
        Content of each file by name, and the manifest of the folder.

    Raises
    ------
    InputError
        If a file or an option can't be read.
    RequirementError
        If the firmware's code differs from what this version generates from its compensator.json. It is then not run.

    Examples
    --------
    >>> from dzdesign import api
    >>> ramps = api.simulate(dp="1 MPa", ramp_time="20 s")
    >>> list(ramps.files), ramps.manifest.simulated
    (['ramp_dP1.csv.gz'], True)
    """
    from dzdesign.regeneration import generated_code
    from dzdesign.verify.closed_loop.plant import Plant, read_plant
    from dzdesign.verify.closed_loop.simulated_recordings import Bench, Series, simulated_files

    if arguments.output is not None:
        check_folder_may_be_written(Path(arguments.output))
    plant = read_plant(Path(arguments.plant), say) if arguments.plant is not None else Plant()
    texts = texts_of(arguments.dp) or list(PRESSURE_DROPS)
    pressures = [parse_quantity(text, "pressure", "--dp") / 1e6 for text in texts]
    if len({f"{dp_MPa:g}" for dp_MPa in pressures}) < len(pressures):  # one file each, named by it
        raise InputError(f"--dp repeats a pressure drop ({', '.join(texts)}); give each of them once")
    read = read_options(arguments, ["repeats", "repeatability", "ramp_time", "dither", "seed"])
    series = Series(repeats=read["repeats"], scatter_V=(read["repeatability"] or 0.0) * plant.u_max_V)
    firmware = Path(arguments.firmware) if arguments.firmware is not None else None
    dither = read["dither"] and read["dither"].of(AS_COMPUTED, plant.u_max_V)
    with (
        nullcontext() if firmware is None else generated_code(firmware) as code,
        stage_progress() as stage,
    ):
        files, manifest = simulated_files(
            plant, pressures, read["ramp_time"], Bench(seed=read["seed"]), say=stage, firmware=code, series=series,
            dither=dither,
        )  # fmt: skip
    if arguments.output is not None:
        write_folder(Path(arguments.output), files, manifest)
    return SimulatedRamps(files=files, manifest=manifest)
