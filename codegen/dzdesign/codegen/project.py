"""`generate`: a `Compensator` and a target in, the files of a C project out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.resources import files as files_of
from textwrap import fill
from typing import TYPE_CHECKING

from dzdesign.codegen.banner import Banner, banner_of, board_lines
from dzdesign.codegen.calibration.block import block_of, built_for
from dzdesign.codegen.calibration.files import (
    block_core_files,
    block_templates,
    block_values,
    core_headers,
    core_sources,
    fixed_core_files,
)
from dzdesign.codegen.calibration.layout import BuiltFor, CalibrationBlock
from dzdesign.codegen.calibration.packing import OCTETS, pack
from dzdesign.codegen.core.certificate_text import zero_command
from dzdesign.codegen.core.constants import Values, current_faults
from dzdesign.codegen.loading.protocol import LOAD_FILES, STORE, load_context
from dzdesign.codegen.target import Target, folder_of
from dzdesign.codegen.vectors import vectors_text
from dzdesign.codegen.wiring import wiring_of
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile, to_json_bytes
from dzdesign.core.display import ShownInNotebooks, strict_templates
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import DzdesignError, InputError, nearest
from dzdesign.design.certificate import reach_of_certificate
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import BLOCK_FILE, VECTORS_NAME, Calibration, FirmwareManifest, FirmwareOrigin
from dzdesign.design.target_inputs import Converter, TargetInputs

if TYPE_CHECKING:
    import jinja2

PACKAGE = "dzdesign.codegen"
#: Width of a paragraph in a README.
README_COLUMNS = 120
#: Keeps git from rewriting line endings in a folder that is compared and compiled.
TEXT_AS_IT_IS = {".gitattributes": "* -text\n"}
#: Where neither the compensator nor anybody else says which.
DEFAULT_TARGET = "f28335"


def _found_targets() -> tuple[str, ...]:
    """Return the names of the folders that have a `target.py`, so that a new one needs no entry here."""
    folders = (entry for entry in files_of(PACKAGE).iterdir() if entry.is_dir())
    return tuple(sorted(entry.name.replace("_", "-") for entry in folders if (entry / "target.py").is_file()))


#: One folder per target; each has `target.py` with a `TARGET` and its templates.
TARGET_NAMES = _found_targets()


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Firmware(ShownInNotebooks):
    """The files of a C project by path, the manifest that states their origin, and notes for the user."""

    files: Mapping[str, str]
    manifest: FirmwareManifest
    compensator: Compensator
    note: str = ""
    #: Octets of the calibration block; empty of a firmware with the numbers of its valve in it.
    block: bytes = b""

    @property
    def contents(self) -> Mapping[str, str | bytes]:
        """Content of each file to write, by path, calibration block included."""
        return {**self.files, **({BLOCK_FILE: self.block} if self.block else {})}


def target_named(name: str) -> Target:
    """Return the target of that name; of an unknown one the `InputError` proposes the nearest."""
    if name not in TARGET_NAMES:
        raise InputError(f"there is no target '{name}'{nearest(name, TARGET_NAMES)}; known: {', '.join(TARGET_NAMES)}")
    target: Target = import_module(f"{PACKAGE}.{folder_of(name)}.target").TARGET
    return target


def target_for(designed_for: TargetInputs, inputs: Sequence[str] = ()) -> Target:
    """Return the target that a compensator with these inputs was designed for, on the board that was declared."""
    return target_named(designed_for.name).on_board(designed_for.crystal_Hz, designed_for.channels, inputs)


def inputs_of(compensator: Compensator) -> tuple[str, ...]:
    """Return what a compensator reads, as `c2000.ROLES` names it, in the order of its declared channels."""
    drive = compensator.current_drive
    pressures = (f"pressure_{name.lower()}" for name in compensator.signals.pressures)
    return (
        "command",
        *pressures,
        *(["current", "current_b"][: drive.loop.shunts] if drive else []),
        *(["supply"] if drive and drive.loop.supply else []),
    )


def targets() -> tuple[Target, ...]:
    """Return every target, in the order of the names."""
    return tuple(target_named(name) for name in TARGET_NAMES)


def generate(
    compensator: Compensator,
    target_name: str | None = None,
    calibration: Calibration = "fixed",
    vectors: int = 0,
) -> Firmware:
    """Generate the C project of a compensator for a target, by default the target of its design.

    Parameters
    ----------
    compensator : Compensator
        The design.
    target_name : str, optional
        Name of the target; None selects that of the design.
    calibration : {"fixed", "block"}, optional
        Place of the valve's numbers: constants in the core, or a block of data beside it.
    vectors : int, optional
        Number of test vectors in vectors.csv.

    Raises
    ------
    InputError
        If the target is unknown, or its converter or PWM differs from that of the design. Also if the compensator
        contradicts its target, or there are too few vectors for every node, corner and fault.
    """
    designed_for = compensator.target
    target = target_named(target_name or (designed_for.name if designed_for else DEFAULT_TARGET))
    if designed_for:
        of_design = target_for(designed_for, inputs_of(compensator))
        of_design.check_designed_for(designed_for)
        target = of_design if of_design.name == target.name else target
    target.check_signals(compensator.signals)
    note = target.check_designed_for(designed_for) if designed_for else ""
    document = to_json_bytes(compensator)
    digest = sha256_of(document)
    if (drive := compensator.current_drive) is not None:
        target.check_current_control(drive.sampling)
    banner, block = banner_of(compensator, digest), None
    if calibration == "block":
        block = block_of(compensator, digest)
        core = block_core_files(built_for(compensator))
        first_lines = banner.of_any_valve
    else:
        core = fixed_core_files(compensator)
        first_lines = banner.lines
    texts = _core_texts(core, first_lines)
    files = (
        texts
        | target_files(compensator, target, banner, block)
        | TEXT_AS_IT_IS
        | {"compensator.json": document.decode()}
    )
    octets = pack(block) if block else b""
    if vectors:
        files[VECTORS_NAME] = vectors_text(compensator, vectors)
    manifest = FirmwareManifest(
        tool=THIS_TOOL,
        made_from=(SourceFile(source="compensator.json", sha256=digest),),
        target=target.name,
        calibration=calibration,
        law=compensator.law,
        core=tuple(sorted(texts)),
        board=tuple(sorted(target.board | (board_of_blocks(target) if block else frozenset()))),
        origin=origin_of(compensator, digest),
        vectors=vectors,
        files={path: sha256_of(text.encode()) for path, text in files.items()}
        | ({BLOCK_FILE: sha256_of(octets)} if octets else {}),
    )
    return Firmware(files=files, manifest=manifest, compensator=compensator, note=note, block=octets)


def origin_of(compensator: Compensator, digest: str) -> FirmwareOrigin:
    """Return from what the files of a compensator come whose document has this SHA-256."""
    ramp_tests = compensator.valve.made_from
    return FirmwareOrigin(compensator_json=digest, valve_json=compensator.valve_json_sha256, ramp_tests=ramp_tests)


def block_core(built: BuiltFor) -> dict[str, str]:
    """Return the core of the firmware in block form, path to text: the same for every valve that it is compiled for."""
    return _core_texts(block_core_files(built), Banner(digest="").of_any_valve)  # which names no compensator


def _core_texts(core: Mapping[str, Values], lines: Callable[[str], Sequence[str]]) -> dict[str, str]:
    """Return the files of the core by their paths in the firmware; `lines` gives the first lines of a template's."""
    templates = {name: f"{name}.jinja" for name in core}
    return {f"core/{name}": _render(PACKAGE, each, lines(each), core[name]) for name, each in templates.items()}


