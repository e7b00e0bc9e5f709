"""`generate`: a `Compensator` and a target in, the files of a C project out."""

import contextlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from importlib.resources import files as files_of
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dzdesign.codegen.comment_text import printable_list
from dzdesign.codegen.core.plan import FilePlan, core_plan, drive_header_plan, drive_plan, header_plan
from dzdesign.codegen.lot_banner import LotInWords, lot_in_words
from dzdesign.codegen.provenance import constants_of, origin_of
from dzdesign.codegen.target import Target, folder_of
from dzdesign.codegen.wiring import wiring_of
from dzdesign.core.artefact_files import (
    MANIFEST_NAME,
    TOOL,
    read_bytes,
    sha256_of,
    to_json,
    write_folder,
)
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.result_display import ShownInNotebooks
from dzdesign.design.compensator import Compensator
from dzdesign.design.compensator_file import compensator_document
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.design.signal_text import Converter

if TYPE_CHECKING:
    import jinja2

PACKAGE = "dzdesign.codegen"
#: Where neither the compensator nor anybody else says which.
DEFAULT_TARGET = "f28335"
#: One file a sign of command, all from one template.
CORE_SOURCES = {1: "dz_comp.c", -1: "dz_comp_negative.c"}


def _found_targets() -> tuple[str, ...]:
    """Return the names of the folders that have a `target.py`, so that a new one needs no entry here."""
    folders = (entry for entry in files_of(PACKAGE).iterdir() if entry.is_dir())
    return tuple(sorted(entry.name.replace("_", "-") for entry in folders if (entry / "target.py").is_file()))


#: One folder a target; each has `target.py` with a `TARGET` and its templates.
TARGET_NAMES = _found_targets()


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Firmware(ShownInNotebooks):
    """The files of a C project, path to text, the manifest that names their origin, and what a person should know."""

    files: Mapping[str, str]
    manifest: FirmwareManifest
    note: str = ""


def write_firmware(firmware: Firmware, folder: Path) -> Firmware:
    """Write a firmware folder; board files that their user changed in an earlier one stay as they are.

    Parameters
    ----------
    firmware : Firmware
        From `generate`.
    folder : Path
        Where it goes.

    Returns
    -------
    Firmware
        The same, with a note on what was kept, and on a target that was replaced.

    Raises
    ------
    InputError
        If the place can't be written, or holds files that would be lost.
    """
    earlier = _target_in(Path(folder))
    kept = write_folder(folder, firmware.files, firmware.manifest)
    notes = [firmware.note] if firmware.note else []
    if earlier not in ("", firmware.manifest.target):
        gone = f"the firmware for {earlier} in '{folder}' was replaced by this one for {firmware.manifest.target}"
        notes.append(f"{gone}; to have both, give each its own folder with -o")
    if kept:
        note = f"kept as you changed it: {', '.join(kept)}"
        if newer := [name for name, other in kept.items() if other]:
            note += f"; would be generated otherwise now: {', '.join(newer)}"
        notes.append(f"{note}; for what is generated now, move yours away or choose a new folder with -o")
    return replace(firmware, note="; ".join(notes))


def _target_in(folder: Path) -> str:
    """Return the target of the firmware that lies in a folder; nothing where there is none."""
    with contextlib.suppress(InputError):
        content = read_bytes(folder / MANIFEST_NAME, "firmware manifest")
        return read_artefact(content, FirmwareManifest, MANIFEST_NAME).target
    return ""


def target_named(name: str) -> Target:
    """Return the target of that name.

    Raises
    ------
    InputError
        If there is none; the nearest name is proposed.
    """
    if name not in TARGET_NAMES:
        raise InputError(f"there is no target '{name}'{nearest(name, TARGET_NAMES)}; known: {', '.join(TARGET_NAMES)}")
    return import_module(f"{PACKAGE}.{folder_of(name)}.target").TARGET


