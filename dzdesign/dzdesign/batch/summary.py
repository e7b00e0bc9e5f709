"""Content of batch.json: the result of a lot, from its table and its lot setting."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile, to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.recorded_units import RecordedUnits, common_units, shown_in
from dzdesign.design.compensator import Compensator
from dzdesign.report.lot.spread import spreads_of
from dzdesign.report.lot.summary import (
    OK,
    VALVES,
    FailedValve,
    LotSettingSummary,
    LotSummary,
    SmallestMargin,
    UntestedPressures,
)

if TYPE_CHECKING:
    from polars import DataFrame

    from dzdesign.design.lot_setting import LotSetting

SETTING_NAME = "lot_compensator.json"


def lot_setting_of(designed: "Mapping[str, Compensator]") -> "tuple[LotSetting | None, str | None]":
    """Return the lot setting of the calibrated valves, by name; or why there is none."""
    from dzdesign.design.lot_setting import lot_setting

    try:
        with shown_in(units_of_lot(designed)):
            return lot_setting(designed), None
    except (InputError, RequirementError) as error:
        return None, str(error)


def summary_of(
    table: "DataFrame", *, files: Mapping[str, bytes], made_from: Mapping[str, bytes], **others: Any
) -> LotSummary:
    """Return what batch.json says of a finished lot.

    `files` of the table and `made_from`, the manifest of each valve's folder by the valve's name, are contents; the
    others are keys of `LotSummary`.
    """
    warnings: dict[str, list[str]] = {}
    for name, codes in table.select("name", "warnings").iter_rows():
        for code in codes.split():
            warnings.setdefault(code, []).append(name)
    return LotSummary(
        tool=THIS_TOOL,
        made_from=tuple(
            SourceFile(source=f"{VALVES}/{name}/{MANIFEST_NAME}", sha256=sha256_of(content))
            for name, content in made_from.items()
        ),
        valves=len(table),
        failed=tuple(
            FailedValve(name=name, status=status, reason=reason)
            for name, status, reason in table.select("name", "status", "reason").iter_rows()
            if status != OK
        ),
        warnings={code: tuple(names) for code, names in sorted(warnings.items())},
        files={name: sha256_of(content) for name, content in files.items()},
        quantiles={spread.column: spread.at for spread in spreads_of(table)},
        **others,
    )


def units_of_lot(designed: "Mapping[str, Compensator]") -> RecordedUnits:
    """Return the units in which all valves of a lot were recorded; V, MPa or L/min where they differ."""
    every = [each.valve.recorded_units for each in designed.values()]
    return common_units(
        {
            "command": tuple(units.command for units in every),
            "pressure": tuple(units.pressure for units in every),
            "flow": tuple(units.flow for units in every),
        }
    )


def setting_summary(setting: "LotSetting") -> LotSettingSummary:
    """Return what batch.json says of the lot setting."""
    from dzdesign.design.lot_valves import lacking_in, without_narrow

    lot = setting.compensator.lot
    lacking = lacking_in(lot)
    narrow, wider = without_narrow(lot, lacking)
    untested = tuple(
        UntestedPressures(
            name=each.name,
            side="positive" if each.sign > 0 else "negative",
            dp_MPa=each.dp_MPa,
        )
        for each in lacking
        if each.name in narrow
    )
    return LotSettingSummary(
        file=SETTING_NAME,
        sha256=sha256_of(to_json_bytes(setting.compensator)),
        dp_MPa=setting.dp_MPa,
        untested=untested,
        dp_without_MPa=wider,
        carrier=setting.carrier,
        binding=setting.binding,
        checked=SmallestMargin(
            valves=len(setting.margins),
            worst=setting.worst.name,
            dp_MPa=round(float(setting.worst.dp_MPa), 4),
            smallest_margin_V=round(float(setting.worst.margin_V), 7),
        ),
    )