def target_files(
    compensator: Compensator, target: Target, banner: Banner, block: CalibrationBlock | None = None
) -> dict[str, str]:
    """Return the files around the core, path to text; with a block those that hold it and load another."""
    signals = compensator.signals
    current = compensator.current_drive
    levels, full_V = signals.code_max + 1, target.converter.full_V
    if target.takes_any_signals and compensator.target:  # a target without a converter of its own takes any
        full_V = compensator.target.converter.full_V
    values = {
        "bipolar": len(signals.signs) == 2,
        "three": signals.pressure_c is not None,
        # Of the negative side's functions: what their codes end with, ahead and behind.
        "negative_pair": signals.negative_pair.lower(),
        "signals": signals,
        "units": compensator.valve.recorded_units.of_controller,
        "u_max_V": float(compensator.u_max_V),
        "drive": compensator.drive_functions,
        "limited": compensator.drive_functions.compare_limit < signals.compare_max,
        "at_zero": {sign: zero_command(compensator, sign) for sign in signals.signs},
        "core_sources": core_sources(block=block is not None, current=current is not None),
        "core_headers": core_headers(block=block is not None, current=current is not None),
        **block_values(compensator, block, target),
        "current": current,
        "loads": block is not None and target.link is not None,
        "link_sources": link_names(target, ".c") if block else (),
        "link_headers": link_names(target, ".h") if block else (),
        "current_faults": current_faults(two=len(signals.signs) == 2),
        "wiring": wiring_of(compensator, Converter(full_V=full_V, levels=levels)),
        "firmware_origin": f"0x{banner.digest[:4].upper()}",
        "lot_setting": banner.lot,
        "block_octets": OCTETS,
        "on_cortex_m4": target.name == "cortex-m4",
        "certificate_reach": fill(reach_of_certificate(compensator), README_COLUMNS),
    }
    if taken := sorted({"banner", "project", *values} & target.context.keys()):
        raise DzdesignError(f"target {target.name}: context names {taken} belong to the renderer")
    values |= target.context
    in_block_form = {**block_templates(target, block), **(target.block_templates if block else {})}
    files = {
        path: _render(
            f"{PACKAGE}.{target.folder}",
            template,
            board_lines(template) if path in target.board else banner.lines(template),
            values,
        )
        for path, template in {**target.templates, **in_block_form}.items()
    }
    return files | (_load_files(target, banner) if block and target.link else {})


