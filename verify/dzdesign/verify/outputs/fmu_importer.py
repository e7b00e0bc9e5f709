"""An FMU in FMPy: what it is, and what is run of it.

Run as a program, ``python -m dzdesign.verify.outputs.fmu_importer JOB ANSWER``, in a process that a binary may crash or
hang. The job is JSON: the name of a function here and its arguments; the answer is the JSON of what it returns.
"""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dzdesign.core.errors import RequirementError
from dzdesign.core.placing import scratch_folder
from dzdesign.verify.toolchain.machines import run_child

if TYPE_CHECKING:
    from fmpy.model_description import ModelDescription

#: A run that takes longer hangs, s.
LONGEST_S = 300.0
Row = list[float]


def binary_here(folder: Path, identifier: str) -> Path | None:
    """Return the binary for this machine in an unpacked FMU, or None.

    FMI 2.0.4 names the folders of aarch64 as FMI 3 does, where FMPy does not look by itself.
    """
    import fmpy

    names = (folder / "binaries" / each / identifier for each in (fmpy.platform_tuple, fmpy.platform))
    found = (path.with_name(path.name + fmpy.sharedLibraryExtension) for path in names)
    return next((path for path in found if path.exists()), None)


class Importer:
    """An instance of an unpacked FMU for one kind of interface, from time 0 on."""

    def __init__(self, folder: str, *, exchange: bool, **before: float) -> None:
        from fmpy import read_model_description
        from fmpy.fmi2 import FMU2Model, FMU2Slave

        self.description: ModelDescription = read_model_description(folder)
        self._known = {each.name: each for each in self.description.modelVariables}
        interface = self.description.modelExchange if exchange else self.description.coSimulation
        self.fmu = (FMU2Model if exchange else FMU2Slave)(
            guid=self.description.guid,
            unzipDirectory=folder,
            modelIdentifier=interface.modelIdentifier,
            instanceName="checked",
            libraryPath=str(binary_here(Path(folder), interface.modelIdentifier)),
        )
        self.fmu.instantiate()
        self.begin(**before)

    def begin(self, **before: float) -> None:
        """Initialize it at time 0, with these values."""
        self.give(**before)
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def give(self, **values: float) -> None:
        """Set variables of any type."""
        for name, value in values.items():
            variable = self._known[name]
            typed = float(value) if variable.type == "Real" else int(value)
            getattr(self.fmu, f"set{variable.type}")([variable.valueReference], [typed])

    def get(self, names: Sequence[str]) -> Row:
        """Return variables of any type."""
        found = (self._known[name] for name in names)
        return [float(getattr(self.fmu, f"get{each.type}")([each.valueReference])[0]) for each in found]


def stepped(
    folder: str, names: list[str], rows: list[Row], outputs: list[str], step_s: float, exchange: bool, codes: bool
) -> list[Row]:
    """Return the outputs of a compensator, each row of inputs held for a step.

    Co-Simulation gives them after the step, Model Exchange at the event with which the step begins, and behind them
    there the time of the next event. What is no code follows the inputs between events too.
    """
    one, found = Importer(folder, exchange=exchange, codes=codes), []
    smooth = [name for name in outputs if name.startswith(("beta", "u_O"))]
    if not exchange:  # a reset leaves nothing of a step
        one.give(**dict(zip(names, rows[0], strict=True)))
        one.fmu.doStep(0.0, step_s)
        one.fmu.reset()
        one.begin(codes=codes)
    for index, row in enumerate(rows):
        if exchange and index:
            one.fmu.enterContinuousTimeMode()
            one.fmu.setTime(index * step_s)
            if not codes:
                one.give(**dict(zip(names, row, strict=True)))
                between = one.get(smooth)
            one.fmu.enterEventMode()
        one.give(**dict(zip(names, row, strict=True)))
        if exchange:
            *_, next_s = one.fmu.newDiscreteStates()
            found.append([*one.get(outputs), next_s])
            if index and not codes and between != one.get(smooth):
                raise RuntimeError(f"between events {smooth} are {between}, at the event {one.get(smooth)}")
        else:
            one.fmu.doStep(index * step_s, step_s)
            found.append(one.get(outputs))
    return found


def coupled(
    compensator: str, plant: str, command_V: Row, drop_MPa: float, back_MPa: float, step_s: float, drive: str,
    pressures: list[str],
) -> list[Row]:  # fmt: skip
    """Return flow in L/min and compare value after each step of both, each given what the other had before it."""
    law = Importer(compensator, exchange=False)
    valve = Importer(plant, exchange=False, supply=drop_MPa, back_pressure=back_MPa)
    compare, found = 0.0, []
    for index, volts in enumerate(command_V):
        law.give(u_i=volts, **dict(zip(pressures, valve.get(("p_ahead", "p_behind")), strict=True)))
        valve.give(compare=compare)
        for each in (law, valve):
            each.fmu.doStep(index * step_s, step_s)
        (compare,) = law.get((drive,))
        found.append([*valve.get(("Q",)), compare])
    return found


def run_in_child(function: str, what: str, **arguments: Any) -> list[Row]:
    """Call a function of this module in a process of its own; one that fails, crashes or hangs: `RequirementError`."""
    with scratch_folder() as place:
        job, answer = place / "job", place / "answer"
        job.write_text(json.dumps({"function": function, **arguments}), encoding="utf-8")
        command = [sys.executable, "-P", "-m", "dzdesign.verify.outputs.fmu_importer", str(job), str(answer)]
        ended = run_child(command, what, LONGEST_S, place=place)
        if ended.reason:
            said = ended.complaint.strip().splitlines()[-1:] or ["without a word"]
            raise RequirementError(f"{what} ended with {ended.reason}: {said[0][:200]}")
        return json.loads(answer.read_text(encoding="utf-8"))  # type: ignore[no-any-return]


if __name__ == "__main__":
    given = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    result = globals()[given.pop("function")](**given)
    Path(sys.argv[2]).write_text(json.dumps(result), encoding="utf-8")
