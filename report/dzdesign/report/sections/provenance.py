"""Sections on requirements, warnings, costs and hashes, and on the lot of which a lot setting is."""

from collections.abc import Callable, Iterator, Sequence

from dzdesign.core.artefact_types import THIS_TOOL, Artefact, schema_of
from dzdesign.core.display import NOT_CHECKED, NOT_REQUIRED
from dzdesign.core.documents import written_by
from dzdesign.core.errors import InputError, and_more
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design import position_loop
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs import lines_of_tests
from dzdesign.design.costs_at_tests import CostAtTest, costs_at_tests
from dzdesign.design.firmware_manifest import setting_words
from dzdesign.design.redesign import without_sensors
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.artefacts import ROLES, Chain
from dzdesign.report.page import (
    Cell,
    Figure,
    Section,
    Table,
    counted,
    finding,
    for_both_sides,
    in_number_font,
    in_units,
    table_of,
    table_of_rows,
    verdict,
    whole,
)
from dzdesign.report.sections.quantities import BRANCHES
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.verification import label_of_untried, untried_requirements

NEVER = "never"
#: Valves of a lot that the page names.
ROWS = 40


def warnings_section(valve: ValveModel | None, compensator: Compensator | None) -> Section:
    """Return the section on warnings, costs, and what is not proved."""
    accepted = compensator.options.get("accept", "") if compensator and compensator.options else ""
    codes = accepted.replace(",", " ").split()
    warnings = []
    for warning in valve.warnings if valve else ():
        source = f"{warning.source}: " if warning.source else ""
        end = ", which it was (--accept)" if warning.code in codes else ""
        warnings.append(f"[{warning.code}] {source}{warning.text}{end}")
    return Section(
        groups=(
            ("Warnings of the recordings", for_both_sides(warnings) or (("None.",) if valve else ())),
            ("What the design costs", for_both_sides(other_costs(compensator)) if compensator else ()),
        )
    )


def provenance_section(chain: Chain) -> Section:
    """Return the section with every hash: of artefacts, recordings, the firmware's files and what was tried."""
    tried = [
        row
        for each in (chain.evidence.inputs if chain.evidence else ())
        for row in (
            (f"C of the {each.side} core that was compiled", each.core_sha256),
            (f"object of the {each.side} core that was tried", each.object_sha256),
            (f"compare values of all {whole(each.inputs)} inputs, 64 bits", each.outputs_hash),
        )
    ]
    tried += chain.firmware.files.items() if chain.firmware else ()
    recordings = [(each.source, each.sha256) for each in chain.valve.made_from] if chain.valve else []
    of_hashes = (
        ("Recordings that the valve was identified from", "file", recordings),
        ("Hashes of the firmware's files and of what was tried", "what", tried),
    )
    tables = [
        table_of_rows(caption, (what, "SHA-256"), [(name, Cell(text=digest, kind="code")) for name, digest in rows])
        for caption, what, rows in of_hashes
        if rows
    ]
    return Section(tables=(_artefacts_table(chain), *tables), lines=tuple(_options(chain)))


def _options(chain: Chain) -> Iterator[str]:
    """Yield the options that each artefact was made with."""
    stated = chain.valve.options if chain.valve else None
    if stated:
        yield f"Options of identify: {', '.join(setting_words(stated.texts))}."
    if chain.compensator and chain.compensator.options:
        yield f"Options of design: {', '.join(setting_words(chain.compensator.options))}."


def _artefacts_table(chain: Chain) -> Table:
    """Return which file made which, from the firmware's evidence back to the recordings."""
    rows: list[tuple[Cell | str, ...]] = []
    for role, (label, kind) in ROLES.items():
        artefact: Artefact | None = getattr(chain, role)
        if artefact:
            place, tool = chain.places[role], artefact.tool
            sources = ", ".join(each.source for each in artefact.made_from) or "–"
            if role == "valve":
                sources = counted(len(artefact.made_from), "recording")
            # The page states its own version; an artefact of another one says so.
            other = "" if tool == THIS_TOOL else f"made by {tool.name} {tool.version}"
            digest = Cell(text=place.sha256, kind="hash")
            rows.append((label, Cell(text=place.name, more=other), digest, sources))
        elif written_by(schema_of(kind)):
            rows.append((label, Cell(text="missing or not used", kind="open"), "", ""))
    columns = ("artefact", "file", "SHA-256", "made from")
    return table_of_rows("Each artefact with the SHA-256 of its bytes, and what it was made from", columns, rows)


def remaining_section(compensator: Compensator) -> Section:
    """Return the section with a table a side, what a fixed offset would leave, and a position loop's largest gain."""
    tables = [_table(compensator, sign, costs) for sign, costs in _costs(compensator)]
    loops = (f"{line[:1].upper()}{line[1:]}." for line in position_loop.in_words(compensator))
    return Section(tables=tables, lines=for_both_sides((*_fixed(compensator), *loops)))


