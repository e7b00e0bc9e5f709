"""Test conditions: how the ramps were recorded, with which meter, oil and temperature."""


from collections.abc import Iterable, Mapping, Sequence
from typing import Literal

from msgspec import UnsetType

from dzdesign.assess.assessment import Assessment
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.valve.model import ValveModel, lag_in_words
from dzdesign.identify.valve.ramp_conditions import RampConditions
from dzdesign.report.cells import Cell, Table, in_number_font
from dzdesign.report.page import Section
from dzdesign.report.sections.curves import measured_curve_of

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
