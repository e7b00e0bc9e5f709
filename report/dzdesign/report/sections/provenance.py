"""Sections on what the report was made from, and on what it does not cover."""

from collections.abc import Callable, Iterator, Sequence

from dzdesign.core.artefact_types import Artefact, schema_of
from dzdesign.core.documents import written_by
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.verdicts import NOT_CHECKED, NOT_REQUIRED
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs import lines_of_tests
from dzdesign.design.costs_at_tests import CostAtTest, costs_at_tests
from dzdesign.design.pressure_inputs import signals_in_words
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.artefacts import ROLES, Chain, standing_warnings
from dzdesign.report.cells import (
    Cell,
    Table,
    counted,
    finding,
    in_number_font,
    recorded,
    table_of,
    unasked,
    verdict,
    whole,
)
from dzdesign.report.page import Section
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.verification import label_of_untried, untried_requirements


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
    for role, (label, kind) in ROLES.items():
        artefact: Artefact | None = getattr(chain, role)
        if artefact:
            place, tool = chain.places[role], artefact.tool
            sources = ", ".join(each.source for each in artefact.made_from) or "–"
            if role == "valve":
                sources = counted(len(artefact.made_from), "recording")
            rows.append((label, place.name, _hash(place.sha256), f"{tool.name} {tool.version}", sources))
        elif written_by(schema_of(kind)):
            rows.append((label, Cell(text="missing or not used", kind="open"), "", "", ""))
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


BRANCHES = ("opening", "closing")
NEVER = "never"


def remaining_section(compensator: Compensator) -> Section:
    """Return the section with a table a side."""
    return Section(tables=[_table(compensator, sign, costs) for sign, costs in _costs(compensator)])


def other_costs(compensator: Compensator) -> tuple[str, ...]:
    """Return the costs of a design without those that its table holds."""
    held = {line for sign, _ in _costs(compensator) for line in lines_of_tests(compensator, sign)}
    return tuple(line for line in compensator.costs if line not in held)


def _costs(compensator: Compensator) -> Iterator[tuple[int, Sequence[CostAtTest]]]:
    for sign in compensator.signals.signs:
        try:
            costs = costs_at_tests(compensator, sign)
        except InputError:  # an output that never opens the valve; the lines of its costs say so
            continue
        yield sign, costs


def _table(compensator: Compensator, sign: int, costs: Sequence[CostAtTest]) -> Table:
    units = compensator.valve.recorded_units.of_side(SIDE_NAMES[sign])
    read = units.text(compensator.reading_flow_L_min, ".2f L/min")
    caption = f"Dead zone by design, in per cent of command, at the onset (knee) and read at {read}"
    if compensator.negative is not None:
        caption += f"; {SIDE_NAMES[sign]} commands"
    columns: list[tuple[str, Callable[[CostAtTest], Cell]]] = [
        (f"dP ({units.label('MPa')})", lambda one: recorded(one.dp_MPa, ".2f MPa", units)),
        (f"offset ({units.label('V')})", lambda one: recorded(one.offset_V, ".3f V", units)),
        *((f"onset, {branch} (%)", _onset(branch, units)) for branch in BRANCHES),
        *((f"read, {branch} (%)", _read(branch)) for branch in BRANCHES),
        ("ideal line (%)", lambda one: _percent(one.ideal)),
    ]
    if compensator.machine is not None:
        columns.insert(4, ("opening at the machine's other end (%)", lambda one: _percent(one.last_opening)))
    if compensator.transition_codes > 0:
        flow = f"flow on closing at the transition's end ({units.label('L/min')})"
        columns.append((flow, lambda one: recorded(one.at_end_L_min, ".2f L/min", units)))
    columns.append(("drive at full command (%)", _drive))
    return table_of(caption, costs, *columns)


def _percent(share: float | None) -> Cell:
    if share is not None and share > 1:
        return in_number_font(NEVER)
    return in_number_font("–" if share is None else f"{100 * share:.2f}")


def _drive(cost: CostAtTest) -> Cell:
    """Return the drive at full command, and the command from which it no longer rises."""
    reached = "" if cost.limited_from is None else f" from {100 * cost.limited_from:.1f} % on"
    return in_number_font(f"{100 * cost.full:.2f}{reached}")


def _read(branch: str) -> Callable[[CostAtTest], Cell]:
    return lambda one: _percent(one.read.get(branch))


def _onset(branch: str, units: RecordedUnits) -> Callable[[CostAtTest], Cell]:
    """Return the dead zone to the knee, or by how much the offset lies above it."""

    def cell(one: CostAtTest) -> Cell:
        above = one.above_knee_V.get(branch)
        if above is None:
            return _percent(one.onset.get(branch))
        return Cell(text=f"none: {units.text(above, '.3f dV')} above the knee")

    return cell


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
