"""Content of batch.json: the result of a lot, from its table and its lot setting."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME, sha256_of
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile, to_json_bytes
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits, common_units
from dzdesign.core.worded import in_units
from dzdesign.design.compensator import Compensator
from dzdesign.report.compensator_sides import SIGNS
from dzdesign.report.lot.budget import LotBudget
from dzdesign.report.lot.output_types import LotOutput
from dzdesign.report.lot.spread import quantiles, spreads_of
from dzdesign.report.lot.summary import (
    FailedValve,
    LotFirmware,
    LotSettingSummary,
    LotSummary,
    SettingOfOthers,
    SmallestMargin,
    UntestedPressures,
)
from dzdesign.report.lot.table import TableRow, column_of
from dzdesign.report.lot.table_rows import extra_dead_zone
from dzdesign.report.lot.valve_folder import VALVES

if TYPE_CHECKING:
    from dzdesign.design.lot_setting import LotSetting

SETTING_NAME = "lot_compensator.json"


def lot_setting_of(designed: "Mapping[str, Compensator]") -> "tuple[LotSetting | None, str | None]":
    """Return the lot setting of the calibrated valves, by name; or why there is none."""
    from dzdesign.design.lot_setting import lot_setting

    try:
        return lot_setting(designed), None
    except (InputError, RequirementError) as error:
        return None, in_units(error, units_of_lot(designed))


def setting_files(setting: "LotSetting") -> dict[str, bytes]:
    """Return the file of the lot setting."""
    return {SETTING_NAME: to_json_bytes(setting.compensator)}


def summary_of(
    rows: Sequence[TableRow],
    *,
    files: Mapping[str, bytes],
    verified: bool,
    setting: LotSettingSummary | None = None,
    why_no_setting: str | None = None,
    made_from: Mapping[str, bytes],
    anomalies: Sequence[str] = (),
    budget: LotBudget | None = None,
    firmware: LotFirmware | None = None,
    outputs: Mapping[str, LotOutput] | None = None,
    units: RecordedUnits = AS_COMPUTED,
) -> LotSummary:
    """Return what batch.json says of a finished lot.

    `files` of the table and `made_from`, the manifest of each valve's folder by the valve's name, are contents; of lot
    setting and reason why there is none exactly one is given.
    """
    warnings: dict[str, list[str]] = {}
    for row in rows:
        for code in row.warnings:
            warnings.setdefault(code, []).append(row.name)
    return LotSummary(
        tool=THIS_TOOL,
        made_from=tuple(
            SourceFile(source=f"{VALVES}/{name}/{MANIFEST_NAME}", sha256=sha256_of(content))
            for name, content in made_from.items()
        ),
        valves=len(rows),
        failed=tuple(
            FailedValve(name=row.name, status=row.status, reason=row.reason) for row in rows if row.status != "ok"
        ),
        verified=verified,
        warnings={code: tuple(names) for code, names in sorted(warnings.items())},
        anomalies=tuple(anomalies),
        files={name: sha256_of(content) for name, content in files.items()},
        quantiles={spread.column: spread.at for spread in spreads_of(rows)},
        lot_setting=setting,
        why_no_lot_setting=why_no_setting,
        budget=budget,
        firmware=firmware,
        outputs=outputs or {},
        recorded_units=units,
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


def setting_summary(setting: "LotSetting", designed: "Mapping[str, Compensator]") -> LotSettingSummary:
    """Return what batch.json says of the lot setting of these calibrated valves."""
    from dzdesign.design.lot_valves import lacking_in, without_narrow

    lot = setting.compensator.lot
    lacking = lacking_in(lot)
    narrow, wider = without_narrow(lot, lacking)
    untested = []
    for each in lacking:
        coarser = each.coarser_V if each.name in setting.binding else 0.0
        full = float(setting.compensator.side(each.sign).drive_range_over_u_max * setting.compensator.u_max_V)
        untested.append(
            UntestedPressures(
                name=each.name,
                side="positive" if each.sign > 0 else "negative",
                dp_MPa=each.dp_MPa,
                narrows=each.name in narrow,
                coarser_V=round(each.coarser_V, 7),
                cost_percent=round(100 * coarser / full, 5),
            )
        )
    return LotSettingSummary(
        file=SETTING_NAME,
        sha256=sha256_of(setting_files(setting)[SETTING_NAME]),
        dp_MPa=setting.dp_MPa,
        untested=tuple(untested),
        dp_without_MPa=wider,
        carrier=setting.carrier,
        binding=setting.binding,
        smallest_margin_V={
            name: tuple(round(float(each.smallest_margin_V), 7) for each in certificates)
            for name, certificates in setting.proved.items()
        },
        checked=SmallestMargin(
            valves=len(setting.margins),
            worst=setting.worst.name,
            dp_MPa=round(float(setting.worst.dp_MPa), 4),
            smallest_margin_V=round(float(setting.worst.margin_V), 7),
        ),
        without_binding=_without_binding(setting, designed),
    )


def _without_binding(setting: "LotSetting", designed: "Mapping[str, Compensator]") -> SettingOfOthers | None:
    """Return what a lot setting costs if the valves that hold it down keep settings of their own.

    That setting is designed and proved like the other one. Leaving out other valves would change nothing: what holds
    the offset down stays. None where fewer than two valves would be left.
    """
    rest = {name: each for name, each in designed.items() if name not in setting.binding}
    if len(rest) < 2:
        return None
    other, why_not = lot_setting_of(rest)
    if other is None:
        return SettingOfOthers(left_out=setting.binding, quantiles={}, why_not=why_not)
    sides = {"": 1} if setting.compensator.negative is None else SIGNS
    return SettingOfOthers(
        left_out=setting.binding,
        quantiles={
            column_of(side, "lot_extra_dead_zone_percent"): quantiles(
                [extra_dead_zone(each, other.compensator, sign) for each in rest.values()]
            )
            for side, sign in sides.items()
        },
    )
