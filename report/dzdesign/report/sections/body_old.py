"""What stands in each section of the report: sentences, figures and tables, and what is missing for them."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from dzdesign.core.artefact_files import to_json
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.errors import InputError
from dzdesign.core.units import chance
from dzdesign.core.verdicts import NOT_CHECKED
from dzdesign.design.compensator import Compensator
from dzdesign.design.signal_descriptions import signals_in_words
from dzdesign.report.artefact_chain import Chain
from dzdesign.report.figures.evidence import dead_zone_figure, loop_figure, map_figure, zero_figure
from dzdesign.report.figures.valve import beta_figure, law_figure, lines_figure, thresholds_figure
from dzdesign.report.page import Section
from dzdesign.report.sections.acceptance import assessed_table, limits_table, paper_tables
from dzdesign.report.sections.cells import Table, counted, whole
from dzdesign.report.sections.lot_setting import common_count, lot_section
from dzdesign.report.sections.tables import (
    checks_table,
    constants_table,
    hashes_table,
    loops_table,
    plant_table,
    provenance_table,
    rounding_table,
    scenarios_table,
    series_table,
    thresholds_table,
)
from dzdesign.verify.closed_loop.evidence_curves import closed_loop_name, input_map_name, read_curves, zero_command_name
from dzdesign.verify.requirements import requirement_statuses

#: Anchor and heading of every section, in their order.
SECTIONS = (
    ("data", "Data and fit"),
    ("thresholds", "Thresholds"),
    ("beta", "β over the pressure drop"),
    ("law", "The law and where it comes from"),
    ("integers", "The integers and their error"),
    ("inputs", "Every input"),
    ("loop", "Closed loop"),
    ("acceptance", "Acceptance"),
    ("checks", "All requirements"),
    ("warnings", "Warnings, and what is not covered"),
    ("provenance", "Provenance"),
)
#: Of a common setting, these are of the one valve that its file holds.
OF_A_VALVE = ("data", "thresholds", "beta", "loop")
#: Of every report, whatever it finds.
NOT_PROVED = (
    "Pressure drops beyond the tested interval: the nearest tested β is held there, and nothing is certified.",
    "Commands above code 0: one code more is 1 to 2 mV more drive, and the law has no dead band.",
    "What the certificate rests on: a threshold that runs one way with the pressure drop, also between the tests, and "
    "a meter's lag that is as declared or found.",
    "A leak or a soft edge below the flow that counts as flow; a meter's zero error that does not show at rest.",
    "Errors of the pressure sensors beyond their converters', and failures that their signals hide.",
    "Oil temperature and the spread between valves of a type: the compensator is certified for the valve of its tests.",
    "The target's compiler and silicon: the C was compiled and tried on the host that made the evidence.",
    "The closed loop is a simulation of the stated plant; it is no measurement.",
)


def sections_of(chain: Chain) -> dict[str, Section]:
    """Return every section by its anchor; figures are drawn under `figure_style`.

    Parameters
    ----------
    chain : Chain
        Of `chain_of`.
    """
    valve, compensator = chain.document("valve"), chain.document("compensator")
    made = {
        **_valve_sections(valve, compensator),
        "law": _law_section(compensator),
        "integers": _integers_section(chain),
        "inputs": _inputs_section(chain),
        "loop": _loop_section(chain),
        "acceptance": _acceptance_section(chain),
        "checks": _checks_section(chain),
        "warnings": _warnings_section(chain),
        "provenance": _provenance_section(chain),
    }
    if compensator and common_count(compensator):
        made |= {name: replace(made[name], of_valve=True) for name in OF_A_VALVE}
        made["lot"] = lot_section(compensator)
    return made


def _valve_sections(valve: dict[str, Any] | None, compensator: dict[str, Any] | None) -> dict[str, Section]:
    if valve is None:
        gap = Section(missing="The valve is not here: `dzdesign identify` makes valve.json.")
        return {"data": gap, "thresholds": gap, "beta": gap}
    both = len(valve["sides"]) > 1
    fits, thresholds, tables, betas = [], [], [], []
    for name, side in valve["sides"].items():
        designed = compensator["sides"][name] if compensator and name in compensator["sides"] else None
        guard = designed["certificate"]["guard"] if designed else side["certificate"]["guard"]
        fits.append(lines_figure(side, name, both))
        thresholds.append(thresholds_figure(side, guard, name, both))
        tables.append(thresholds_table(side, guard, f"Thresholds, {name} commands"))
        betas.append(beta_figure(side, guard, name, both, compensator if designed else None))
    drawn = tuple(figure for figure in betas if figure)
    lag = {"declared": "declared", "identified": "from ramps of two rates", "unknown": "none declared"}
    meter = valve["meter"]
    return {
        "data": Section(
            figures=tuple(fits),
            lines=(
                f"{counted(sum(len(side['tests']) for side in valve['sides'].values()), 'ramp test')}; full command "
                f"{valve['u_max_V']:g} V.",
                f"Flow meter: floor {meter['floor_L_min']:.2f} L/min; lag taken as {meter['lag_s']:.3g} s "
                f"({lag.get(meter['lag_is'], meter['lag_is'])}).",
                *(_trend(name, side) for name, side in valve["sides"].items()),
                *(f"{name.capitalize()} commands: not tested." for name in valve.get("untested_sides", [])),
            ),
        ),
        "thresholds": Section(figures=tuple(thresholds), tables=tuple(tables)),
        "beta": Section(
            figures=drawn,
            missing="" if drawn else "One pressure drop was tested, so β is 1 and its trend is not known.",
        ),
    }


def _trend(name: str, side: dict[str, Any]) -> str:
    stroke = (
        f"{name.capitalize()} commands: drive range of the valve k x_max/u_max = {side['k_x_max_over_u_max']:.4f}, the "
        "command from the knee to full stroke as a share of full command"
    )
    if side["trend"] is None:
        return f"{stroke}; how the threshold moves with the pressure drop can't be said from one ramp test."
    change, error = 1e3 * side["trend_change_V"], 1e3 * side["trend_change_se_V"]
    return (
        f"{stroke}; trend of the threshold with the pressure drop: {side['trend']}, {change:+.1f} ± {error:.1f} mV "
        f"over the tested range ({chance(side['trend_p'])})."
    )


def _law_section(compensator: dict[str, Any] | None) -> Section:
    if compensator is None:
        return Section(missing="No compensator is here: `dzdesign design` makes compensator.json.")
    names = [name for name, side in compensator["sides"].items() if side]
    below = {"hold": "β = 1, as in the paper", "extend": "β as tested"}[compensator["below_dp0"]]
    lines, valves = [f"Up to dP0: {below}."], compensator["valve"]["sides"]
    for name in names:
        side = compensator["sides"][name]
        (k_top, k_under), (u_top, u_under) = side["k_x_max_over_u_max"], side["u_min0_over_u_max"]
        lines.append(
            f"{name.capitalize()} commands: drive range of the law k x_max/u_max = {k_top}/{k_under} = "
            f"{k_top / k_under:.5f}, from its offset to full flow; the valve's, "
            f"{valves[name]['k_x_max_over_u_max']:.4f}, counts from the knee, which lies higher; "
            f"offset at dP0 u_min0/u_max = {u_top}/{u_under} = {u_top / u_under:.5f}, "
            f"both as shares of full command; β is straight between {len(side['beta'])} nodes, "
            f"{compensator['beta_step_codes']} pressure codes apart, each a whole number of "
            f"1/{compensator['beta_denominator']}."
        )
    return Section(
        figures=tuple(law_figure(compensator, name, len(names) > 1) for name in names), lines=tuple(lines)
    )


def _integers_section(chain: Chain) -> Section:
    firmware, compensator = chain.document("firmware"), chain.document("compensator")
    tables = (rounding_table(compensator),) if compensator else ()
    if firmware is None:
        return Section(tables=tables, missing="No firmware is here: `dzdesign codegen` makes it, and its constants.")
    if not firmware.get("constants"):
        return Section(tables=tables, missing="This firmware's manifest has no constants; make it again with codegen.")
    return Section(tables=(*tables, constants_table(firmware)))


def _curves(chain: Chain, name: str) -> Mapping[str, Any] | None:
    """Return a CSV file of the evidence as columns; None if it is not there."""
    if name not in chain.curves:
        return None
    try:
        return read_curves(chain.curves[name])
    except ValueError as error:
        raise InputError(f"'{name}' is no table of numbers ({error}); make it again with `dzdesign verify`") from error


def _inputs_section(chain: Chain) -> Section:
    evidence, compensator = chain.document("verification"), chain.document("compensator")
    if evidence is None:
        return Section(missing="No evidence is here: `dzdesign verify` tries every input of the C.")
    figures, lines, missing = [], [], ""
    for each in evidence["inputs"]:
        side = "positive" if each["sign"] > 0 else "negative"
        lines.append(
            f"{side.capitalize()} commands: {whole(each['inputs'])} pairs of command and pressure-difference code "
            f"compared with the exactly rounded law, {whole(each['wrong'])} wrong, largest error "
            f"{each['largest_error']} counts; {each['over_compensated']} pressure codes over-compensated, smallest "
            f"margin of the C's compare values {1e3 * each['smallest_margin_V']:.3f} mV."
        )
        if each["first_wrong"]:
            lines.append(f"First wrong: {each['first_wrong']}.")
        for name, draw in ((input_map_name(side), map_figure), (zero_command_name(side), zero_figure)):
            curves = _curves(chain, name)
            if curves is None or compensator is None or not compensator["sides"][side]:
                missing = f"{name} or its compensator is missing; `dzdesign verify` makes it."
            elif draw is map_figure:
                zero = _curves(chain, zero_command_name(side))
                figures.append(map_figure(curves, chain.curves[name], compensator, side, each, zero))
            else:
                guard = compensator["sides"][side]["certificate"]["guard"]
                figures.append(zero_figure(curves, chain.curves[name], side, guard))
    if not evidence["inputs"]:
        missing = f"{NOT_CHECKED}: the C did not compile or did not run, see the requirements."
    return Section(figures=tuple(figures), lines=tuple(lines), missing=missing)


def _loop_section(chain: Chain) -> Section:
    evidence = chain.document("verification")
    if evidence is None:
        return Section(missing="No evidence is here: `dzdesign verify` runs the closed loop.")
    loop = evidence["closed_loop"]
    if not loop["pressures"]:
        return Section(missing=f"{NOT_CHECKED}: the closed loop did not run, see the requirements.")
    sides = list(dict.fromkeys(each["side"] for each in loop["pressures"]))
    figures, missing = [], ""
    for side in sides:
        of_side = [each for each in loop["pressures"] if each["side"] == side]
        figures.append(dead_zone_figure(of_side, side, len(sides) > 1))
        curves = _curves(chain, closed_loop_name(side))
        if curves is None:
            missing = f"{closed_loop_name(side)} is missing, so the ramps are not drawn; `dzdesign verify` makes it."
        else:
            figures.append(loop_figure(curves, chain.curves[closed_loop_name(side)], side, len(sides) > 1))
    tables = (
        loops_table(loop["pressures"]), scenarios_table(evidence["scenarios"]), series_table(evidence["monte_carlo"]),
        plant_table(loop),
    )  # fmt: skip
    return Section(
        figures=tuple(figures),
        tables=tuple(table for table in tables if table),
        lines=(_plant_line(loop),),
        missing=missing,
    )


def _plant_line(loop: dict[str, Any]) -> str:
    """Say which plant it was, and whether it stands in for the valve."""
    line = f"A simulation. Plant: {loop['plant_source']}"
    if loop.get("plant_sha256"):
        return f"{line}, SHA-256 {loop['plant_sha256']}."
    if loop.get("plant"):
        return f"{line}."
    return f"{line}, one for each pressure drop: this checks the design and the C, not the identification."


def _acceptance_section(chain: Chain) -> Section:
    assessment, reproduction = chain.document("assessment"), chain.document("reproduction")
    tables: list[Table] = []
    if assessment:
        limits = limits_table(assessment)
        tables += [*([limits] if limits else []), assessed_table(assessment)]
    if reproduction:
        tables += paper_tables(reproduction)
    missing = (
        ""
        if tables
        else "No acceptance table is here: `dzdesign assess` compares recordings with limits, `dzdesign reproduce` the "
        "paper's numbers."
    )
    return Section(tables=tuple(tables), missing=missing, optional=True)


def _checks_section(chain: Chain) -> Section:
    evidence = chain.document("verification")
    if evidence is None:
        return Section(missing=f"{NOT_CHECKED}: no evidence is here; `dzdesign verify` makes it.")
    return Section(tables=(checks_table(evidence, requirement_statuses(chain.evidence())),))


def _warnings_section(chain: Chain) -> Section:
    valve, compensator = chain.document("valve"), chain.document("compensator")
    warnings = []
    for warning in valve.get("warnings", []) if valve else []:
        source = f"{warning['source']}: " if warning["source"] else ""
        accepted = warning["code"] in _accepted(compensator)
        end = ", which it was (--accept)" if accepted else ""
        warnings.append(f"[{warning['code']}] {source}{warning['text']}{end}")
    signals = []
    if compensator:
        one = read_artefact(to_json(compensator).encode(), Compensator, "compensator.json")
        signals = signals_in_words(one.signals, float(one.u_max_V))
    return Section(
        groups=(
            ("Warnings of the recordings", tuple(warnings) or (("None.",) if valve else ())),
            ("What the design costs", tuple(compensator["costs"]) if compensator else ()),
            ("What the codes stand for", tuple(signals)),
            ("What this report does not prove", NOT_PROVED),
        )
    )


def _accepted(compensator: dict[str, Any] | None) -> list[str]:
    """Return the codes of the warnings in spite of which the compensator was designed."""
    options = (compensator or {}).get("options") or {}
    return options.get("accept", "").replace(",", " ").split()


def _provenance_section(chain: Chain) -> Section:
    evidence, firmware = chain.document("verification"), chain.document("firmware")
    hashes = hashes_table(evidence["inputs"] if evidence else [], firmware)
    return Section(tables=tuple(table for table in (provenance_table(chain), hashes) if table))
