"""The folder of a lot: one folder per valve, written whole, read back, and the table of all of them."""

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.batch.calibration import Outcome
from dzdesign.core.artefact_files import MANIFEST_NAME, write_file, write_folder
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import THIS_TOOL, to_json_bytes
from dzdesign.core.documents import read_bytes, sha256_of
from dzdesign.core.errors import InputError
from dzdesign.core.placing import make_folder
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.model import SIDES, ValveModel
from dzdesign.identify.valve.test_record import checked_record
from dzdesign.report.artefacts import laws_of
from dzdesign.report.lot.folder import is_lot
from dzdesign.report.lot.summary import (
    AGAIN,
    FAILED,
    FIRMWARE,
    OK,
    SUMMARY_NAME,
    VALVES,
    LotSummary,
    UnfinishedLot,
    ValveManifest,
)
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
    both = any(each.compensator and each.compensator.two_sided for each in valves)
    rows: list[dict[str, Cell]] = []
    for each in sorted(valves, key=lambda valve: by_name(valve.name)):
        manifest, own = each.manifest, each.compensator
        standing = own.valve.warnings if own else ()
        row: dict[str, Cell] = {"name": each.name, "status": manifest.status, "reason": manifest.reason}
        for side in SIDES if both else ("",):
            row |= {column_of(side, column): None for column in SIDE_COLUMNS}
            if own and (not side or side in laws_of(own)):
                figures = _figures(own, own.valve.sign_of(side) if side else 1, lot_law)
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
    side = own.valve.side(sign)
    test = min(side.tests, key=lambda test: abs((test.dp_MPa or 0.0) - (side.reference.dp_MPa or 0.0)))
    left = {branch: round(100 * max(values), 5) for branch, values in _remaining(own, own, sign).items()}
    curve = side.certified[own.side(sign).certificate.guard]
    code = own.signals.pair(sign).code_at(side.reference.dp_MPa)
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

    tests = own.valve.side(sign).tests
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


class Results:
    """The folder that a batch is written into: new, empty, or of an earlier run, which is then taken up; no other."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        if folder.is_symlink() and not folder.exists():
            raise InputError(f"'{folder}' is a link to '{folder.readlink()}', which is gone; choose another with -o")
        try:
            if folder.exists() and (not folder.is_dir() or any(folder.iterdir())) and not is_lot(folder):
                raise InputError(
                    f"'{folder}' is not empty and no folder of a batch, so it is left alone; choose another with -o"
                )
            make_folder(folder / VALVES)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"'{folder}' can't be written into: {reason}; choose another folder with -o") from error

    def begin(self, names: Collection[str]) -> None:
        """Mark the folder as a lot's."""
        self.write_summary(UnfinishedLot(tool=THIS_TOOL, made_from=(), names=tuple(names)))

    def write_summary(self, summary: LotSummary | UnfinishedLot) -> None:
        """Write batch.json, of a lot that has come to its end or not."""
        write_file(self.folder / SUMMARY_NAME, to_json_bytes(summary))

    def of(self, name: str) -> Path:
        """Return a valve's folder."""
        return self.folder / VALVES / name

    def write(self, outcome: Outcome) -> None:
        """Write a valve's folder, whole or not at all, in place of what an earlier run made of it."""
        files = dict(outcome.files)
        if outcome.manifest.reason:
            files["reason.txt"] = f"{outcome.manifest.reason}\n".encode()
        firmware = files.get(f"{FIRMWARE}/{MANIFEST_NAME}")  # its board files are the user's to fill in
        board = tuple(f"{FIRMWARE}/{name}" for name in json.loads(firmware)["board"]) if firmware else ()
        write_folder(self.of(outcome.name), files, replace(outcome.manifest, board=board))

    def refuse(self, name: str, reason: str) -> None:
        """Turn a calibrated valve into a failed one, without its block and what was found of it.

        The next run tries it again.
        """
        folder = self.of(name)
        manifest = replace(read_manifest(folder), status=FAILED, reason=reason, inputs_sha256=None, outputs=())
        kept = [file for file in manifest.files if file in (ValveModel.FILE_NAME, Compensator.FILE_NAME)]
        self.write(Outcome(manifest=manifest, files={file: (folder / file).read_bytes() for file in kept}))

    def read(self, name: str, unwritten: Mapping[str, str]) -> ValveFolder:
        """Read a valve's folder; one that could not be written has failed, whatever an earlier run left there."""
        if name not in unwritten:
            return read_valve_folder(self.of(name))
        return ValveFolder(
            manifest=ValveManifest(
                tool=THIS_TOOL, made_from=(), name=name, status=FAILED, reason=unwritten[name], files={}
            )
        )

    def is_done(self, name: str, digest: str) -> bool:
        """Tell whether a valve's folder was made from these inputs and holds every file as it was written."""
        folder = self.of(name)
        try:
            manifest = read_manifest(folder)
            return manifest.inputs_sha256 == digest and all(
                # A person's version of a board file is as good.
                sha256_of((folder / file).read_bytes()) == sha256 or file in manifest.board
                for file, sha256 in manifest.files.items()
            )
        except (InputError, OSError):
            return False
