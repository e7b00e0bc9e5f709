"""Every symbol of the account, declared once: its sign, its unit, its meaning and, where the name does not spell it,
its look.

The paper uses three names for two things each. They are kept apart here: ``u_0`` (compensation signal) and
``u_O`` (output of the compensator), which Eqs. (14) and (18) print alike; ``K_e`` (flow gain, Eq. 2) and
``K_a`` (gain of the proportional amplifier, which Eq. (19) calls K_e); ``u_i'`` (command beyond the threshold,
Eq. 11) and ``n_i`` (code of the command, which Eq. (29) calls u_i').
"""

import re
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import sympy
from sympy.core.function import AppliedUndef

#: A symbol, or a Laplace transform such as I(s).
Name: TypeAlias = sympy.Symbol | sympy.core.function.AppliedUndef


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """What is known of a symbol."""

    #: Such as ``m**3/s/V``; counts are ``code``.
    unit: str
    #: In a few words, which may name other symbols.
    meaning: str
    #: How it looks, where its name does not spell it.
    latex: str = ""


QUANTITIES: dict[Name, Quantity] = {}
#: Units in others of the same kind, as if metre, kilogram, second, ampere and count were other ones than they are.
_METRE, _KILOGRAM, _SECOND, _AMPERE, _COUNT = 1.3, 0.7, 1.9, 0.6, 2.3
_NEWTON = _KILOGRAM * _METRE / _SECOND**2
_VOLT = _NEWTON * _METRE / _SECOND / _AMPERE
_RESCALED = {
    "m": _METRE, "kg": _KILOGRAM, "s": _SECOND, "A": _AMPERE, "code": _COUNT, "N": _NEWTON, "Pa": _NEWTON / _METRE**2,
    "V": _VOLT, "ohm": _VOLT / _AMPERE, "H": _VOLT * _SECOND / _AMPERE, "dimensionless": 1.0,
}  # fmt: skip


def _declare(name: Name, unit: str, meaning: str, **more: Any) -> Any:
    QUANTITIES[name] = Quantity(unit=unit, meaning=meaning, **more)
    return name


def _symbol(name: str, unit: str, meaning: str, *, latex: str = "", **sign: bool) -> sympy.Symbol:
    return _declare(sympy.Symbol(name, **sign), unit, meaning, latex=latex)


_positive = partial(_symbol, positive=True)
_nonnegative = partial(_symbol, nonnegative=True)
_real = partial(_symbol, real=True)
_FLOW = "m**3/s"

# Codes in the compensator, Eqs. (29)-(32), and ratios
scale = _positive("lambda", "dimensionless", "factor between two valves of the same flow", latex=r"\lambda")
n_full = _positive("n_full", "code", "compare value of full command")
n_adc = _positive("n_adc", "code", "largest code of the converter")
n_V = _positive("n_V", "code/V", "counts per volt, 1365 in the paper")
K_c = _real("K_c", "V/code", "conversion coefficient (Eq. 32)")
n = _positive("n", "dimensionless", "exponent of flow over pressure drop")
beta = _positive("beta", "dimensionless", "correction coefficient, $u_min1 / u_min0$ (Eq. 5)")
beta_o = _positive(
    "beta_o", "dimensionless", "offset of the opening threshold over $u_min0$; $beta$ is the closing one's"
)
share = _nonnegative("share", "dimensionless", "part of the transition that the command has passed")
kappa = _positive("kappa", "dimensionless", "$k x_max / u_max$")
slope = _real("slope", "dimensionless", "output per input of the compensator")
duty = _real("duty", "dimensionless", "duty cycle")

# Metering edge
gamma_0 = _positive("gamma_0", "m**2/s", "flow per opening at the reference")
gamma_1 = _positive("gamma_1", "m**2/s", "flow per opening at $dP1$")
C_d = _positive("C_d", "dimensionless", "discharge coefficient")
W = _positive("W", "m", "area gradient of the edge")
rho = _positive("rho", "kg/m**3", "density of the oil")

# Plant, Eqs. (19)-(24)
K_a = _positive("K_a", "dimensionless", "gain of the amplifier, $K_e$ in the paper's (19)")
K_i = _positive("K_i", "N/A", "force per current")
K_fi = _positive("K_fi", "V/A", "gain of the current feedback")
K_0 = _positive("K_0", f"{_FLOW}/V", "flow gain at the reference")
K_1 = _positive("K_1", f"{_FLOW}/V", "flow gain at $dP1$")
K_e = _positive("K_e", f"{_FLOW}/V", "flow gain: flow per command (Eq. 2)")
L_c = _positive("L_c", "H", "inductance of the coil")
R_c = _positive("R_c", "ohm", "resistance of the coil")
r_p = _positive("r_p", "ohm", "internal resistance of the amplifier")
m_e = _positive("m_e", "kg", "mass of the armature")
B_e = _positive("B_e", "N*s/m", "damping of the armature")
K_et = _positive("K_et", "N/m", "stiffness of the spring")
G_0 = _positive("G_0", f"{_FLOW}/V", "static gain of the transfer function")

