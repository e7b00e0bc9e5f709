"""Sections on the evidence: every input, closed loop, requirements."""

from collections.abc import Callable, Sequence
from dataclasses import asdict

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.verdicts import NOT_CHECKED, NOT_REQUIRED
from dzdesign.report.chain import Chain
from dzdesign.report.compensator_sides import laws_of
from dzdesign.report.figures.closed_loop import dead_zone_figure, loop_figure
from dzdesign.report.figures.figure import Curves, ReportFigure
from dzdesign.report.figures.input_map import map_figure
from dzdesign.report.figures.zero_command import zero_figure
from dzdesign.report.page import Section
from dzdesign.report.sections.cells import (
    Cell,
    Table,
    finding,
    in_number_font,
    number,
    recorded,
    table_of,
    unasked,
    verdict,
    whole,
)
from dzdesign.report.sections.current_loop import current_tables
from dzdesign.verify.closed_loop.evidence_curves import closed_loop_name, input_map_name, read_curves, zero_command_name
from dzdesign.verify.evidence import Evidence, InputCheck
from dzdesign.verify.loop_results import ClosedLoopResult, MonteCarlo, PressureResult, ScenarioResult, Spread
from dzdesign.verify.untried import label_of_untried, untried_requirements

#: Parameters of a plant that count where its edge does not.
COIL_AND_SPOOL = (
    "K_a", "K_fi_V_A", "R_c_ohm", "r_p_ohm", "L_c_H", "K_i_N_A", "m_e_kg", "B_e_N_s_m", "K_et_N_m",
)  # fmt: skip


def _curves(chain: Chain, name: str) -> Curves | None:
    """Return a CSV file of the evidence; None if it is not there."""
    text = chain.curves.get(name)
    if text is None:
        return None
    try:
        return Curves(text=text, columns=read_curves(text))
    except ValueError as error:
        raise InputError(f"'{name}' is no table of numbers ({error}); make it again with `dzdesign verify`") from error


def inputs_section(chain: Chain) -> Section:
    """Return the section on the check of every input."""
    if chain.evidence is None:
        return Section(missing="No evidence is here: `dzdesign verify` tries every input of the C code.")
    figures: list[ReportFigure] = []
    lines, missing = [], ""
    for each in chain.evidence.inputs:
        side = each.side
        lines += _input_lines(each, chain.recorded_units)
        law = laws_of(chain.compensator).get(side)
        map_curves, zero_curves = (_curves(chain, name(side)) for name in (input_map_name, zero_command_name))
        if map_curves and law and chain.compensator:
            figures.append(map_figure(map_curves, zero_curves, chain.compensator, each))
        if zero_curves and law:
            figures.append(zero_figure(zero_curves, side, law.certificate.guard, chain.recorded_units.of_side(side)))
        for curves, name in ((map_curves, input_map_name(side)), (zero_curves, zero_command_name(side))):
            if curves is None or law is None:
                missing = f"{name} or its compensator is missing; `dzdesign verify` makes it."
    if not chain.evidence.inputs:
        missing = f"{NOT_CHECKED}: the C code did not compile or did not run, see the requirements."
    return Section(figures=figures, lines=tuple(lines), missing=missing)


def _input_lines(found: InputCheck, units: RecordedUnits) -> list[str]:
    line = (
        f"{found.side.capitalize()} commands: {whole(found.inputs)} pairs of command and pressure-difference code "
        f"compared with the exactly rounded law, {whole(found.wrong)} wrong, largest error {found.largest_error} "
        f"counts; {found.over_compensated} pressure codes over-compensated, smallest margin of the C code's compare "
        f"values {units.text(1e3 * found.smallest_margin_V, '.3f mV')}."
    )
    return [line, f"First wrong: {found.first_wrong}."] if found.first_wrong else [line]


def loop_section(chain: Chain) -> Section:
    """Return the section on the closed loop."""
    evidence = chain.evidence
    if evidence is None:
        return Section(missing="No evidence is here: `dzdesign verify` runs the closed loop.")
    loop = evidence.closed_loop
    if not loop.pressures:
        return Section(missing=f"{NOT_CHECKED}: the closed loop did not run, see the requirements.")
    sides = dict.fromkeys(each.side for each in loop.pressures)
    figures, missing, units = [], "", chain.recorded_units
    for side in sides:
        of_side = [each for each in loop.pressures if each.side == side]
        figures.append(dead_zone_figure(of_side, side, len(sides) > 1, units))
        curves = _curves(chain, closed_loop_name(side))
        if curves is None:
            missing = f"{closed_loop_name(side)} is missing, so the ramps are not drawn; `dzdesign verify` makes it."
        else:
            unseen = max((each.unseen_below_L_min for each in of_side if each.unseen_below_L_min), default=None)
            figures.append(loop_figure(curves, side, len(sides) > 1, units, unseen))
    return Section(
        figures=figures,
        tables=(
            loops_table(loop.pressures, units),
            readings_table(loop.pressures, units),
            scenarios_table(evidence.scenarios, units),
            series_table(evidence.monte_carlo, units),
            plant_table(loop),
            *current_tables(evidence.current_loop, units),
        ),
        lines=(_plant_line(loop),),
        missing=missing,
    )


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
    return Table(
        caption=f"The plant's parameters; the unit is in the name{of}",
        columns=("parameter", "value", "parameter", "value"),
        rows=tuple((*left, *beside) for left, beside in zip(cells[:half], right, strict=False)),
    )


