"""The goals of the generated core, judged on what was measured."""

from collections.abc import Sequence

import on_avr
from measuring import Measured
from scoreboard import Row

FLOAT32, PW_LIN = "float32 slope table", "casadi pw_lin"
TIMES_FLOAT32 = 1.25
SHARE_OF_CASADI = 0.01
AVR_SHARE = 0.15
ZERO_BAND_INSTRUCTIONS = 60
ISR_HZ = 2500


def zero_band_goals(results: Sequence[Measured]) -> list[Row]:
    """Return the goals of the core with zero band and transition, as it is by default."""
    fastest = min(results, key=lambda result: result.cortex_m4.most)
    wrong = sum(each.wrong_host + (each.wrong_cortex_m4 or 0) + sum(each.wrong_tried) for each in results)
    on_avr_fastest = min((each.avr for each in results), key=lambda counts: counts.most)
    counted = [machine for each in results for machine in (each.x86, each.cortex_m4)] + [on_avr_fastest]
    spread = sum(counts.most - counts.least for counts in counted)
    return [
        Row(what="with zero band and transition: wrong compare values, all machines", value=wrong, limit=0),
        Row(
            what="with zero band and transition: spread over inputs, x86-64, Cortex-M4, and AVR where it is fastest",
            value=spread,
            limit=0,
        ),
        Row(
            what=f"{fastest.contender.name}: Cortex-M4 instructions",
            value=fastest.cortex_m4.most,
            limit=ZERO_BAND_INSTRUCTIONS,
        ),
    ]


def goals(results: Sequence[Measured]) -> list[Row]:
    """Return the goals with their verdicts.

    Every form of ours must be right and take the same for every input; on a machine the form that is fastest there is
    judged, because the target chooses it.
    """
    by_name = {result.contender.name: result for result in results}
    ours = [result for result in results if result.contender.ours]
    rows = []
    for result in ours:
        rows += [
            Row(
                what=f"{result.contender.name}: wrong compare values, all inputs and the counted ones, all machines",
                value=result.wrong_host + (result.wrong_cortex_m4 or 0) + sum(result.wrong_tried),
                limit=0,
            ),
            Row(
                what=f"{result.contender.name}: spread of instructions over inputs, x86-64 and Cortex-M4",
                value=result.x86.most - result.x86.least + result.cortex_m4.most - result.cortex_m4.least,
                limit=0,
            ),
        ]
    fastest = min(ours, key=lambda result: result.cortex_m4.most)
    m4, float32, unchecked, casadi = (
        each.cortex_m4.most for each in (fastest, by_name[FLOAT32], by_name[f"{FLOAT32}, unchecked"], by_name[PW_LIN])
    )
    rows += [
        Row(
            what=f"{fastest.contender.name}: Cortex-M4 instructions over the float32 slope table's",
            value=m4 / float32,
            limit=TIMES_FLOAT32,
            note=f"{m4} and {float32}; the table without input checks {unchecked}, {m4 / unchecked:.2f}",
        ),
        Row(
            what=f"{fastest.contender.name}: Cortex-M4 instructions over CasADi pw_lin's",
            value=m4 / casadi,
            limit=SHARE_OF_CASADI,
            note=f"{m4} and {casadi}: {casadi / m4:.0f} times fewer",
        ),
    ]
    fastest = min(ours, key=lambda result: result.avr.most)
    period = on_avr.CLOCK_HZ / ISR_HZ
    rows += [
        Row(
            what=f"{fastest.contender.name}: AVR cycles, share of a period of {ISR_HZ} Hz at 16 MHz",
            value=100 * fastest.avr.most / period,
            limit=100 * AVR_SHARE,
            unit="%",
            note=f"{fastest.avr.most} cycles of {period:.0f}",
        ),
        Row(
            what=f"{fastest.contender.name}: spread of cycles over inputs, AVR",
            value=fastest.avr.most - fastest.avr.least,
            limit=0,
        ),
    ]
    return rows
