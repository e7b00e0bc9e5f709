"""FMUs of a compensator, and of a plant where one is given: `output_files` returns them.

One machine compiles the binaries of every platform, by ziglang; they need no library. The headers of the standard come
with FMPy, which `verify` runs the FMUs by.
"""

import json
import os
import re
import struct
import subprocess
import sys
import uuid
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from zipfile import ZIP_DEFLATED, BadZipFile, ZipFile, ZipInfo
from zlib import error as ZlibError

from dzdesign.codegen.banner import banner_of
from dzdesign.codegen.fmu.description import SOURCE, Model, model_description
from dzdesign.codegen.fmu.models import compensator_model, plant_model, plant_of
from dzdesign.core.artefact_files import TOOL
from dzdesign.core.display import strict_templates
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import MissingToolError, quoted
from dzdesign.core.placing import scratch_folder
from dzdesign.core.processes import run_program
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareOrigin

#: Where an FMU keeps what belongs to no tool but this one.
EXTRA = "extra/dzdesign"
SCHEMA = "dzdesign.fmu/2"
#: Octets that are read of a manifest in an FMU that may be somebody else's; one of ours has 300.
LARGEST_MANIFEST = 2**20
#: The earliest that a zip knows.
DATE = (1980, 1, 1, 0, 0, 0)
#: Of a file, as Unix has it: anybody reads it; binaries run.
READABLE, RUNNABLE, UNIX = 0o100644, 0o100755, 3
#: Of FMPy: the headers of the standard, under the BSD licence that each of them carries.
HEADERS = ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h")
INSTALL = 'run `pip install "ziglang>=0.17,<0.18" "fmpy>=0.3.20,<0.4"`'
#: As in the checked core: no contraction to fused products, so that every processor gives the same digits.
FLAGS = (
    "-O2", "-std=c99", "-shared", "-fPIC", "-nostdlib", "-g0", "-s", "-fvisibility=hidden", "-ffp-contract=off",
    "-fno-sanitize=all", "-fno-stack-protector", "-Wall", "-Wextra", "-Werror",
)  # fmt: skip
#: Of ziglang: 0.13 wants a library's entry point of every DLL.
OLDEST = (0, 17)
#: Folder with an empty stdlib.h, which the standard's headers include and need nothing of.
NO_LIBRARY = "no_library"
#: Seconds; the first compilation for a platform fills ziglang's cache.
LONGEST_S = 300
#: Variables by which the compiler takes other headers or options than those of the command.
REDIRECTING = ("CPATH", "C_INCLUDE_PATH", "CCC_OVERRIDE_OPTIONS")
#: Compilers side by side.
WORKERS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Platform:
    """Where an FMU runs: ziglang's name of it, the folder of its binary, and that one's ending."""

    triple: str
    folder: str
    ending: str


#: FMI 2.0.4 (2.3) takes the names of FMI 3 for all processors but those of the PC.
PLATFORMS = (
    Platform(triple="x86_64-linux-gnu", folder="linux64", ending="so"),
    Platform(triple="aarch64-linux-gnu", folder="aarch64-linux", ending="so"),
    Platform(triple="x86_64-windows-gnu", folder="win64", ending="dll"),
    Platform(triple="x86_64-macos", folder="darwin64", ending="dylib"),
    Platform(triple="aarch64-macos", folder="aarch64-darwin", ending="dylib"),
)  # fmt: skip


def output_files(compensator: Compensator, origin: FirmwareOrigin, settings: Mapping[str, str]) -> Mapping[str, bytes]:
    """Return the FMUs, name to bytes: of the compensator, and of the plant in the settings, as JSON, if there is one.

    The same input, ziglang and FMPy give the same bytes. Without these two, or for a plant behind a current controller,
    it is an `InputError`.
    """
    made_with()
    plant = plant_of(settings.get("plant", ""), compensator)
    models = [compensator_model(compensator), *([plant_model(plant, compensator)] if plant is not None else [])]
    return {f"{model.identifier}.fmu": _fmu(model, compensator, origin) for model in models}


def note_of(compensator: Compensator, settings: Mapping[str, str]) -> str:
    """Return how to have an FMU of the plant too; empty where there is one, or can't be one."""
    if settings.get("plant") or compensator.current_drive is not None:
        return ""
    return "no FMU of the plant is made; for one, give --plant PLANT.toml, such as demo/example/plant.toml"


@cache
def made_with() -> str:
    """Return the versions of what makes an FMU; without one of them the `MissingToolError` says how to install it."""
    if missing := [name for name in ("ziglang", "fmpy") if find_spec(name) is None]:
        raise MissingToolError(
            f"an FMU is compiled by ziglang with the headers of FMPy; {' and '.join(missing)} not found; {INSTALL}"
        )
    found = version("ziglang")
    if tuple(int(part) for part in re.findall(r"\d+", found)[:2]) < OLDEST:
        raise MissingToolError(
            f"ziglang {found} can't link the FMUs' binaries without a library, expected {OLDEST[0]}.{OLDEST[1]} or "
            f"later; {INSTALL}"
        )
    return f"ziglang {found}, FMPy {version('fmpy')}"


