"""The two FMUs as models: their variables, and what their templates print.

The compensator's core is word for word that of the firmware. The plant is amplifier, coil, spool and edge by Eqs.
(19)-(24), with parameters that the importer may change; `verify` simulates the same equations in a text of its own, and
this one stands in ``templates/plant.c.jinja``.
"""

import json
from collections.abc import Mapping
from typing import Any

from dzdesign.codegen.calibration.files import core_headers, core_sources
from dzdesign.codegen.fmu.description import Causality, Kind, Model, Variable
from dzdesign.codegen.project import generate
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.pressure_inputs import what_machine_switches
from dzdesign.design.signals import SIDE_NAMES

#: Of a default experiment, s.
STOP_S, PLANT_STOP_S = 10.0, 1.0
#: The library for a PC: it takes the scalings of any compensator.
TARGET = "host"
#: Of the core's 16 bits; beyond the converter's own none is valid.
LARGEST_CODE = 65535.0
#: Pressures of a bench, MPa: where nothing is set, the spring alone would hold the valve at no pressure drop.
SUPPLY_MPA, BACK_MPA = 1.0, 1.0
#: Unit and meaning of each parameter of the plant, by its name in plant.toml.
PARAMETERS: Mapping[str, tuple[str, str]] = {
    "u_max_V": ("V", "Command at which the PWM is fully on."),
    "K_a": ("", "Amplifier gain, Eq. (19)."),
    "K_fi_V_A": ("V/A", "Current feedback, Eq. (21)."),
    "R_c_ohm": ("ohm", "Resistance of the coil, Eq. (20)."),
    "r_p_ohm": ("ohm", "Internal resistance of the amplifier, Eq. (20)."),
    "L_c_H": ("H", "Inductance of the coil, Eq. (20)."),
    "K_i_N_A": ("N/A", "Force of the solenoid per current, Eq. (22)."),
    "m_e_kg": ("kg", "Moving mass, Eq. (23)."),
    "B_e_N_s_m": ("N s/m", "Damping, Eq. (23)."),
    "K_et_N_m": ("N/m", "Spring, Eq. (23)."),
    "preload_N": ("N", "Load force at rest."),
    "pressure_force_N_MPa": ("N/MPa", "By how much it falls with the pressure drop."),
    "flow_force_N_mm_MPa": ("N/(mm MPa)", "By how much it grows with pressure drop and opening."),
    "overlap_mm": ("mm", "Travel before the edge opens."),
    "stroke_mm": ("mm", "Travel to the stop."),
    "hysteresis_V": ("V", "Play between current and force, as command."),
    "hysteresis_lag_s": ("s", "Lag of that play, which widens it with the rate."),
    "C_d_W_mm": ("mm", "Discharge coefficient times area gradient, Eq. (24)."),
    "rho_kg_m3": ("kg/m3", "Density, Eq. (24)."),
    "droop_MPa_L_min2": ("MPa/(L/min)^2", "Pressure drop lost per flow squared."),
}


def compensator_model(compensator: Compensator) -> Model:
    """Return what the FMU is called, and its variables."""
    made = generate(compensator, TARGET).files
    names = (*core_headers(block=False, current=False), *core_sources(block=False, current=False))
    return Model(
        identifier="dz_compensator",
        title="dzdesign compensator",
        description=f"Dead-zone compensator of a proportional valve, law {compensator.law}: the firmware's integers. "
        f"{what_machine_switches(compensator)}".strip(),
        variables=_compensator_variables(compensator),
        exchange=True,
        step_s=1 / compensator.signals.tick_Hz,
        stop_s=STOP_S,
        units=compensator.valve.recorded_units,
        template="compensator.c.jinja",
        values=_compensator_values(compensator),
        core={name: made[f"core/{name}"].encode() for name in names},
        extra={Compensator.FILE_NAME: to_json_bytes(compensator)},
    )


class _Table:
    """The variables of a model, numbered as they are added."""

    def __init__(self) -> None:
        self.variables: list[Variable] = []

    def add(self, name: str, description: str, causality: Causality, *, kind: Kind = "real", **how: Any) -> None:
        """Add a variable."""
        reference = 1 + len(self.variables)
        self.variables.append(
            Variable(name=name, reference=reference, description=description, causality=causality, kind=kind, **how)
        )


