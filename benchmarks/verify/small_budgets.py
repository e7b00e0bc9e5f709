"""Budgets of which one component is ten times too small, each to be caught by machines drawn from the right one."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_files import write_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.closed_loop import population
from dzdesign.verify.closed_loop.drawn_machine import COMPONENTS
from dzdesign.verify.closed_loop.population import run_population
from dzdesign.verify.closed_loop.scene import Scene, scenes_of
from dzdesign.verify.loop_results import Population

SEED = 2
#: A coil on the bench at 20 °C and a supply of 24 V; and an amplifier, with nothing else than what a case is about.
DUTY = {"coil_temperature": "-20..80 degC", "supply": "18..32 V", "bench_supply": "24 V"}
LITTLE = {
    "amplifier": "1 %", "pressure_error": "0 %", "bench_pressure_error": "0 MPa", "oil": "0 %", "ageing": "0 %",
    "pressure_converter": "0 + 0 + 1 codes",
}  # fmt: skip
#: The component that costs most of the coil and the supply above, and a tenth of it.
LARGEST = (DUTY, {"supply": "23.4..24.8 V"})
#: Component that is drawn -> what is declared, and a tenth of the component's. Sensors and converter are declared so
#: coarse that a tenth of them shows beside what the table of beta leaves unused, some millivolts.
IN_TURN = {
    "coil temperature": (DUTY, {"coil_temperature": "16..26 degC"}),
    "supply": LARGEST,
    "current": (LITTLE, {"amplifier": "0.1 %"}),
    "pressure sensor A": (LITTLE | {"pressure_error": "2 % / 0 %"}, {"pressure_error": "0.2 % / 0 %"}),
    "pressure sensor B": (LITTLE | {"pressure_error": "0 % / 2 %"}, {"pressure_error": "0 % / 0.2 %"}),
    "bench pressure drop": (LITTLE | {"bench_pressure_error": "0.4 MPa"}, {"bench_pressure_error": "0.04 MPa"}),
    "offset of converter A": (
        LITTLE | {"pressure_converter": "60 + 0 + 1 codes"}, {"pressure_converter": "6 + 0 + 1 codes"},
    ),
    "gain of converter A": (
        LITTLE | {"pressure_converter": "0 + 300 + 1 codes"}, {"pressure_converter": "0 + 30 + 1 codes"},
    ),
    "oil": (LITTLE | {"oil": "1 %"}, {"oil": "0.1 %"}),
    "ageing": (LITTLE | {"ageing": "1 %"}, {"ageing": "0.1 %"}),
}  # fmt: skip


def designed(valve: ValveModel, folder: Path, **options: str) -> Compensator:
    """Write the firmware of a valve, and return what it was made from."""
    compensator = design(valve, options_of(options, target_named("f28335").inputs()))
    made = generate(compensator, "f28335")
    write_folder(folder, made.files, made.manifest)
    return compensator


def called_ten_times_better(valve: ValveModel) -> ValveModel:
    """Return a valve whose certified bound is moved up by nine tenths of its least distance to the threshold."""
    curve = valve.positive.certified["closing"]
    by = 0.9 * min(u - low for u, low in zip(curve.u_threshold_V, curve.u_lower_V, strict=True))
    above = curve.above and replace(
        curve.above,
        band_V=tuple(band - by for band in curve.above.band_V),
        u_lower_V=tuple(low + by for low in curve.above.u_lower_V),
    )
    moved = replace(
        curve,
        above=above,
        u_lower_V=tuple(low + by for low in curve.u_lower_V),
        offset_V=tuple(low + by for low in curve.offset_V),
        u_min0_V=curve.u_min0_V + by,
    )
    certified = {**valve.positive.certified, "closing": moved}
    tests = tuple(replace(each, u_guard_lower_V=each.u_guard_lower_V + by) for each in valve.positive.tests)
    return replace(valve, sides={"positive": replace(valve.positive, certified=certified, tests=tests)})


#: The end of each component at which the valve passes flow soonest; of pressures where dP reads too low.
ENDS = dict(zip(COMPONENTS, (-1, -1, 1, 1, 1, 1, -1, -1, -1, 1, -1, -1, 1, -1, 1, 1), strict=True))
PRESSURES = [name for name in COMPONENTS if "pressure" in name or "converter" in name]


def worst_ends(scene: Scene) -> np.ndarray:
    """Return the end of each component at which the valve of a scene passes flow soonest."""
    way = -1.0 if scene.identified.trend == "increasing" else 1.0
    return np.array([end * (way if name in PRESSURES else 1.0) for name, end in ENDS.items()])


@contextmanager
def drawn_alone(scenes: Sequence[Scene], *names: str) -> Iterator[None]:
    """Draw these components only; the others stand at their worst ends."""
    kept, worst, draw = [name not in names for name in COMPONENTS], worst_ends(scenes[0]), population.draw

    def some(count: int, random: np.random.Generator) -> np.ndarray:
        shares = draw(count, random)
        shares[:, kept] = worst[kept]
        return shares

    with patch.object(population, "draw", some):
        yield


def right_and_wrong(
    valve: ValveModel, folder: Path, true: dict[str, str], wrong: dict[str, str], *drawn: str, machines: int,
    change: Callable[[ValveModel], ValveModel] = lambda valve: valve,
) -> tuple[Population, Population]:  # fmt: skip
    """Return the machines of the true budget with its firmware, and with one that was designed for a wrong budget.

    Components that are not drawn stand at their worst ends; with none named all are drawn.
    """
    compensator = designed(valve, folder / "true", **true)
    short = designed(change(valve), folder / "wrong", **(true | wrong))
    # What is drawn, and what the thresholds are bounded by, is that of the true budget.
    laws = {"true": compensator, "wrong": replace(short, machine=compensator.machine, valve=compensator.valve)}
    found = []
    for name, law in laws.items():
        scenes = scenes_of(folder / name, law, None)
        with drawn_alone(scenes, *(drawn or COMPONENTS)):
            found.append(run_population(scenes, machines, SEED))
    return found[0], found[1]