def made_by_another_compiler(files: Mapping[str, bytes]) -> str:
    """Return why binaries are others than this machine's compiler makes; empty if it is the one that made them."""
    this = made_with()
    for name in sorted(name for name in files if name.endswith(".fmu")):
        try:
            with ZipFile(BytesIO(files[name])) as packed, packed.open(f"{EXTRA}/manifest.json") as manifest:
                found = json.loads(manifest.read(LARGEST_MANIFEST))["made_with"]
        except (BadZipFile, KeyError, TypeError, ValueError, RuntimeError, EOFError, OSError, ZlibError, struct.error):
            continue  # no FMU: then it is another file than is generated
        if found != this and isinstance(found, str):
            return f"{name} was made with {quoted(found)}, and here is {this}"
    return ""


def _fmu(model: Model, compensator: Compensator, origin: FirmwareOrigin) -> bytes:
    """Return one FMU."""
    digest = origin.compensator_json
    # What ties a binary to its modelDescription.xml.
    made_from = (digest, model.identifier, model.variables, sorted(model.extra.items()), TOOL)
    token = f"{{{uuid.UUID(sha256_of(repr(made_from).encode())[:32])}}}"
    values = {
        **model.values,
        "banner": banner_of(compensator, digest).lines("dz_fmu.c.jinja"),
        "title": model.title.replace("dzdesign ", "").capitalize(),
        "token": token,
        "exchange": model.exchange,
        "variables": model.variables,
        "model_template": model.template,
    }
    template = strict_templates("dzdesign.codegen.fmu", autoescape=False).get_template("dz_fmu.c.jinja")
    sources = {SOURCE: str(template.render(values)).encode(), **model.core, **_headers()}
    manifest = {"schema": SCHEMA, "tool": TOOL, "made_with": made_with(), "compensator_json": digest, "token": token}
    return archive({
        "modelDescription.xml": model_description(model, token).encode(),
        **{f"sources/{name}": content for name, content in sources.items()},
        **binaries_of(model.identifier, sources),
        **{f"{EXTRA}/{name}": content for name, content in model.extra.items()},
        f"{EXTRA}/manifest.json": (json.dumps(manifest, indent=2) + "\n").encode(),
    })  # fmt: skip


def _headers() -> dict[str, bytes]:
    """Return the headers of the standard, found without the import of FMPy, which takes a second."""
    spec = find_spec("fmpy")
    (folder,) = (spec.submodule_search_locations if spec else None) or [""]
    return {name: (Path(folder) / "c-code" / name).read_bytes().replace(b"\r\n", b"\n") for name in HEADERS}


def archive(files: Mapping[str, bytes]) -> bytes:
    """Return the zip of files, path to content, the same bytes each time: modelDescription.xml first, then by name."""
    stream = BytesIO()
    with ZipFile(stream, "w", ZIP_DEFLATED, compresslevel=9) as packed:
        for path in sorted(files, key=lambda path: (path != "modelDescription.xml", path)):
            entry = ZipInfo(path, DATE)
            entry.compress_type, entry.create_system = ZIP_DEFLATED, UNIX
            entry.external_attr = (RUNNABLE if path.startswith("binaries/") else READABLE) << 16
            packed.writestr(entry, files[path])
    return stream.getvalue()


def binaries_of(identifier: str, sources: Mapping[str, bytes]) -> dict[str, bytes]:
    """Compile the sources for every platform; path in the FMU to bytes."""
    with scratch_folder() as folder, ThreadPoolExecutor(WORKERS) as pool:
        for name, content in sources.items():
            (folder / name).write_bytes(content)
        (folder / NO_LIBRARY).mkdir()
        (folder / NO_LIBRARY / "stdlib.h").write_bytes(b"")
        compiled = pool.map(lambda platform: _compiled(folder, identifier, platform), PLATFORMS)
        return {
            f"binaries/{platform.folder}/{identifier}.{platform.ending}": content
            for platform, content in zip(PLATFORMS, compiled, strict=True)
        }


def _compiled(folder: Path, identifier: str, platform: Platform) -> bytes:
    """Compile for one platform, in a folder of its own, so that its names are the same each time."""
    made = folder / platform.triple
    made.mkdir()
    name = f"{identifier}.{platform.ending}"
    named = {
        # A name that nothing defines is an error: the linkers of the other two systems say so by themselves.
        "so": (f"-Wl,-soname,{name}", "-Wl,-z,noexecstack", "-Wl,-z,defs"),
        "dll": ("-Wl,--no-entry",),
        "dylib": (f"-Wl,-install_name,@rpath/{name}",),
    }
    command = [
        sys.executable, "-P", "-m", "ziglang", "cc", "-target", platform.triple, *FLAGS,
        *named[platform.ending], "-I.", "-isystem", NO_LIBRARY, SOURCE, "-o", f"{platform.triple}/{name}",
    ]  # fmt: skip
    try:
        done = run_program(
            command, cwd=folder, timeout=LONGEST_S,
            env={name: value for name, value in os.environ.items() if name not in REDIRECTING},
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        raise MissingToolError(f"ziglang can't compile the FMU for {platform.triple}: {error}") from error
    if done.returncode:
        said = " ".join(done.stderr.split())[:400]
        raise MissingToolError(f"ziglang can't compile the FMU for {platform.triple}: {said}")
    return (made / name).read_bytes()