# Flow per command beyond the threshold, command per opening, flows, openings
s_flow = _positive("S", f"{_FLOW}/V", "flow per command beyond the threshold")
s_flow0 = _positive("S_0", f"{_FLOW}/V", "flow per command beyond the threshold, at $dP0$")
s_flow1 = _positive("S_1", f"{_FLOW}/V", "flow per command beyond the threshold, at $dP1$")
k = _positive("k", "V/m", "command per opening beyond the threshold (Eq. 11)")
Q_max = _positive("Q_max", _FLOW, "largest flow")
Q_max0 = _positive("Q_max0", _FLOW, "largest flow at $dP0$")
Q_max1 = _positive("Q_max1", _FLOW, "largest flow at $dP1$")
Q_floor = _positive("Q_floor", _FLOW, "least flow that the meter shows")
Q = _real("Q", _FLOW, "flow")
Q_w = _real("Q_w", _FLOW, "wanted flow at the present pressure drop")
Q_O = _real("Q_O", _FLOW, "wanted flow at the reference")
Q_O_prime = _real("Q_O'", _FLOW, "wanted flow off the reference")
Q_neg = _real("Q_neg", _FLOW, "flow at the opposite command", latex="Q_{-}")
Q_scaled = _real("Q_scaled", _FLOW, "flow of the other valve")
Q_1 = _real("Q_1", _FLOW, "flow of a first sample")
Q_2 = _real("Q_2", _FLOW, "flow of a second sample")
V_pin = _real("V_pin", "V", "voltage at the converter's pin")
V_adc = _positive("V_adc", "V", "full scale of the converter")
x = _nonnegative("x", "m", "opening of the edge")
x_max = _positive("x_max", "m", "largest opening")
x_ov = _nonnegative("x_ov", "m", "overlap of the spool")
q_x = _positive("q_x", "V", "$k x_max$, the command that full opening takes")

# Pressure drop: at no index, at the reference (0), off the reference (1)
dP = _positive("dP", "Pa", "pressure drop across the edge", latex=r"\mathrm{\Delta} P")
dP0 = _positive("dP0", "Pa", "pressure drop at the reference", latex=r"\mathrm{\Delta} P_{0}")
dP1 = _positive("dP1", "Pa", "a pressure drop off the reference", latex=r"\mathrm{\Delta} P_{1}")
f = sympy.Function("f", positive=True)
_declare(f(dP), "V", "threshold as a function of the pressure drop (Eq. 4)")

# Time, and the Laplace transform of Eqs. (25)-(28)
t = _positive("t", "s", "time")
s = _positive("s", "1/s", "variable of the Laplace transform")
a = _real("a", "1/s", "half the rate at which a drifting pressure drop falls")
i_init = _real("i(0)", "A", "current at $t = 0$", latex="i(0)")
x_init = _real("x_e(0)", "m", "travel at $t = 0$", latex="x_{e}(0)")
v_init = _real("v(0)", "m/s", "speed at $t = 0$", latex="v(0)")

# Thresholds, and the command as a meter sees it
u_min = _positive("u_min", "V", "threshold of the dead zone")
u_min0 = _positive("u_min0", "V", "threshold at the reference")
u_min1 = _positive("u_min1", "V", "threshold at $dP1$")
u_seen = _positive("u_seen", "V", "command at which the meter first shows flow")
u_seen0 = _positive("u_seen0", "V", "command at which the meter first shows flow, at $dP0$")
u_seen1 = _positive("u_seen1", "V", "command at which the meter first shows flow, at $dP1$")
u_max = _positive("u_max", "V", "full command")
u_z = _positive("u_z", "V", "end of the zero band")
u_t = _positive("u_t", "V", "end of the transition")
u_dz = _real("u_dz", "V", "dead zone that is left")
drive_left = _real("drive_left", "V", "drive that is not used at full command")
jump = _real("jump", "V", "step of the output where $dP$ passes $dP0$")
fall = _real("fall", "V", "fall of the threshold as the meter shows it")

# Distances that decide between the cases of Eqs. (1) and (7); where one may be zero, its case is closed
y = _nonnegative("y", "V", "from the threshold up to the command")
rest = _positive("rest", "V", "from the command up to that of full opening")
headroom = _nonnegative("headroom", "V", "from the valve's command up to full command")
excess = _positive("excess", "V", "by how much a threshold is exceeded")
guard = _positive("guard", "V", "by how much a threshold is not reached")
below = _nonnegative("below", "Pa", "$dP0 - dP1$, zero or more")
width = _positive("width", "V", "$u_t - u_z$, more than zero")
above = _positive("above", "Pa", "$dP1 - dP0$, more than zero")

