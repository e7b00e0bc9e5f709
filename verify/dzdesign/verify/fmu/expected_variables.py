"""The variables that an FMU must have, and how each must be described."""

from collections.abc import Mapping
from dataclasses import dataclass

from dzdesign.design.compensator import Compensator

#: Inputs of a compensator, and those of them that beta follows.
VOLTS, CODES = ("u_i", "p_A", "p_B"), ("u_i_code", "p_A_code", "p_B_code")
ALL_INPUTS = frozenset((*VOLTS, *CODES))
PRESSURES = ALL_INPUTS - {"u_i", "u_i_code"}
#: Codes and compare values are of 16 bits.
SIXTEEN_BITS = {"min": "0", "max": "65535"}
#: The plant's parameter to its unit: that which its name ends in.
OF_PARAMETERS: Mapping[str, str] = {
    "u_max_V": "V", "K_a": "", "K_fi_V_A": "V/A", "R_c_ohm": "ohm", "r_p_ohm": "ohm", "L_c_H": "H", "K_i_N_A": "N/A",
    "m_e_kg": "kg", "B_e_N_s_m": "N s/m", "K_et_N_m": "N/m", "preload_N": "N", "pressure_force_N_MPa": "N/MPa",
    "flow_force_N_mm_MPa": "N/(mm MPa)", "overlap_mm": "mm", "stroke_mm": "mm", "hysteresis_V": "V", "C_d_W_mm": "mm",
    "rho_kg_m3": "kg/m3", "droop_MPa_L_min2": "MPa/(L/min)^2",
}  # fmt: skip
STATES = {"i": ("A", "1.0"), "x": ("m", "0.001"), "v": ("m/s", "0.1")}


@dataclass(frozen=True, slots=True, kw_only=True)
class Expected:
    """A variable as it must be described."""

    kind: str = "real"
    causality: str = "output"
    unit: str = ""
    #: None of what is computed.
    start: float | None = None
    #: Of an output or a rate: what it follows at once.
    follows: frozenset[str] = frozenset()
    derivative_of: str = ""
    #: Further attributes.
    others: Mapping[str, str] | None = None
    #: Shown as the command of this side was recorded; 0: it is not a command.
    command: int = 0

    @property
    def variability(self) -> str:
        """When it changes."""
        if self.causality == "parameter":
            return "fixed"
        return "continuous" if self.kind == "real" else "discrete"


def of_compensator(compensator: Compensator) -> dict[str, Expected]:
    """Return the variables of a compensator's FMU."""
    signals, drive = compensator.signals, compensator.current_drive
    zeros = (signals.command.zero_code, signals.pressure_a.zero_code, signals.pressure_b.zero_code)
    found = {
        "u_i": Expected(causality="input", unit="V", start=0.0, command=1),
        "p_A": Expected(causality="input", unit="MPa", start=0.0),
        "p_B": Expected(causality="input", unit="MPa", start=0.0),
        "codes": Expected(kind="boolean", causality="parameter", start=0.0),
    }
    for name, zero in zip(CODES, zeros, strict=True):
        found[name] = Expected(kind="integer", causality="input", start=zero, others=SIXTEEN_BITS)
    for sign in signals.signs:
        end = "" if sign > 0 else "_negative"
        unit, command = ("V", sign) if drive is None else ("A", 0)
        found[f"u_O{end}"] = Expected(unit=unit, follows=ALL_INPUTS, command=command)
        found[f"beta{end}"] = Expected(follows=PRESSURES)
        found[f"compare{end}"] = found[f"status{end}"] = Expected(kind="integer", follows=ALL_INPUTS)
    return found | dict.fromkeys(("compare_a", "compare_b", "drive_status"), Expected(kind="integer"))


def of_plant(plant: Mapping[str, float]) -> dict[str, Expected]:
    """Return the variables of a plant's FMU."""
    moved = frozenset({"i", "x", "v", "supply"})
    flow = frozenset({"x", "supply"})
    found = {
        "compare": Expected(kind="integer", causality="input", start=0.0, others=SIXTEEN_BITS),
        "voltage": Expected(causality="input", unit="V", start=0.0),
        "supply": Expected(causality="input", unit="MPa", start=1.0),
        "back_pressure": Expected(causality="input", unit="MPa", start=1.0),
        "Q": Expected(unit="L/min", follows=flow),
        "dP": Expected(unit="MPa", follows=flow),
        "p_ahead": Expected(unit="MPa", follows=flow | {"back_pressure"}),
        "p_behind": Expected(unit="MPa", follows=frozenset({"back_pressure"})),
        "at_stop": Expected(kind="integer"),
    }
    for name, unit in OF_PARAMETERS.items():
        found[name] = Expected(causality="parameter", unit=unit, start=plant[name])
    for name, (unit, nominal) in STATES.items():
        others = {"initial": "exact", "nominal": nominal}
        found[name] = Expected(unit=unit, start=0.0, follows=frozenset({name}), others=others)
    for state, unit, follows in (("i", "A/s", {"i", "compare", "voltage"}), ("x", "m/s", {"v"}), ("v", "m/s2", moved)):
        found[f"der({state})"] = Expected(
            causality="local", unit=unit, follows=frozenset(follows), derivative_of=state
        )
    return found
