"""What is of a lot as a whole: content of batch.json, what is odd across its valves, its one firmware in block form."""

import os
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from dzdesign.batch.calibration import BLOCK_IMAGE
from dzdesign.batch.outputs import WantedOutput
from dzdesign.batch.valve_folders import ValveFolder
from dzdesign.batch.valves import Valve
from dzdesign.codegen.calibration.block import entry_of_record
from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile, to_json_bytes
from dzdesign.core.documents import read_bytes, sha256_of
from dzdesign.core.errors import InputError, RequirementError, and_more, quoted
from dzdesign.core.recorded_units import RecordedUnits, common_units, shown_in
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import BLOCK_FILE
from dzdesign.report.lot.spread import spreads_of
from dzdesign.report.lot.summary import (
    DOES_NOT_HOLD,
    FIRMWARE,
    HOLDS,
    LOT_SETTING,
    NOT_MADE,
    NOT_VERIFIED,
    OK,
    VALVES,
    FailedValve,
    LotFirmware,
    LotOutput,
    LotSettingSummary,
    LotSummary,
    OutputVerdict,
    SmallestMargin,
    UntestedPressures,
)
from dzdesign.report.lot.table import by_name

if TYPE_CHECKING:
    from polars import DataFrame

    from dzdesign.codegen.calibration.layout import BuiltFor
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


def lot_outputs(wanted: Sequence[WantedOutput], found: Sequence[ValveFolder]) -> dict[str, LotOutput]:
    """Return what batch.json says of the outputs of the valves, as read back from their folders."""
    return {each.target: _lot_output(each, found) for each in wanted}


def _lot_output(wanted: WantedOutput, found: Sequence[ValveFolder]) -> LotOutput:
    names: dict[OutputVerdict, list[str]] = {HOLDS: [], DOES_NOT_HOLD: [], NOT_VERIFIED: [], NOT_MADE: []}
    for valve in found:
        for output in valve.manifest.outputs:
            if output.target == wanted.target:
                names[output.verdict].append(valve.name)
    return LotOutput(
        folder=wanted.folder,
        settings=dict(wanted.settings),
        holds=tuple(names[HOLDS]),
        does_not_hold=tuple(names[DOES_NOT_HOLD]),
        not_verified=tuple(names[NOT_VERIFIED]),
        not_made=tuple(names[NOT_MADE]),
    )


#: Names in a sentence.
NAMED = 5


def anomalies_of(found: Sequence[ValveFolder], folder: Path, valves: Sequence[Valve]) -> list[str]:
    """Return sentences on a lot as read back from its folder, and as it was given, with patterns of recordings."""
    overlapping = _overlapping(valves)
    names = {each.name for each in found}
    shared = (*_shared_recordings(found, overlapping), *_shared_serials(found, overlapping))
    return [*overlapping.values(), *shared, *_left_over(names, folder)]


def _overlapping(valves: Sequence[Valve]) -> dict[tuple[str, ...], str]:
    """Return what to say of valves whose patterns match one file, by their names."""
    owners: dict[str, dict[str, str]] = {}
    for valve in valves:
        try:
            for path, pattern in valve.recordings().items():
                owners.setdefault(os.path.abspath(path), {})[valve.name] = pattern
        except InputError:  # such a valve has failed, and says so itself
            continue
    shared: dict[tuple[str, ...], list[str]] = {}
    for place, by in owners.items():
        if len(by) > 1:
            shared.setdefault(tuple(by), []).append(place)
    lines = {}
    for names, places in shared.items():
        by = owners[places[0]]
        more = f" and {len(places) - 1} more" if len(places) > 1 else ""
        what = " and ".join(f"'{by[name]}' of {name}" for name in names[:2])
        lines[names] = (
            f"{and_more(names, NAMED)} take the same file, '{Path(places[0]).name}'{more}: in the column files {what} "
            "overlap; let each valve's match its own files alone, unless one valve is meant twice, with other options"
        )
    return lines


def _shared_recordings(found: Sequence[ValveFolder], known: Collection[tuple[str, ...]]) -> list[str]:
    """A bench that saves a recording under the wrong name gives a valve the firmware of another."""
    owners: dict[str, list[str]] = {}
    for each in found:
        for source in each.manifest.made_from if each.compensator else ():
            owners.setdefault(source.sha256, []).append(each.name)
    groups = dict.fromkeys(tuple(dict.fromkeys(names)) for names in owners.values())
    return [
        f"{and_more(names, NAMED)} share a recording, byte for byte, in files of their own: was one saved under the "
        "name of another valve? Their firmware is that valve's; record the ramp test again"
        for names in groups
        if len(names) > 1 and names not in known
    ]