def targets() -> tuple[Target, ...]:
    """Return every target, in the order of the names."""
    return tuple(target_named(name) for name in TARGET_NAMES)


def generate(
    compensator: Compensator, target_name: str | None = None, compensator_bytes: bytes | None = None
) -> Firmware:
    """Generate the C project of a compensator for a target.

    Parameters
    ----------
    compensator : Compensator
        From `dzdesign.design.designing.design` or compensator.json.
    target_name : str, optional
        One of `TARGET_NAMES`; by default the one that the compensator was designed for.
    compensator_bytes : bytes, optional
        The file it was read from; without it the document as it would be written.

    Raises
    ------
    InputError
        If the target is unknown, its converter or PWM differs from those that the compensator was designed for, or the
        compensator says of the target that it was designed for what is not so.
    """
    designed_for = compensator.request.target if compensator.request else None
    target = target_named(target_name or (designed_for.name if designed_for else DEFAULT_TARGET))
    if designed_for:
        target_named(designed_for.name).check_is_described(designed_for)
    target.check_signals(compensator.signals)
    note = target.check_designed_for(designed_for)
    document = compensator_bytes or to_json(compensator_document(compensator)).encode()
    digest = sha256_of(document)
    opening = banner_of(compensator, digest)
    header = header_plan(compensator)
    hardware = hardware_context(compensator, target, digest)
    shared = environment(PACKAGE)
    core = _core_files(compensator, target, header)
    plans = [(path, shared, template, plan.values) for path, template, plan in core]
    own = environment(f"{PACKAGE}.{target.folder}")
    plans += [(path, own, template, hardware) for path, template in target.templates.items()]
    files = {
        path: _render(
            renderer,
            template,
            board_banner(template) if path in target.board else opening(template),
            plan,
        )
        for path, renderer, template, plan in plans
    }
    files["compensator.json"] = document.decode()
    manifest = FirmwareManifest(
        tool=THIS_TOOL,
        made_from=(SourceFile(source="compensator.json", sha256=digest),),
        target=target.name,
        law=compensator.law_name,
        core=tuple(sorted(path for path in files if path.startswith("core/"))),
        board=tuple(sorted(target.board)),
        origin=origin_of(compensator, digest),
        constants=constants_of(compensator, {path: plan.constants for path, _, plan in core}),
        files={path: sha256_of(text.encode()) for path, text in files.items()},
    )
    return Firmware(files=files, manifest=manifest, note=note)


def _core_files(compensator: Compensator, target: Target, header: FilePlan) -> list[tuple[str, str, FilePlan]]:
    """Return path, template and plan of every file of the core."""
    sides = [
        (f"core/{name}", "dz_comp.c.jinja", core_plan(compensator, sign, target.arithmetic))
        for sign, name in CORE_SOURCES.items()
        if sign in compensator.signals.signs
    ]
    return [
        *sides,
        ("core/dz_comp.h", "dz_comp.h.jinja", header),
        ("core/dz_drive.c", "dz_drive.c.jinja", drive_plan(compensator)),
        ("core/dz_drive.h", "dz_drive.h.jinja", drive_header_plan(compensator)),
    ]


def hardware_context(compensator: Compensator, target: Target, digest: str) -> dict[str, Any]:
    """Return what the templates of a target print, but for banner and project.

    Parameters
    ----------
    compensator : Compensator
        What the firmware is of.
    target : Target
        Where it goes.
    digest : str
        SHA-256 of compensator.json.
    """
    levels = compensator.signals.code_max + 1  # a target without a converter of its own takes any
    full_V = target.adc_full_V
    if target.takes_any_signals and compensator.request:
        full_V = compensator.request.target.converter.full_V
    return {
        **target.context,
        **core_context(compensator.signals.signs),
        "wiring": wiring_of(compensator, Converter(full_V=full_V, levels=levels)),
        "firmware_origin": f"0x{digest[:4].upper()}",
        "common_setting": lot_in_words(compensator),
    }


