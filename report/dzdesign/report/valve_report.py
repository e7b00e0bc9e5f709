"""report.html: one page, from the verdict to the hashes, of whatever artefacts there are."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from dzdesign.identify.valve.model import SCHEMA as VALVE_SCHEMA
from dzdesign.report.artefact_chain import Chain, chain_of
from dzdesign.report.artefact_folder import is_of, places_of, shelf_of
from dzdesign.report.body import SECTIONS, sections_of
from dzdesign.report.figures.figure import figure_style
from dzdesign.report.page import render_page
from dzdesign.report.sections.law import account_of
from dzdesign.report.sections.lot_setting import SECTION as LOT_SECTION
from dzdesign.report.sections.lot_setting import carrier_of, common_count, lot_figures
from dzdesign.report.summary import headline, key_figures

REPORT_NAME = "report.html"


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """A finished report.

    Attributes
    ----------
    html : str
        The page.
    kind : {"good", "bad", "open"}
        Of its verdict.
    holds : bool or None
        None where something was not checked, or is not there.
    verdict : str
        In words.
    faults, missing : tuple of str
        What does not fit, and what is not there.
    """

    html: str
    kind: str
    holds: bool | None
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
    return make_report(chain_of(shelf_of(folder), own=places_of(folder)))


def with_report(files: Mapping[str, str | bytes], firmware: Path, output: Path) -> dict[str, str | bytes]:
    """Return the files of an evidence folder with the report of them: of what `verify` used, and of nothing else.

    Its verdict is the evidence's own. Files that lie about, an assessment or a stranger's valve.json, have no part in
    it; `dzdesign report` looks at them.

    Parameters
    ----------
    files : mapping
        Of the evidence folder, not written yet: name to content.
    firmware : Path
        The firmware folder that it is of; the valve.json that it was made from is looked for around it.
    output : Path
        The evidence folder.
    """
    name, place = Path(output).resolve().name, Path(firmware).resolve().name
    if name == place:  # in two folders of one name
        name = f"{name} (evidence)"
    new = {
        f"{name}/{file}": content.encode() if isinstance(content, str) else content
        for file, content in files.items()
    }
    around = shelf_of(firmware)
    compensator = around.get(f"{place}/compensator.json")
    used = {
        file: content
        for file, content in around.items()
        if file.startswith(f"{place}/") or content == compensator or is_of(content, VALVE_SCHEMA)
    }
    kept = {file: content for file, content in used.items() if not file.startswith(f"{name}/")}
    chain = chain_of(new | kept, own=(f"{name}/", f"{place}/"), sealed=False)
    return {**files, REPORT_NAME: make_report(chain).html}


def make_report(chain: Chain) -> Report:
    """Make the report of a chain of artefacts.

    Parameters
    ----------
    chain : Chain
        Of `chain_of`.
    """
    verdict = headline(chain)
    compensator = chain.document("compensator")
    lot, figures = lot_figures(chain), key_figures(chain)
    if lot and chain.document("verification"):  # the last of them, the inputs, is of the C and not of a valve
        lot, figures = (*lot, figures[-1]), figures[:-1]
    with figure_style():
        sections = sections_of(chain)
    html = render_page(
        title=_title(chain),
        verdict=verdict,
        record=_record(chain),
        figures=figures,
        lot=lot,
        carrier=carrier_of(compensator) if common_count(compensator) and compensator else "",
        headings=[(name, heading) for name, heading in (LOT_SECTION, *SECTIONS) if name in sections],
        sections=sections,
        missing=chain.missing,
        law=account_of(compensator["law"]) if compensator else None,
    )
    holds = {"good": True, "bad": False, "open": None}[verdict.kind]
    return Report(
        html=html, kind=verdict.kind, holds=holds, verdict=verdict.text, faults=chain.faults, missing=chain.missing
    )


def _record(chain: Chain) -> tuple[tuple[str, str], ...]:
    """Return who and what, as valve.json has it: the engineer's words, escaped by the template as all others."""
    valve = chain.document("valve")
    return tuple(valve.get("record", {}).items()) if valve else ()


def _title(chain: Chain) -> str:
    firmware, valve = chain.document("firmware"), chain.document("valve")
    count = common_count(chain.document("compensator"))
    what = f"Common setting of {count} valves: dead-zone compensator" if count else "Dead-zone compensator"
    if firmware:
        return f"{what} for {firmware['target']}, law “{firmware['law']}”"
    if "compensator" in chain.artefacts:
        return what
    return "Valve, identified from ramp tests" if valve else "Evidence of a dead-zone compensator"
