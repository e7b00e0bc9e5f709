"""Tables on a drive by current: its loop at every corner of coil and supply, faults, the valve behind it."""

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.report.sections.cells import Cell, Table, in_number_font, number, recorded, table_of
from dzdesign.verify.current.results import CurrentLoopResult
from dzdesign.verify.loop_results import flow_in_words


def current_tables(result: CurrentLoopResult | None, units: RecordedUnits) -> tuple[Table | None, ...]:
    """Return the tables; none of a drive by duty."""
    if result is None:
        return ()
    return (_corners(result), _faults(result), _valve(result, units))


def _optional(value: float | None, places: int, factor: float = 1.0) -> Cell:
    return Cell(text="not carried") if value is None else number(factor * value, places)


def _corners(result: CurrentLoopResult) -> Table:
    return table_of(
        "Current loop: margins of its equations, and the C code with the coil, at every corner",
        result.corners,
        ("resistance (ohm)", lambda one: number(one.resistance_ohm, 2)),
        ("inductance (mH)", lambda one: number(1e3 * one.inductance_H, 1)),
        ("supply (V)", lambda one: number(one.supply_V, 1)),
        ("phase margin (degrees)", lambda one: number(one.phase_margin_deg, 1)),
        ("gain margin", lambda one: number(one.gain_margin, 2)),
        ("limit cycle (codes)", lambda one: number(one.limit_cycle_codes, 2)),
        ("steady error (codes)", lambda one: number(one.steady_error_codes, 2)),
        ("beyond the set point on release (codes)", lambda one: number(one.release_overshoot_codes, 2)),
        ("10 to 90 % (ms)", lambda one: _optional(one.rise_s, 1, 1e3)),
        ("switch on all the time (ms)", lambda one: _optional(one.least_rise_s, 1, 1e3)),
        ("overshoot (%)", lambda one: _optional(one.overshoot, 1, 100.0)),
    )


def _faults(result: CurrentLoopResult) -> Table:
    return table_of(
        "Current loop: faults of the circuit, put in and taken away again",
        result.faults,
        ("fault", lambda one: one.name),
        ("bit", lambda one: Cell(text=f"DZ_CURRENT_{one.expected}", kind="symbol")),
        (
            "seen after (ms)",
            lambda one: Cell(text="not seen") if one.seen_after_s is None else number(1e3 * one.seen_after_s, 1),
        ),
        ("at most (ms)", lambda one: number(1e3 * one.limit_s, 1)),
        ("output stays off", lambda one: "yes" if one.latched else "no"),
    )


def _valve(result: CurrentLoopResult, units: RecordedUnits) -> Table | None:
    if not result.valve:
        return None
    return table_of(
        "The valve with the declared coil and at the ends of its ranges and the supply's",
        result.valve,
        (f"dP ({units.label('MPa')})", lambda one: recorded(one.dp_MPa, ".2f MPa", units)),
        ("opening, least (%)", lambda one: number(100 * one.opening_least, 2)),
        ("opening, largest (%)", lambda one: number(100 * one.opening_largest, 2)),
        (
            f"at zero, after closing ({units.label('L/min')})",
            lambda one: in_number_font(flow_in_words(one.q_zero_L_min, one.unseen_below_L_min, units)),
        ),
        (
            f"at zero, as the drive is released ({units.label('L/min')})",
            lambda one: in_number_font(flow_in_words(one.q_released_L_min, one.unseen_below_L_min, units)),
        ),
    )
