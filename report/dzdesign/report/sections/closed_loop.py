"""Section on the closed loop, and on the current loop of a drive by current."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict

import numpy as np

from dzdesign.core.display import NOT_CHECKED
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.report.artefacts import Chain
from dzdesign.report.figure import (
    LIGHT,
    PressureHues,
    ReportFigure,
    label_ends,
    side_words,
    titled_axes,
    to_report_figure,
)
from dzdesign.report.page import (
    Cell,
    Section,
    Table,
    counted,
    in_number_font,
    in_units,
    number,
    percent,
    table_of,
    table_of_rows,
)
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN
from dzdesign.verify.closed_loop.ramps import Curves, closed_loop_name, csv_of
from dzdesign.verify.current.results import CurrentLoopResult
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.loop_results import ClosedLoopResult, PressureResult, ScenarioResult

#: What a scenario measures whose flow is that of a command that was never taken away.
OF_A_COMMAND = "flow_after_zero_command_L_min"
#: Parameters of a plant that count where its edge does not.
COIL_AND_SPOOL = (
    "K_a", "K_fi_V_A", "R_c_ohm", "r_p_ohm", "L_c_H", "K_i_N_A", "m_e_kg", "B_e_N_s_m", "K_et_N_m",
)  # fmt: skip


def loop_section(chain: Chain, hues: PressureHues) -> Section:
    """Return the section on the closed loop."""
    evidence = chain.evidence
    if evidence is None:
        return Section(missing="No evidence is here: `dzdesign verify` runs the closed loop.")
    loop = evidence.closed_loop
    if not loop.pressures:
        return Section(missing=f"{NOT_CHECKED}: the closed loop did not run, see the requirements.")
    sides = dict.fromkeys(each.side for each in loop.pressures)
    figures, units = [], chain.recorded_units
    for side in sides:
        of_side = [each for each in loop.pressures if each.side == side]
        unseen = max((each.unseen_below_L_min for each in of_side if each.unseen_below_L_min), default=None)
        curves = chain.curves[closed_loop_name(side)]
        figures.append(loop_figure(curves, side, len(sides) > 1, units, hues, unseen))
    # Without recordings of the compensated valve these numbers are those of the characteristic.
    ramps = (loops_table(loop.pressures, units),) if chain.assessment else ()
    exceptions = [each for each in worst_of_each(evidence.scenarios) if passes_flow(each)]
    return Section(
        figures=figures,
        tables=(*ramps, scenarios_table(evidence.scenarios, exceptions, units)),
        lines=(_plant_line(loop), *_scenarios_line(evidence.scenarios, len(exceptions), units)),
    )


def plant_section(evidence: Evidence) -> Section:
    """Return the section with the constants of the plant, and the corners and faults of a current loop."""
    return Section(tables=(plant_table(evidence.closed_loop), *current_tables(evidence.current_loop)))


def _scenarios_line(scenarios: Sequence[ScenarioResult], exceptions: int, units: RecordedUnits) -> Iterator[str]:
    """Say in a sentence what the scenarios beside the ramps show."""
    if not scenarios:
        return
    kinds, way = len(worst_of_each(scenarios)), max(scenarios, key=lambda one: one.q_peak_at_zero_L_min)
    found = "no flow at zero command at the end of any" if not exceptions else (
        f"flow at zero command at the end of {exceptions}, in the table; none at the end of the other "
        f"{kinds - exceptions}"
    )  # fmt: skip
    peak = way.in_words(way.q_peak_at_zero_L_min, units)
    yield (
        f"Beside ramps, {len(scenarios)} runs of {counted(kinds, 'scenario')}: {found}. On the way to zero command at "
        f"most {peak} {units.label('L/min')} ({way.name})."
    )


def facts(evidence: Evidence, units: RecordedUnits) -> tuple[Table, ...]:
    """Return what the closed loop shows, the same on the page and on a terminal: ramps, readings, scenarios."""
    pressures = evidence.closed_loop.pressures
    ramps = (loops_table(pressures, units), readings_table(pressures, units)) if pressures else ()
    scenarios = scenarios_table(evidence.scenarios, worst_of_each(evidence.scenarios), units)
    return (*ramps, scenarios) if scenarios else ramps


def _plant_line(loop: ClosedLoopResult) -> str:
    """Say which plant it was, and whether it stands in for the valve."""
    line = f"A simulation. Plant: {loop.plant_source}"
    if loop.plant_sha256:
        return f"{line}, SHA-256 {loop.plant_sha256}."
    if loop.plant:
        return f"{line}."
    return (
        f"{line}: between two tests its thresholds are straight lines against the pressure drop, and below the noise "
        "level, where the recordings show no flow, nothing is known of it. What it does in time is the default plant's."
    )


def plant_table(loop: ClosedLoopResult) -> Table | None:
    """Return the parameters of the closed loop's plant; of one that moves the recorded flow those of coil and spool."""
    plant = loop.plant or loop.dynamics
    if plant is None:
        return None
    names = asdict(plant) if loop.plant else COIL_AND_SPOOL
    cells = [(Cell(text=name, kind="symbol"), in_number_font(f"{getattr(plant, name):.6g}")) for name in names]
    half = -(-len(cells) // 2)  # in two columns, or they would take a page of paper
    right = [*cells[half:], (Cell(text=""), Cell(text=""))]
    of = "" if loop.plant else ": its coil and spool; the flow is the recorded one"
    return table_of_rows(
        f"The plant's parameters; the unit is in the name{of}",
        ("parameter", "value", "parameter", "value"),
        [(*left, *beside) for left, beside in zip(cells[:half], right, strict=False)],
    )


def readings_table(pressures: Sequence[PressureResult], units: RecordedUnits) -> Table:
    """Return the dead zones read at the reading flow, beside what an ideal line would read there."""
    flows = [each.reading_flow_L_min for each in pressures]
    return table_of(
        f"Dead zones read {units.span(min(flows), max(flows), '.2f L/min')}, in per cent of command; an ideal line "
        "rises straight from zero command",
        pressures,
        ("side", lambda one: one.side),
        in_units("dP", "dp_MPa", ".2f MPa", units),
        percent("opening without", "reading_opening_without"),
        percent("opening with", "reading_opening"),
        percent("closing without", "reading_closing_without"),
        percent("closing with", "reading_closing"),
        percent("ideal line", "ideal_line"),
    )


def loops_table(pressures: Sequence[PressureResult], units: RecordedUnits) -> Table:
    """Return dead zones and flows of the closed loop."""
    flow = units.label("L/min")
    return table_of(
        f"Dead zones at the onset of flow in per cent of command, flows in {flow}",
        pressures,
        ("side", lambda one: one.side),
        in_units("dP", "dp_MPa", ".2f MPa", units),
        percent("opening without", "dead_zone_opening"),
        percent("opening with", "residual_opening"),
        percent("closing without", "dead_zone_closing"),
        percent("closing with", "residual_closing"),
        (f"at zero without β ({flow})", lambda one: in_number_font(one.in_words(one.q_zero_without_beta_L_min, units))),
        (f"at zero ({flow})", lambda one: in_number_font(one.in_words(one.q_zero_L_min, units))),
        in_units("largest without", "q_max_direct_L_min", ".2f L/min", units),
        in_units("largest with", "q_max_L_min", ".2f L/min", units),
    )


def passes_flow(result: PressureResult | ScenarioResult) -> bool:
    """Return whether flow passes at zero command, beyond what may and what the recordings hide.

    That of a command that was never taken away is none.
    """
    shown = result.q_zero_L_min >= (result.unseen_below_L_min or 0.0)
    of_a_command = isinstance(result, ScenarioResult) and OF_A_COMMAND in result.figures
    return shown and result.q_beyond_L_min > NO_FLOW_L_MIN and not of_a_command


def scenarios_table(
    scenarios: Sequence[ScenarioResult], shown: Sequence[ScenarioResult], units: RecordedUnits
) -> Table | None:
    """Return those scenarios that are shown at the pressures where each is worst; None if there are none."""
    if not shown:
        return None
    flow = units.label("L/min")
    return table_of(
        "Scenarios beside ramps, at the pressures where each is worst",
        shown,
        ("scenario", lambda one: Cell(text=one.name, more=_where(one, scenarios, units))),
        in_units("dP", "dp_MPa", ".2f MPa", units),
        in_units("behind the edge", "back_MPa", ".2f MPa", units),
        (f"at zero, at the end ({flow})", lambda one: in_number_font(one.in_words(one.q_zero_L_min, units))),
        (f"on the way, at most ({flow})", lambda one: in_number_font(one.in_words(one.q_peak_at_zero_L_min, units))),
        ("required", lambda one: _required(one, units) if one.must_shut else f"{one.not_required}: not required"),
    )


def worst_of_each(scenarios: Sequence[ScenarioResult]) -> list[ScenarioResult]:
    """Return each scenario where it is worst, in their order; one that is required in part stands twice."""
    worst: dict[tuple[str, str], ScenarioResult] = {}
    for each in sorted(scenarios, key=lambda one: (one.q_zero_L_min, one.q_peak_at_zero_L_min, one.dp_MPa)):
        worst[each.name, each.not_required] = each
    return [worst[key] for key in dict.fromkeys((each.name, each.not_required) for each in scenarios)]


def _where(row: ScenarioResult, scenarios: Sequence[ScenarioResult], units: RecordedUnits) -> str:
    """Say of which runs a row is, where those of one name are required in part: side and pressure drop decide it."""
    alike = [each for each in scenarios if each.name == row.name]
    if len({each.not_required for each in alike}) == 1:
        return ""
    drops: dict[str, dict[str, None]] = {}
    for each in sorted(alike, key=lambda one: one.dp_MPa):
        if each.not_required == row.not_required:
            drops.setdefault(each.side, {})[units.number(each.dp_MPa, ".2f MPa")] = None
    two_sided = len({each.side for each in scenarios}) > 1
    return "; ".join(
        (f"{side} commands, " if two_sided else "") + f"at {', '.join(found)} {units.label('MPa')}"
        for side, found in drops.items()
    )


def _required(scenario: ScenarioResult, units: RecordedUnits) -> str:
    """Say what may flow at the end of a scenario."""
    allowed = scenario.allowed_at_zero_L_min
    return "shut" if allowed is None else f"{units.text(allowed, '.3g L/min')} at most"


def current_tables(result: CurrentLoopResult | None) -> tuple[Table, ...]:
    """Return the tables of a drive by current, corners and faults; none of one by duty."""
    if result is None:
        return ()

    def known(value: float | None, factor: float, missing: str = "not carried") -> Cell:
        return Cell(text=missing) if value is None else number(factor * value, 1)

    corners = table_of(
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
        ("10 to 90 % (ms)", lambda one: known(one.rise_s, 1e3)),
        ("switch on all the time (ms)", lambda one: known(one.least_rise_s, 1e3)),
        ("overshoot (%)", lambda one: known(one.overshoot, 100.0)),
    )
    faults = table_of(
        "Current loop: faults of the circuit, put in and taken away again",
        result.faults,
        ("fault", lambda one: one.name),
        ("bit", lambda one: Cell(text=f"DZ_CURRENT_{one.expected}", kind="symbol")),
        ("seen after (ms)", lambda one: known(one.seen_after_s, 1e3, "not seen")),
        ("at most (ms)", lambda one: number(1e3 * one.limit_s, 1)),
        ("output stays off", lambda one: "yes" if one.latched else "no"),
    )
    return corners, faults


#: Where the drawn part ends, percent of full command.
NEAR_ZERO = 15.0


def loop_figure(
    curves: Curves,
    side: str,
    both: bool,
    units: RecordedUnits,
    hues: PressureHues,
    unseen_below_L_min: float | None = None,
) -> ReportFigure:
    """Draw flow against command near zero, with the compensator, from closed_loop_<side>.csv.

    Below `unseen_below_L_min` nothing of the flow was recorded: the lines go on there as the first flows do.
    """
    ends = [name.removeprefix("q_with_") for name in curves if name.startswith("q_with_")]
    figure, axes = titled_axes(3.0, side, both)
    command, labels, top = curves["command_percent"], [], 0.0
    opening = np.arange(command.size) <= int(np.argmax(command))
    for end in ends:
        dp_MPa = float(end.removesuffix("_MPa_L_min"))
        hue, driven = hues.of(dp_MPa), units.convert(curves[f"q_with_{end}"], "L/min")
        for dash, branch in (("-", opening), ("--", ~opening)):
            inside = branch & (command <= NEAR_ZERO)
            axes.plot(command[inside], driven[inside], dash, color=hue, lw=1.5)
            top = max(top, float(driven[inside].max()))
            if dash == "-":
                labels.append((NEAR_ZERO, float(driven[inside][-1]), units.number(dp_MPa, ".2f MPa")))
    for dash, word in (("-", f"opening, dP in {units.label('MPa')} at the end"), ("--", "closing")):
        axes.plot([], [], dash, color=LIGHT["soft"], label=word)
    axes.legend(loc="upper left")
    flow = f"flow Q ({units.label('L/min')})"
    axes.set(xlabel="command (% of full)", ylabel=flow, xlim=(0, NEAR_ZERO), ylim=(0, 1.1 * top or 1))
    label_ends(axes, labels)
    hidden = ""
    if unseen_below_L_min is not None:
        axes.axhspan(0, units.convert(unseen_below_L_min, "L/min"), color=LIGHT["soft"], alpha=0.15, lw=0, zorder=0)
        shown = units.text(unseen_below_L_min, ".2f L/min")
        hidden = f" Shaded: below {shown} the recordings show no flow, and the first flows are continued."
    bare, starts = ([_first_flow(curves, f"q_{which}_{end}") for end in ends] for which in ("without", "with"))
    return to_report_figure(
        figure,
        f"loop-{side}",
        "Closed loop near zero: a ramp up and down, the generated C driving the simulated valve"
        f"{side_words(side, both)}. Of two branches the one at lower commands is closing; what lies between is the "
        f"valve's hysteresis. The CSV has the whole ramp, without the compensator too.{hidden}",
        f"Flow against command at {len(ends)} pressure drops. First flow on the ramp up: without the "
        f"compensator at {min(bare):.1f} to {max(bare):.1f} %, with it at {min(starts):.1f} to {max(starts):.1f} % "
        "of full command.",
        csv_of(curves),
    )


def _first_flow(curves: Curves, column: str) -> float:
    """Return the first command at which there is flow, percent."""
    flowing = curves["command_percent"][curves[column] > 0]
    return float(flowing[0]) if flowing.size else 100.0
