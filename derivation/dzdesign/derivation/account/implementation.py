"""Eqs. (29)-(32): the law in the codes of the converter, as printed and as it should read."""

import sympy

from dzdesign.derivation import scaling
from dzdesign.derivation.account.published import DUTY_COMMAND_V, DUTY_WITH_PERCENT, DUTY_WITHOUT_PERCENT, FIRST, SECOND
from dzdesign.derivation.account.statement import Case, Condition, Ground, Kind, Outcome, Statement, Value
from dzdesign.derivation.law import law
from dzdesign.derivation.symbols import (
    K_c,
    V_adc,
    V_pin,
    above,
    below,
    beta,
    dP0,
    dP1,
    duty,
    k,
    kappa,
    n_0,
    n_adc,
    n_full,
    n_i,
    n_no,
    n_pwm,
    n_V,
    u_0,
    u_i,
    u_max,
    u_min0,
    u_no,
    u_O,
    x_max,
)

_IN_COUNTS = scaling.law_in_counts(law("paper"))
_SHARES = {kappa: k * x_max / u_max, scaling.mu: u_min0 / u_max}
_PER_VOLT = n_adc / u_max  # counts per volt of command, what Eqs. (30) and (31) need where they have 1365
_REST = k * x_max / u_max - 1
_CONVERTER = ((n_adc, sympy.Integer(4095)), (V_adc, sympy.Integer(3)), (n_V, sympy.Integer(1365)))
_UP_TO_REFERENCE = Case(at=((dP1, dP0 - below),), where="dP <= dP0")
_ABOVE_REFERENCE = Case(at=((dP1, dP0 + above),), where="dP > dP0")


def _by_selector(up_to_reference: sympy.Expr, above_reference: sympy.Expr) -> sympy.Expr:
    return sympy.Piecewise((up_to_reference, dP1 <= dP0), (above_reference, dP1 > dP0))


