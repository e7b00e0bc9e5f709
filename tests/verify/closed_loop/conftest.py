"""The example's firmware in a loop, compiled once for all tests: with its stand-in, and with its plant of equations."""

import pytest

from dzdesign.core.artefact_files import write_folder
from dzdesign.verify.closed_loop.plant import read_plant
from dzdesign.verify.closed_loop.scene import scenes_of


@pytest.fixture(scope="session")
def plant(example_folder):
    return read_plant(example_folder / "plant.toml")


@pytest.fixture(scope="session")
def firmware(example_firmware, tmp_path_factory):
    folder = tmp_path_factory.mktemp("closed_loop") / "fw"
    write_folder(folder, example_firmware.files, example_firmware.manifest)
    return folder


@pytest.fixture(scope="session")
def scenes(firmware, example_compensator):
    return scenes_of(firmware, example_compensator, None)


@pytest.fixture(scope="session")
def plant_scenes(firmware, example_compensator, plant):
    return scenes_of(firmware, example_compensator, plant)
