"""The common setting of a batch, and what it would cost without the valves that hold it down."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from dzdesign.batch.table import Calibrated, extra_dead_zone
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.report.lot.spread import quantiles

if TYPE_CHECKING:
    from dzdesign.design.lot_setting import CommonSetting

COST = "common_extra_dead_zone_percent"


def common_of(found: Mapping[str, Calibrated]) -> "tuple[CommonSetting | None, str]":
    """Return the common setting of the valves that are calibrated, or why there is none.

    Parameters
    ----------
    found : mapping
        Name to what is in the valve's folder.
    """
    from dzdesign.design.lot_setting import common_setting

    designed = {name: each.designed for name, each in found.items() if each.designed is not None}
    try:
        return common_setting(designed), ""
    except (InputError, RequirementError) as error:
        return None, str(error)


def without_binding(found: Mapping[str, Calibrated], common: "CommonSetting | None") -> dict[str, Any] | None:
    """Return what a common setting costs if the valves that hold it down keep settings of their own.

    That setting is designed and proved like the other one. Leaving out other valves would change nothing: what holds
    the offset down stays.

    Parameters
    ----------
    found : mapping
        Name to what is in the valve's folder.
    common : CommonSetting or None
        Of all of them.

    Returns
    -------
    dict or None
        Valves left out, and quantiles of the dead zone that the setting of the others leaves beyond their own, in per
        cent of command, or why there is no such setting. None where fewer than two valves would be left.
    """
    if common is None:
        return None
    rest = {name: each for name, each in found.items() if each.designed is not None and name not in common.binding}
    if len(rest) < 2:
        return None
    other, why_not = common_of(rest)
    if other is None:
        return {"why_not": why_not}
    designed = [each.designed for each in rest.values() if each.designed is not None]
    signs = {"": 1} if common.compensator.negative is None else {"positive_": 1, "negative_": -1}
    return {
        "left_out": list(common.binding),
        "quantiles": {
            side + COST: quantiles([extra_dead_zone(each, other, sign) for each in designed])
            for side, sign in signs.items()
        },
    }