#: Section 3.
IMPLEMENTATION = (
    Statement(
        number="converter",
        title="code of the voltage at the converter's pin",
        kind=Kind.PREMISE,
        symbol=n_i,
        members=(n_adc * V_pin / V_adc,),
        note="n_adc = 4095 counts at V_adc = 3 V: the F28335 converts to 12 bits, in a register of the text's 16.",
    ),
    Statement(
        number="attenuator",
        title="full command at the converter's full scale",
        kind=Kind.CHOICE,
        symbol=V_pin,
        members=(V_adc * u_i / u_max,),
        note="The command goes to 10 V, the pin only to 3 V, so something divides it; the paper does not say what.",
    ),
    Statement(
        number="1365",
        title="counts per volt at the pin",
        kind=Kind.DEFINITION,
        symbol=n_V,
        members=(n_adc / V_adc,),
        note="4095 / 3, the factor in Eqs. (30) and (31).",
    ),
    Statement(
        number="(29)",
        title="code of the command",
        kind=Kind.PAPER,
        symbol=n_i,
        members=(n_adc * u_i / V_adc,),
        grounds=(Ground(number="converter"), Ground(number="attenuator")),
        eliminate=(V_pin,),
        condition=Condition(
            any_of=((sympy.Eq(u_max, V_adc),),),
            for_all=(u_i,),
            ruled_out_by=((u_max, sympy.Integer(10)), (V_adc, sympy.Integer(3))),
            discrepancy=n_adc * u_i * (1 / u_max - 1 / V_adc),
        ),
        expected=Outcome.DOES_NOT_FOLLOW,
        corrected_by="(29c)",
        values=(
            Value(
                label="code of 10 V by (29)",
                at=(*_CONVERTER, (u_i, sympy.Integer(10))),
                unit="counts",
                remark="14 bits. A 12-bit converter stands at 4095 from 3 V on: 70 % of the command would be lost.",
            ),
        ),
        note="Printed as hex(4095 u_i / 3), called u_i' like the command in Eq. (11); hex() only changes the notation. "
        "Right if u_i were the voltage at the pin; before the 0-10 V command an attenuator has to stand (our choice).",
    ),
    Statement(
        number="(29c)",
        title="code of the command, corrected",
        kind=Kind.CORRECTED,
        symbol=n_i,
        members=(n_adc * u_i / u_max,),
        grounds=(Ground(number="converter"), Ground(number="attenuator")),
        eliminate=(V_pin,),
    ),
    Statement(
        number="code of u_0",
        title="compensation signal at 1365 counts per volt",
        kind=Kind.ASSUMPTION,
        symbol=n_0,
        members=(n_V * u_0,),
        note="What Eq. (30) sets out to compute: all of u_0 in the scale of its first term.",
    ),
    Statement(
        number="code of u_no",
        title="compensation signal off the reference at 1365 counts per volt",
        kind=Kind.ASSUMPTION,
        symbol=n_no,
        members=(n_V * u_no,),
    ),
    Statement(
        number="(30)",
        title="code of the compensation signal at the reference",
        kind=Kind.PAPER,
        symbol=n_0,
        members=(n_V * _REST * u_i + u_min0,),
        grounds=(Ground(number="code of u_0"), Ground(number="(13)")),
        eliminate=(u_0,),
        condition=Condition(
            any_of=((sympy.Eq(n_V, 1),),),
            ruled_out_by=((n_V, sympy.Integer(1365)),),
            discrepancy=(n_V - 1) * u_min0,
        ),
        expected=Outcome.DOES_NOT_FOLLOW,
        corrected_by="(30c)",
        values=(
            Value(
                label="u_min0 as it stands in (30), first valve",
                of=u_min0,
                at=FIRST.at(),
                unit="counts",
                remark="volts added to counts: 0.13 % of the code range where 53.9 % is meant",
            ),
            Value(
                label="command above which (30) is negative, first valve",
                of=-1000 * u_min0 / (n_V * _REST),
                at=(*FIRST.at(), *_CONVERTER),
                unit="mV",
                remark="over nearly the whole range hex() would be given a negative number",
            ),
        ),
        note="Its first term is scaled by 1365 counts per volt, u_min0 is not scaled at all. Most likely a bracket is "
        "missing; (30c) has it, with n_adc/u_max counts per volt of the command for 1365 per volt at the pin.",
    ),
    Statement(
        number="(31)",
        title="code of the compensation signal off the reference",
        kind=Kind.PAPER,
        symbol=n_no,
        members=(n_V * beta * _REST * u_i + beta * u_min0,),
        grounds=(Ground(number="code of u_no"), Ground(number="(17)")),
        eliminate=(u_no,),
        condition=Condition(
            any_of=((sympy.Eq(n_V, 1),),),
            ruled_out_by=((n_V, sympy.Integer(1365)),),
            discrepancy=(n_V - 1) * beta * u_min0,
        ),
        expected=Outcome.DOES_NOT_FOLLOW,
        corrected_by="(31c)",
        note="As (30).",
    ),
    Statement(
        number="scale of u_0",
        title="compensation signal in the counts of the command",
        kind=Kind.CHOICE,
        symbol=n_0,
        members=(_PER_VOLT * u_0,),
        note="So that the sum of codes in Eq. (32) is the code of the sum.",
    ),
    Statement(
        number="scale of u_no",
        title="compensation signal off the reference in the counts of the command",
        kind=Kind.CHOICE,
        symbol=n_no,
        members=(_PER_VOLT * u_no,),
    ),
    Statement(
        number="(30c)",
        title="code of the compensation signal at the reference, corrected",
        kind=Kind.CORRECTED,
        symbol=n_0,
        members=(_PER_VOLT * (_REST * u_i + u_min0), _REST * n_i + _PER_VOLT * u_min0),
        grounds=(Ground(number="scale of u_0"), Ground(number="(13)"), Ground(number="(29c)")),
        eliminate=(u_0, n_i),
        values=(
            Value(
                label="code of u_min0, first valve",
                of=_PER_VOLT * u_min0,
                at=(*FIRST.at(), *_CONVERTER),
                unit="counts",
            ),
        ),
    ),
    Statement(
        number="(31c)",
        title="code of the compensation signal off the reference, corrected",
        kind=Kind.CORRECTED,
        symbol=n_no,
        members=(_PER_VOLT * beta * (_REST * u_i + u_min0), beta * _REST * n_i + _PER_VOLT * beta * u_min0),
        grounds=(Ground(number="scale of u_no"), Ground(number="(17)"), Ground(number="(29c)")),
        eliminate=(u_no, n_i),
    ),
    Statement(
        number="(32)",
        title="output from the codes",
        kind=Kind.PAPER,
        symbol=u_O,
        members=(_by_selector(K_c * (n_i + n_0), K_c * (n_i + n_no)),),
        grounds=(
            Ground(number="u_O", at=((u_0, u_no),), where="with u_no for u_0"),
            Ground(number="(7)"),
            Ground(number="(13)"),
            Ground(number="(29c)"),
            Ground(number="(30c)"),
            Ground(number="(31c)"),
        ),
        eliminate=(u_no, u_0, n_i, n_0, n_no),
        cases=(_UP_TO_REFERENCE, _ABOVE_REFERENCE),
        condition=Condition(
            any_of=((sympy.Eq(K_c, u_max / n_adc),),),
            for_all=(u_i,),
            words="(with the corrected codes)",
            # Up to dP0; above it the same factor stands before Eq. (18).
            discrepancy=(1 - K_c * n_adc / u_max) * (k * x_max / u_max * u_i + u_min0),
        ),
        expected=Outcome.FOLLOWS_IF,
        see=("T5a",),
        note="With the corrected codes. Each code is rounded, so the sum is off by up to one count, 0.024 % of u_max.",
    ),
)

