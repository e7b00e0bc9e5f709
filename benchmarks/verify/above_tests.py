"""Above the tested pressures: the C of each `design --above`, on valve A's truth continued in several ways.

The plant is written here and shares nothing with the product: the truth of the generator says at which command valve A
closes down to a few flows, at each tested pressure drop. Above the last one each of these commands goes on from the
last two tests' slope, straight, or bent by a stated second derivative. Flow between them is straight.
"""

import ctypes
import json
import os
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scoreboard import Row, print_rows, say

from dzdesign.codegen.project import DEFAULT_TARGET, generate, target_named
from dzdesign.core.artefact_files import write_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.identify.identification import identify
from dzdesign.identify.reading.ramp_files import read_ramp_file

SHARED = Path(os.environ.get("DZDESIGN_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data"))
TESTED = (1, 2, 3, 4, 5)
#: Flows of the truth on closing, L/min, and what it calls their commands; below the first nothing is known.
LEVELS = {0.1: "u_falling_Q0.1", 0.3: "u_falling_Q0.3", 0.6: "u_falling_Q0.6", 1.0: "u_falling_Q1.0"}
TRIED_MPa = (8.0, 10.0, 15.0)
#: Second derivatives of the truth above the tests, V/MPa²; those of the Q0.6 command at the tests are 0.007 to 0.010.
SHAPES = {"straight": 0.0, "convex": 0.008, "concave": -0.008}
#: DZ_STATUS_ABOVE, as the header has it.
ABOVE_BIT = 16


class Truth:
    """Valve A's closing edge: flow over drive, at any pressure drop."""

    def __init__(self, truth: Mapping[str, Mapping], bend_V_MPa2: float) -> None:
        self.tests = [truth[f"A_dP{dp}"]["pos"] for dp in TESTED]
        self.bend = bend_V_MPa2

    def command_V(self, level: str, dp_MPa: float) -> float:
        """Return the command at which the flow comes down to a level."""
        known = [test[level] for test in self.tests]
        if dp_MPa <= TESTED[-1]:
            return float(np.interp(dp_MPa, TESTED, known))
        beyond = dp_MPa - TESTED[-1]
        return known[-1] + (known[-1] - known[-2]) * beyond + self.bend / 2 * beyond**2

    def flow_L_min(self, drive_V: float, dp_MPa: float) -> float:
        """Return the flow at a drive, beyond the last level as steep as between the last two."""
        commands = [self.command_V(level, dp_MPa) for level in LEVELS.values()]
        flows = list(LEVELS)
        if drive_V > commands[-1]:
            return flows[-1] + (flows[-1] - flows[-2]) / (commands[-1] - commands[-2]) * (drive_V - commands[-1])
        return float(np.interp(drive_V, commands, flows, left=0.0))


class Core:
    """The compiled core of a compensator."""

    def __init__(self, compensator: Compensator, folder: Path) -> None:
        self.compensator = compensator
        firmware = generate(compensator, "host")
        write_folder(folder, firmware.files, firmware.manifest)
        library = folder.parent / f"{folder.name}.so"
        source = folder / "core" / "dz_comp.c"
        subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-o", library, source], check=True)
        self.library = ctypes.CDLL(str(library))

    def at_zero(self, dp_MPa: float, behind_MPa: float = 1.0) -> tuple[float, int]:
        """Return drive, V, and status at zero command, for the codes that the two sensors give."""
        signals = self.compensator.signals
        codes = []
        for sensor, pressure in ((signals.pressure_a, behind_MPa + dp_MPa), (signals.pressure_b, behind_MPa)):
            span = sensor.full_code - sensor.zero_code
            codes.append(sensor.zero_code + int(pressure / float(sensor.span_MPa) * span))
        compare = self.library.dz_comp(signals.command.zero_code, *codes)
        status = self.library.dz_status(signals.command.zero_code, *codes)
        return compare / signals.compare_max * float(self.compensator.u_max_V), status


def cores(folder: Path, texts: Mapping[str, Mapping[str, str]]) -> dict[str, Core]:
    """Return the cores of valve A, by name, each designed with its options."""
    valve = identify([read_ramp_file(SHARED / "valve_a" / f"A_dP{dp}.csv.gz") for dp in TESTED])
    inputs = target_named(DEFAULT_TARGET).inputs()
    return {name: Core(design(valve, options_of(each, inputs)), folder / name) for name, each in texts.items()}


def most_flow(core: Core, truth: Truth, pressures_MPa: Sequence[float]) -> tuple[float, float]:
    """Return the largest flow at zero command, L/min, and where it is."""
    return max((truth.flow_L_min(core.at_zero(dp)[0], dp), dp) for dp in pressures_MPa)


def print_above(*, quick: bool, seed: int) -> list[Row]:
    """Print and return flow and status at zero command above the tests; nothing of it is drawn."""
    del seed
    if not SHARED.is_dir():
        say(f"skipped: the shared measurements are not at {SHARED} (set DZDESIGN_SHARED_DATA)")
        return []
    truth = json.loads((SHARED / "truth.json").read_text())
    rows = []
    with TemporaryDirectory() as name:
        made = cores(Path(name), {choice: {"above": choice} for choice in ("hold", "lower", "release")})
        side = made["lower"].compensator.valve.positive
        level, curve = side.certificate.level_L_min, side.certified["closing"].above
        for choice, core in made.items():
            for shape, bend in SHAPES.items():
                plant = Truth(truth, bend)
                for dp in TRIED_MPa:
                    drive, status = core.at_zero(dp)
                    note = f"drive {drive:.3f} V, status {status}" + ("" if status & ABOVE_BIT else ", BIT MISSING")
                    limit = None if choice == "hold" else level * bool(status & ABOVE_BIT)
                    flow = plant.flow_L_min(drive, dp)
                    rows.append(
                        Row(what=f"{choice}, {shape}, {dp:g} MPa", value=flow, limit=limit, unit="L/min", note=note)
                    )
        rows += everywhere(made, truth, curve.curvature_V_MPa2, level, 0.5 if quick else 0.05)
    print_rows("Above the tests: flow at zero command on valve A's truth, continued", rows)
    return rows


def everywhere(
    made: Mapping[str, Core], truth: Mapping[str, Mapping], largest_bend: float, level: float, step_MPa: float
) -> list[Row]:
    """Return the largest flow anywhere above the tests, for bends up to M, and for one beyond it, which may flow.

    As far as the certificate says that it holds.
    """
    pressures = np.arange(TESTED[-1] + step_MPa, 18.0, step_MPa).tolist()
    rows = []
    for share, limit in ((-1.0, level), (1.0, level), (-4.0, None)):
        plant = Truth(truth, share * largest_bend)
        for choice in ("lower", "release"):
            holds_to = float(made[choice].compensator.positive.certificate.holds_to_MPa)
            # A threshold below zero would be a valve that is open without drive.
            tried = [dp for dp in pressures if dp <= holds_to and plant.command_V(LEVELS[0.1], dp) > 0]
            flow, at = most_flow(made[choice], plant, tried)
            note = f"most at {at:.2f} of {tried[0]:.2f} to {tried[-1]:.2f} MPa; M = {1e3 * largest_bend:.0f} mV/MPa²"
            if limit is None:
                note += ": outside what is promised"
            what = f"{choice}, bent by {share:g} M"
            rows.append(Row(what=what, value=flow, limit=limit, unit="L/min", note=note))
    return rows
