"""report.html: one page, from the verdict to the hashes, of whatever artefacts there are."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dzdesign.core.display import verdict_words
from dzdesign.design.certificate import not_counted
from dzdesign.report.artefacts import Chain, MadeOutput, MadeOutputs, chain_of_evidence, outputs_in, read_chain
from dzdesign.report.figure import PressureHues, figure_style
from dzdesign.report.page import Cell, Headline, Page, Report, Section, counted, report_of, table_of, verdict, whole
from dzdesign.report.sections.characteristic import characteristic_figure, characteristic_section
from dzdesign.report.sections.closed_loop import loop_section, plant_section
from dzdesign.report.sections.inputs import inputs_section
from dzdesign.report.sections.law import account_of, budget_section, law_section
from dzdesign.report.sections.provenance import (
    carrier_of,
    checks_sections,
    lot_figures,
    lot_section,
    provenance_section,
    remaining_section,
    warnings_section,
)
from dzdesign.report.sections.quantities import characteristic_curves, characteristic_quantities, pressure_hues
from dzdesign.report.sections.valve import conditions_section, thresholds_section
from dzdesign.report.summary import further_record, headline, key_figures, sets_in_words, valve_name
from dzdesign.verify.verification import Verification, evidence_files

REPORT_NAME = "report.html"
NO_OUTPUTS = MadeOutputs()


def report_of_folder(folder: Path, logo: str = "", firmware: Path | None = None, *, full: bool = False) -> Report:
    """Make the report of an artefact folder: of evidence, of demo, or with valve.json or compensator.json.

    `logo` is a data: address, `firmware` the folder that the evidence is of where that does not lie beside it. A `full`
    one has nothing folded.
    """
    chain = read_chain(Path(folder), firmware)
    made_of = chain.places.get("compensator")
    outputs = outputs_in(chain.root, made_of.sha256) if chain.root and made_of else NO_OUTPUTS
    return make_report(chain, outputs, logo, full=full)


def with_report(verification: Verification, firmware: Path, output: Path) -> dict[str, bytes]:
    """Return the files of an evidence folder, to be written into `output`, with the report of what was verified."""
    chain = chain_of_evidence(verification.evidence, verification.curves, output, firmware)
    return {**evidence_files(verification), REPORT_NAME: make_report(chain).html.encode()}


def make_report(chain: Chain, outputs: MadeOutputs = NO_OUTPUTS, logo: str = "", *, full: bool = False) -> Report:
    """Make the report of a chain of artefacts, and of the outputs that were made of its compensator.

    `logo` is a data: address. A `full` one has nothing folded.
    """
    compensator, evidence = chain.compensator, chain.evidence
    curves = characteristic_curves(chain.valve, chain.assessment, chain.curves)
    loops = evidence.closed_loop.pressures if evidence else ()
    found = characteristic_quantities(chain.valve, chain.assessment, loops, curves)
    hues = pressure_hues((*(each.dp_MPa for each in curves), *(each.dp_MPa for each in loops)))
    with figure_style():
        sections = {
            **_sections(chain, hues),
            **outputs_sections(chain, outputs),
            "characteristic": characteristic_section(found, chain.recorded_units),
        }
        lead = characteristic_figure(curves, chain.recorded_units, hues)
    name = valve_name(chain.valve.record) if chain.valve else ""
    page = Page(
        title=name or _title(chain),
        subtitle=_title(chain) if name else "",
        lead=lead,
        logo=logo,
        verdict=with_outputs(headline(chain), outputs, chain),
        record=tuple(further_record(chain.valve.record).items()) if chain.valve else (),
        figures=key_figures(chain, found),
        of_figures=sets_in_words(found, chain.recorded_units),
        lot=lot_figures(chain),
        carrier=carrier_of(compensator) if compensator and compensator.lot else "",
        template="valve.html.jinja",
        sections={name: section for name, section in sections.items() if not section.is_empty},
        missing=chain.missing,
        not_counted=not_counted(compensator),
        law=account_of(compensator.law) if compensator else None,
        full=full,
    )
    return replace(report_of(page), outputs=outputs)


def _sections(chain: Chain, hues: PressureHues) -> dict[str, Section]:
    """Return every section by its anchor."""
    compensator, evidence = chain.compensator, chain.evidence
    sections = {
        "conditions": conditions_section(chain.valve, chain.assessment),
        "thresholds": thresholds_section(chain.valve, compensator, evidence),
        "budget": budget_section(compensator),
        "law": law_section(compensator, hues),
        "inputs": inputs_section(chain),
        "loop": loop_section(chain, hues),
        **checks_sections(evidence),
        "warnings": warnings_section(chain.valve, compensator),
        "provenance": provenance_section(chain),
    }
    if evidence:
        sections["plant"] = plant_section(evidence)
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


# --- other outputs of the same compensator ------------------------------------------------------------------


def outputs_sections(chain: Chain, made: MadeOutputs) -> dict[str, Section]:
    """Return the section by its anchor; none where the firmware that the report is of is all there is."""
    if not (_beside_firmware(made, chain) or made.others):
        return {}
    table = None
    if made.listed:
        table = table_of(
            "Every output made of this compensator.json, with the SHA-256 of its manifest",
            made.listed,
            ("output", lambda each: Cell(text=each.kind, more=each.settings)),
            ("folder", lambda each: each.place),
            ("SHA-256", lambda each: Cell(text=each.sha256, kind="hash")),
            ("check", _check),
        )
    return {"outputs": Section(tables=(table,), groups=(("Not listed here", made.others),))}


def _beside_firmware(made: MadeOutputs, chain: Chain) -> list[MadeOutput]:
    """Return the outputs other than the firmware that the report is of, on which its verdict speaks already."""
    firmware = chain.places.get("firmware")
    return [each for each in made.listed if firmware is None or each.sha256 != firmware.sha256]


def _check(output: MadeOutput) -> Cell:
    if output.changed:
        return Cell(text="✗ CHANGED", kind="bad", more=output.changed)
    if output.holds is None and not output.evidence:
        return Cell(text="? NOT VERIFIED", kind="open", more=_how_to_verify(output))
    # Such as without Octave: none was tried, and the fault says so.
    tried = f"{whole(output.inputs)} {'input' if output.inputs == 1 else 'inputs'} tried" if output.inputs else ""
    more = "; ".join(filter(None, [output.fault, tried, output.evidence]))
    return replace(verdict(output.holds), more=more)


def with_outputs(headline: Headline, made: MadeOutputs, chain: Chain) -> Headline:
    """Return the verdict of a report, which speaks of a C firmware, with what is to be said of the outputs.

    It is not good if one of them is wrong. One that was not verified turns no verdict on another: it has its own line,
    with the command. Where there is no C firmware and no evidence of one, the verdict is of the outputs.
    """
    others = _beside_firmware(made, chain)
    if wrong := [each for each in others if each.is_wrong]:
        text = headline.text
        if headline.kind != "bad":
            names = ", ".join(each.place for each in wrong)
            text = f"{counted(len(wrong), 'output')} NOT to be used: {names}. {text}"
        return replace(headline, kind="bad", text=text, reasons=(*headline.reasons, *map(_reason, wrong)))
    untried = [each for each in others if each.holds is None]
    if made.listed and not (chain.firmware or chain.evidence):
        held = ", ".join(each.place for each in made.listed if each.holds)
        if not untried:
            return replace(headline, kind="good", text=f"Every requirement holds of {held}; no C firmware is here")
        text = _named(untried) + (f"; every requirement holds of {held}" if held else "")
        return replace(headline, kind="open", text=text, reasons=tuple(map(_reason, untried)))
    return replace(headline, cautions=(*headline.cautions, *map(_reason, untried)))


def _reason(output: MadeOutput) -> str:
    """Return an output's verdict with why, and how to have it where there is none."""
    why = output.changed or output.fault or _how_to_verify(output)
    return f"{output.verdict}: {output.place} ({output.kind}): {why}"


def _how_to_verify(output: MadeOutput) -> str:
    name = output.place.removesuffix("/")
    return f"`dzdesign verify {name} -o {name}_evidence`"


def _named(untried: Sequence[MadeOutput]) -> str:
    """Return the outputs by their verdict, those without evidence first."""
    by_verdict = {verdict: [each.place for each in untried if each.verdict == verdict]
                  for verdict in ("NOT VERIFIED", verdict_words(None))}  # fmt: skip
    return "; ".join(f"{verdict}: {', '.join(places)}" for verdict, places in by_verdict.items() if places)
