"""The paper's symbols, each made once; the comment gives its meaning and unit.

The paper uses three names for two things each. They are kept apart here: ``u_0`` (compensation signal) and
``u_O`` (output of the compensator), which Eqs. (14) and (18) print alike; ``K_e`` (flow gain, Eq. 2) and
``K_a`` (gain of the proportional amplifier, which Eq. (19) calls K_e); ``u_i'`` (command beyond the threshold,
Eq. 11) and ``n_i`` (code of the command, which Eq. (29) calls u_i').
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
x = sympy.Symbol("x", nonnegative=True)  # orifice opening: m
x_max = sympy.Symbol("x_max", positive=True)  # its maximum: m
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

Q_max0, Q_max1 = _positive("Q_max0 Q_max1")  # largest flow at dP0 and at dP1
n = sympy.Symbol("n", positive=True)  # exponent of flow over pressure drop
slope, jump, u_dz, duty = _real("slope jump u_dz duty")  # du_O/du_i; step of u_O at dP0; dead zone that is left, V
drive_left, fall = _real("drive_left fall")  # drive not used at full command; of the threshold, seemingly: V
u_above, u_below = _real("u_above u_below")  # u_O just above and just below dP0: V

# A flow meter that shows nothing below a floor
Q_floor, u_seen, u_seen0, u_seen1 = _positive("Q_floor u_seen u_seen0 u_seen1")
s_flow, s_flow0, s_flow1 = _positive("S S_0 S_1")  # flow per command beyond the threshold: m^3/s/V
q_x = sympy.Symbol("q_x", positive=True)  # k x_max, the command that full opening takes: V

# Identifiability: a valve with other parameters and the same flow; derivatives of the flow by parameters
scale = sympy.Symbol("lambda", positive=True)
Q_scaled = sympy.Symbol("Q_scaled", real=True)
dQ_dC_d, dQ_dk, dQ_dx_max = _real("dQ_dC_d dQ_dk dQ_dx_max")
Q_1, Q_2, u_1, u_2 = _real("Q_1 Q_2 u_1 u_2")  # two samples

# Codes in the compensator, Eqs. (29)-(32): counts
n_i, n_0, n_no, n_pwm = _real("n_i n_0 n_no n_O")  # command; compensation at and off the reference; compare value
n_adc, n_V, n_full = _positive("n_adc n_V n_full")  # full scale; per volt, 1365 in the paper; compare value of u_max
V_pin = sympy.Symbol("V_pin", real=True)  # at the converter's pin: V
V_adc = sympy.Symbol("V_adc", positive=True)  # full scale of the converter: V
K_c = sympy.Symbol("K_c", real=True)  # conversion coefficient, Eq. (32): V per count

# Distances that decide between the cases of Eqs. (1) and (7); where one may be zero, its case is closed
headroom = sympy.Symbol("headroom", nonnegative=True)  # from the valve's command up to full command: V
excess = sympy.Symbol("excess", positive=True)  # from the threshold up to the output at zero command: V
guard = sympy.Symbol("guard", positive=True)  # from the output at zero command up to the threshold: V
below = sympy.Symbol("below", nonnegative=True)  # dP0 - dP1: Pa
above = sympy.Symbol("above", positive=True)  # dP1 - dP0: Pa
y = sympy.Symbol("y", nonnegative=True)  # from the threshold up to the command: V
rest = sympy.Symbol("rest", positive=True)  # from there up to the command of full opening: V
DISTANCES = (headroom, excess, guard, below, above, y, rest)

# Plant, Eqs. (19)-(24)
u_e, u_if = _real("u_e u_if")  # output of the amplifier, feedback: V
i, di_dt = _real("i di_dt")  # coil current: A, A/s
f_e, f_eL = _real("f_e f_eL")  # solenoid force, load force: N
x_e, dx_e_dt, v, dv_dt = _real("x_e dx_e_dt v dv_dt")  # armature: m, m/s, m/s, m/s^2
K_a, K_fi, K_i = _positive("K_a K_fi K_i")  # amplifier gain; feedback, V/A; force per current, N/A
R_c, r_p, L_c = _positive("R_c r_p L_c")  # coil, ohm; internal, ohm; inductance, H
m_e, B_e, K_et = _positive("m_e B_e K_et")  # mass, kg; damping, N s/m; spring, N/m

x_ov = sympy.Symbol("x_ov", nonnegative=True)  # overlap of the spool: m

# Laplace transforms, Eqs. (25)-(28), and values at t = 0
t, s = sympy.symbols("t s", positive=True)  # time, s; variable of the transform, 1/s
U_e, U_i, U_if, I_s, F_e, F_eL, X_e, Q_s = (
    sympy.Function(name)(s) for name in ("U_e", "U_i", "U_if", "I", "F_e", "F_eL", "X_e", "Q")
)
i_init, x_init, v_init = _real("i(0) x_e(0) v(0)")
G = sympy.Function("G")(s)  # transfer function from command to flow: m^3/s/V
G_0 = sympy.Symbol("G_0", positive=True)  # its static gain
a = sympy.Symbol("a", real=True)  # half the rate at which a drifting pressure drop falls: 1/s
