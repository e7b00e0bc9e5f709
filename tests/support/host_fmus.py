"""FMUs of the goldens' compensator with everything switched on, with this machine's binaries alone; and wrong ones."""

import json
import shutil
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import fmpy

from dzdesign.codegen.fmu import files
from dzdesign.codegen.fmu.files import archive
from dzdesign.codegen.other_targets import Output, generate_output
from dzdesign.design.compensator import Compensator
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.outputs.fmu import Unpacked
from dzdesign.verify.toolchain.host_compiler import built, host_compiler, words_of
from tests.support.golden_firmware import FULL, golden_compensator

PLANT = Plant()


def full_compensator() -> Compensator:
    """Two unlike sides, swapped sensors of unlike spans, transition, ramps, dither, latch."""
    return golden_compensator("f28335", FULL)


def host_platforms() -> tuple[files.Platform, ...]:
    """Return the platform of this machine, of those that FMUs have."""
    return tuple(each for each in files.PLATFORMS if each.folder in (fmpy.platform, fmpy.platform_tuple))[-1:]


def plant_setting(plant: Plant = PLANT) -> str:
    """Return a plant as the setting of an output."""
    return json.dumps({name: float(value) for name, value in asdict(plant).items()})


def fmus_of(compensator: Compensator, plant: Plant | None = PLANT) -> Output:
    """Return the FMUs, with the binaries of the platforms that `files.PLATFORMS` has now."""
    settings = {"plant": plant_setting(plant) if plant else ""}
    return generate_output(compensator, "fmu", settings)


def written(output: Output, folder: Path) -> Path:
    """Write the files of an output without its manifest."""
    for name, content in output.files.items():
        (folder / name).write_bytes(content)
    return folder


def edited(fmu: Unpacked, place: Path, name: str, old: str, new: str) -> Unpacked:
    """Return an FMU whose binary for this machine is compiled from other text in one of its sources."""
    sources = {path.name: path.read_bytes() for path in (fmu.folder / "sources").iterdir()}
    text = sources[name].decode()
    assert old in text, old
    sources[name] = text.replace(old, new, 1).encode()
    command = [*words_of(host_compiler()), "-std=c99", "-O1", "-shared", "-fPIC", "-I.", "dz_fmu.c"]
    return with_binary(fmu, place, built("edited.so", command, sources, "an edited FMU").read_bytes())


def with_binary(fmu: Unpacked, place: Path, content: bytes) -> Unpacked:
    """Return a copy of an FMU with another binary for this machine."""
    folder = place / fmu.folder.name
    shutil.copytree(fmu.folder, folder)
    binary = folder / fmu.binary.relative_to(fmu.folder)
    binary.write_bytes(content)
    return replace(fmu, folder=folder, binary=binary)


def repacked(path: Path, change: Callable[[dict[str, bytes]], None]) -> None:
    """Change the files in an FMU."""
    from zipfile import ZipFile

    with ZipFile(path) as packed:
        found = {name: packed.read(name) for name in packed.namelist()}
    change(found)
    path.write_bytes(archive(found))