def _shared_serials(found: Sequence[ValveFolder], known: Collection[tuple[str, ...]]) -> list[str]:
    """A block is told from another valve's by its serial number."""
    owners: dict[str, list[str]] = {}
    for each in found:
        if each.compensator and (serial := entry_of_record(each.compensator, "serial")):
            owners.setdefault(serial, []).append(each.name)
    return [
        f"{and_more(names, NAMED)} have the same serial number, {quoted(serial)}, and by it their blocks can't be told "
        "apart; correct record.serial"
        for serial, names in owners.items()
        if len(names) > 1 and tuple(names) not in known
    ]


def _left_over(names: Collection[str], folder: Path) -> list[str]:
    there = (path.name for path in (folder / VALVES).iterdir() if path.is_dir() and path.name not in names)
    others = sorted((name for name in there if not name.startswith(".")), key=by_name)
    if not others:
        return []
    return [
        f"the folder '{VALVES}' holds {and_more(others, NAMED)}, not of this lot: left by an earlier run; take them "
        "away"
    ]


#: Folder of what is of all valves together: `output` itself is locked as long as the batch runs.
LOT = "lot"


class Project(NamedTuple):
    """All that the C code of a firmware in block form depends on."""

    target: str
    built: "BuiltFor"


def project_of(compensator: "Compensator") -> Project:
    """Return the firmware that a compensator's block needs."""
    from dzdesign.codegen.calibration.block import built_for
    from dzdesign.codegen.project import DEFAULT_TARGET

    return Project(compensator.target.name if compensator.target else DEFAULT_TARGET, built_for(compensator))


def needing_another(valves: Sequence[ValveFolder]) -> dict[str, str]:
    """Return the valves whose block the lot's firmware would refuse, by name, each with the reason.

    The lot's firmware is the one that most of its valves need; of two that as many need the one of the first valve.
    """
    needed = {each.name: project_of(each.compensator) for each in valves if each.compensator is not None}
    if not needed:
        return {}
    ((lot, _),) = Counter(needed.values()).most_common(1)
    return {name: _reason(own, lot) for name, own in needed.items() if own != lot}


def _reason(own: Project, lot: Project) -> str:
    """Say in what a valve's firmware would differ."""
    others = [("target", own.target, lot.target), ("wiring", _wiring(own.built), _wiring(lot.built))]
    names = [field.name for field in fields(own.built) if field.name != "shape"]
    others += [(name, str(getattr(own.built, name)), str(getattr(lot.built, name))) for name in names]
    words = ", ".join(f"{what} {mine} instead of {theirs}" for what, mine, theirs in others if mine != theirs)
    return (
        f"its calibration block needs another firmware than that of the lot: {words}; give it the lot's options, or "
        "calibrate it in a batch of its own"
    )


def _wiring(built: "BuiltFor") -> str:
    from dzdesign.codegen.calibration.layout import SHAPE_BITS

    return " and ".join(text for name, text in SHAPE_BITS.items() if built.has(name)) or "one solenoid"


def write_lot_firmware(
    output: Path, designed: "Mapping[str, Compensator]", setting: "Compensator | None"
) -> LotFirmware | None:
    """Write the lot's firmware into `output`, and return what batch.json says of it; None without a calibrated valve.

    Until a valve's own block is loaded it has that of the lot setting, which over-compensates none of the valves;
    where there is no such setting that of the first valve.
    """
    from dzdesign.codegen.project import generate
    from dzdesign.codegen.writing import write_generated

    if not designed:
        return None
    first = min(designed, key=by_name)
    project = project_of(designed[first])
    fits = setting is not None and project_of(setting) == project
    compensator = setting if setting is not None and fits else designed[first]
    folder = output / LOT / FIRMWARE
    firmware = generate(compensator, project.target, "block")
    write_generated(firmware, folder, over_another=True)
    return LotFirmware(
        folder=f"{LOT}/{FIRMWARE}",
        target=project.target,
        manifest_sha256=sha256_of(read_bytes(folder / MANIFEST_NAME, "firmware manifest")),
        block_of=LOT_SETTING if fits else first,
        blocks=(BLOCK_FILE, BLOCK_IMAGE),
    )


def firmware_left(output: Path, firmware: LotFirmware | None) -> list[str]:
    """Return what to say of a lot's firmware that this run did not write: it would pass for one of this lot."""
    if firmware is not None or not (output / LOT / FIRMWARE / MANIFEST_NAME).is_file():
        return []
    return [
        f"the folder '{LOT}/{FIRMWARE}' is left of an earlier run with --calibration block, and none of these valves "
        "has a block for it; take it away, or give --calibration block again"
    ]


def foreign_block(firmware: LotFirmware | None, valves: int) -> Sequence[str]:
    """Say of the firmware of a lot of so many calibrated valves that it drives each of them by the block of one."""
    if firmware is None or firmware.block_of == LOT_SETTING or valves < 2:
        return ()
    return [
        f"'{firmware.folder}' drives every valve by the block of {firmware.block_of} until its own is loaded, which "
        "may over-compensate the others: there is no lot setting; load each valve's own block before it is driven"
    ]
