"""Content of batch.json: the result of a lot, from its table and its lot setting."""

from collections.abc import Mapping, Sequence
from statistics import median
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME, sha256_of
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile, to_json_bytes
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits, common_units
from dzdesign.core.worded import in_units
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.model import SIDES
from dzdesign.report.artefacts import laws_of
from dzdesign.report.lot.spread import quantiles, spreads_of
from dzdesign.report.lot.summary import (
    OK,
    VALVES,
    FailedValve,
    LotBudget,
    LotBudgetLine,
    LotFirmware,
    LotOutput,
    LotSettingSummary,
    LotSummary,
    SettingOfOthers,
    SmallestMargin,
    UntestedPressures,
)
from dzdesign.report.lot.table import column_of, extra_dead_zone

if TYPE_CHECKING:
    from polars import DataFrame

    from dzdesign.design.lot_setting import LotSetting

SETTING_NAME = "lot_compensator.json"
#: Of a number in mV and of a price in percent: finer than any error here.
DIGITS = 5


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
    table: "DataFrame",
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
        verified=verified,
        warnings={code: tuple(names) for code, names in sorted(warnings.items())},
        anomalies=tuple(anomalies),
        files={name: sha256_of(content) for name, content in files.items()},
        quantiles={spread.column: spread.at for spread in spreads_of(table)},
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
    sides = {"": 1} if setting.compensator.negative is None else SIDES
    return SettingOfOthers(
        left_out=setting.binding,
        quantiles={
            column_of(side, "lot_extra_dead_zone_percent"): quantiles(
                [extra_dead_zone(each, other.compensator, sign) for each in rest.values()]
            )
            for side, sign in sides.items()
        },
    )


def lot_budget(designed: Mapping[str, Compensator]) -> LotBudget | None:
    """Return the budgets of calibrated valves as one; None without a valve."""
    if not designed:
        return None
    found: dict[tuple[str, str], list[tuple[str, float, float]]] = {}
    for compensator in designed.values():
        for name, law in laws_of(compensator).items():
            for line in law.budget.lines if law.budget else ():
                entry = (line.origin, max(line.contribution_mV), 100 * line.price)
                found.setdefault((name, line.component), []).append(entry)
    return LotBudget(
        certified_of=tuple(sorted({each.certified_of for each in designed.values()})),
        lines=tuple(
            LotBudgetLine(
                side=side,
                component=component,
                origin=tuple(dict.fromkeys(origin for origin, _, _ in entries)),
                contribution_mV=round(max(mV for _, mV, _ in entries), DIGITS),
                price_percent=tuple(  # type: ignore[arg-type]
                    round(of([price for _, _, price in entries]), DIGITS) for of in (min, median, max)
                ),
            )
            for (side, component), entries in found.items()
        ),
    )