def readings_table(pressures: Sequence[PressureResult], units: RecordedUnits) -> Table:
    """Return the dead zones read at the reading flow, beside what an ideal line would read there."""
    flows = [each.reading_flow_L_min for each in pressures]
    return table_of(
        f"Dead zones read {units.span(min(flows), max(flows), '.2f L/min')}, in per cent of command; an ideal line "
        "rises straight from zero command",
        pressures,
        ("side", lambda one: one.side),
        (f"dP ({units.label('MPa')})", lambda one: recorded(one.dp_MPa, ".2f MPa", units)),
        ("opening without (%)", lambda one: number(100 * one.reading_opening_without, 1)),
        ("opening with (%)", lambda one: number(100 * one.reading_opening, 1)),
        ("closing without (%)", lambda one: number(100 * one.reading_closing_without, 1)),
        ("closing with (%)", lambda one: number(100 * one.reading_closing, 1)),
        ("ideal line (%)", lambda one: number(100 * one.ideal_line, 1)),
    )


def loops_table(pressures: Sequence[PressureResult], units: RecordedUnits) -> Table:
    """Return dead zones and flows of the closed loop."""
    flow = units.label("L/min")
    return table_of(
        f"Dead zones at the onset of flow in per cent of command, flows in {flow}",
        pressures,
        ("side", lambda one: one.side),
        (f"dP ({units.label('MPa')})", lambda one: recorded(one.dp_MPa, ".2f MPa", units)),
        ("opening without (%)", lambda one: number(100 * one.dead_zone_opening, 1)),
        ("opening with (%)", lambda one: number(100 * one.residual_opening, 1)),
        ("closing without (%)", lambda one: number(100 * one.dead_zone_closing, 1)),
        ("closing with (%)", lambda one: number(100 * one.residual_closing, 1)),
        (f"at zero without β ({flow})", lambda one: in_number_font(one.in_words(one.q_zero_without_beta_L_min, units))),
        (f"at zero ({flow})", lambda one: in_number_font(one.in_words(one.q_zero_L_min, units))),
        (f"largest without ({flow})", lambda one: recorded(one.q_max_direct_L_min, ".2f L/min", units)),
        (f"largest with ({flow})", lambda one: recorded(one.q_max_L_min, ".2f L/min", units)),
    )


def scenarios_table(scenarios: Sequence[ScenarioResult], units: RecordedUnits) -> Table | None:
    """Return each scenario at the pressure drop where it is worst; None if there are none."""
    worst: dict[tuple[str, str], ScenarioResult] = {}
    for each in sorted(scenarios, key=lambda one: (one.q_zero_L_min, one.q_peak_at_zero_L_min, one.dp_MPa)):
        worst[each.name, each.not_required] = each
    if not worst:
        return None
    flow = units.label("L/min")
    return table_of(
        "Beside ramps: each scenario at the pressures where it is worst",
        [worst[key] for key in dict.fromkeys((each.name, each.not_required) for each in scenarios)],
        ("scenario", lambda one: Cell(text=one.name, more=_where(one, scenarios, units))),
        (f"dP ({units.label('MPa')})", lambda one: recorded(one.dp_MPa, ".2f MPa", units)),
        (f"behind the edge ({units.label('MPa')})", lambda one: recorded(one.back_MPa, ".2f MPa", units)),
        (f"at zero, at the end ({flow})", lambda one: in_number_font(one.in_words(one.q_zero_L_min, units))),
        (f"on the way, at most ({flow})", lambda one: in_number_font(one.in_words(one.q_peak_at_zero_L_min, units))),
        ("required", lambda one: _required(one, units) if one.must_shut else f"{one.not_required}: not required"),
    )


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
    return "must be shut at the end" if allowed is None else f"{units.text(allowed, '.3g L/min')} at most at the end"


def series_table(series: MonteCarlo | None, units: RecordedUnits) -> Table | None:
    """Return the quantiles of a series of plants; None if none was run."""
    if series is None:
        return None

    def spread(of: Spread, shown: Callable[[float], str]) -> Cell:
        middle, low, high = map(shown, (of.p50, of.p01, of.p99))
        return in_number_font(f"{middle} ({low} to {high})")

    def percent(share: float) -> str:
        return f"{100 * share:.2f}"

    def flow(value: float) -> str:
        return units.number(value, ".2f L/min")

    return table_of(
        "Series of plants: median (1 to 99 %). No requirement: the certificate covers the tested valve",
        series.pressures,
        ("side", lambda one: one.side),
        (f"dP ({units.label('MPa')})", lambda one: recorded(one.dp_MPa, ".2f MPa", units)),
        ("opening with (%)", lambda one: spread(one.residual_opening, percent)),
        ("closing with (%)", lambda one: spread(one.residual_closing, percent)),
        (f"at zero ({units.label('L/min')})", lambda one: spread(one.q_zero_L_min, flow)),
        ("plants that leak", lambda one: in_number_font(f"{one.leaking} of {one.plants}")),
    )


def checks_section(evidence: Evidence | None) -> Section:
    """Return the section with every requirement."""
    if evidence is None:
        return Section(missing=f"{NOT_CHECKED}: no evidence is here; `dzdesign verify` makes it.")
    tried: list[tuple[Cell | str, str, str]] = []
    for check in evidence.checks:
        tried.append((verdict(check.holds), check.name, check.text))
        tried += [(NOT_REQUIRED, check.name, found) for found in check.not_required]
    untried = untried_requirements(evidence)
    how = [f"to try it: {each.how}" for each in untried]
    labels = [unasked(label_of_untried(each)) for each in untried]
    titles = [each.title for each in untried]
    rows = [*tried, *zip(labels, titles, how, strict=True)]
    table = table_of(
        f"{len(evidence.checks)} requirements tried, {len(untried)} not",
        rows,
        ("verdict", lambda row: row[0]),
        ("requirement", lambda row: row[1]),
        ("figures", lambda row: finding(row[2])),
    )
    return Section(tables=(table,))
