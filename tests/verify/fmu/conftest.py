"""FMUs with this machine's binaries, made once for all tests of the room."""

import pytest

from dzdesign.codegen.fmu import files
from dzdesign.verify.outputs.fmu import unpacked
from tests.support.host_fmus import fmus_of, full_compensator, host_platforms, written


@pytest.fixture(scope="session")
def compensator():
    """Return the compensator of all FMUs here."""
    return full_compensator()


@pytest.fixture(scope="session")
def fmu_folder(tmp_path_factory, compensator):
    """Return a folder with FMUs of a compensator and of a plant."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(files, "PLATFORMS", host_platforms())
        return written(fmus_of(compensator), tmp_path_factory.mktemp("fmus"))


@pytest.fixture(scope="session")
def fmu(fmu_folder, tmp_path_factory):
    """Return the compensator's FMU."""
    return unpacked(fmu_folder / "dz_compensator.fmu", tmp_path_factory.mktemp("unpacked"))


@pytest.fixture(scope="session")
def plant_fmu(fmu_folder, tmp_path_factory):
    """Return the plant's FMU."""
    return unpacked(fmu_folder / "dz_plant.fmu", tmp_path_factory.mktemp("unpacked"))