def core_context(signs: Sequence[int]) -> dict[str, Any]:
    """Return what the templates of a target print of the core.

    Parameters
    ----------
    signs : sequence of int
        Signs of command that it has a law for.

    Returns
    -------
    dict
        ``bipolar``, and the core's files in the order of a makefile: ``core_sources``, ``core_headers``.
    """
    return {
        "bipolar": len(signs) == 2,
        "core_sources": [*(CORE_SOURCES[sign] for sign in signs), "dz_drive.c"],
        "core_headers": ["dz_comp.h", "dz_drive.h"],
    }


def ramp_tests_of(compensator: Compensator) -> tuple[str, ...]:
    """Return the names of the recordings that the valve was identified from, as their users gave them."""
    made_from = json.loads(compensator.valve_document).get("made_from", ())
    return tuple(str(entry["source"]) for entry in made_from)


def is_simulated(compensator: Compensator) -> bool:
    """Tell whether a recording that the valve was identified from is marked as simulated."""
    warnings = json.loads(compensator.valve_document).get("warnings", ())
    return any(warning["code"] == "simulated" for warning in warnings)


@cache
def environment(package: str) -> "jinja2.Environment":
    """Return the renderer of a package's templates, then of the shared ones: strict, a name without a value fails.

    Kept, with the templates that it has compiled.
    """
    import jinja2

    packages = dict.fromkeys((package, f"{PACKAGE}.core", PACKAGE))
    return jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(name, "templates") for name in packages]),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        autoescape=False,  # C and make, not HTML
    )


def banner_of(compensator: Compensator, digest: str) -> Callable[[str], tuple[str, ...]]:
    """Return what gives each template's file its first lines.

    Parameters
    ----------
    compensator : Compensator
        What the firmware is of.
    digest : str
        SHA-256 of compensator.json.
    """
    recordings, simulated, lot = ramp_tests_of(compensator), is_simulated(compensator), lot_in_words(compensator)
    return lambda template: banner(template, digest, recordings, simulated, lot)


def banner(
    template: str, digest: str, recordings: Sequence[str] = (), simulated: bool = False, lot: LotInWords | None = None
) -> tuple[str, ...]:
    """Return the lines that open every generated file: tool, template, hash and recordings; no date.

    Parameters
    ----------
    template : str
        File name of the template.
    digest : str
        SHA-256 of compensator.json.
    recordings : sequence of str
        Names from users; whatever could act in a comment is replaced.
    simulated : bool
        Whether they are marked as simulated.
    lot : LotInWords, optional
        Of a common setting: its valves, of which the recordings are those of one.
    """
    lines = [
        f"Generated by dzdesign {TOOL['version']} from template {template}. Do not edit: generate it again.",
        f"Compensator SHA-256: {digest}",
    ]
    lines += [lot.banner] if lot else []
    if recordings:
        of = f"{lot.carrier} identified from" if lot else "Valve identified from"
        lines.append(f"{of}: {printable_list(recordings)}")
    if simulated:
        lines.append("SIMULATED recordings: an example, not of a measured valve. Not for a machine.")
    return tuple(lines)


def board_banner(template: str) -> tuple[str, ...]:
    """Return the lines that open a file which its user fills in.

    Nothing in them, such as a hash, grows old where the file is kept through the next generation.

    Parameters
    ----------
    template : str
        File name of the template.
    """
    return (
        f"Written by dzdesign {TOOL['version']} from template {template}. Yours to edit: `dzdesign codegen` keeps what",
        "you change here, and `dzdesign verify` names this file as yours and does not check it.",
    )


def _render(
    renderer: "jinja2.Environment", template: str, opening: tuple[str, ...], values: Mapping[str, object]
) -> str:
    return renderer.get_template(template).render(banner=opening, project="dzdesign", **values)
