"""FMUs of a compensator, and of a plant where one is given: `output_files` returns them."""

import json
import struct
import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files as files_of
from io import BytesIO
from zipfile import BadZipFile, ZipFile
from zlib import error as ZlibError

from dzdesign.codegen.banner import banner_of
from dzdesign.codegen.fmu.archive import archive
from dzdesign.codegen.fmu.binaries import binaries_of, ziglang_version
from dzdesign.codegen.fmu.compensator import compensator_core, compensator_model, compensator_values
from dzdesign.codegen.fmu.description import SOURCE, Model, model_description
from dzdesign.codegen.fmu.plant import plant_model, plant_of, plant_values
from dzdesign.core.artefact_files import TOOL, sha256_of
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import quoted
from dzdesign.core.strict_templates import strict_templates
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareOrigin

PACKAGE = "dzdesign.codegen.fmu"
#: Where an FMU keeps what belongs to no tool but this one.
EXTRA = "extra/dzdesign"
SCHEMA = "dzdesign.fmu/1"
#: Octets that are read of a manifest in an FMU that may be somebody else's; one of ours has 2 kB.
LARGEST_MANIFEST = 2**20


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """What an FMU is made of beside its model: printed values, C files of its own, and the file of its data."""

    model: Model
    template: str
    values: Mapping[str, object]
    core: Mapping[str, bytes]
    extra: Mapping[str, bytes]


def output_files(
    compensator: Compensator, origin: FirmwareOrigin, settings: Mapping[str, str]
) -> Mapping[str, bytes]:
    """Return the FMUs, name to bytes: of the compensator, and of the plant in the settings, as JSON, if there is one.

    The same input and the same ziglang give the same bytes. Without ziglang, or for a plant behind a current
    controller, it is an `InputError`.
    """
    ziglang_version()
    plant = plant_of(settings.get("plant", ""), compensator)
    document = {Compensator.FILE_NAME: to_json_bytes(compensator)}
    parts = [
        Parts(
            model=compensator_model(compensator),
            template="compensator.c.jinja",
            values=compensator_values(compensator),
            core=compensator_core(compensator),
            extra=document,
        )
    ]
    if plant is not None:
        parts.append(
            Parts(
                model=plant_model(plant, compensator),
                template="plant.c.jinja",
                values=plant_values(compensator),
                core={},
                extra={"plant.json": (json.dumps(dict(plant), indent=2) + "\n").encode()},
            )
        )
    return {f"{part.model.identifier}.fmu": _fmu(part, compensator, origin) for part in parts}


def note_of(compensator: Compensator, settings: Mapping[str, str]) -> str:
    """Return how to have an FMU of the plant too; empty where there is one, or can't be one."""
    if settings.get("plant") or compensator.current_drive is not None:
        return ""
    return "no FMU of the plant is made; for one, give --plant PLANT.toml, such as demo/example/plant.toml"


def made_by_another_compiler(files: Mapping[str, bytes]) -> str:
    """Return why binaries are others than this machine's compiler makes; empty if it is the one that made them."""
    this = f"ziglang {ziglang_version()}"
    for name in sorted(name for name in files if name.endswith(".fmu")):
        try:
            with ZipFile(BytesIO(files[name])) as packed, packed.open(f"{EXTRA}/manifest.json") as manifest:
                found = json.loads(manifest.read(LARGEST_MANIFEST))["compiler"]
        except (BadZipFile, KeyError, TypeError, ValueError, RuntimeError, EOFError, OSError, ZlibError, struct.error):
            continue  # no FMU: then it is another file than is generated
        if found != this and isinstance(found, str):
            return f"{name} was compiled by {quoted(found)}, and here is {this}"
    return ""


def _fmu(part: Parts, compensator: Compensator, origin: FirmwareOrigin) -> bytes:
    """Return one FMU."""
    model, digest = part.model, origin.compensator_json
    token = _token(part, digest)
    values = {
        **part.values,
        "banner": banner_of(compensator, digest).lines("dz_fmu.c.jinja"),
        "title": model.title.replace("dzdesign ", "").capitalize(),
        "token": token,
        "variables": model.variables,
        "indicators": model.indicators,
        "states": model.states,
        "rates": [each for each in model.variables if each.derivative_of],
        "model_template": part.template,
    }
    template = strict_templates(PACKAGE, autoescape=False).get_template("dz_fmu.c.jinja")
    sources = {SOURCE: str(template.render(values)).encode(), **part.core, **_headers()}
    files = {
        "modelDescription.xml": model_description(model, token).encode(),
        **{f"sources/{name}": content for name, content in sources.items()},
        **binaries_of(model.identifier, sources),
        **{f"{EXTRA}/{name}": content for name, content in part.extra.items()},
    }
    manifest = {
        "schema": SCHEMA,
        "tool": TOOL,
        "compiler": f"ziglang {ziglang_version()}",
        "compensator_json": digest,
        "token": token,
        "files": {path: sha256_of(files[path]) for path in sorted(files)},
    }
    files[f"{EXTRA}/manifest.json"] = (json.dumps(manifest, indent=2) + "\n").encode()
    return archive(files)


def _token(part: Parts, digest: str) -> str:
    """Return what ties a binary to its modelDescription.xml: from the compensator's hash and the variables."""
    made_from = (digest, part.model.identifier, part.model.variables, sorted(part.extra.items()), TOOL)
    return f"{{{uuid.UUID(sha256_of(repr(made_from).encode())[:32])}}}"


def _headers() -> dict[str, bytes]:
    """Return the headers of the standard, which carry their licence."""
    folder = files_of(PACKAGE) / "headers"
    names = sorted(entry.name for entry in folder.iterdir() if entry.name.endswith(".h"))
    return {name: (folder / name).read_bytes() for name in names}
