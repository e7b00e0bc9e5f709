"""Section on acceptance: the paper's numbers beside ours, and the user's limits on recordings."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Literal

from msgspec import UnsetType

from dzdesign.assess.assessment import Assessment
from dzdesign.assess.limits import LimitResult
from dzdesign.assess.quantities import Quantity, Reading
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.valve.model import ValveModel, lag_in_words
from dzdesign.identify.valve.ramp_conditions import RampConditions
from dzdesign.report.cells import Cell, Table, in_number_font, number, recorded, table_of, verdict
from dzdesign.report.page import Section
from dzdesign.report.reproduction import Outcome, PaperNumber, Reproduction
from dzdesign.report.sections.curves import measured_curve_of

#: Decimals in the unit of a quantity.
DECIMALS = {"%": 2, "L/min": 3, "L/min/V": 4}
IN_RECORDED_UNITS = ("L/min", "L/min/V")


def acceptance_section(assessment: Assessment | None, reproduction: Reproduction | None) -> Section | None:
    """Return the section on acceptance; None where nothing was accepted by."""
    tables: list[Table] = []
    if assessment:
        tables += [_limits_table(assessment)] if assessment.limits else []
        tables.append(_before_after_table(assessment))
    if reproduction:
        for valve in dict.fromkeys(row.valve for row in reproduction.numbers):
            tables.append(_paper_table(valve, [row for row in reproduction.numbers if row.valve == valve]))
    return Section(tables=tables) if tables else None


def _paper_table(valve: str, rows: Sequence[PaperNumber]) -> Table:
    """Return the numbers of one valve; why each may differ stands below, once."""
    texts = dict.fromkeys(text for row in rows for text in _notes(row))
    marks = {text: f"[{place}]" for place, text in enumerate(texts, start=1)}

    def ours(row: PaperNumber, by: str) -> Cell:
        return in_number_font(" / ".join(_ours(each) for each in row.outcomes if each.by == by) or "–")

    return table_of(
        f"The paper's {valve}: without, and with an assumed hysteresis where two values stand",
        rows,
        ("quantity", lambda row: row.quantity),
        ("dP (MPa)", lambda row: in_number_font("–" if row.dp_MPa is None else f"{row.dp_MPa:g}")),
        ("published", lambda row: in_number_font(_printed(row))),
        ("bare valve", lambda row: ours(row, "valve")),
        ("paper's law", lambda row: ours(row, "paper's law")),
        ("product", lambda row: ours(row, "product")),
        ("kind", lambda row: row.kind),
        ("agrees, or is missed for a reason", _verdict),
        ("notes", lambda row: in_number_font(" ".join(marks[text] for text in _notes(row)))),
        notes=[f"{mark} {text}" for text, mark in marks.items()],
    )


def _printed(row: PaperNumber) -> str:
    """Return a printed number with its unit; words have none."""
    return f"{row.published} {row.unit}" if row.published[0].isdigit() and row.unit != "1" else row.published


def _notes(row: PaperNumber) -> list[str]:
    """Return what a number's range is made of, why ours misses it, and what else is to be known of it."""
    texts = (row.tolerance, *(each.reason for each in row.outcomes), row.why)
    return [text for text in dict.fromkeys(texts) if text]


def _verdict(row: PaperNumber) -> Cell | str:
    """Return the verdict of a number; only what is predicted can agree."""
    if row.holds is False:
        return verdict(False)
    if row.kind != "predicted":
        return "–"
    return "agrees" if row.agrees else "missed"


def _ours(outcome: Outcome) -> str:
    if outcome.value is None:
        return "not compared"
    text = f"{outcome.value:.2f}"
    return text if outcome.difference is None else f"{text} ({outcome.difference:+.2f})".replace("-", "−")


def _limits_table(assessment: Assessment) -> Table:
    """Return the user's limits with their verdicts."""
    return table_of(
        "The limits that were set",
        assessment.limits,
        ("verdict", lambda one: verdict(one.holds)),
        ("quantity", lambda one: _quantity(assessment, one.quantity).name),
        ("where", lambda one: one.place),
        ("limit", lambda one: in_number_font(_limit(one, assessment.recorded_units))),
        ("found", lambda one: one.text),
    )


def _limit(one: LimitResult, units: RecordedUnits) -> str:
    known = one.unit in IN_RECORDED_UNITS
    return units.text(one.limit, f".4g {one.unit}") if known else f"{one.limit:.4g} {one.unit}"


def _before_after_table(assessment: Assessment) -> Table:
    """Return each quantity before and after, at every pressure drop."""
    units = assessment.recorded_units
    compared = [item for item in assessment.pressures if item.readings("after")]
    rows = [
        (item, quantity, _reading(quantity.unit, both.before, units), _reading(quantity.unit, both.after, units))
        for item in compared or assessment.pressures
        for quantity, both in ((_quantity(assessment, key), both) for key, both in item.quantities.items())
    ]
    return table_of(
        "Recordings without and with the compensator, at the pressure drops that have both",
        [row for row in rows if {row[2], row[3]} - {"–", "not seen"}],
        (f"dP ({units.label('MPa')})", lambda row: recorded(row[0].dp_MPa, ".2f MPa", units)),
        ("commands", lambda row: row[0].side),
        ("quantity", lambda row: row[1].name),
        ("before", lambda row: in_number_font(row[2])),
        ("after", lambda row: in_number_font(row[3])),
        ("unit", lambda row: units.label(row[1].unit) if row[1].unit in IN_RECORDED_UNITS else row[1].unit),
    )


