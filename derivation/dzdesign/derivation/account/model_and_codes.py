"""Sections 2 and 3 of the paper, and theorems 5 and 6: the simulation model, and the law in the codes of the converter.

Eqs. (19)-(28) are the model in time and under the Laplace transform, with what the paper leaves out of it;
Eqs. (29)-(32) are the codes, as printed and as they should read.
"""

import sympy
from sympy import Eq, Piecewise, sqrt

from dzdesign.derivation import scaling
from dzdesign.derivation.account.equations import ORIFICE, beyond
from dzdesign.derivation.account.published import *
from dzdesign.derivation.account.scope import *
from dzdesign.derivation.account.statement import Case, Ground, Kind, Statement, Value
from dzdesign.derivation.law import law
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
        words="(a constant pressure drop, Assumption 4)",
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

_IN_COUNTS = scaling.law_in_counts(law("paper"))
_SHARES = {kappa: k * x_max / u_max, scaling.mu: u_min0 / u_max}
_PER_VOLT = n_adc / u_max  # counts per volt of command, what Eqs. (30) and (31) need where they have 1365
_REST = k * x_max / u_max - 1
_CONVERTER = (
    (n_adc, sympy.Integer(LARGEST_CODE)),
    (V_adc, sympy.Integer(PIN_V)),
    (n_V, sympy.Integer(COUNTS_PER_PIN_VOLT)),
)
_AT_2_V = ((u_i, sympy.Integer(DUTY_COMMAND_V)), (u_max, sympy.Integer(U_MAX_V)))
_UP_TO_REFERENCE = Case(((dP1, dP0 - below),), "$dP <= dP0$")
_ABOVE_REFERENCE = Case(((dP1, dP0 + above),), "$dP > dP0$")


def _by_selector(up_to_reference: sympy.Expr, above_reference: sympy.Expr) -> sympy.Expr:
    return Piecewise((up_to_reference, dP1 <= dP0), (above_reference, dP1 > dP0))


