"""What an FMU says of itself against what it was made from: its manifest, files and variables."""

from collections.abc import Iterator, Mapping

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.artefact_types import THIS_TOOL, as_document, to_json_bytes
from dzdesign.design.compensator import Compensator
from dzdesign.verify.fmu.fmu_file import DESCRIPTION, EXTRA, FmuFile
from dzdesign.verify.fmu.needed_libraries import machine_of, needed_libraries

MANIFEST = f"{EXTRA}/manifest.json"
#: What a platform's binary may ask for: every process of these systems has it.
ALWAYS_THERE = {"dll": {"kernel32.dll"}, "dylib": {"/usr/lib/libSystem.B.dylib"}, "so": set[str]()}
#: Folders of binaries that each version has, to their ending.
PLATFORMS: Mapping[int, Mapping[str, str]] = {
    2: {"linux64": "so", "win64": "dll", "darwin64": "dylib"},
    3: {
        "x86_64-linux": "so", "aarch64-linux": "so", "x86_64-windows": "dll", "x86_64-darwin": "dylib",
        "aarch64-darwin": "dylib",
    },
}  # fmt: skip
#: Folder of a binary to the machine that it is for, as `machine_of` names them.
MACHINES: Mapping[str, str] = {
    "linux64": "x86_64 ELF", "x86_64-linux": "x86_64 ELF", "aarch64-linux": "aarch64 ELF", "win64": "x86_64 PE",
    "x86_64-windows": "x86_64 PE", "darwin64": "x86_64 Mach-O", "x86_64-darwin": "x86_64 Mach-O",
    "aarch64-darwin": "aarch64 Mach-O",
}  # fmt: skip
#: Units that stand for something, and their factors to SI.
FACTORS = {"V": 1.0, "MPa": 1e6, "L/min": 1e-3 / 60, "A": 1.0, "m": 1.0, "m/s": 1.0}


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
        ("fmi", f"{fmu.fmi}.0"),
        ("token", fmu.token),
    ):
        if fmu.manifest.get(key) != expected:
            yield f"its manifest's {key} is {str(fmu.manifest.get(key))[:50]}, expected {str(expected)[:70]}"
    document = fmu.files.get(f"{EXTRA}/{Compensator.FILE_NAME}")
    if document is not None and document != to_json_bytes(compensator):
        yield f"its {Compensator.FILE_NAME} is another"
    if fmu.identifier != fmu.name.partition("_fmi")[0]:
        yield f"{DESCRIPTION}: the model is {fmu.identifier!r}, another than the file's"
    expected_files = _expected_files(fmu, compensator)
    for path in sorted(expected_files - fmu.files.keys()):
        yield f"{path} is missing"
    for path in sorted(fmu.files.keys() - expected_files):
        yield f"{path} is no file of such an FMU"


def _expected_files(fmu: FmuFile, compensator: Compensator) -> set[str]:
    """Return the paths that an FMU has: what else a tool finds in it, it would load or compile too."""
    types = {2: "fmi2TypesPlatform.h", 3: "fmi3PlatformTypes.h"}[fmu.fmi]
    sources = {"dz_fmu.c", f"fmi{fmu.fmi}Functions.h", f"fmi{fmu.fmi}FunctionTypes.h", types}
    sources |= {"buildDescription.xml"} if fmu.fmi == 3 else set()
    if fmu.name.startswith("dz_compensator"):
        sources |= {"dz_comp.c", "dz_comp.h", "dz_drive.c", "dz_drive.h"}
        sources |= {"dz_comp_negative.c"} if len(compensator.signals.signs) == 2 else set()
        data = Compensator.FILE_NAME
    else:
        data = "plant.json"
    binaries = (f"binaries/{folder}/{fmu.identifier}.{ending}" for folder, ending in PLATFORMS[fmu.fmi].items())
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
        if machine != MACHINES.get(path.split("/")[1]):
            yield f"{path} is for {machine}"
        known = ALWAYS_THERE.get(ending, set())
        if others := [name for name in needed if name not in known and name.lower() not in known]:
            yield f"{path} needs {', '.join(others)}"


def compensator_faults(fmu: FmuFile, compensator: Compensator) -> Iterator[str]:
    """Yield what modelDescription.xml says otherwise than compensator.json: variables, units, codes at zero."""
    signals = compensator.signals
    inputs = {"u_i": "V", "p_A": "MPa", "p_B": "MPa"}
    codes = {
        "u_i_code": signals.command.zero_code,
        "p_A_code": signals.pressure_a.zero_code,
        "p_B_code": signals.pressure_b.zero_code,
    }
    outputs = {"compare_a", "compare_b", "drive_status"}
    for sign in signals.signs:
        ending = "" if sign > 0 else "_negative"
        outputs |= {f"{name}{ending}" for name in ("u_O", "beta", "compare", "status")}
        inputs |= {f"u_O{ending}": "V"}
    yield from _unit_faults(fmu, inputs)
    for name, code in codes.items():
        found = fmu.variables.get(name)
        if found is None or found.start != str(code) or found.kind != "integer":
            yield f"{DESCRIPTION}: {name} starts at {found.start if found else None}, expected {code}"
    yield from _causality_faults(fmu, {"input": {"u_i", "p_A", "p_B", *codes}, "output": outputs,
                                       "parameter": {"codes"}})  # fmt: skip


def plant_faults(fmu: FmuFile, plant: Mapping[str, float]) -> Iterator[str]:
    """Yield what modelDescription.xml says otherwise than the plant's parameters."""
    yield from _unit_faults(fmu, {"voltage": "V", "supply": "MPa", "Q": "L/min", "dP": "MPa", "x": "m", "i": "A"})
    for name, value in plant.items():
        found = fmu.variables.get(name)
        if found is None or found.start is None or float(found.start) != value:
            yield f"{DESCRIPTION}: {name} is {found.start if found else None}, expected {value}"
    yield from _causality_faults(fmu, {"input": {"compare", "voltage", "supply", "back_pressure"},
                                       "parameter": set(plant)})  # fmt: skip


def _unit_faults(fmu: FmuFile, units: Mapping[str, str]) -> Iterator[str]:
    for name, unit in units.items():
        found = fmu.variables.get(name)
        if found is None or found.unit != unit or found.kind != "real":
            yield f"{DESCRIPTION}: {name} has unit {found.unit if found else None}, expected {unit}"
        factor = fmu.units.get(unit)
        if factor is None or abs(factor / FACTORS[unit] - 1) > 1e-12:
            yield f"{DESCRIPTION}: the unit {unit} has factor {factor}, expected {FACTORS[unit]:.6g}"


def _causality_faults(fmu: FmuFile, expected: Mapping[str, set[str]]) -> Iterator[str]:
    for causality, names in expected.items():
        found = {name for name, each in fmu.variables.items() if each.causality == causality}
        if causality != "output" and found != names:
            yield f"{DESCRIPTION}: {causality}s {', '.join(sorted(found ^ names))} are missing or too many"
        if causality == "output" and not names <= found:
            yield f"{DESCRIPTION}: outputs {', '.join(sorted(names - found))} are missing"