def _quantity(assessment: Assessment, key: str) -> Quantity:
    return assessment.quantities.get(key) or Quantity(name=key, unit="", formula="")


def _reading(unit: str, reading: Reading | None, units: RecordedUnits) -> str:
    """Return a value, or the bound of what can't be seen."""
    if reading is None:
        return "–"
    digits = DECIMALS.get(unit, 3)

    def text(value: float) -> str:
        known = unit in IN_RECORDED_UNITS
        return (recorded(value, f".{digits}f {unit}", units) if known else number(value, digits)).text

    if reading.value is not None:
        return text(reading.value)
    return "not seen" if reading.at_most is None else f"≤ {text(reading.at_most)}"


#: What a record may tell -> words in the names of its entries; the first entry that has one counts.
RECORDED = {
    "Oil": ("oil", "fluid", "öl", "druckflüssigkeit", "hydraulic oil", "hydrauliköl"),
    "Oil temperature": (
        "oil temperature", "temperature", "oil temp", "fluid temperature", "öltemperatur", "temperatur",
        "temperatur der druckflüssigkeit",
    ),
    "Filter": ("filter", "flow filter", "signal filter", "messfilter"),
}  # fmt: skip
Column = Literal["before", "after"]


def conditions_section(valve: ValveModel | None, assessment: Assessment | None) -> Section:
    """Return the section on test conditions; recordings with the compensator have a column of their own."""
    if valve is None and assessment is None:
        return Section(missing="No recordings are here: `dzdesign identify` makes valve.json.")
    units = (assessment or valve).recorded_units  # type: ignore[union-attr]
    columns = [_of_valve(valve)] if assessment is None else [_of_set(assessment, name) for name in ("before", "after")]
    heads = ["recordings"] if assessment is None else ["without the compensator", "with the compensator"]
    rows: list[tuple[str, list[str]]] = [
        ("Ramp rate", [_range([each.rate_V_s for each in found], ".3g V/s", units) for found in columns]),
        ("Sampling", [_hertz(each.sampling_Hz for each in found) for found in columns]),
        ("Samples", [str(sum(each.samples for each in found)) if found else "" for found in columns]),
    ]
    if assessment:
        meter = lag_in_words(assessment.meter.lag_s, assessment.meter.lag_is)
        floor = assessment.meter.floor_L_min
    else:
        meter, floor = (valve.meter.lag_in_words(), valve.meter.floor_L_min) if valve else ("", 0.0)
    rows += [
        ("Flow meter", [f"{meter}; floor {units.text(floor, '.2f L/min')}"]),
        *([("Dither", [valve.dither_in_words])] if valve and valve.dither else []),
        *((name, [_entry(valve.record if valve else {}, known)]) for name, known in RECORDED.items()),
    ]
    missing = [name.lower() for name, values in rows[-len(RECORDED):] if values == [""]]
    hint = (
        f"Not recorded: {', '.join(missing)}. `identify --record \"{missing[0]} = ...\"` writes it into valve.json."
        if missing
        else ""
    )
    return Section(
        tables=(
            Table(
                caption="Recordings",
                columns=("", *heads),
                rows=tuple(
                    (Cell(text=name), *(_cell(values[min(i, len(values) - 1)]) for i in range(len(heads))))
                    for name, values in rows
                ),
            ),
        ),
        missing=hint,
        optional=True,
    )


def _of_valve(valve: ValveModel | None) -> list[RampConditions]:
    found = [test.conditions for side in valve.sides.values() for test in side.tests] if valve else []
    return [each for each in found if not isinstance(each, UnsetType)]


def _of_set(assessment: Assessment, name: Column) -> list[RampConditions]:
    return [curve.conditions for item in assessment.pressures if (curve := measured_curve_of(item, name))]


def _range(values: Sequence[float | None], form: str, units: RecordedUnits) -> str:
    known = [value for value in values if value is not None]
    if not known:
        return ""
    ends = dict.fromkeys(units.number(end, form) for end in (min(known), max(known)))
    return f"{' … '.join(ends)} {units.label(form.partition(' ')[2])}"


def _hertz(values: Iterable[float | None]) -> str:
    known = [value for value in values if value is not None]
    return f"{' … '.join(dict.fromkeys(f'{end:.4g}' for end in (min(known), max(known))))} Hz" if known else ""


def _entry(record: Mapping[str, str], known: Sequence[str]) -> str:
    plain = {" ".join(name.lower().replace("-", " ").replace("_", " ").split()): text for name, text in record.items()}
    return next((plain[name] for name in known if name in plain), "")


def _cell(text: str) -> Cell:
    return in_number_font(text) if text and text[0].isdigit() else Cell(text=text or "not recorded")
