"""Compensator and plant coupled, as FMUs, against the closed loop that `verify` runs of the same law and plant."""

from collections.abc import Mapping

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.design.compensator import Compensator
from dzdesign.verify.closed_loop.loop import BENCH_BACK_MPA, ClosedLoop
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.fmu.core_in_fmu import firmware_folder
from dzdesign.verify.fmu.fmu_file import FmuFile
from dzdesign.verify.fmu.stepping import coupled
from dzdesign.verify.loop_results import Side
from dzdesign.verify.requirements import FMU_CLOSED_LOOP, Check

#: Of the largest flow.
TOLERANCE = 1e-4
#: Command over time: rest, up, full, down, rest, then steps; s and shares of full command.
COURSE = ((0.0, 0.0), (0.1, 0.0), (0.5, 1.0), (0.55, 1.0), (0.9, 0.0), (1.0, 0.0), (1.0, 0.5), (1.1, 0.5),
          (1.1, 0.02), (1.2, 0.02), (1.2, 1.0), (1.3, 0.0), (1.4, 0.0))  # fmt: skip
SIDES: Mapping[int, Side] = {1: "positive", -1: "negative"}


def closed_loop_check(
    fmu: FmuFile, plant_fmu: FmuFile, plant: Mapping[str, float], compensator: Compensator
) -> Check:
    """Compare the flow at the end of every PWM period, at the least and the largest tested pressure drop."""
    try:
        worst, periods, text = _compared(fmu, plant_fmu, Plant(**plant), compensator)
    except RequirementError as error:
        return FMU_CLOSED_LOOP.check(holds=False, text=str(error))
    words = f"{periods} PWM periods, flows differ by at most {worst:.2g} of the largest; {TOLERANCE:g} is allowed{text}"
    return FMU_CLOSED_LOOP.check(holds=worst <= TOLERANCE, text=words)


def _compared(
    fmu: FmuFile, plant_fmu: FmuFile, plant: Plant, compensator: Compensator
) -> tuple[float, int, str]:
    """Return the largest distance over the largest flow, how many periods were run, and where compare values differ."""
    binaries = fmu.binary_here(), plant_fmu.binary_here()
    if binaries[0] is None or binaries[1] is None:
        raise RequirementError(f"{fmu.name} has no binary for this machine")
    step_s, signals = 1 / compensator.signals.tick_Hz, compensator.signals
    times = np.arange(0, COURSE[-1][0], step_s)
    corners = np.array(COURSE)
    share = np.interp(times, corners[:, 0], corners[:, 1])
    worst, periods, others = 0.0, 0, 0
    with firmware_folder(fmu) as firmware:
        for sign in signals.signs:
            loop = ClosedLoop(plant, firmware, compensator, sign)
            tests = compensator.valve.sides[SIDES[sign]].tests
            pressures = [test.dp_MPa for test in tests if test.dp_MPa is not None] or [1.0]
            for dp_MPa in sorted({min(pressures), max(pressures)}):
                back_MPa = loop.back_within_span(BENCH_BACK_MPA, dp_MPa)
                run = loop.run(share, dp_MPa, "compensated", back_MPa=back_MPa, periods_per_record=1)
                flow, compare = coupled(
                    fmu, plant_fmu, (binaries[0], binaries[1]), sign * share * float(compensator.u_max_V), dp_MPa,
                    back_MPa, step_s, negative=sign < 0, swapped=sign < 0 and signals.swapped,
                )  # fmt: skip
                largest = float(run.q_L_min.max())
                if largest <= 0:
                    raise RequirementError(f"the closed loop of the same plant lets no flow pass at {dp_MPa:g} MPa")
                worst = max(worst, float(np.abs(flow - run.q_L_min).max()) / largest)
                periods += share.size
                others += int((compare != run.compare).sum())
    return worst, periods, f"; {others} compare values differ" if others else ""
