"""FMUs of the example: the checks of `verify`, another tool, the sources compiled again."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from time import perf_counter

from example_valve import example_valve
from scoreboard import Row, print_rows, say

from dzdesign.codegen.other_targets import generate_output
from dzdesign.codegen.project import target_named
from dzdesign.codegen.writing import write_generated
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.example import example_folder
from dzdesign.verify.closed_loop.plant import read_plant
from dzdesign.verify.folder import read_output_manifest
from dzdesign.verify.outputs import fmu
from dzdesign.verify.requirements import FMU_CLOSED_LOOP

STEP_S, STOP_S = 1 / 2500, 0.1


def print_fmus(quick: bool = False, seed: int = 0) -> list[Row]:
    """Make and check the FMUs, print and return the rows; quick: without the sources compiled again."""
    del seed
    every_code = {"pressure_a": "0..3 V", "pressure_b": "0..3 V", "accept": "broken-sensor"}
    compensator = design(example_valve(), options_of(every_code, target_named("f28335").inputs()))
    plant = json.dumps(asdict(read_plant(example_folder() / "plant.toml")))
    with tempfile.TemporaryDirectory(prefix="bench-outputs-") as place:
        folder = Path(place) / "fmus"
        begin = perf_counter()
        first, again = (generate_output(compensator, "fmu", {"plant": plant}) for _ in range(2))
        seconds = (perf_counter() - begin) / 2
        write_generated(first, folder)
        differing = sum(first.files[name] != again.files[name] for name in first.files)
        rows = [Row(what="FMUs that differ when made again", value=differing, limit=0, note=f"{seconds:.0f} s for all")]
        rows += _checked(folder, compensator)
        rows += _in_other_tools(folder)
        if not quick:
            rows.append(_compiled_again(folder, Path(place)))
    print_rows("FMUs", rows)
    return rows


def _checked(folder: Path, compensator: Compensator) -> list[Row]:
    """Return what the checks of `verify` found."""
    begin = perf_counter()
    found = fmu.checks(folder, read_output_manifest(folder), compensator, say)
    seconds = perf_counter() - begin
    rows = [Row(what=f"{each.name}: wrong of {each.inputs} inputs", value=each.wrong, limit=0,
                note=f"hash {each.outputs_hash}") for each in found.inputs]  # fmt: skip
    missed = [check for check in found.checks if not check.holds]
    for check in missed:
        print(f"{check.name}: {check.text}")
    rows.append(Row(what="checks of verify that do not hold", value=len(missed), limit=0, note=f"{seconds:.0f} s"))
    for check in (check for check in found.checks if check.id == FMU_CLOSED_LOOP.id):
        rows.append(Row(what=check.name, value=float(check.text.split("at most ")[1].split()[0]), limit=1e-4))
    return rows


def _in_other_tools(folder: Path) -> list[Row]:
    """Return the problems that the FMU Manipulation Toolbox finds."""
    files = sorted(folder.glob("*.fmu"))
    said = ""
    for file in files:
        command = [str(Path(sys.executable).with_name("fmutool")), "-input", str(file), "-check"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        said += done.stdout + done.stderr
    sound = said.count("seems to be compliant") + said.count("No semantic error")
    return [Row(what="verdicts of fmutool -check that are not good", value=2 * len(files) - sound, limit=0)]


def _compiled_again(folder: Path, place: Path) -> Row:
    """Return how many FMUs answer otherwise once FMPy has compiled their sources with this machine's compiler."""
    import fmpy
    import numpy as np
    from fmpy.build import build_platform_binary

    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"  # for cmake
    others = 0
    for file in sorted(folder.glob("*.fmu")):
        unpacked, build = place / file.stem, place / f"build-{file.stem}"
        build.mkdir()
        fmpy.extract(str(file), unzipdir=str(unpacked))
        shutil.rmtree(unpacked / "binaries")
        build_platform_binary(unpacked, build)
        of_plant = "plant" in file.name
        how = {
            "stop_time": STOP_S, "output_interval": STEP_S, "fmi_type": "CoSimulation",
            "start_values": {"compare": 50000} if of_plant else {"u_i": 4.0, "p_A": 3.0, "p_B": 1.0},
            "output": ["Q", "x"] if of_plant else ["u_O", "beta", "compare_a"],
        }  # fmt: skip
        first, again = (fmpy.simulate_fmu(str(each), **how) for each in (file, unpacked))
        others += not all(np.allclose(first[name], again[name], rtol=1e-9, atol=1e-12) for name in first.dtype.names)
    return Row(what="FMUs that answer otherwise, compiled again from their sources", value=others, limit=0)
