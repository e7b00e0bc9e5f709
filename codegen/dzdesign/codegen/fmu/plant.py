"""The plant as an FMU: amplifier, coil, spool and edge by Eqs. (19)-(24), with parameters that the importer may change.

`verify` simulates the same equations in a text of its own; this one stands in ``templates/plant.c.jinja``.
"""

import json
from collections.abc import Mapping
from typing import NamedTuple

from dzdesign.codegen.fmu.description import Causality, Kind, Model, Variable
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator

#: Of a default experiment, s.
STOP_S = 1.0
#: Pressures of a bench, MPa: where nothing is set, the spring alone would hold the valve at no pressure drop.
SUPPLY_MPA, BACK_MPA = 1.0, 1.0


class Parameter(NamedTuple):
    """Unit and meaning of a parameter of the plant, whose name is that in plant.toml."""

    unit: str
    description: str


PARAMETERS: Mapping[str, Parameter] = {
    "u_max_V": Parameter("V", "Command at which the PWM is fully on."),
    "K_a": Parameter("", "Amplifier gain, Eq. (19)."),
    "K_fi_V_A": Parameter("V/A", "Current feedback, Eq. (21)."),
    "R_c_ohm": Parameter("ohm", "Resistance of the coil, Eq. (20)."),
    "r_p_ohm": Parameter("ohm", "Internal resistance of the amplifier, Eq. (20)."),
    "L_c_H": Parameter("H", "Inductance of the coil, Eq. (20)."),
    "K_i_N_A": Parameter("N/A", "Force of the solenoid per current, Eq. (22)."),
    "m_e_kg": Parameter("kg", "Moving mass, Eq. (23)."),
    "B_e_N_s_m": Parameter("N s/m", "Damping, Eq. (23)."),
    "K_et_N_m": Parameter("N/m", "Spring, Eq. (23)."),
    "preload_N": Parameter("N", "Load force at rest."),
    "pressure_force_N_MPa": Parameter("N/MPa", "By how much it falls with the pressure drop."),
    "flow_force_N_mm_MPa": Parameter("N/(mm MPa)", "By how much it grows with pressure drop and opening."),
    "overlap_mm": Parameter("mm", "Travel before the edge opens."),
    "stroke_mm": Parameter("mm", "Travel to the stop."),
    "hysteresis_V": Parameter("V", "Play between current and force, as command."),
    "C_d_W_mm": Parameter("mm", "Discharge coefficient times area gradient, Eq. (24)."),
    "rho_kg_m3": Parameter("kg/m3", "Density, Eq. (24)."),
    "droop_MPa_L_min2": Parameter("MPa/(L/min)^2", "Pressure drop lost per flow squared."),
}


def plant_of(text: str, compensator: Compensator) -> Mapping[str, float] | None:
    """Return the plant of a setting, JSON of its parameters; None of an empty one.

    A plant behind a current controller is an `InputError`: its FMU takes the compare value as a duty.
    """
    if not text:
        return None
    if compensator.current_drive is not None:
        raise InputError(
            "--plant: the compensator controls the current, and the plant's FMU takes a duty; leave --plant out"
        )
    try:
        found = json.loads(text)
        plant = {name: float(found[name]) for name in PARAMETERS}
    except (ValueError, TypeError, KeyError) as error:
        raise InputError(f"the setting plant is no plant of {len(PARAMETERS)} parameters: {error}") from error
    if set(found) != set(PARAMETERS):
        raise InputError(f"the setting plant has other parameters: {', '.join(sorted(set(found) - set(PARAMETERS)))}")
    return plant


def plant_model(plant: Mapping[str, float], compensator: Compensator) -> Model:
    """Return what the FMU is called, and its variables."""
    found = list[Variable]()
    signals = compensator.signals

    def add(name: str, description: str, causality: Causality, *, kind: Kind = "real", **how: object) -> None:
        found.append(
            Variable(name=name, reference=1 + len(found), description=description, causality=causality, kind=kind,
                     **how)  # type: ignore[arg-type]
        )  # fmt: skip

    add("compare", f"PWM compare value, of {signals.compare_max}.", "input", kind="integer", start=0.0,
        range=(0.0, 65535.0))  # fmt: skip
    add("voltage", "Voltage at the amplifier's input, added to that of the PWM.", "input", unit="V", start=0.0)
    add("supply", "Pressure drop at no flow.", "input", unit="MPa", start=SUPPLY_MPA)
    add("back_pressure", "Pressure behind the edge.", "input", unit="MPa", start=BACK_MPA)
    for name, (unit, description) in PARAMETERS.items():
        add(name, description, "parameter", unit=unit, start=float(plant[name]))
    add("i", "Current of the coil.", "output", unit="A")
    add("x", "Position of the spool.", "output", unit="m")
    add("v", "Speed of the spool.", "output", unit="m/s")
    add("Q", "Flow.", "output", unit="L/min")
    add("dP", "Pressure drop over the edge.", "output", unit="MPa")
    add("p_ahead", "Pressure ahead of the edge.", "output", unit="MPa")
    add("p_behind", "Pressure behind the edge.", "output", unit="MPa")
    add("at_stop", "-1: the spool is held at its closed end, 1: at its open end, 0: it is free.", "output",
        kind="integer")  # fmt: skip
    return Model(
        identifier="dz_plant",
        title="dzdesign plant",
        description="Proportional valve by Eqs. (19)-(24): amplifier, coil, spool with stops and play, metering edge.",
        variables=tuple(found),
        step_s=1 / signals.tick_Hz,
        stop_s=STOP_S,
        units=compensator.valve.recorded_units,
    )


def plant_values(compensator: Compensator) -> Mapping[str, object]:
    """Return what the template prints."""
    return {
        "tick_Hz": compensator.signals.tick_Hz,
        "compare_max": compensator.signals.compare_max,
    }
