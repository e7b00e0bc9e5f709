"""report.html: one page, from the verdict to the hashes, of whatever artefacts there are.

The page needs no network and no script: figures are SVG in it, their numbers are data: addresses. Every text that comes
from a file is escaped by the template engine; only figures and formulas, made here, are markup.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dzdesign.core.artefacts import TOOL
from dzdesign.core.errors import InputError
from dzdesign.derivation.report_html import anchor
from dzdesign.design.compensator_file import compensator_from_document
from dzdesign.design.signals_in_words import signals_in_words, unseen_failures
from dzdesign.verify.evidence_curves import closed_loop_name, input_map_name, read_curves, zero_command_name
from dzdesign.verify.report_acceptance import assessed_table, limits_table, paper_tables
from dzdesign.verify.report_artefacts import VERIFICATION_NAME, Chain, chain_of, shelf_of
from dzdesign.verify.report_evidence_figures import dead_zone_figure, loop_figure, map_figure, zero_figure
from dzdesign.verify.report_figure import PALETTE, ReportFigure, data_uri, figure_style
from dzdesign.verify.report_law import account_of
from dzdesign.verify.report_sections import (
    checks_table,
    constants_table,
    hashes_table,
    loops_table,
    provenance_table,
    rounding_table,
    scenarios_table,
    thresholds_table,
)
from dzdesign.verify.report_summary import headline, key_figures
from dzdesign.verify.report_table import Table
from dzdesign.verify.report_valve_figures import beta_figure, law_figure, lines_figure, thresholds_figure

REPORT_NAME = "report.html"
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """What a section holds, in the order in which it is shown.

    Attributes
    ----------
    figures : tuple of ReportFigure
    tables : tuple of Table
    lines : tuple of str
        Sentences of figures.
    missing : str
        What it lacks and which command makes that; empty if nothing.
    """

    figures: tuple[ReportFigure, ...] = ()
    tables: tuple[Table, ...] = ()
    lines: tuple[str, ...] = ()
    missing: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """A finished report.

    Attributes
    ----------
    html : str
        The page.
    kind : {"good", "bad", "open"}
        Of its verdict.
    verdict : str
        In words.
    faults, missing : tuple of str
        What does not fit, and what is not there.
    """

    html: str
    kind: str
    verdict: str
    faults: tuple[str, ...]
    missing: tuple[str, ...]


def report_of_folder(folder: Path) -> Report:
    """Make the report of an artefact folder.

    Parameters
    ----------
    folder : Path
        Of `dzdesign demo`, of evidence, of firmware, or with valve.json or compensator.json.

    Raises
    ------
    InputError
        If there is nothing to report, or an artefact is none.
    """
    return make_report(chain_of(shelf_of(folder)))


def with_report(files: Mapping[str, str | bytes], firmware: Path, output: Path) -> dict[str, str | bytes]:
    """Return the files of an evidence folder with the report of them.

    Parameters
    ----------
    files : mapping
        Of the evidence folder, not written yet: name to content.
    firmware : Path
        The firmware folder that it is of; what that was made from is looked for beside it.
    output : Path
        The evidence folder.
    """
    name = Path(output).resolve().name
    new = {
        f"{name}/{file}": content.encode() if isinstance(content, str) else content
        for file, content in files.items()
    }
    around = shelf_of(firmware)
    # Evidence that is older is another firmware's, or about to be replaced.
    older = {place for place, _, leaf in (file.rpartition("/") for file in around) if leaf == VERIFICATION_NAME}
    kept = {file: content for file, content in around.items() if file.rpartition("/")[0] not in older | {name}}
    return {**files, REPORT_NAME: make_report(chain_of(new | kept)).html}


def make_report(chain: Chain) -> Report:
    """Make the report of a chain of artefacts.

    Parameters
    ----------
    chain : Chain
        Of `chain_of`.
    """
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dzdesign.verify", "templates"),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=True,
    )
    environment.filters.update(data_uri=data_uri, anchor=anchor)
    verdict = headline(chain)
    compensator = chain.document("compensator")
    with figure_style():
        sections = _sections(chain)
    html = environment.get_template("report.html.jinja").render(
        title=_title(chain),
        tool=TOOL,
        verdict=verdict,
        figures=key_figures(chain),
        sections=sections,
        headings=SECTIONS,
        law=account_of(compensator["law"]) if compensator else None,
        palette=PALETTE,
        faults=chain.faults,
        missing=chain.missing,
    )
    return Report(html=html, kind=verdict.kind, verdict=verdict.text, faults=chain.faults, missing=chain.missing)


def _title(chain: Chain) -> str:
    firmware, valve = chain.document("firmware"), chain.document("valve")
    if firmware:
        return f"Dead-zone compensator for {firmware['target']}, law “{firmware['law']}”"
    if "compensator" in chain.artefacts:
        return "Dead-zone compensator"
    return "Valve, identified from ramp tests" if valve else "Evidence of a dead-zone compensator"


def _sections(chain: Chain) -> dict[str, Section]:
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
    return {name: made[name] for name, _ in SECTIONS}


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
                f"{sum(len(side['tests']) for side in valve['sides'].values())} ramp tests; full command "
                f"{valve['u_max_V']:g} V.",
                f"Flow meter: floor {meter['floor_L_min']:.2f} L/min; lag taken as {meter['lag_s']:.3g} s "
                f"({lag.get(meter['lag_is'], meter['lag_is'])}).",
                *(_trend(name, side) for name, side in valve["sides"].items()),
                *(f"{name} commands: not tested." for name in valve.get("untested_sides", [])),
            ),
        ),
        "thresholds": Section(figures=tuple(thresholds), tables=tuple(tables)),
        "beta": Section(
            figures=drawn,
            missing="" if drawn else "One pressure drop was tested, so β is 1 and its trend is not known.",
        ),
    }


def _trend(name: str, side: dict[str, Any]) -> str:
    stroke = f"{name.capitalize()} commands: k x_max/u_max = {side['k_x_max_over_u_max']:.4f}"
    if side["trend"] is None:
        return f"{stroke}; how the threshold moves with the pressure drop can't be said from one ramp test."
    change, error = 1e3 * side["trend_change_V"], 1e3 * side["trend_change_se_V"]
    return (
        f"{stroke}; trend of the threshold with the pressure drop: {side['trend']}, {change:+.1f} ± {error:.1f} mV over "
        f"the tested range (p = {side['trend_p']:.2g})."
    )


def _law_section(compensator: dict[str, Any] | None) -> Section:
    if compensator is None:
        return Section(missing="No compensator is here: `dzdesign design` makes compensator.json.")
    names = [name for name, side in compensator["sides"].items() if side]
    below = {"hold": "β = 1, as in the paper", "extend": "β as tested"}[compensator["below_dp0"]]
    lines = [f"Up to dP0: {below}."]
    for name in names:
        side = compensator["sides"][name]
        (k_top, k_under), (u_top, u_under) = side["k_x_max_over_u_max"], side["u_min0_over_u_max"]
        lines.append(
            f"{name.capitalize()} commands: k x_max/u_max = {k_top}/{k_under} = {k_top / k_under:.5f} (from the offset "
            f"to full flow), u_min0/u_max = {u_top}/{u_under} = {u_top / u_under:.5f}, β: {len(side['beta'])} nodes over "
            f"{compensator['beta_denominator']}, {compensator['beta_step_codes']} pressure codes apart."
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
            f"{side.capitalize()} commands: {each['inputs']:,} pairs of command and pressure-difference code compared "
            f"with the exactly rounded law, {each['wrong']:,} wrong".replace(",", "\u202f")
            + f", largest error {each['largest_error']} counts; {each['over_compensated']} pressure codes "
            f"over-compensated, smallest margin {1e3 * each['smallest_margin_V']:.3f} mV."
        )
        if each["first_wrong"]:
            lines.append(f"First wrong: {each['first_wrong']}.")
        for name, draw in ((input_map_name(side), map_figure), (zero_command_name(side), zero_figure)):
            curves = _curves(chain, name)
            if curves is None or compensator is None or not compensator["sides"][side]:
                missing = f"{name} or its compensator is missing; `dzdesign verify` makes it."
            elif draw is map_figure:
                figures.append(map_figure(curves, chain.curves[name], compensator, side, each))
            else:
                guard = compensator["sides"][side]["certificate"]["guard"]
                figures.append(zero_figure(curves, chain.curves[name], side, guard))
    if not evidence["inputs"]:
        missing = "NOT CHECKED: the C did not compile or did not run, see the requirements."
    return Section(figures=tuple(figures), lines=tuple(lines), missing=missing)


def _loop_section(chain: Chain) -> Section:
    evidence = chain.document("verification")
    if evidence is None:
        return Section(missing="No evidence is here: `dzdesign verify` runs the closed loop.")
    loop = evidence["closed_loop"]
    if not loop["pressures"]:
        return Section(missing="NOT CHECKED: the closed loop did not run, see the requirements.")
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
    tables = (loops_table(loop["pressures"]), scenarios_table(evidence["scenarios"]))
    return Section(
        figures=tuple(figures),
        tables=tuple(table for table in tables if table),
        lines=(f"A simulation. Plant: {loop['plant_source']}.",),
        missing=missing,
    )


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
    return Section(tables=tuple(tables), missing=missing)


def _checks_section(chain: Chain) -> Section:
    evidence = chain.document("verification")
    if evidence is None:
        return Section(missing="NOT CHECKED: no evidence is here; `dzdesign verify` makes it.")
    return Section(tables=(checks_table(evidence),))


def _warnings_section(chain: Chain) -> Section:
    valve, compensator = chain.document("valve"), chain.document("compensator")
    lines = []
    for warning in valve.get("warnings", []) if valve else []:
        source = f"{warning['source']}: " if warning["source"] else ""
        lines.append(f"[{warning['code']}] {source}{warning['text']}")
    if compensator:
        one = compensator_from_document(_bytes(compensator), "compensator.json")
        lines += [f"Cost: {text}" for text in compensator["costs"]]
        lines += [f"Wiring: {text}" for text in signals_in_words(one.signals, float(one.u_max_V))]
        lines += [f"Not seen by the C: {text}" for text in unseen_failures(one.signals)]
    return Section(lines=tuple(lines), missing="" if lines else "None was given.")


def _bytes(document: dict[str, Any]) -> bytes:
    from dzdesign.core.artefacts import to_json

    return to_json(document).encode()


def _provenance_section(chain: Chain) -> Section:
    evidence, firmware = chain.document("verification"), chain.document("firmware")
    hashes = hashes_table(evidence["inputs"] if evidence else [], firmware)
    return Section(tables=tuple(table for table in (provenance_table(chain), hashes) if table))