def _load_files(target: Target, banner: Banner) -> dict[str, str]:
    """Return the files that take a block over the target's serial line."""
    board = board_of_blocks(target)

    def lines(name: str) -> Sequence[str]:
        template = f"{name}.jinja"
        return board_lines(template) if f"{target.folder}/{name}" in board else banner.of_any_valve(template)

    values = load_context(target.tick_Hz)
    return {
        f"{target.folder}/{name}": _render(f"{PACKAGE}.loading", f"{name}.jinja", lines(name), values)
        for name in LOAD_FILES
    }


def link_names(target: Target, ending: str) -> tuple[str, ...]:
    """Return the names of the files of block form beside the target's own, those with this ending."""
    own = (path.rpartition("/")[2] for path in target.block_templates)
    return tuple(name for name in (*own, *(LOAD_FILES if target.link else ())) if name.endswith(ending))


def board_of_blocks(target: Target) -> frozenset[str]:
    """Return the files that are the user's to fill in because blocks are loaded: the memory that keeps them."""
    return frozenset(f"{target.folder}/{name}" for name in STORE) if target.link else frozenset()


@cache
def _environment(package: str) -> "jinja2.Environment":
    """Return the renderer of a package's templates, then of the shared ones; kept, with what it has compiled."""
    packages = dict.fromkeys((package, f"{PACKAGE}.core", f"{PACKAGE}.calibration", PACKAGE))
    return strict_templates(*packages, autoescape=False)  # C and make, not HTML


def _render(package: str, template: str, banner: Sequence[str], values: Values) -> str:
    return str(_environment(package).get_template(template).render(banner=banner, project="dzdesign", **values))