#: Section 3.
IMPLEMENTATION = (
    Kind.PREMISE("converter", "code of the voltage at the converter's pin")
    .says(n_i, n_adc * V_pin / V_adc)
    .remark("$n_adc = 4095$ counts at $V_adc = 3$ V: the F28335 converts to 12 bits, in a register of the text's 16."),
    Kind.CHOICE("attenuator", "full command at the converter's full scale")
    .says(V_pin, V_adc * u_i / u_max)
    .remark("The command goes to 10 V, the pin only to 3 V, so something divides it; the paper does not say what."),
    Kind.DEFINITION("1365", "counts per volt at the pin")
    .says(n_V, n_adc / V_adc)
    .remark("4095 / 3, the factor in Eqs. (30) and (31)."),
    Kind.PAPER("(29)", "code of the command")
    .says(n_i, n_adc * u_i / V_adc)
    .by("converter", "attenuator")
    .if_(
        Eq(u_max, V_adc),
        for_all=(u_i,),
        ruled_out_by=((u_max, sympy.Integer(U_MAX_V)), (V_adc, sympy.Integer(PIN_V))),
        discrepancy=n_adc * u_i * (1 / u_max - 1 / V_adc),
    )
    .corrected("(29c)")
    .qualified_by("T5d")
    .numbers(
        Value(
            "code of 10 V by (29)",
            (*_CONVERTER, (u_i, sympy.Integer(U_MAX_V))),
            "counts",
            remark="14 bits. A 12-bit converter stands at 4095 from 3 V on: 70 % of the command would be lost.",
        )
    )
    .remark(
        "Printed as hex(4095 $u_i$ / 3), called $u_i'$ like the command in Eq. (11); hex() only changes the "
        "notation. Right if $u_i$ is the voltage at the pin: as printed it goes with one bracket in (30) and (31), "
        "T5d. For a 0-10 V command an attenuator has to stand before the pin: one reading more, our choice."
    ),
    Kind.CORRECTED("(29c)", "code of the command, corrected")
    .says(n_i, n_adc * u_i / u_max)
    .rearranging("converter", "attenuator"),
    Kind.ASSUMPTION("code of u_0", "compensation signal at 1365 counts per volt")
    .says(n_0, n_V * u_0)
    .within(CODES_AT_PIN)
    .remark("What Eq. (30) sets out to compute: all of $u_0$ in the scale of its first term."),
    Kind.ASSUMPTION("code of u_no", "compensation signal off the reference at 1365 counts per volt")
    .says(n_no, n_V * u_no)
    .within(CODES_AT_PIN, LAW_OFF_REFERENCE),
    Kind.PAPER("(30)", "code of the compensation signal at the reference")
    .says(n_0, n_V * _REST * u_i + u_min0)
    .by("code of u_0", "(13)")
    .within(CODES_AT_PIN)
    .if_(Eq(n_V, 1), ruled_out_by=((n_V, sympy.Integer(COUNTS_PER_PIN_VOLT)),), discrepancy=(n_V - 1) * u_min0)
    .corrected("(30b)")
    .qualified_by("(30c)", "T5d")
    .numbers(
        Value(
            "$u_min0$ as it stands in (30), first valve",
            of=u_min0,
            at=FIRST.at(),
            unit="counts",
            remark="volts added to counts: 0.13 % of the code range where 53.9 % is meant",
        ),
        Value(
            "command above which (30) is negative, first valve",
            of=-1000 * u_min0 / (n_V * _REST),
            at=(*FIRST.at(), *_CONVERTER),
            unit="mV",
            remark="over nearly the whole range hex() would be given a negative number",
        ),
    )
    .remark(
        "Its first term is scaled by 1365 counts per volt, $u_min0$ is not scaled at all. The smallest erratum "
        "is one bracket, (30b): with $K_c = 3/4095$ V a count it closes (29) to (32) as they stand, T5d. (30c) has "
        "the counts of the command, $n_adc/u_max$ per volt, behind an attenuator."
    ),
    Kind.PAPER("(31)", "code of the compensation signal off the reference")
    .says(n_no, n_V * beta * _REST * u_i + beta * u_min0)
    .by("code of u_no", "(17)")
    .within(CODES_AT_PIN, LAW_OFF_REFERENCE)
    .if_(
        Eq(n_V, 1),
        ruled_out_by=((n_V, sympy.Integer(COUNTS_PER_PIN_VOLT)),),
        discrepancy=(n_V - 1) * beta * u_min0,
    )
    .corrected("(31b)")
    .qualified_by("(31c)", "T5d")
    .remark("As (30)."),
    Kind.CORRECTED("(30b)", "code of the compensation signal at the reference, with the bracket")
    .says(n_0, n_V * (_REST * u_i + u_min0))
    .by("code of u_0", "(13)")
    .within(CODES_AT_PIN)
    .qualified_by("T5d", "(30c)"),
    Kind.CORRECTED("(31b)", "code of the compensation signal off the reference, with the bracket")
    .says(n_no, n_V * beta * (_REST * u_i + u_min0))
    .by("code of u_no", "(17)")
    .within(CODES_AT_PIN, LAW_OFF_REFERENCE)
    .qualified_by("T5d", "(31c)"),
    Kind.CHOICE("scale of u_0", "compensation signal in the counts of the command")
    .says(n_0, _PER_VOLT * u_0)
    .within(CODES_OF_COMMAND)
    .remark("So that the sum of codes in Eq. (32) is the code of the sum."),
    Kind.CHOICE("scale of u_no", "compensation signal off the reference in the counts of the command")
    .says(n_no, _PER_VOLT * u_no)
    .within(CODES_OF_COMMAND, LAW_OFF_REFERENCE),
    Kind.CORRECTED("(30c)", "code of the compensation signal at the reference, corrected")
    .says(n_0, _PER_VOLT * (_REST * u_i + u_min0), _REST * n_i + _PER_VOLT * u_min0)
    .by("scale of u_0", "(13)", "(29c)")
    .within(CODES_OF_COMMAND)
    .numbers(
        Value("code of $u_min0$, first valve", of=_PER_VOLT * u_min0, at=(*FIRST.at(), *_CONVERTER), unit="counts")
    ),
    Kind.CORRECTED("(31c)", "code of the compensation signal off the reference, corrected")
    .says(n_no, _PER_VOLT * beta * (_REST * u_i + u_min0), beta * _REST * n_i + _PER_VOLT * beta * u_min0)
    .by("scale of u_no", "(17)", "(29c)")
    .within(CODES_OF_COMMAND, LAW_OFF_REFERENCE),
    Kind.PAPER("(32)", "output from the codes")
    .says(u_O, _by_selector(K_c * (n_i + n_0), K_c * (n_i + n_no)))
    .by(Ground("u_O", ((u_0, u_no),)), "(7)", "(13)", "(29c)", "(30c)", "(31c)")
    .within(CODES_OF_COMMAND, under_law("paper"), Eq(dP, dP1))
    .in_cases(_UP_TO_REFERENCE, _ABOVE_REFERENCE)
    .if_(
        Eq(K_c, u_max / n_adc),
        for_all=(u_i,),
        words="(with the corrected codes)",
        discrepancy=(1 - K_c * n_adc / u_max) * (k * x_max / u_max * u_i + u_min0),
    )
    .qualified_by("T5a")
    .remark(
        "With the corrected codes. Each code is rounded, so the sum is off by up to one count, 0.024 % of $u_max$."
    ),
)

