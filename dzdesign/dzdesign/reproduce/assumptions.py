"""What the paper does not state and `reproduce` takes for granted: each with its number, printed with the result."""

from typing import NamedTuple

from dzdesign.derivation.account.published import DP0_MPA, DROP_ASSUMED, LOAD_DP_MPA

#: Distance between the commands at which the valve opens and closes, V: that of the default plant, 1.5 % of full
#: command. The paper shows opening branches only.
HYSTERESIS_V = 0.15
#: Pressures downstream of the edge of Figs. 20 and 21, MPa: with the pressure drop, within the sensors' 20 MPa.
LOADS_MPA = (0.0, 15.0)


class Oil(NamedTuple):
    """Oil of Fig. 22: its temperature in °C, viscosity and density over those at the middle one."""

    temperature_C: float
    viscosity: float
    density: float


#: A mineral oil of 46 mm²/s at 40 °C, as ISO 3448 grades it: viscosity by its usual index of 100, density falling by
#: 0.65 kg/m³ per K.
OILS = (Oil(30, 1.59, 1.0076), Oil(40, 1.0, 1.0), Oil(50, 0.66, 0.9924))

ASSUMPTIONS = (
    f"hysteresis: none, and beside it {HYSTERESIS_V:g} V, with the opening branch as fitted; the paper shows no "
    "closing branch",
    "stop: of the first valve only, met at the reference pressure drop from 8.25 V of command on, the middle of "
    "what is printed",
    f"second valve: its other pressure drop is {DROP_ASSUMED.removeprefix('at ')}",
    f"paper's law at {LOAD_DP_MPA} MPa: Eq. (4) is a straight line through its two tests",
    f"loads of Figs. 20 and 21: {LOADS_MPA[0]:g} to {LOADS_MPA[1]:g} MPa behind the edge",
    "oil of Fig. 22: " + ", ".join(f"{oil.temperature_C:g}" for oil in OILS) + " °C, a mineral oil of 46 mm²/s",
    f"step of Fig. 8: at {DP0_MPA} MPa, with the default plant's dynamics",
)
