"""report.html: one page, from the verdict to the hashes, of whatever artefacts there are."""

from dataclasses import replace
from pathlib import Path

from dzdesign.design.certificate import not_counted
from dzdesign.report.artefacts import Chain, chain_of_evidence, read_chain
from dzdesign.report.figure import figure_style
from dzdesign.report.outputs import outputs_in, outputs_sections, with_outputs
from dzdesign.report.page import MadeOutputs, Page, Report, Section, report_of
from dzdesign.report.sections.budget import budget_section
from dzdesign.report.sections.characteristic import characteristic_figure, characteristic_section
from dzdesign.report.sections.closed_loop import loop_section
from dzdesign.report.sections.conditions import conditions_section
from dzdesign.report.sections.curves import characteristic_curves
from dzdesign.report.sections.inputs import inputs_section
from dzdesign.report.sections.law import account_of, integers_section, law_section
from dzdesign.report.sections.lot_setting import carrier_of, lot_figures, lot_section
from dzdesign.report.sections.provenance import (
    checks_section,
    provenance_section,
    remaining_section,
    warnings_section,
)
from dzdesign.report.sections.quantities import characteristic_quantities
from dzdesign.report.sections.valve import valve_sections
from dzdesign.report.summary import headline, key_figures, valve_name
from dzdesign.verify.verification import Verification, evidence_files

REPORT_NAME = "report.html"
NO_OUTPUTS = MadeOutputs()
#: Of a lot setting, these are of the one valve that its file holds.
OF_A_VALVE = ("characteristic", "conditions", "data", "thresholds", "beta", "remaining", "budget", "loop")


def report_of_folder(folder: Path, logo: str = "", firmware: Path | None = None) -> Report:
    """Make the report of an artefact folder: of evidence, of demo, or with valve.json or compensator.json.

    `logo` is a data: address, `firmware` the folder that the evidence is of where that does not lie beside it.
    """
    chain = read_chain(Path(folder), firmware)
    made_of = chain.places.get("compensator")
    outputs = outputs_in(chain.root, made_of.sha256) if chain.root and made_of else NO_OUTPUTS
    return make_report(chain, outputs, logo)


def with_report(verification: Verification, firmware: Path, output: Path) -> dict[str, bytes]:
    """Return the files of an evidence folder, to be written into `output`, with the report of what was verified."""
    chain = chain_of_evidence(verification.evidence, verification.curves, output, firmware)
    return {**evidence_files(verification), REPORT_NAME: make_report(chain).html.encode()}


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
    return replace(report_of(page), outputs=outputs)


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
