"""What many tests share: the bundled example through the pipeline, once."""

import os

# As the command line does: the matrices are small. Read when NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from pathlib import Path

import pytest

from dzdesign.core.artefact_files import write_folder
from dzdesign.example import example_folder as bundled_folder
from dzdesign.identify.reading.ramp_files import read_ramp_file
from tests.support.wording import Wording, name_of_tests


def pytest_addoption(parser):
    parser.addoption("--update-goldens", action="store_true", help="write tests/goldens anew")
    parser.addoption("--update-docs", action="store_true", help="write what commands print into the pages of docs/")


@pytest.fixture(autouse=True)
def page_of_a_file(monkeypatch):
    """Print as into a file, whatever the terminal or CI that runs the tests says of its width."""
    monkeypatch.delenv("COLUMNS", raising=False)


@pytest.fixture(scope="session", autouse=True)
def short_windows_beside_casadi():
    """Compare the plant with CasADi's CVODES over 0.3 s, not 1 s: much of what `verify` costs a test.

    They are whole in another process, which takes nothing of this patch: where a test runs the program, as the pages of
    docs/ do, and of `batch --verify` with two or more `--jobs`. In this process, `batch --jobs 1` too, they are whole
    where a test asks for `whole_windows`.
    """
    from dzdesign.verify.closed_loop import against_cvodes

    whole_s = against_cvodes.WINDOW_S
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(against_cvodes, "WINDOW_S", 0.3)
        yield whole_s


@pytest.fixture
def whole_windows(short_windows_beside_casadi, monkeypatch):
    """Compare the plant with CasADi's CVODES over all of what `verify` does."""
    monkeypatch.setattr("dzdesign.verify.closed_loop.against_cvodes.WINDOW_S", short_windows_beside_casadi)


@pytest.fixture
def each_core_once(monkeypatch):
    """Run equal cores once in a session: for tests of what stands around that, see `run_each_core_once`."""
    from tests.support.attacked_firmware import run_each_core_once

    run_each_core_once(monkeypatch)


@pytest.fixture
def wording(request, tmp_path) -> Wording:
    """Compare whole messages with those kept: `wording("group: case", text)`, `with wording.refusal(Error):`."""
    node = request.node
    case = f" [{node.callspec.id}]" if hasattr(node, "callspec") else ""
    test = f"{name_of_tests(node.path.stem)}: {name_of_tests(node.originalname)}{case}"
    return Wording(request.config.getoption("--update-goldens"), tmp_path, test=test)


@pytest.fixture(scope="session")
def example_folder() -> Path:
    return bundled_folder()


@pytest.fixture(scope="session")
def example_tests(example_folder):
    return [read_ramp_file(path) for path in sorted((example_folder / "ramps").glob("*.csv.gz"))]


@pytest.fixture(scope="session")
def example_valve(example_tests):
    from dzdesign.identify.identification import identify

    return identify(example_tests)


def default_options():
    """What `design` takes where no option is given."""
    from dzdesign.codegen.project import DEFAULT_TARGET, target_named
    from dzdesign.design.options import options_of

    return options_of({}, target_named(DEFAULT_TARGET).inputs())


@pytest.fixture(scope="session")
def example_compensator(example_valve):
    from dzdesign.design.designing import design

    return design(example_valve, default_options())


@pytest.fixture(scope="session")
def example_firmware(example_compensator):
    from dzdesign.codegen.project import generate

    return generate(example_compensator, "f28335")


@pytest.fixture
def firmware_folder(example_firmware, tmp_path):
    folder = tmp_path / "firmware"
    write_folder(folder, example_firmware.files, example_firmware.manifest)
    return folder


@pytest.fixture(scope="session")
def reported_demo(example_valve, tmp_path_factory):
    """A folder as `dzdesign demo` leaves it, with quicker ramps: valve.json, compensator.json, firmware, evidence."""
    from dzdesign.codegen.project import generate
    from dzdesign.core.artefact_types import to_json_bytes
    from dzdesign.design.designing import design
    from dzdesign.regeneration import regenerated
    from dzdesign.report.valve_report import with_report
    from dzdesign.verify.closed_loop.loop import RampSequence
    from dzdesign.verify.verification import Asked, evidence_manifest, verify

    folder = tmp_path_factory.mktemp("reported")
    valve_json = to_json_bytes(example_valve)
    compensator = design(example_valve, default_options())
    compensator_json = to_json_bytes(compensator).decode()
    (folder / "valve.json").write_bytes(valve_json)
    (folder / "compensator.json").write_text(compensator_json, encoding="utf-8", newline="")
    firmware = generate(compensator, "f28335")
    write_folder(folder / "firmware", firmware.files, firmware.manifest)
    again = regenerated(folder / "firmware")
    asked = Asked(sequence=RampSequence(rest=0.5, ramp=10.0, top=0.5))
    evidence = verify(folder / "firmware", asked, again)
    files = with_report(evidence, folder / "firmware", folder / "evidence")
    write_folder(folder / "evidence", files, evidence_manifest(evidence.evidence))
    return folder
