"""Outputs that are no C firmware: the one list of them, and what writes one.

Each is made by a module that offers ``output_files(compensator, origin, settings) -> Mapping[str, bytes]``: relative
path to content, without compensator.json and the manifest, which every output has. The same input gives the same bytes.
A module may also offer ``note_of(compensator, settings) -> str``: what of this design the output leaves out.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module

from dzdesign.codegen.amplifier.device import DEVICE_NAMES
from dzdesign.codegen.project import TARGET_NAMES, TEXT_AS_IT_IS, origin_of, target_named
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile, to_json_bytes
from dzdesign.core.display import ShownInNotebooks
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import flag_of
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import OutputManifest


@dataclass(frozen=True, slots=True, kw_only=True)
class OtherTarget:
    """One kind of output."""

    #: On the command line, after ``--target``.
    name: str
    #: One line for ``--list-targets``.
    description: str
    #: Where its ``output_files`` stands.
    module: str
    #: Option of `codegen` that is of this kind, as a field's name, to the values that it takes, the default first;
    #: with none listed any text is taken, by default an empty one.
    options: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    #: Those of the options without a default: one must be given.
    required: tuple[str, ...] = ()
    #: Folder that it is written into where no other is named; without one that of its name.
    folder: str = ""


#: In the order of ``--list-targets``.
OTHER_TARGETS: Mapping[str, OtherTarget] = {
    each.name: each
    for each in (
        OtherTarget(
            name="iec61131",
            description="Structured Text of IEC 61131-3: a function block for a PLC, and PLCopen XML",
            module="dzdesign.codegen.integers.plc",
            options={"dialect": ("codesys", "twincat"), "interface": ("plc", "codes"), "cycle_time": ()},
            folder="plc",
        ),
        OtherTarget(
            name="fmu",
            description="FMUs for simulation tools, FMI 2.0: the compensator and, with --plant, the plant",
            module="dzdesign.codegen.fmu.files",
            options={"plant": ()},
        ),
        OtherTarget(
            name="matlab",
            description="a function of MATLAB and Octave in integer arithmetic, and C for Simulink's C Caller block",
            module="dzdesign.codegen.integers.matlab",
        ),
        OtherTarget(
            name="amplifier",
            description="fixed parameters of the amplifier --device, and a table of the dead zones that they leave",
            module="dzdesign.codegen.amplifier.files",
            options={"device": DEVICE_NAMES, "table_dp": (), "threshold": ()},
            required=("device",),
        ),
    )
}
#: Folder that a C firmware is written into where no other is named.
FIRMWARE_FOLDER = "firmware"
#: Options of `codegen` that a firmware alone has.
OF_FIRMWARE = ("calibration", "vectors")
#: What ``--target`` of `codegen` takes.
ALL_TARGET_NAMES = (*TARGET_NAMES, *OTHER_TARGETS)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Output(ShownInNotebooks):
    """The files of an output, path to content, the manifest that names their origin, and what a person should know."""

    files: Mapping[str, bytes]
    manifest: OutputManifest
    compensator: Compensator
    note: str = ""

    @property
    def contents(self) -> Mapping[str, bytes]:
        """What is written, path to content, beside the manifest."""
        return self.files


def check_target_name(name: str) -> None:
    """Refuse a target that is neither a microcontroller nor another output; the message proposes the nearest."""
    if name not in ALL_TARGET_NAMES:
        known = ", ".join(ALL_TARGET_NAMES)
        raise InputError(f"there is no target '{name}'{nearest(name, ALL_TARGET_NAMES)}; known: {known}")


def folder_of(target: str) -> str:
    """Return the folder that a target is written into where no other is named: firmware, plc, fmu.

    Examples
    --------
    >>> folder_of("f28335"), folder_of("iec61131"), folder_of("fmu")
    ('firmware', 'plc', 'fmu')
    """
    return (OTHER_TARGETS[target].folder or target) if target in OTHER_TARGETS else FIRMWARE_FOLDER


def settings_of(target: str, given: Mapping[str, str | None], chosen_by: str = "--target") -> dict[str, str]:
    """Return the settings of a target out of the options of all of them; None stands for one that was not given.

    An option of another target, an unknown value, and a missing one without a default are an `InputError`; `chosen_by`
    is the option that names the target.
    """
    own = OTHER_TARGETS[target].options if target in OTHER_TARGETS else {}
    for name in (name for name, value in given.items() if value is not None and name not in own):
        owners = [each.name for each in OTHER_TARGETS.values() if name in each.options]
        of = f"of target {' and '.join(owners)}" if owners else "of a C firmware"
        remedy = "leave it out, or choose another --target"
        raise InputError(f"{flag_of(name)} is an option {of}, not of {target}; {remedy}")
    settings = {}
    for name, values in own.items():
        value = given.get(name)
        if value is None and name in OTHER_TARGETS[target].required:
            raise InputError(f"{chosen_by} {target} needs {flag_of(name)}; "
                             f"known: {', '.join(values)}")  # fmt: skip
        if value is not None and values and value not in values:
            raise InputError(f"{flag_of(name)}: '{value[:40]}' is unknown{nearest(value, values)}; "
                             f"known: {', '.join(values)}")  # fmt: skip
        settings[name] = (values or ("",))[0] if value is None else value
    return settings


def generate_output(
    compensator: Compensator,
    target: str,
    settings: Mapping[str, str],
) -> Output:
    """Generate an output of a compensator, one of `OTHER_TARGETS`, with settings as `settings_of` gives them.

    A compensator that this kind of output can't hold is an `InputError`.
    """
    if designed_for := compensator.target:
        target_named(designed_for.name).check_designed_for(designed_for)
    document = to_json_bytes(compensator)
    digest = sha256_of(document)
    origin = origin_of(compensator, digest)
    module = import_module(OTHER_TARGETS[target].module)
    made: Mapping[str, bytes] = module.output_files(compensator, origin, settings)
    note = module.note_of(compensator, settings) if hasattr(module, "note_of") else ""
    files = {**made, **{name: text.encode() for name, text in TEXT_AS_IT_IS.items()}, Compensator.FILE_NAME: document}
    manifest = OutputManifest(
        tool=THIS_TOOL,
        made_from=(SourceFile(source=Compensator.FILE_NAME, sha256=digest),),
        target=target,
        settings=dict(settings),
        law=compensator.law,
        origin=origin,
        files={path: sha256_of(content) for path, content in files.items()},
    )
    return Output(files=files, manifest=manifest, compensator=compensator, note=note)
