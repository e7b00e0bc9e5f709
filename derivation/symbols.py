"""The paper's symbols, each made once; the comment gives its meaning and unit.

The paper uses two names for two things each. They are kept apart here: ``u_0`` (compensation signal) and
``u_O`` (output of the compensator), which Eqs. (14) and (18) print alike; ``K_e`` (flow gain, Eq. 2) and
``K_a`` (gain of the proportional amplifier, which Eq. (19) calls K_e).
"""

import sympy


def _positive(names: str) -> tuple[sympy.Symbol, ...]:
    return sympy.symbols(names, positive=True)


def _real(names: str) -> tuple[sympy.Symbol, ...]:
    return sympy.symbols(names, real=True)


# Commands: V
u_i, u_O, u_0, u_no = _real("u_i u_O u_0 u_no")  # input; output; compensation at and off the reference
u_max, u_min, u_min0, u_min1 = _positive("u_max u_min u_min0 u_min1")  # full command; dead-zone thresholds
u_i_prime = sympy.Symbol("u_i'", nonnegative=True)  # command beyond the threshold, Fig. 3 and Eq. (11)

# Metering edge
C_d, W, rho = _positive("C_d W rho")  # discharge coefficient; area gradient, m; density, kg/m^3
x, x_max = _positive("x x_max")  # orifice opening, its maximum: m
k = sympy.Symbol("k", positive=True)  # command per opening, V/m, Eq. (11)

# Pressure drop: Pa; at no index, at the reference (0), off the reference (1)
dP, dP0, dP1 = _positive("dP dP0 dP1")
f = sympy.Function("f", positive=True)  # u_min = f(dP), Eq. (4): V

# Flow: m^3/s, and flow gain: m^3/s/V
Q, Q_O, Q_O_prime = _real("Q Q_O Q_O'")
Q_neg = sympy.Symbol("Q_neg", real=True)  # flow at the mirrored command
Q_max = sympy.Symbol("Q_max", positive=True)
K_e, K_0, K_1 = _positive("K_e K_0 K_1")
gamma_0, gamma_1 = _positive("gamma_0 gamma_1")  # flow per opening, m^2/s, Eqs. (8), (15)

beta = sympy.Symbol("beta", positive=True)  # correction coefficient, Eq. (5)
kappa = sympy.Symbol("kappa", positive=True)  # k x_max / u_max: share of the drive that full opening takes

# Distances that decide between the cases of Eqs. (1) and (7); where one may be zero, its case is closed
headroom = sympy.Symbol("headroom", nonnegative=True)  # from the valve's command up to full command: V
guard = sympy.Symbol("guard", positive=True)  # from the output at zero command up to the threshold: V
below = sympy.Symbol("below", nonnegative=True)  # dP0 - dP1: Pa
above = sympy.Symbol("above", positive=True)  # dP1 - dP0: Pa

# Plant, Eqs. (19)-(24)
u_e, u_if = _real("u_e u_if")  # output of the amplifier, feedback: V
i, di_dt = _real("i di_dt")  # coil current: A, A/s
f_e, f_eL = _real("f_e f_eL")  # solenoid force, load force: N
x_e, dx_e_dt, v, dv_dt = _real("x_e dx_e_dt v dv_dt")  # armature: m, m/s, m/s, m/s^2
K_a, K_fi, K_i = _positive("K_a K_fi K_i")  # amplifier gain; feedback, V/A; force per current, N/A
R_c, r_p, L_c = _positive("R_c r_p L_c")  # coil, ohm; internal, ohm; inductance, H
m_e, B_e, K_et = _positive("m_e B_e K_et")  # mass, kg; damping, N s/m; spring, N/m

# How the symbols are typeset where their name alone would not do.
LATEX_NAMES = {
    dP: r"\Delta P",
    dP0: r"\Delta P_{0}",
    dP1: r"\Delta P_{1}",
    u_i_prime: r"u_{i}'",
    Q_O_prime: r"Q_{O}'",
    Q_neg: r"Q_{-}",
    di_dt: r"\dot{i}",
    dx_e_dt: r"\dot{x}_{e}",
    dv_dt: r"\dot{v}",
}
