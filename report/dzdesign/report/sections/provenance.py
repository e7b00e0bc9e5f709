"""Sections on what the report was made from, and on what it does not cover."""

from dzdesign.core.artefact_types import Artefact
from dzdesign.design.compensator import Compensator
from dzdesign.design.pressure_inputs import signals_in_words
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.chain import KINDS, Chain
from dzdesign.report.compensator_sides import standing_warnings
from dzdesign.report.page import Section
from dzdesign.report.sections.cells import Cell, Table, counted, table_of, whole
from dzdesign.report.sections.remaining import other_costs


def warnings_section(valve: ValveModel | None, compensator: Compensator | None) -> Section:
    """Return the section on warnings, costs, signals, and what is not proved."""
    accepted = compensator.options.get("accept", "") if compensator and compensator.options else ""
    codes = accepted.replace(",", " ").split()
    warnings = []
    for warning in standing_warnings(valve, compensator):
        source = f"{warning.source}: " if warning.source else ""
        end = ", which it was (--accept)" if warning.code in codes else ""
        warnings.append(f"[{warning.code}] {source}{warning.text}{end}")
    signals = signals_in_words(compensator) if compensator else []
    return Section(
        groups=(
            ("Warnings of the recordings", tuple(warnings) or (("None.",) if valve else ())),
            ("What the design costs", other_costs(compensator) if compensator else ()),
            ("What the codes stand for", tuple(signals)),
        )
    )


def provenance_section(chain: Chain) -> Section:
    """Return the section with every hash."""
    return Section(tables=(_provenance_table(chain), _recordings_table(chain), _hashes_table(chain)))


def _provenance_table(chain: Chain) -> Table:
    """Return which file made which, from the firmware's evidence back to the recordings."""
    rows: list[tuple[str, Cell | str, Cell | str, str, str]] = []
    for role, kind in KINDS.items():
        artefact: Artefact | None = getattr(chain, role)
        if artefact:
            place, tool = chain.places[role], artefact.tool
            sources = ", ".join(each.source for each in artefact.made_from) or "–"
            if role == "valve":
                sources = counted(len(artefact.made_from), "recording")
            rows.append((kind.label, place.name, _hash(place.sha256), f"{tool.name} {tool.version}", sources))
        elif kind.command:
            rows.append((kind.label, Cell(text="missing or not used", kind="open"), "", "", ""))
    return table_of(
        "Each artefact with the SHA-256 of its bytes, and what it was made from",
        rows,
        ("artefact", lambda row: row[0]),
        ("file", lambda row: row[1]),
        ("SHA-256", lambda row: row[2]),
        ("made by", lambda row: row[3]),
        ("made from", lambda row: row[4]),
    )


def _recordings_table(chain: Chain) -> Table | None:
    """Return the recordings that the valve was identified from; there may be many, so each takes one line."""
    if chain.valve is None:
        return None
    return table_of(
        "Recordings that the valve was identified from",
        chain.valve.made_from,
        ("file", lambda row: row.source),
        ("SHA-256", lambda row: Cell(text=row.sha256, kind="code")),
    )


def _hash(digest: str) -> Cell:
    return Cell(text=digest, kind="hash")


def _hashes_table(chain: Chain) -> Table | None:
    """Return the hashes of what was tried: sources, object, outputs; and of the firmware's files."""
    rows = []
    for each in chain.evidence.inputs if chain.evidence else ():
        rows += [
            (f"C of the {each.side} core that was compiled", each.core_sha256),
            (f"object of the {each.side} core that was tried", each.object_sha256),
            (f"compare values of all {whole(each.inputs)} inputs, 64 bits", each.outputs_hash),
        ]
    rows += chain.firmware.files.items() if chain.firmware else ()
    if not rows:
        return None
    return table_of(
        "Hashes of the firmware's files and of what was tried",
        rows,
        ("what", lambda row: row[0]),
        ("SHA-256", lambda row: Cell(text=row[1], kind="code")),
    )
