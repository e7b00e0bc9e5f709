"""The variables of the FMUs: one table each for the compensator and for the plant, from which C and XML are printed."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from dzdesign.design.compensator import Compensator

Kind = Literal["real", "integer", "boolean"]
Causality = Literal["input", "output", "parameter", "local"]
#: In C: who may set a variable of that causality.
SETTINGS: Mapping[str, str] = {"input": "ALWAYS", "parameter": "BEFORE_START"}


#: Of the core's 16 bits; beyond the converter's own none is valid.
LARGEST_CODE = 65535.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """One variable of an FMU."""

    name: str
    reference: int
    description: str
    causality: Causality
    kind: Kind = "real"
    #: Of `UNITS` in description.py; empty of what has none.
    unit: str = ""
    #: None of what is computed.
    start: float | None = None
    #: Changes at events only; so does every integer.
    discrete: bool = False
    #: Of a derivative the name of its state.
    derivative_of: str = ""
    #: Names of inputs and states that an output or a derivative follows at once.
    follows: tuple[str, ...] = ()
    #: A continuous state: its start is its first value, and its size this much.
    nominal: float | None = None
    #: Least and largest value.
    range: tuple[float, float] | None = None
    #: A command as it was recorded, which has a unit and a zero of its own; any other voltage is one.
    command: bool = False

    @property
    def symbol(self) -> str:
        """Name of its value reference in C."""
        inner = self.name.removeprefix("der(").removesuffix(")")
        return f"V_DER_{inner.upper()}" if self.derivative_of else f"V_{inner.upper()}"

    @property
    def setting(self) -> str:
        """Who may set it, in C."""
        return "BEFORE_START" if self.nominal is not None else SETTINGS.get(self.causality, "NEVER")

    @property
    def c_start(self) -> str:
        """Return its first value in C."""
        return repr(float(self.start or 0.0))

    @property
    def c_ends(self) -> str:
        """Return the least and the largest number that it may be set to, in C."""
        if self.kind == "real":
            return "-LARGEST_REAL, LARGEST_REAL"
        least, largest = self.range or ((-(2.0**31), 2.0**31 - 1) if self.kind == "integer" else (0.0, 1.0))
        return f"{least!r}, {largest!r}"

    @property
    def variability(self) -> str:
        """Return it as FMI names it."""
        if self.causality == "parameter":
            return "fixed"
        return "discrete" if self.discrete or self.kind != "real" else "continuous"


def compensator_variables(compensator: Compensator) -> tuple[Variable, ...]:
    """Return the variables of a compensator's FMU; of two solenoids the law's outputs are there for either."""
    c, found = compensator, list[Variable]()
    signals, command = c.signals, c.signals.command
    u_max, two = float(c.u_max_V), len(signals.signs) == 2
    volts = ("u_i", "p_A", "p_B")
    inputs = (*volts, "u_i_code", "p_A_code", "p_B_code")

    def add(name: str, description: str, causality: Causality, **how: object) -> None:
        found.append(
            Variable(name=name, reference=1 + len(found), description=description, causality=causality, **how)  # type: ignore[arg-type]
        )

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
        unit, full = full_output(compensator)
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
    return tuple(found)


def full_output(compensator: Compensator) -> tuple[str, float]:
    """Return unit and size of the law's output at full drive: the command, or the current that is controlled."""
    if (drive := compensator.current_drive) is not None:
        return "A", float(drive.circuit.rated_A)
    return "V", float(compensator.u_max_V)
