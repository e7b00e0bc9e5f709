"""Rows of a lot's table, made from the valves' folders alone, whenever these were written."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.errors import InputError
from dzdesign.identify.valve.test_record import checked_record
from dzdesign.report.compensator_sides import SIGNS, standing_warnings
from dzdesign.report.lot.table import HASHED, OUTPUT_HASH, SideFigures, TableRow
from dzdesign.report.lot.valve_folder import ValveFolder
from dzdesign.report.lot.valve_names import by_name

if TYPE_CHECKING:
    from dzdesign.design.compensator import Compensator
    from dzdesign.identify.valve.side_model import SideModel


def table_rows(
    valves: Sequence[ValveFolder],
    lot_law: "Compensator | None" = None,
    records: Mapping[str, Mapping[str, str]] | None = None,
) -> list[TableRow]:
    """Return the rows of valves as read back, in the order of the names.

    `lot_law` is the lot setting, for the cost of it at each valve; `records` what each valve was given as its record,
    for those without a valve.json that has it.
    """
    both = any(each.compensator and each.compensator.negative for each in valves)
    sides = tuple(SIGNS) if both else ("",)
    return [
        TableRow(
            name=each.name,
            status=each.manifest.status,
            reason=each.manifest.reason,
            sides={side: _figures(each.compensator, SIGNS.get(side, 1), lot_law) for side in sides},
            warnings=_warnings(each.compensator),
            hashes=_hashes(each),
            record=_record(each, (records or {}).get(each.name, {})),
            outputs=_outputs(each),
        )
        for each in sorted(valves, key=lambda valve: by_name(valve.name))
    ]


def _warnings(compensator: "Compensator | None") -> tuple[str, ...]:
    """Return the codes of the warnings that stand beside a compensator, each once."""
    found = standing_warnings(compensator.valve, compensator) if compensator else ()
    return tuple(dict.fromkeys(each.code for each in found))


def _hashes(valve: ValveFolder) -> dict[str, str]:
    files = {column: valve.manifest.files.get(file) for column, file in HASHED.items()}
    return {name: value for name, value in {"inputs_sha256": valve.manifest.inputs_sha256, **files}.items() if value}


def _outputs(valve: ValveFolder) -> dict[str, str]:
    """Return the cells about the outputs of a valve: verdict and hash of the manifest."""
    cells: dict[str, str] = {}
    for each in valve.manifest.outputs:
        cells[each.target] = each.verdict
        cells[each.target + OUTPUT_HASH] = valve.manifest.files.get(f"{each.folder}/{MANIFEST_NAME}", "")
    return cells


def _record(valve: ValveFolder, given: Mapping[str, str]) -> Mapping[str, str]:
    """Return a valve's record: of its valve.json, or as it was given if that can be a record."""
    if valve.compensator:
        return valve.compensator.valve.record
    try:
        return checked_record(given.items(), "the record")
    except InputError:  # such a valve has failed, and says why itself
        return {}


def _figures(designed: "Compensator | None", sign: int, lot_law: "Compensator | None") -> SideFigures:
    """Return the columns of one side; numbers as valve.json has them."""
    if designed is None or (sign < 0 and designed.negative is None):
        return SideFigures()
    own, side = designed, _side(designed, sign)
    test = min(side.tests, key=lambda test: abs((test.dp_MPa or 0.0) - (side.reference.dp_MPa or 0.0)))
    left = {
        branch: round(100 * max(values), 5)
        for branch, values in _remaining(own, side, sign).items()
    }
    curve = side.certified[own.side(sign).certificate.guard]
    code = round(own.signals.dp_code(Fraction(repr(side.reference.dp_MPa))))
    return SideFigures(
        dp0_MPa=side.reference.dp_MPa,
        knee_opening_V=test.u_knee_rising_V,
        knee_closing_V=test.u_knee_falling_V,
        knee_se_V=test.u_knee_se_V,
        bound_V=curve.u_lower_V[side.tests.index(test)],
        offset_V=round(float(own.beta(code, sign) * own.side(sign).u_min0_over_u_max * own.u_max_V), 7),
        trend=side.trend,
        highest_dp_MPa=side.beta.dp_MPa[-1],
        beta_at_highest_dp=side.beta.beta[-1],
        k_x_max_over_u_max=side.k_x_max_over_u_max,
        dead_zone_opening_percent=left.get("opening"),
        dead_zone_closing_percent=left.get("closing"),
        lot_extra_dead_zone_percent=extra_dead_zone(designed, lot_law, sign) if lot_law else None,
    )


def _side(designed: "Compensator", sign: int) -> "SideModel":
    return designed.valve.sides["positive" if sign > 0 else "negative"]


def _remaining(law: "Compensator", side: "SideModel", sign: int) -> dict[str, list[float]]:
    """Return the dead zone that a law leaves at each of a valve's tests, by branch, as shares of command."""
    from dzdesign.design.costs_at_tests import remaining_dead_zone

    left = [remaining_dead_zone(law, test, sign) for test in side.tests]
    return {branch: [each[branch] for each in left] for branch in left[0]}


def extra_dead_zone(designed: "Compensator", lot_law: "Compensator", sign: int) -> float:
    """Return how much more dead zone the lot setting leaves than a valve's own, in percent of command.

    At the pressure drop of its tests where that is most, on opening; on closing where no opening was recorded.
    """
    side = _side(designed, sign)
    branch = "opening" if side.tests[0].u_knee_rising_V is not None else "closing"
    with_lot, with_own = (_remaining(law, side, sign)[branch] for law in (lot_law, designed))
    return round(100 * max(lot - own for lot, own in zip(with_lot, with_own, strict=True)), 5)