#: Theorem 5: what the codes of the paper do, and the duty cycles.
CODES = (
    Kind.THEOREM("T5a", "Eq. (32) with Eqs. (29) and (30) as printed gives the law (14)")
    .says(u_O, K_c * (n_adc * u_i / V_adc + n_V * _REST * u_i + u_min0))
    .by("(14)", "1365")
    .within(UP_TO_REFERENCE)
    .if_(
        (Eq(K_c, 1), Eq(n_adc, V_adc)),
        for_all=(u_i,),
        ruled_out_by=_CONVERTER,
        discrepancy=(1 - K_c * n_adc / V_adc) * k * x_max / u_max * u_i + (1 - K_c) * u_min0,
    )
    .remark(
        "The formula is (32) with $n_i = n_adc/V_adc u_i$, as (29) reads with $V_adc$ for 3 V, and $n_0$ as "
        "(30) is printed. No conversion coefficient saves the printed set, its two terms are in different units; one "
        "bracket does: T5d."
    ),
    Kind.THEOREM("T5d", "with one bracket in (31), Eqs. (29) to (32) as printed give the law (18), at $beta = 1$ (14)")
    .says(u_O, K_c * (n_adc * u_i / V_adc + n_V * beta * (_REST * u_i + u_min0)))
    .by("(18)", "1365")
    .within(LAW_OFF_REFERENCE, CODES_AT_PIN)
    .if_(Eq(K_c, V_adc / n_adc), for_all=(u_i,), discrepancy=(1 - K_c * n_adc / V_adc) * law("paper").output)
    .qualified_by("(30b)", "(31b)")
    .remark(
        "The smallest erratum of (29) to (32): a bracket, and $K_c = 3/4095$ V a count. The attenuator of (29c) "
        "is one reading more: then the counts are those of a 0-10 V command, and $K_c$ is 10/4095 V."
    ),
    Kind.CHOICE("PWM", "compare value: full drive is $n_full$ counts").says(n_pwm, scaling.COMPARE_VALUE),
    Kind.LAW("L4", "the scaling of this tool is the corrected Eq. (29)")
    .says(n_i, scaling.COMMAND_CODE)
    .rearranging("(29c)"),
    Kind.THEOREM("T5b", "the law in counts, from the command's code to the compare value")
    .says(
        n_pwm,
        n_full / n_adc * (beta * _REST + 1) * n_i + n_full * beta * u_min0 / u_max,
        _IN_COUNTS.slope.subs(_SHARES) * n_i + _IN_COUNTS.start.subs(_SHARES),
    )
    .by("PWM", "(18)", "L4", eliminate=(u_O, u_i))
    .within(LAW_OFF_REFERENCE)
    .remark("What the firmware computes, rounded to the nearest count."),
    Kind.DEFINITION("duty", "duty cycle").says(duty, u_O / u_max),
    Kind.THEOREM("T5c", "duty cycle with compensation at the reference")
    .says(duty, (k * x_max / u_max * u_i + u_min0) / u_max)
    .by("duty", "(14)")
    .within(UP_TO_REFERENCE)
    .numbers(
        Value("without compensation at 2 V", _AT_2_V, "%", of=u_i / u_max, published=DUTY_WITHOUT_PERCENT),
        SECOND.value("at 2 V", "%", also=_AT_2_V, published=DUTY_WITH_PERCENT),
        FIRST.value(
            "at 2 V",
            "%",
            also=_AT_2_V,
            remark="Fig. 13 does not name its valve; its 55 % fits the second, not the first.",
        ),
    ),
)
