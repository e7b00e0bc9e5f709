"""Co-Simulation of the FMUs, step by step: what the programs are given, and what they print."""

import struct
from collections.abc import Sequence

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.verify.fmu.binary_core import FMU_HOST, fmu_flags, fmu_program, reference_flags, text_flag
from dzdesign.verify.fmu.fmu_file import FmuFile
from dzdesign.verify.fmu.results import results_of
from dzdesign.verify.toolchain.machines import stored

#: Places for value references of outputs, as programs/steps.c has them.
MOST_OUTPUTS = 8
CODES = ("u_i_code", "p_A_code", "p_B_code")
VALUES = ("u_i", "p_A", "p_B")


def stepped(
    fmu: FmuFile, binary: bytes, rows: np.ndarray, outputs: Sequence[str], step_s: float, *, codes: bool
) -> np.ndarray:
    """Return integer outputs after each step, (N, outputs), of a compensator given a row of inputs before it, (N, 3).

    The rows are codes, or V and MPa. A binary that refuses a call or its own token, or takes another, is a
    `RequirementError`.
    """
    references = [fmu.reference(name) for name in (CODES if codes else VALUES)] + [0]
    targets = [fmu.reference(name) for name in outputs] + [0] * (MOST_OUTPUTS - len(outputs))
    head = struct.pack(f"<{8 + MOST_OUTPUTS}I", 3 if codes else 0, len(outputs), len(rows), 0, *references, *targets)
    given = head + struct.pack("<d", step_s) + np.ascontiguousarray(rows, dtype="<f8").tobytes()
    of_fmu = {"CODES": "codes", "U_I": "u_i", "U_I_CODE": "u_i_code"}
    flags = (*fmu_flags(fmu, binary), *reference_flags(fmu, of_fmu))
    program = fmu_program("steps.c", flags, FMU_HOST, f"the steps of {fmu.name}")
    found = np.array(results_of(FMU_HOST, program, [str(stored(given))], fmu.name), dtype=np.int64)
    if found.shape != (len(rows), len(outputs)):
        raise RequirementError(f"{fmu.name} gave outputs of shape {found.shape}, expected {(len(rows), len(outputs))}")
    return found


def coupled(
    compensator: FmuFile,
    plant: FmuFile,
    binaries: tuple[bytes, bytes],
    command_V: np.ndarray,
    drop_MPa: float,
    back_MPa: float,
    step_s: float,
    *,
    negative: bool,
    swapped: bool,
) -> tuple[np.ndarray, np.ndarray]:
    """Return flow in L/min and compare value after each step of both FMUs, (N,) each.

    Of negative commands it is solenoid B that drives the plant; `swapped` sensors see it the other way round.
    """
    of_plant = {"P_AHEAD": "p_ahead", "P_BEHIND": "p_behind", "SUPPLY": "supply", "BACK_PRESSURE": "back_pressure",
                "PLANT_COMPARE": "compare", "Q": "Q"}  # fmt: skip
    ahead, behind = ("p_B", "p_A") if swapped else ("p_A", "p_B")
    of_compensator = {"U_I": "u_i", "AHEAD": ahead, "BEHIND": behind, "DRIVE": "compare_b" if negative else "compare_a"}
    flags = (
        *fmu_flags(compensator, binaries[0]),
        text_flag("PLANT_PATH", str(stored(binaries[1]))),
        text_flag("PLANT_TOKEN", plant.token),
        *reference_flags(plant, of_plant),
        *reference_flags(compensator, of_compensator),
    )
    what = f"{compensator.name} with {plant.name}"
    program = fmu_program("couple.c", flags, FMU_HOST, what)
    given = struct.pack("<4d", step_s, drop_MPa, back_MPa, len(command_V)) + command_V.astype("<f8").tobytes()
    found = results_of(FMU_HOST, program, [str(stored(given))], what)
    if len(found) != len(command_V):
        raise RequirementError(f"{what} made {len(found)} steps, expected {len(command_V)}")
    flow = np.array([row[0] for row in found], dtype=np.uint64).view(np.float64)
    return flow, np.array([row[1] for row in found])