def _compensator_variables(compensator: Compensator) -> tuple[Variable, ...]:
    """Return the variables of a compensator's FMU; of two solenoids the law's outputs are there for either."""
    c, table = compensator, _Table()
    signals, command, add = c.signals, c.signals.command, table.add
    u_max, two = float(c.u_max_V), len(signals.signs) == 2
    names = [f"p_{name}" for name in signals.pressures]
    inputs = ("u_i", *names, "u_i_code", *(f"{name}_code" for name in names))
    add("u_i", f"Command, {-u_max if two else 0.0:g} to {u_max:g} V.", "input", unit="V", start=0.0, command=True)
    for name in signals.pressures:
        add(f"p_{name}", f"Pressure {_of_edges(compensator, name)}.", "input", unit="MPa", start=0.0)
    codes = {"u_i_code": ("command", command.zero_code)}
    codes |= {
        f"p_{name}_code": (f"pressure sensor {name}", sensor.zero_code) for name, sensor in signals.pressures.items()
    }
    for name, (what, zero) in codes.items():
        add(name, f"Converter code of the {what}, where codes is true.", "input", kind="integer",
            start=float(zero), range=(0.0, LARGEST_CODE))  # fmt: skip
    add("codes", "True: the inputs are the converter's codes; false: V and MPa, which an ideal converter reads.",
        "parameter", kind="boolean", start=0.0)  # fmt: skip
    for sign in signals.signs:
        end, side = ("", "") if sign > 0 else ("_negative", ", for negative commands")
        unit, full = _full_output(compensator)
        what = "Set point of the current" if unit == "A" else "What the law drives the valve with"
        # The negative side counts from zero outwards: a reading that is not zero at zero command falls there.
        recorded = unit == "V" and (sign > 0 or c.valve.recorded_units.command.at_zero == 0)
        add(f"u_O{end}", f"{what}{side}: compare{end} in {unit}, {full:g} {unit} at {signals.compare_max}.", "output",
            unit=unit, follows=inputs, command=recorded)  # fmt: skip
        own = [f"p_{name}" for name in signals.pair(sign).names]
        read = (*own, "u_i_code", *(f"{name}_code" for name in own))
        add(f"beta{end}", f"Beta that the law uses{side}.", "output", follows=tuple(n for n in inputs if n in read))
        add(f"compare{end}", f"PWM compare value of the law{side}, of {signals.compare_max}; changes at events.",
            "output", kind="integer", follows=inputs)  # fmt: skip
        add(f"status{end}", f"What there is to say of the inputs{side}, DZ_STATUS_... of dz_comp.h.", "output",
            kind="integer", follows=inputs)  # fmt: skip
    each = f"set at every PWM period, {signals.tick_Hz} a second"
    add("compare_a", f"PWM compare value of the drive for solenoid A, {each}.", "output", kind="integer", start=None)
    add("compare_b", f"The same for solenoid B, {each}; 0 where there is none.", "output", kind="integer")
    add("drive_status", "What the drive says of its inputs, DZ_STATUS_... of dz_drive.h; 0: all valid, and used.",
        "output", kind="integer")  # fmt: skip
    return tuple(table.variables)


def _of_edges(compensator: Compensator, name: str) -> str:
    """Say of which sides' edges a pressure is ahead or behind."""
    signals = compensator.signals
    found = [
        f"{place} the metering edge at {SIDE_NAMES[sign]} commands"
        for sign in signals.signs
        for place, each in zip(("ahead of", "behind"), signals.pair(sign).names, strict=True)
        if each == name
    ]
    return ", ".join(found)


def _full_output(compensator: Compensator) -> tuple[str, float]:
    """Return unit and size of the law's output at full drive: the command, or the current that is controlled."""
    if (drive := compensator.current_drive) is not None:
        return "A", float(drive.circuit.rated_A)
    return "V", float(compensator.u_max_V)


def _compensator_values(compensator: Compensator) -> Mapping[str, object]:
    """Return what the template prints."""
    signals, command = compensator.signals, compensator.signals.command

    def codes(sign: int) -> str:
        return repr(float(sign * command.direction(sign) * (command.span(sign) + 1)))

    def per_MPa(zero: int, full: int, span: float) -> str:
        return repr((full - zero + 1) / span)

    return {
        "bipolar": len(signals.signs) == 2,
        "tick_Hz": signals.tick_Hz,
        "ticks_per_sample": signals.tick_Hz // signals.sample_Hz,
        "code_max": signals.code_max,
        "compare_max": signals.compare_max,
        "u_max": repr(float(compensator.u_max_V)),
        "full_output": repr(_full_output(compensator)[1]),
        "command_zero": command.zero_code,
        "positive_codes": codes(1),
        "negative_codes": codes(-1) if len(signals.signs) == 2 else "",
        # By the name of the input: code without pressure, and codes per MPa.
        "pressures": {
            name: (sensor.zero_code, per_MPa(sensor.zero_code, sensor.full_code, float(sensor.span_MPa)))
            for name, sensor in signals.pressures.items()
        },
        "sides": {
            "" if sign > 0 else "_negative": ", ".join(f"codes.{name.lower()}" for name in signals.pair(sign).names)
            for sign in signals.signs
        },
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
    table, signals = _Table(), compensator.signals
    add = table.add
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
        variables=tuple(table.variables),
        step_s=1 / signals.tick_Hz,
        stop_s=PLANT_STOP_S,
        units=compensator.valve.recorded_units,
        template="plant.c.jinja",
        values={"tick_Hz": signals.tick_Hz, "compare_max": signals.compare_max},
        extra={"plant.json": (json.dumps(dict(plant), indent=2) + "\n").encode()},
    )
