"""report.html: one page, from the verdict to the hashes, of whatever artefacts there are."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.artefact_types import schema_of
from dzdesign.design.compensator import Compensator
from dzdesign.design.machine.accounting import not_counted
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.artefact_chain import chain_of
from dzdesign.report.artefact_folder import asked_prefixes, is_of, read_artefact_folder
from dzdesign.report.chain import Chain
from dzdesign.report.characteristic.curves import characteristic_curves
from dzdesign.report.characteristic.quantities import characteristic_quantities
from dzdesign.report.figures.characteristic import characteristic_figure
from dzdesign.report.figures.figure import figure_style
from dzdesign.report.outputs.folder_outputs import outputs_of_folder
from dzdesign.report.outputs.made_output import NO_OUTPUTS, MadeOutputs
from dzdesign.report.outputs.section import outputs_sections, with_outputs
from dzdesign.report.page import Page, Report, Section, report_of
from dzdesign.report.sections.acceptance import acceptance_section
from dzdesign.report.sections.budget import budget_section
from dzdesign.report.sections.characteristic import characteristic_section
from dzdesign.report.sections.compensator import integers_section, law_section
from dzdesign.report.sections.conditions import conditions_section
from dzdesign.report.sections.evidence import checks_section, inputs_section, loop_section
from dzdesign.report.sections.law import account_of
from dzdesign.report.sections.lot_setting import carrier_of, lot_figures, lot_section
from dzdesign.report.sections.provenance import provenance_section, warnings_section
from dzdesign.report.sections.remaining import remaining_section
from dzdesign.report.sections.valve import valve_sections
from dzdesign.report.summary import headline, key_figures
from dzdesign.report.valve_name import valve_name

REPORT_NAME = "report.html"
#: Of a lot setting, these are of the one valve that its file holds.
OF_A_VALVE = ("characteristic", "conditions", "data", "thresholds", "beta", "remaining", "budget", "loop")


def report_of_folder(folder: Path, logo: str = "") -> Report:
    """Make the report of an artefact folder: of demo, evidence or firmware, or with valve.json or compensator.json.

    `logo` is a data: address.
    """
    chain = chain_of(read_artefact_folder(folder), asked=asked_prefixes(folder))
    made_of = chain.places.get("compensator")
    outputs = outputs_of_folder(folder, made_of.sha256) if made_of else NO_OUTPUTS
    return make_report(chain, outputs, logo)


def with_report(
    files: Mapping[str, str | bytes], firmware: Path, output: Path, derived: Compensator | None = None
) -> dict[str, str | bytes]:
    """Return the files of an evidence folder, not written yet, with the report of what `verify` used alone.

    Its verdict is the evidence's own. Files that lie about, an assessment or a stranger's valve.json, have no part in
    it; `dzdesign report` looks at them. The valve.json that the firmware was made from is looked for around it. The
    firmware's compensator that `verify` has read and `derived` again is not read again.
    """
    name, place = Path(output).resolve().name, Path(firmware).resolve().name
    if name == place:  # in two folders of one name
        name = f"{name} (evidence)"
    new = {
        f"{name}/{file}": content.encode(errors="replace") if isinstance(content, str) else content
        for file, content in files.items()
    }
    around = read_artefact_folder(firmware)
    compensator = around.get(f"{place}/compensator.json")
    used = {
        file: content
        for file, content in around.items()
        if not file.startswith(f"{name}/")
        and (file.startswith(f"{place}/") or content == compensator or is_of(content, schema_of(ValveModel)))
    }
    known = {sha256_of(compensator): derived} if compensator and derived else {}
    chain = chain_of(new | used, asked=(f"{name}/", f"{place}/"), sealed=False, known=known)
    return {**files, REPORT_NAME: make_report(chain).html}


def make_report(chain: Chain, outputs: MadeOutputs = NO_OUTPUTS, logo: str = "") -> Report:
    """Make the report of a chain of artefacts, and of the outputs that were made of its compensator.

    `logo` is a data: address.
    """
    compensator = chain.compensator
    curves = characteristic_curves(chain.valve, chain.assessment, chain.curves)
    loops = chain.evidence.closed_loop.pressures if chain.evidence else ()
    found = characteristic_quantities(chain.valve, chain.assessment, loops, curves)
    lot, figures = lot_figures(chain), key_figures(chain, found)
    if lot and chain.evidence:  # the last of them, the inputs, is of the C code and not of a valve
        lot, figures = (*lot, figures[-1]), figures[:-1]
    with figure_style():
        sections = {
            **_sections(chain),
            **outputs_sections(chain, outputs),
            "characteristic": characteristic_section(found, chain.recorded_units),
            "conditions": conditions_section(chain.valve, chain.assessment),
        }
        if compensator and compensator.lot:
            sections |= {name: replace(sections[name], of_valve=True) for name in OF_A_VALVE}
        lead = characteristic_figure(curves, chain.recorded_units)
    name = valve_name(chain.valve.record) if chain.valve else ""
    page = Page(
        title=name or _title(chain),
        subtitle=_title(chain) if name else "",
        lead=lead,
        logo=logo,
        verdict=with_outputs(headline(chain), outputs, chain),
        record=tuple(chain.valve.record.items()) if chain.valve else (),
        figures=figures,
        lot=lot,
        carrier=carrier_of(compensator) if compensator and compensator.lot else "",
        template="valve.html.jinja",
        sections=sections,
        missing=chain.missing,
        not_counted=not_counted(compensator),
        law=account_of(compensator.law) if compensator else None,
    )
    return replace(report_of(page, chain.faults), outputs=outputs)


def _sections(chain: Chain) -> dict[str, Section]:
    """Return every section by its anchor."""
    compensator = chain.compensator
    sections = {
        **valve_sections(chain.valve, compensator),
        "budget": budget_section(compensator),
        "law": law_section(compensator),
        "integers": integers_section(chain.firmware, compensator),
        "inputs": inputs_section(chain),
        "loop": loop_section(chain),
        "checks": checks_section(chain.evidence),
        "warnings": warnings_section(chain.valve, compensator),
        "provenance": provenance_section(chain),
    }
    if acceptance := acceptance_section(chain.assessment, chain.reproduction):
        sections["acceptance"] = acceptance
    if compensator:
        sections["remaining"] = remaining_section(compensator)
    if compensator and compensator.lot:
        sections["lot"] = lot_section(compensator)
    return sections


def _title(chain: Chain) -> str:
    count = len(chain.compensator.lot) if chain.compensator else 0
    what = f"Lot setting of {count} valves: dead-zone compensator" if count else "Dead-zone compensator"
    if chain.firmware:
        return f"{what} for {chain.firmware.target}, law “{chain.firmware.law}”"
    if chain.compensator:
        return what
    return "Valve, identified from ramp tests" if chain.valve else "Evidence of a dead-zone compensator"
