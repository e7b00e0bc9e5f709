"""FMUs of the goldens' compensator with everything switched on, with this machine's binaries alone; and wrong ones."""

import json
import sys
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from dzdesign.codegen.fmu import binaries
from dzdesign.codegen.other_targets import Output, generate_output
from dzdesign.design.compensator import Compensator
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.fmu.fmu_file import HERE, FmuFile
from dzdesign.verify.toolchain.host_compiler import built, host_compiler, words_of
from tests.support.golden_firmware import FULL, golden_compensator

PLANT = Plant()


def full_compensator() -> Compensator:
    """Two unlike sides, swapped sensors of unlike spans, transition, ramps, dither, latch."""
    return golden_compensator("f28335", FULL)


def host_platforms() -> tuple[binaries.Platform, ...]:
    """Return the platform of this machine, of those that FMUs have."""
    folder, _ = next(value for (system, _), value in HERE.items() if sys.platform == system)
    return tuple(each for each in binaries.PLATFORMS if each.folder == folder)


def plant_setting(plant: Plant = PLANT) -> str:
    """Return a plant as the setting of an output."""
    return json.dumps({name: float(value) for name, value in asdict(plant).items()})


def fmus_of(compensator: Compensator, plant: Plant | None = PLANT) -> Output:
    """Return the FMUs, with the binaries of the platforms that `binaries.PLATFORMS` has now."""
    settings = {"plant": plant_setting(plant) if plant else ""}
    return generate_output(compensator, "fmu", settings)


def written(output: Output, folder: Path) -> Path:
    """Write the files of an output without its manifest."""
    for name, content in output.files.items():
        (folder / name).write_bytes(content)
    return folder


def edited(fmu: FmuFile, name: str, old: str, new: str, *flags: str) -> bytes:
    """Return this machine's binary of an FMU with other text in one of its sources."""
    sources = {path.removeprefix("sources/"): content for path, content in fmu.files.items() if "sources/" in path}
    text = sources[name].decode()
    assert old in text, old
    sources[name] = text.replace(old, new, 1).encode()
    command = [*words_of(host_compiler()), "-std=c99", "-O1", "-shared", "-fPIC", "-I.", *flags, "dz_fmu.c"]
    return built("edited.so", command, sources, "an edited FMU").read_bytes()


def with_binary(fmu: FmuFile, content: bytes) -> FmuFile:
    """Return an FMU with another binary for this machine."""
    return with_files(fmu, {path: content for path in fmu.files if path.startswith("binaries/")})


def with_files(fmu: FmuFile, files: Mapping[str, bytes], manifest: Mapping[str, Any] | None = None) -> FmuFile:
    """Return an FMU with other files, and where one is given another manifest of them."""
    return replace(fmu, files={**fmu.files, **files}, manifest=manifest or fmu.manifest)
