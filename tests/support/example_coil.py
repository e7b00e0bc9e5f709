"""The example's coil (examples/paper_valve/plant.toml) and the loop that is chosen for it; once for all tests."""

from dataclasses import replace
from functools import cache

from dzdesign.codegen.project import target_named
from dzdesign.codegen.target import Target
from dzdesign.design.compensator import Compensator
from dzdesign.design.current.circuit import CoilCircuit, CurrentLoop, CurrentSampling, CurrentSensor
from dzdesign.design.current.drive import choose_loop, design_current_drive
from dzdesign.design.current.responses import CurrentRequest
from dzdesign.design.designing import design
from dzdesign.design.signals import Signals
from dzdesign.design.target_inputs import Converter
from tests.support.core_variants import BOTH
from tests.support.golden_firmware import FULL, full_options, golden_valve

COIL = CoilCircuit(resistance_ohm=3.5, inductance_H=0.04, rated_A=1.0, supply_V=(18.0, 32.0))
CONVERTER, SAMPLING = Converter(), CurrentSampling()
#: With and without the supply measured.
SENSORS = {
    "supply unknown": CurrentSensor(V_per_A=2.0, offset_V=0.15),
    "supply measured": CurrentSensor(V_per_A=2.0, offset_V=0.15, supply_divider=0.075),
}


def asked(sensor: CurrentSensor, circuit: CoilCircuit = COIL) -> CurrentRequest:
    """Return what is asked for a coil and a sensor."""
    return CurrentRequest(circuit=circuit, sensor=sensor, sampling=SAMPLING, converter=CONVERTER)


@cache
def example_loop(name: str) -> CurrentLoop:
    """Return the loop that `design` chooses."""
    return choose_loop(asked(SENSORS[name]), 60000)


def with_current(compensator: Compensator, target: Target, sensor: CurrentSensor) -> Compensator:
    """Return a compensator that controls the current of this coil on a target."""
    request = replace(asked(sensor), sampling=target.current_sampling, converter=target.converter)
    return replace(compensator, current_drive=_drive(request, compensator.signals.compare_max))


@cache
def two_with_current(target_name: str, shunts: int) -> Compensator:
    """Return a compensator of two solenoids with this coil, the supply measured."""
    target = target_named(target_name)
    signals = Signals(command=BOTH, compare_max=target.compare_max)
    made = design(golden_valve(FULL), full_options(signals=signals, negative_dp="wired"))
    request = replace(
        asked(SENSORS["supply measured"]), converter=target.converter, sampling=target.current_sampling,
        solenoids=2, shunts=shunts,
    )  # fmt: skip
    return replace(made, current_drive=_drive(request, signals.compare_max))


_drive = cache(design_current_drive)