# What varies: the plant's state and its transforms, ...
dv_dt = _real("dv_dt", "m/s**2", "rate of the armature's speed", latex=r"\frac{\mathrm{d}v}{\mathrm{d}t}")
dx_e_dt = _real("dx_e_dt", "m/s", "rate of the armature's travel", latex=r"\frac{\mathrm{d}x_{e}}{\mathrm{d}t}")
v = _real("v", "m/s", "speed of the armature")
x_e = _real("x_e", "m", "travel of the armature")
f_e = _real("f_e", "N", "force of the solenoid")
f_eL = _real("f_eL", "N", "force of the load")
di_dt = _real("di_dt", "A/s", "rate of the coil's current", latex=r"\frac{\mathrm{d}i}{\mathrm{d}t}")
i = _real("i", "A", "current of the coil")
u_e = _real("u_e", "V", "output of the amplifier")
u_if = _real("u_if", "V", "feedback of the current")


def _transform(name: str, unit: str, meaning: str) -> Any:
    # A transform is an integral over time.
    return _declare(sympy.Function(name)(s), unit, meaning)


X_e = _transform("X_e", "m*s", "transform of $x_e$")
F_e = _transform("F_e", "N*s", "transform of $f_e$")
F_eL = _transform("F_eL", "N*s", "transform of $f_eL$")
U_e = _transform("U_e", "s*V", "transform of $u_e$")
U_i = _transform("U_i", "s*V", "transform of $u_i$")
U_if = _transform("U_if", "s*V", "transform of $u_if$")
I_s = _transform("I", "A*s", "transform of i")
Q_s = _transform("Q", "m**3", "transform of $Q$")
G = _transform("G", f"{_FLOW}/V", "transfer function from command to flow")

# ... what an identification differentiates, ...
dQ_dC_d = _real("dQ_dC_d", _FLOW, "sensitivity of the flow to $C_d$", latex=r"\frac{\partial Q}{\partial C_{d}}")
dQ_dk = _real("dQ_dk", "m**4/s/V", "sensitivity of the flow to $k$", latex=r"\frac{\partial Q}{\partial k}")
dQ_dx_max = _real(
    "dQ_dx_max", "m**2/s", "sensitivity of the flow to $x_max$", latex=r"\frac{\partial Q}{\partial x_{\text{max}}}"
)

# ... and commands, last in a product
u_O = _real("u_O", "V", "output of the compensator")
u_above = _real("u_above", "V", "output just above $dP0$")
u_below = _real("u_below", "V", "output at $dP0$")
u_0 = _real("u_0", "V", "compensation signal at the reference")
u_no = _real("u_no", "V", "compensation signal off the reference")
u_i_prime = _nonnegative("u_i'", "V", "command beyond the threshold (Fig. 3, Eq. 11)")
u_1 = _real("u_1", "V", "command of the first sample")
u_2 = _real("u_2", "V", "command of the second sample")
u_i = _real("u_i", "V", "command, the compensator's input; in (1) the valve's input")
n_pwm = _real("n_O", "code", "code of the output")
n_i = _real("n_i", "code", "code of the command (Eq. 29)")
n_0 = _real("n_0", "code", "code of the compensation signal at the reference")
n_no = _real("n_no", "code", "code of the compensation signal off the reference")

#: What depends on the pressure drop: its name at the present one, at dP0 and at dP1.
AT_PRESSURE_DROPS: dict[Name, tuple[Name, Name]] = {
    dP: (dP0, dP1),
    u_min: (u_min0, u_min1),
    u_seen: (u_seen0, u_seen1),
    K_e: (K_0, K_1),
    Q_max: (Q_max0, Q_max1),
    Q_w: (Q_O, Q_O_prime),
    s_flow: (s_flow0, s_flow1),
}


def unit_of(name: Name) -> str:
    """Return the unit of a symbol; X_e(s + a) has that of X_e(s), and f(dP1) that of f(dP). KeyError if it has none."""
    if isinstance(name, AppliedUndef):
        name = name.func(dP if name.func == f else s)
    return QUANTITIES[name].unit


def print_unit(name: Name) -> str:
    """Return the unit of a symbol as a person writes it.

    Examples
    --------
    >>> print_unit(Q), print_unit(beta)
    ('m^3/s', '1')
    """
    return unit_of(name).replace("**", "^").replace("code", "counts").replace("dimensionless", "1")


def rescaled(name: Name) -> float:
    """Return what one unit of a symbol is in other units."""
    grown = 1.0
    for sign, unit, power in re.findall(r"([*/]?)([a-zA-Z]+)(?:\*\*(\d))?", unit_of(name)):
        factor = _RESCALED[unit] ** float(power or 1)
        grown = grown / factor if sign == "/" else grown * factor
    return grown