#: Theorem 5: what the codes of the paper do, and the duty cycles.
CODES = (
    Statement(
        number="T5a",
        title="Eq. (32) with Eqs. (29) and (30) as printed gives the law (14)",
        kind=Kind.THEOREM,
        symbol=u_O,
        members=(K_c * (n_adc * u_i / V_adc + n_V * _REST * u_i + u_min0),),
        grounds=(Ground(number="(14)"), Ground(number="1365")),
        eliminate=(n_V,),
        condition=Condition(
            any_of=((sympy.Eq(K_c, 1), sympy.Eq(n_adc, V_adc)),),
            for_all=(u_i,),
            ruled_out_by=_CONVERTER,
            discrepancy=(1 - K_c * n_adc / V_adc) * k * x_max / u_max * u_i + (1 - K_c) * u_min0,
        ),
        expected=Outcome.DOES_NOT_FOLLOW,
        note="The formula is (32) with n_i = n_adc/V_adc u_i, as (29) reads with V_adc for 3 V, and n_0 as (30) is "
        "printed. No conversion coefficient saves the printed set: its two terms are in different units.",
    ),
    Statement(
        number="PWM",
        title="compare value: full drive is n_full counts",
        kind=Kind.CHOICE,
        symbol=n_pwm,
        members=(scaling.COMPARE_VALUE,),
    ),
    Statement(
        number="L4",
        title="the scaling of this tool is the corrected Eq. (29)",
        kind=Kind.LAW,
        symbol=n_i,
        members=(scaling.COMMAND_CODE,),
        grounds=(Ground(number="(29c)"),),
    ),
    Statement(
        number="T5b",
        title="the law in counts, from the command's code to the compare value",
        kind=Kind.THEOREM,
        symbol=n_pwm,
        members=(
            n_full / n_adc * (beta * _REST + 1) * n_i + n_full * beta * u_min0 / u_max,
            _IN_COUNTS.slope.subs(_SHARES) * n_i + _IN_COUNTS.start.subs(_SHARES),
        ),
        grounds=(Ground(number="PWM"), Ground(number="(18)"), Ground(number="L4")),
        eliminate=(u_O, u_i),
        note="What the firmware computes, rounded to the nearest count.",
    ),
    Statement(
        number="duty",
        title="duty cycle",
        kind=Kind.DEFINITION,
        symbol=duty,
        members=(u_O / u_max,),
    ),
    Statement(
        number="T5c",
        title="duty cycle with compensation at the reference",
        kind=Kind.THEOREM,
        symbol=duty,
        members=((k * x_max / u_max * u_i + u_min0) / u_max,),
        grounds=(Ground(number="duty"), Ground(number="(14)")),
        eliminate=(u_O,),
        values=(
            Value(
                label="without compensation at 2 V",
                of=u_i / u_max,
                at=(*FIRST.at(), (u_i, sympy.Integer(DUTY_COMMAND_V))),
                unit="%",
                published=DUTY_WITHOUT_PERCENT,
            ),
            Value(
                label="second valve at 2 V",
                at=(*SECOND.at(), (u_i, sympy.Integer(DUTY_COMMAND_V))),
                unit="%",
                published=DUTY_WITH_PERCENT,
            ),
            Value(
                label="first valve at 2 V",
                at=(*FIRST.at(), (u_i, sympy.Integer(DUTY_COMMAND_V))),
                unit="%",
                remark="Fig. 13 does not name its valve; its 55 % fits the second, not the first.",
            ),
        ),
    ),
)
