"""Eqs. (19)-(28): the simulation model in time and under the Laplace transform, and what the paper leaves out of it."""

import sympy
from sympy import Eq, sqrt

from dzdesign.derivation.account.equations import ORIFICE, beyond
from dzdesign.derivation.account.published import SIMULATION
from dzdesign.derivation.account.scope import BARE, PLANT
from dzdesign.derivation.account.statement import Ground, Kind, Statement
from dzdesign.derivation.plant import PLANT_EQUATIONS, current_time_constant
from dzdesign.derivation.symbols import *

_TITLES = {
    "(19)": ("proportional amplifier", "Its gain is printed $K_e$, the name of the flow gain in Eq. (2); here $K_a$."),
    "(20)": ("coil", ""),
    "(21)": ("current feedback", ""),
    "(22)": ("solenoid force", "Linear in the current, and the same at every position: a good proportional solenoid."),
    "(23)": ("motion of the armature", "No friction and no stop; the load force $f_eL$ is left open."),
    "(24)": (
        "flow across the edge",
        "As printed, with the armature's travel for the opening: a valve without overlap.",
    ),
}


def _premise(number: str) -> Statement:
    title, note = _TITLES[number]
    equation = PLANT_EQUATIONS[number]
    stated = Kind.PREMISE(number, title).says(equation.lhs, equation.rhs).remark(note)
    # Beyond the simulation model a valve has a dead zone, which (24) has not.
    return stated.within(PLANT).qualified_by("T6d") if number == "(24)" else stated


def _transformed(transform: sympy.Expr, order: int, *initial: sympy.Symbol) -> sympy.Expr:
    """Return the Laplace transform of a derivative, by SymPy's rule and not by ours."""
    signal = sympy.Function("signal")
    derivative = sympy.diff(signal(t), t, order)
    rule = sympy.laplace_correspondence(
        sympy.laplace_transform(derivative, t, s, noconds=True), {signal: transform.func}
    )
    return sympy.laplace_initial_conds(rule, t, {signal: list(initial)})


#: Each signal of Eqs. (19)-(24) and its Laplace transform; the equations are linear with constant coefficients.
LAPLACE = (
    (u_e, U_e),
    (u_i, U_i),
    (u_if, U_if),
    (i, I_s),
    (di_dt, _transformed(I_s, 1, i_init)),
    (f_e, F_e),
    (f_eL, F_eL),
    (x_e, X_e),
    (dx_e_dt, _transformed(X_e, 1, x_init)),
    (dv_dt, _transformed(X_e, 2, x_init, v_init)),
    (Q, Q_s),
)


def laplace(number: str) -> Ground:
    """Return a plant equation, of Eqs. (19)-(24), as a ground, transformed term by term.

    One that is not linear and homogeneous in the signals is refused: its transform is another one.
    """
    equation = PLANT_EQUATIONS[number]
    signals = [signal for signal, _ in LAPLACE if equation.has(signal)]
    terms = sympy.Poly(equation.lhs - equation.rhs, *signals).monoms()
    if any(sum(powers) != 1 for powers in terms):
        raise ValueError(f"{number} is not linear in {signals}")
    return Ground(number, LAPLACE)


#: Section 2.1.
SIMULATION_MODEL = (
    *(_premise(number) for number in PLANT_EQUATIONS),
    Kind.PAPER("(25)", "amplifier and coil, transformed")
    .says(U_e, K_a * (U_i - K_fi * I_s), (R_c + r_p) * I_s + I_s * L_c * s)
    .by(laplace("(19)"), laplace("(21)"), laplace("(20)"), eliminate=(U_if, I_s))
    .if_(Eq(i_init, 0), for_all=(s,), discrepancy=-L_c * i_init, words="(Assumption 4)")
    .remark("Printed without its middle, $U_e$($s$)."),
    Kind.PAPER("(26)", "solenoid force, transformed").says(F_e, K_i * I_s).rearranging(laplace("(22)")),
    Kind.PAPER("(27)", "motion, transformed")
    .says(F_e, K_i * I_s, (m_e * s**2 + B_e * s + K_et) * X_e + F_eL)
    .by(laplace("(23)"), "(26)", eliminate=(I_s,))
    .if_(
        (Eq(x_init, 0), Eq(v_init, 0)),
        for_all=(s,),
        discrepancy=-(m_e * s + B_e) * x_init - m_e * v_init,
        words="(Assumption 4)",
    )
    .remark("Printed without its left end, $F_e$($s$)."),
    Kind.PAPER("(28)", "flow, transformed")
    .says(Q_s, C_d * W * X_e * sqrt(2 * dP / rho))
    .by(Ground("(24)", ((Q, Q_s), (x_e, X_e.func(s + a)))))
    .if_(
        Eq(a, 0),
        witness=((X_e, 1 / s), (X_e.func(s + a), 1 / (s + a))),
        for_all=(s,),
        discrepancy=ORIFICE * (X_e.func(s + a) - X_e),
        words="($a$ constant pressure drop, Assumption 4)",
    )
    .remark(
        "Shown for a pressure drop that falls as exp(-2 a $t$) during a step: flow and travel are in proportion "
        "only at $a = 0$."
    ),
)

