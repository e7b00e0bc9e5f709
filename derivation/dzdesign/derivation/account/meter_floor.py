"""Theorem 9: what a meter that shows nothing below its floor does to thresholds."""

import sympy

from dzdesign.derivation.account.equations import ORIFICE
from dzdesign.derivation.account.published import FIRST, SECOND, PublishedValve
from dzdesign.derivation.account.readings import DROP_ASSUMED
from dzdesign.derivation.account.scope import BARE, CONSTANT_THRESHOLD, FREE_OPENING, scope
from dzdesign.derivation.account.statement import Ground, Kind, Value
from dzdesign.derivation.symbols import *

_FIRST = dict(FIRST.at())


def _fall_percent(valve: PublishedValve) -> str:
    """Fall of the threshold that the paper reads."""
    return f"{float(sympy.Rational(valve.dead_zone0_percent) - sympy.Rational(valve.dead_zone1_percent)):.1f}"


#: Theorem 9: a meter that shows nothing below its floor.
METER_FLOOR = (
    Kind.THEOREM(
        "T9a",
        "command at which the meter first shows flow",
        u_seen,
        u_min + Q_floor / s_flow,
        u_min + Q_floor * k / ORIFICE,
        grounds=(Ground("straight part", ((Q, Q_floor), (u_O, u_seen))), "S"),
        eliminate=(s_flow,),
        note="Above the threshold, and the more so the lower the pressure drop.",
    ),
    Kind.ASSUMPTION(
        "constant threshold",
        "a threshold that does not depend on the pressure drop",
        u_min1,
        u_min0,
        scope=CONSTANT_THRESHOLD,
        note="Against Eq. (4), to see what the meter alone does.",
    ),
    Kind.DEFINITION("fall", "fall of the threshold as the meter shows it", fall, u_seen0 - u_seen1),
    Kind.THEOREM(
        "T9b",
        "a constant threshold seems to fall",
        fall,
        Q_floor * k / gamma_0 * (1 - sympy.sqrt(dP0) / sympy.sqrt(dP1)),
        scope=CONSTANT_THRESHOLD,
        grounds=(
            "fall",
            Ground("T9a", ((u_seen, u_seen0), (dP, dP0), (u_min, u_min0))),
            Ground("T9a", ((u_seen, u_seen1), (dP, dP1), (u_min, u_min1))),
            "gamma_0",
            "constant threshold",
        ),
        eliminate=(u_seen0, u_seen1, u_min1, gamma_0),
        positive_if=sympy.sqrt(dP1) > sympy.sqrt(dP0),
        values=tuple(
            Value(
                f"in per cent of $u_max$, {valve.name}",
                of=Q_floor * (u_max - u_min0) / Q_max0 * (1 - sympy.sqrt(dP0 / dP1)) / u_max,
                at=valve.at(),
                unit="%",
                remark=f"the paper reads a fall of {_fall_percent(valve)} %" + assumed,
            )
            for valve, assumed in ((FIRST, ""), (SECOND, f"; {DROP_ASSUMED}"))
        ),
        note="The numbers: the printed thresholds taken for the true ones, a floor of 0.6 L/min, and flow that grows "
        "with the root of the pressure drop.",
    ),
    Kind.THEOREM(
        "T9c",
        "the same with the slopes that were measured",
        fall,
        Q_floor * (1 / s_flow0 - 1 / s_flow1),
        scope=CONSTANT_THRESHOLD,
        grounds=(
            "fall",
            Ground("straight part", ((Q, Q_floor), (u_O, u_seen0), (s_flow, s_flow0), (u_min, u_min0))),
            Ground(
                "straight part",
                ((Q, Q_floor), (u_O, u_seen1), (s_flow, s_flow1), (u_min, u_min1)),
            ),
            "constant threshold",
        ),
        eliminate=(u_seen0, u_seen1, u_min1),
        values=tuple(
            Value(
                f"in per cent of $u_max$, {valve.name}",
                of=Q_floor * ((u_max - u_min0) / Q_max0 - (u_max - u_min1) / Q_max1) / u_max,
                at=valve.at(),
                unit="%",
                remark=f"of the {_fall_percent(valve)} % that the paper reads",
            )
            for valve in (FIRST, SECOND)
        ),
    ),
    Kind.THEOREM(
        "slope at dP1",
        "flow per command at $dP1$ from the two ends of the straight part",
        s_flow1,
        (Q_max1 - Q_floor) / (u_max - u_seen1),
        scope=scope(FREE_OPENING),
        provided=(sympy.Ne(u_max, u_seen1),),
        grounds=(
            Ground("straight part", ((Q, Q_max1), (u_O, u_max), (s_flow, s_flow1), (u_min, u_min1))),
            Ground(
                "straight part",
                ((Q, Q_floor), (u_O, u_seen1), (s_flow, s_flow1), (u_min, u_min1)),
            ),
        ),
        eliminate=(u_min1,),
    ),
    Kind.THEOREM(
        "T9d",
        "flow at zero command without $beta$, if the thresholds are the first flow seen",
        Q,
        Q_floor + (Q_max1 - Q_floor) * (u_seen0 - u_seen1) / (u_max - u_seen1),
        scope=scope(BARE, FREE_OPENING, sympy.Eq(u_i, u_seen0), sympy.Eq(dP, dP1), u_min1 <= u_seen0),
        grounds=(
            Ground(
                "straight part",
                ((u_O, u_seen0), (s_flow, s_flow1), (u_min, u_min1)),
            ),
            Ground(
                "straight part",
                ((Q, Q_floor), (u_O, u_seen1), (s_flow, s_flow1), (u_min, u_min1)),
            ),
            "slope at dP1",
        ),
        eliminate=(u_min1, s_flow1),
        values=(
            Value(
                "first valve",
                (*FIRST.at(), (u_seen0, u_min0.subs(_FIRST)), (u_seen1, u_min1.subs(_FIRST))),
                "L/min",
                published=FIRST.zero_flow_without_beta,
                remark="6 % above what was measured, where the model without the floor (T3b) is 30 % below",
            ),
        ),
        note="A spool that meets its stop before full command makes the straight part steeper, this flow larger still.",
    ),
)
