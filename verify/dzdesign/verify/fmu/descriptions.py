"""The files of an FMU against its own manifest, and its binaries against the platforms that they are for."""

from collections.abc import Iterator, Mapping

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.artefact_types import THIS_TOOL, as_document, to_json_bytes
from dzdesign.design.compensator import Compensator
from dzdesign.verify.fmu.fmu_file import DESCRIPTION, EXTRA, FmuFile
from dzdesign.verify.fmu.needed_libraries import machine_of, needed_libraries

MANIFEST = f"{EXTRA}/manifest.json"
#: What a platform's binary may ask for: every process of these systems has it.
ALWAYS_THERE = {"dll": {"kernel32.dll"}, "dylib": {"/usr/lib/libSystem.B.dylib"}, "so": set[str]()}
#: Folder of a binary to its ending, and to the machine that it is for, as `machine_of` names them.
PLATFORMS: Mapping[str, tuple[str, str]] = {
    "linux64": ("so", "x86_64 ELF"),
    "aarch64-linux": ("so", "aarch64 ELF"),
    "win64": ("dll", "x86_64 PE"),
    "darwin64": ("dylib", "x86_64 Mach-O"),
    "aarch64-darwin": ("dylib", "aarch64 Mach-O"),
}


def file_faults(fmu: FmuFile, compensator: Compensator, digest: str) -> Iterator[str]:
    """Yield what is otherwise than the FMU's own manifest has it, or than what the manifest must have."""
    stated = fmu.manifest.get("files")
    stated = stated if isinstance(stated, dict) else {}
    for path in sorted(set(fmu.files) - set(stated) - {MANIFEST}):
        yield f"{path} is not in its manifest"
    for path, of_file in stated.items():
        if path not in fmu.files or sha256_of(fmu.files[path]) != of_file:
            yield f"{path} is missing or changed"
    for key, expected in (
        ("tool", as_document(THIS_TOOL)),
        ("compensator_json", digest),
        ("token", fmu.token),
    ):
        if fmu.manifest.get(key) != expected:
            yield f"its manifest's {key} is {str(fmu.manifest.get(key))[:50]}, expected {str(expected)[:70]}"
    document = fmu.files.get(f"{EXTRA}/{Compensator.FILE_NAME}")
    if document is not None and document != to_json_bytes(compensator):
        yield f"its {Compensator.FILE_NAME} is another"
    if fmu.identifier != fmu.name.removesuffix(".fmu"):
        yield f"{DESCRIPTION}: the model is {fmu.identifier!r}, another than the file's"
    expected_files = _expected_files(fmu, compensator)
    for path in sorted(expected_files - fmu.files.keys()):
        yield f"{path} is missing"
    for path in sorted(fmu.files.keys() - expected_files):
        yield f"{path} is no file of such an FMU"


def _expected_files(fmu: FmuFile, compensator: Compensator) -> set[str]:
    """Return the paths that an FMU has: what else a tool finds in it, it would load or compile too."""
    sources = {"dz_fmu.c", "fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"}
    if fmu.name.startswith("dz_compensator"):
        sources |= {"dz_comp.c", "dz_comp.h", "dz_drive.c", "dz_drive.h", "dz_calibration.h", "dz_valve.h"}
        data = Compensator.FILE_NAME
    else:
        data = "plant.json"
    binaries = (f"binaries/{folder}/{fmu.identifier}.{ending}" for folder, (ending, _) in PLATFORMS.items())
    return {DESCRIPTION, MANIFEST, f"{EXTRA}/{data}", *(f"sources/{name}" for name in sources), *binaries}


def library_faults(fmu: FmuFile) -> Iterator[str]:
    """Yield the libraries that binaries ask for and not every machine has, and what is no binary."""
    for path in sorted(path for path in fmu.files if path.startswith("binaries/")):
        ending = path.rpartition(".")[2]
        try:
            machine, needed = machine_of(fmu.files[path]), needed_libraries(fmu.files[path])
        except ValueError as error:
            yield f"{path}: {error}"
            continue
        if machine != PLATFORMS.get(path.split("/")[1], ("", ""))[1]:
            yield f"{path} is for {machine}"
        known = ALWAYS_THERE.get(ending, set())
        if others := [name for name in needed if name not in known and name.lower() not in known]:
            yield f"{path} needs {', '.join(others)}"