#: Section 2.2: the share of the simulated spool's travel that is dead.
_OVERLAP_MM = sympy.Rational(SIMULATION.stroke0_mm) * sympy.Rational(SIMULATION.displacement_dead_zone0_percent) / 100
_RESISTANCE = R_c + r_p + K_a * K_fi

#: Theorem 6.
TRANSFER_FUNCTION = (
    Kind.THEOREM("T6a", "current loop, from command to coil current")
    .says(I_s, K_a * U_i / (_RESISTANCE + L_c * s), K_a / _RESISTANCE * U_i / (1 + current_time_constant() * s))
    .by(Ground("(25)", member=0), Ground("(25)", member=1))
    .on_their_condition()
    .remark(
        "Time constant $L_c$ / ($R_c + r_p + K_a K_fi$): the feedback makes the coil faster by the factor 1 + "
        "$K_a K_fi$ / ($R_c + r_p$), and makes the current depend less on the coil's temperature by the same factor."
    ),
    Kind.DEFINITION("transfer function", "transfer function from command to flow").says(G, Q_s / U_i),
    Kind.THEOREM("T6b", "transfer function of Eqs. (19) to (24) without load force")
    .says(G, ORIFICE * K_i * K_a / ((L_c * s + _RESISTANCE) * (m_e * s**2 + B_e * s + K_et)))
    .by(
        "transfer function",
        "(28)",
        Ground("(27)", member=1, at=((F_eL, sympy.S.Zero),)),
        "(26)",
        "T6a",
        eliminate=(Q_s, X_e, F_e, I_s),
    )
    .within(Eq(F_eL, 0))
    .on_their_condition()
    .remark("Third order. All coefficients of both factors are positive, so it is stable for every set of parameters."),
    Kind.THEOREM("T6c", "static gain from command to flow")
    .says(G_0, ORIFICE * K_i * K_a / (_RESISTANCE * K_et))
    .by(Ground("T6b", ((G, G_0), (s, sympy.S.Zero))))
    .on_their_condition()
    .remark("By the final value theorem, which the stability of T6b allows."),
    Kind.DEFINITION("overlap", "opening of the edge: travel beyond the overlap")
    .says(x, x_e - x_ov)
    .within(u_min <= u_O),
    Kind.THEOREM("T6d", "Eq. (24) is the dead-zone model (1) beyond the threshold")
    .says(Q, ORIFICE * x_e)
    .by(Ground("(1)", beyond(u_min)), "overlap")
    .within(BARE, u_min <= u_i)
    .if_(Eq(x_ov, 0), ruled_out_by=((x_ov, _OVERLAP_MM / 1000),), discrepancy=-ORIFICE * x_ov)
    .corrected("T6e")
    .remark(
        "If the dead zone is overlap (our reading: 54 % of 1.8 mm, 0.97 mm), Eq. (24) lacks it; a preload "
        "within $f_eL$ would be another explanation."
    ),
    Kind.CORRECTED("T6e", "flow across an edge with overlap, opened")
    .says(Q, ORIFICE * (x_e - x_ov))
    .by(Ground("(1)", beyond(u_min)), "overlap")
    .within(BARE, u_min <= u_i),
)