def _fixed(compensator: Compensator) -> Iterator[str]:
    fixed = without_sensors(compensator)
    if fixed.onset is not None:
        at = compensator.valve.recorded_units.text(compensator.reading_flow_L_min, ".2f L/min")
        read = "" if fixed.reading is None else f", {fixed.reading:.2%} read at {at}"
        yield f"One fixed offset, which needs no pressure sensors, would leave {fixed.onset:.2%} on opening{read}."


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
    units = compensator.valve.recorded_units.of_side(compensator.valve.side_name(sign))
    read = units.text(compensator.reading_flow_L_min, ".2f L/min")
    caption = f"Dead zone by design, in per cent of command, at the onset (knee) and read at {read}"
    if compensator.two_sided:
        caption += f"; {compensator.valve.side_name(sign)} commands"
    columns: list[tuple[str, Callable[[CostAtTest], Cell]]] = [
        in_units("dP", "dp_MPa", ".2f MPa", units),
        in_units("offset", "offset_V", ".3f V", units),
        *((f"onset, {branch} (%)", _onset(branch, units)) for branch in BRANCHES),
        *((f"read, {branch} (%)", _read(branch)) for branch in BRANCHES),
        ("ideal line (%)", lambda one: _percent(one.ideal)),
    ]
    if compensator.machine is not None:
        columns.insert(4, ("opening at the machine's other end (%)", lambda one: _percent(one.last_opening)))
    if compensator.transition_codes > 0:
        columns.append(in_units("flow on closing at the transition's end", "at_end_L_min", ".2f L/min", units))
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


def checks_sections(evidence: Evidence | None) -> dict[str, Section]:
    """Return the sections "missed", on what does not hold or was not checked, and "checks", on all else."""
    if evidence is None:
        return {"checks": Section(missing=f"{NOT_CHECKED}: no evidence is here; `dzdesign verify` makes it.")}
    held: list[tuple[Cell | str, ...]] = []
    missed: list[tuple[Cell | str, ...]] = []
    for check in evidence.checks:
        (held if check.holds else missed).append((verdict(check.holds), check.name, finding(check.text)))
        held += [(NOT_REQUIRED, check.name, finding(found)) for found in check.not_required]
    untried = untried_requirements(evidence)
    for each in untried:
        label = label_of_untried(each)
        sign = Cell(text=f"? {label}", kind="open" if label == NOT_CHECKED else "")
        held.append((sign, each.title, finding(f"to try it: {each.how}")))
    columns = ("verdict", "requirement", "figures")
    count = len(evidence.checks)
    counts = f"{count - len(missed)} of {count} requirements hold, {len(untried)} not tried"
    of_missed = table_of_rows("Requirements that do not hold, or were not checked", columns, missed)
    return {
        "checks": Section(tables=(table_of_rows(counts, columns, held),)),
        "missed": Section(tables=(of_missed,) if missed else ()),
    }


# --- of how many valves a lot setting is, and the worst of them ----------------------------------------------


def carrier_of(compensator: Compensator) -> str:
    """Return the name, in the lot, of the valve that the file of a lot setting holds."""
    names = (each.name for each in compensator.lot if each.valve_sha256 == compensator.valve_json_sha256)
    return next(names, "the valve in compensator.json")


def lot_figures(chain: Chain) -> tuple[Figure, ...]:
    """Return what the page of a lot setting leads with; none of a valve's own."""
    compensator = chain.compensator
    if compensator is None or not compensator.lot:
        return ()
    first = Figure(
        label="Lot setting",
        value=f"of {len(compensator.lot)} valves",
        note=f"one law for all; the file holds one of them, {carrier_of(compensator)}, its carrier",
    )
    return (first, _worst(chain.evidence, chain.recorded_units))


def _worst(evidence: Evidence | None, units: RecordedUnits) -> Figure:
    found = [each.lot for each in evidence.inputs if each.lot] if evidence else []
    if not found:
        return Figure(
            label="Worst valve of the lot", value=NOT_CHECKED, kind="open",
            note="no evidence here compares the C code with the bounds of each valve",
        )  # fmt: skip
    worst = min(found, key=lambda each: each.smallest_margin_V)
    over = {name for each in found for name in each.over_compensated}
    return Figure(
        label=f"Worst valve of the lot: {worst.worst}",
        value=units.text(1e3 * worst.smallest_margin_V, ".3f mV"),
        note="margin of the C code's compare values at zero command under its own lower bound, at "
        f"{units.text(worst.worst_dp_MPa, '.2f MPa')}; {len(over)} of {min(each.valves for each in found)} valves "
        "over-compensated",
        kind="bad" if over else "text",
    )


def lot_section(compensator: Compensator) -> Section:
    """Return the section on the lot of a lot setting."""
    return Section(
        lines=(
            f"One setting for {len(compensator.lot)} valves, each with bounds of its own in compensator.json: "
            f"{and_more([valve.name for valve in compensator.lot], ROWS)}. Lot SHA-256 {compensator.lot_sha256}.",
            f"All else in this report that is of one valve (recordings, thresholds, β, certificate, closed loop) is of "
            f"{carrier_of(compensator)}, the carrier.",
            "What the setting costs each valve stands in the report of dzdesign batch.",
        )
    )
