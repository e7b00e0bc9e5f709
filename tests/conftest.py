"""What many tests share: the bundled example through the pipeline, once."""

import os

# As the command line does: the matrices are small. Read when NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from importlib.resources import files
from pathlib import Path

import pytest

from dzdesign.core.artefacts import to_json, write_folder
from dzdesign.identify.ramp_files import read_ramp_file


def pytest_addoption(parser):
    parser.addoption("--update-goldens", action="store_true", help="write tests/goldens anew, from its valve.json")
    parser.addoption("--update-docs", action="store_true", help="write what commands print into the pages of docs/")


@pytest.fixture(scope="session")
def example_folder() -> Path:
    return Path(str(files("dzdesign.example")))


@pytest.fixture(scope="session")
def example_tests(example_folder):
    return [read_ramp_file(path) for path in sorted((example_folder / "ramps").glob("*.csv.gz"))]


@pytest.fixture(scope="session")
def example_valve(example_tests):
    from dzdesign.identify.identification import identify

    return identify(example_tests)


@pytest.fixture(scope="session")
def example_compensator(example_valve):
    from dzdesign.design.designing import design

    return design(example_valve)


@pytest.fixture(scope="session")
def example_firmware(example_compensator):
    from dzdesign.codegen.project import generate
    from dzdesign.design.compensator_file import compensator_document

    return generate(example_compensator, "f28335", to_json(compensator_document(example_compensator)).encode())


@pytest.fixture
def firmware_folder(example_firmware, tmp_path):
    folder = tmp_path / "firmware"
    write_folder(folder, example_firmware.files, example_firmware.manifest)
    return folder
