"""A lot setting in the report of its firmware: of how many valves it is, the worst of them, and the bounds of each."""



from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.verdicts import NOT_CHECKED
from dzdesign.design.compensator import Compensator
from dzdesign.design.lot_valves import LotSide, LotValve
from dzdesign.identify.valve.model import SIDES
from dzdesign.report.artefacts import Chain
from dzdesign.report.cells import Cell, in_number_font, recorded, table_of
from dzdesign.report.figure import csv_text
from dzdesign.report.page import Figure, Section
from dzdesign.verify.evidence import Evidence

#: Valves in the table of the page; all of them stand in the CSV.
ROWS = 40
Row = tuple[LotValve, str, LotSide]

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
    """Return the section on the lot of a lot setting: each valve, and its own bounds."""
    rows = [(valve, name, side) for name in SIDES for valve in compensator.lot if (side := getattr(valve, name))]
    more = f": the first {ROWS} of {len(rows)}" if len(rows) > ROWS else ""
    units = compensator.valve.recorded_units

    def tested(row: Row) -> Cell:
        ends = (units.number(end(row[2].dp_MPa), ".2f MPa") for end in (min, max))
        return in_number_font(" to ".join(dict.fromkeys(ends)))

    table = table_of(
        f"The valves of the lot, each with its own bounds{more}",
        rows[:ROWS],
        ("valve", lambda row: row[0].name),
        ("commands", lambda row: row[1]),
        (f"tested ({units.label('MPa')})", tested),
        (f"least bound ({units.label('V')})",
         lambda row: recorded(min(row[2].u_lower_V), ".3f V", units.of_side(row[1]))),
        ("confidence (%)", lambda row: in_number_font(f"{100 * row[2].confidence:.6g}")),
        csv=csv_text(
            ("valve", "side", "dp_MPa", "lower_bound_V"),
            ((valve.name, name, *test) for valve, name, side in rows
             for test in zip(side.dp_MPa, side.u_lower_V, strict=True)),
        ),
        name="lot",
    )  # fmt: skip
    return Section(
        lines=(
            f"One setting for {len(compensator.lot)} valves, each with bounds of its own; lot SHA-256 "
            f"{compensator.lot_sha256}.",
            f"All else in this report that is of one valve (recordings, thresholds, β, certificate, closed loop) is of "
            f"{carrier_of(compensator)}, the carrier.",
            "What the setting costs each valve stands in the report of dzdesign batch.",
        ),
        tables=(table,),
    )
