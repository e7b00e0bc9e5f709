"""The compensator's FMU as a model: its variables, and what its template prints.

Its core is word for word that of the firmware.
"""

from collections.abc import Mapping
from typing import Any

from dzdesign.codegen.calibration.files import core_headers, core_sources
from dzdesign.codegen.fmu.description import Causality, Kind, Model, Variable
from dzdesign.codegen.project import generate
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.design.compensator import Compensator

#: The library for a PC: it takes the scalings of any compensator.
TARGET = "host"
#: Of the core's 16 bits; beyond the converter's own none is valid.
LARGEST_CODE = 65535.0


def compensator_model(compensator: Compensator) -> Model:
    """Return what the FMU is called, and its variables."""
    made = generate(compensator, TARGET).files
    names = (*core_headers(block=False, current=False), *core_sources(block=False, current=False))
    return Model(
        description=f"Dead-zone compensator of a proportional valve, law {compensator.law}: the firmware's integers.",
        variables=_compensator_variables(compensator),
        step_s=1 / compensator.signals.tick_Hz,
        units=compensator.valve.recorded_units,
        values=_compensator_values(compensator),
        core={name: made[f"core/{name}"].encode() for name in names},
        document=to_json_bytes(compensator),
    )


class _Table:
    """The variables of a model, numbered as they are added."""

    def __init__(self) -> None:
        self.variables: list[Variable] = []

    def add(self, name: str, description: str, causality: Causality, *, kind: Kind = "real", **how: Any) -> None:
        """Add a variable."""
        reference = 1 + len(self.variables)
        self.variables.append(
            Variable(
                name=name, reference=reference, description=description, causality=causality, kind=kind, **how
            )
        )


def _compensator_variables(compensator: Compensator) -> tuple[Variable, ...]:
    """Return the variables of a compensator's FMU; of two solenoids the law's outputs are there for either."""
    c, table = compensator, _Table()
    signals, command, add = c.signals, c.signals.command, table.add
    u_max, two = float(c.u_max_V), len(signals.signs) == 2
    inputs = ("u_i", "p_A", "p_B", "u_i_code", "p_A_code", "p_B_code")
    add("u_i", f"Command, {-u_max if two else 0.0:g} to {u_max:g} V.", "input", unit="V", start=0.0, command=True)
    add("p_A", "Pressure ahead of the metering edge, for positive command.", "input", unit="MPa", start=0.0)
    add("p_B", "Pressure behind it.", "input", unit="MPa", start=0.0)
    for name, what, zero in (
        ("u_i_code", "command", command.zero_code),
        ("p_A_code", "pressure sensor A", signals.pressure_a.zero_code),
        ("p_B_code", "pressure sensor B", signals.pressure_b.zero_code),
    ):
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
        add(f"beta{end}", f"Beta that the law uses{side}.", "output", follows=inputs[1:3] + inputs[4:])
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

    a, b = signals.pressure_a, signals.pressure_b
    return {
        "suffixes": ["" if sign > 0 else "_negative" for sign in signals.signs],
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
        "a_zero": a.zero_code,
        "a_codes": per_MPa(a.zero_code, a.full_code, float(a.span_MPa)),
        "b_zero": b.zero_code,
        "b_codes": per_MPa(b.zero_code, b.full_code, float(b.span_MPa)),
    }
