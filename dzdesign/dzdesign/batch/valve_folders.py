"""The folders of a lot's valves, read back, and the table of all of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.documents import read_bytes, sha256_of
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.model import SIDES
from dzdesign.identify.valve.test_record import checked_record
from dzdesign.report.artefacts import standing_warnings
from dzdesign.report.lot.summary import AGAIN, OK, ValveManifest
from dzdesign.report.lot.table import (
    HASHED,
    OUTPUT,
    OUTPUT_HASH,
    RECORD,
    SIDE_COLUMNS,
    Cell,
    by_name,
    column_of,
    frame_of,
    read_manifest,
)

if TYPE_CHECKING:
    from polars import DataFrame


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveFolder:
    """A valve of a lot, as its folder has it: its manifest and, where it was calibrated, valve and compensator."""

    manifest: ValveManifest
    compensator: Compensator | None = None

    @property
    def name(self) -> str:
        """Its name."""
        return self.manifest.name


def read_valve_folder(folder: Path) -> ValveFolder:
    """Read a valve's folder."""
    manifest = read_manifest(folder)
    if manifest.status != OK:
        return ValveFolder(manifest=manifest)
    path = folder / "compensator.json"
    content = read_bytes(path, "compensator of the lot")
    if sha256_of(content) != manifest.files.get(path.name):
        raise InputError(f"'{path}' was changed; take the valve's folder away and {AGAIN}")
    return ValveFolder(manifest=manifest, compensator=read_artefact(content, Compensator, str(path)))


def table_of_valves(
    valves: Sequence[ValveFolder],
    lot_law: Compensator | None = None,
    records: Mapping[str, Mapping[str, str]] | None = None,
) -> "DataFrame":
    """Return the table of valves as read back, in the order of the names.

    `lot_law` is the lot setting, for the cost of it at each valve; `records` what each valve was given as its record,
    for those without a valve.json that has it.
    """
    both = any(each.compensator and each.compensator.negative for each in valves)
    rows: list[dict[str, Cell]] = []
    for each in sorted(valves, key=lambda valve: by_name(valve.name)):
        manifest, own = each.manifest, each.compensator
        standing = standing_warnings(own.valve, own) if own else ()
        row: dict[str, Cell] = {"name": each.name, "status": manifest.status, "reason": manifest.reason}
        for side in SIDES if both else ("",):
            row |= {column_of(side, column): None for column in SIDE_COLUMNS}
            if own and not (side == "negative" and own.negative is None):
                figures = _figures(own, SIDES.get(side, 1), lot_law)
                row |= {column_of(side, column): value for column, value in figures.items()}
        row["warnings"] = " ".join(dict.fromkeys(warning.code for warning in standing))
        row["inputs_sha256"] = manifest.inputs_sha256
        row |= {column: manifest.files.get(file) for column, file in HASHED.items()}
        for output in manifest.outputs:
            row[OUTPUT + output.target] = output.verdict
            row[OUTPUT + output.target + OUTPUT_HASH] = manifest.files.get(f"{output.folder}/{MANIFEST_NAME}")
        record = _record(each, (records or {}).get(each.name, {}))
        rows.append({**row, **{RECORD + name: text for name, text in record.items()}})
    return frame_of(rows)


def _record(valve: ValveFolder, given: Mapping[str, str]) -> Mapping[str, str]:
    """Return a valve's record: of its valve.json, or as it was given if that can be a record."""
    if valve.compensator:
        return valve.compensator.valve.record
    try:
        return checked_record(given.items(), "the record")
    except InputError:  # such a valve has failed, and says why itself
        return {}


def _figures(own: Compensator, sign: int, lot_law: Compensator | None) -> dict[str, Cell]:
    """Return the columns of one side; numbers as valve.json has them."""
    side = own.valve.sides["positive" if sign > 0 else "negative"]
    test = min(side.tests, key=lambda test: abs((test.dp_MPa or 0.0) - (side.reference.dp_MPa or 0.0)))
    left = {branch: round(100 * max(values), 5) for branch, values in _remaining(own, own, sign).items()}
    curve = side.certified[own.side(sign).certificate.guard]
    code = own.signals.code_at(side.reference.dp_MPa)
    values = (
        side.reference.dp_MPa, test.u_knee_rising_V, test.u_knee_falling_V, test.u_knee_se_V,
        curve.u_lower_V[side.tests.index(test)],
        round(float(own.beta(code, sign) * own.side(sign).u_min0_over_u_max * own.u_max_V), 7), side.trend,
        side.beta.dp_MPa[-1], side.beta.beta[-1], side.k_x_max_over_u_max, left.get("opening"), left.get("closing"),
        extra_dead_zone(own, lot_law, sign) if lot_law else None,
    )  # fmt: skip
    return dict(zip(SIDE_COLUMNS, values, strict=True))


def _remaining(own: Compensator, law: Compensator, sign: int) -> dict[str, list[float]]:
    """Return the dead zone that a law leaves at each of a valve's tests, by branch, as shares of command."""
    from dzdesign.design.costs_at_tests import remaining_dead_zone

    tests = own.valve.sides["positive" if sign > 0 else "negative"].tests
    left = [remaining_dead_zone(law, test, sign) for test in tests]
    return {branch: [each[branch] for each in left] for branch in left[0]}


def extra_dead_zone(own: Compensator, lot_law: Compensator, sign: int) -> float:
    """Return how much more dead zone the lot setting leaves than a valve's own, in percent of command.

    At the pressure drop of its tests where that is most, on opening; on closing where no opening was recorded.
    """
    with_lot, with_own = (_remaining(own, law, sign) for law in (lot_law, own))
    branch = "opening" if "opening" in with_own else "closing"
    pairs = zip(with_lot[branch], with_own[branch], strict=True)
    return round(100 * max(lot - alone for lot, alone in pairs), 5)
