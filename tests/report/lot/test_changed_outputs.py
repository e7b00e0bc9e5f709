"""Folders of a lot's valves whose manifest is the one of the table: what was changed beside it is found."""

import pytest

from dzdesign.codegen.other_targets import generate_output, settings_of, write_output
from dzdesign.codegen.project import generate, write_firmware
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.design.compensator import Compensator
from dzdesign.report.lot.changed_outputs import change_in
from tests.support.paths import GOLDENS


@pytest.fixture(scope="module")
def compensator():
    return read_artefact((GOLDENS / "compensator.json").read_bytes(), Compensator, "compensator.json")


@pytest.fixture
def valve(tmp_path, compensator):
    """The folder of a valve with a firmware and an output."""
    write_firmware(generate(compensator, "host"), tmp_path / "firmware")
    write_output(generate_output(compensator, "matlab", settings_of("matlab", {})), tmp_path / "matlab")
    return tmp_path


def test_what_was_written_is_unchanged(valve):
    assert change_in(valve / "firmware") == change_in(valve / "matlab") == ""


@pytest.mark.parametrize(
    ("folder", "name"), [("firmware", "core/dz_comp.c"), ("matlab", "dz_comp.m"), ("matlab", "core/dz_comp.h")]
)
@pytest.mark.parametrize("how", ["edit", "delete"])
def test_a_changed_file_is_named(valve, folder, name, how):
    path = valve / folder / name
    if how == "edit":
        path.write_bytes(path.read_bytes() + b"\n")
    else:
        path.unlink()
    assert name in change_in(valve / folder)


def test_an_added_file_is_named(valve):
    """MATLAB runs a MEX file before a function of the same name."""
    (valve / "matlab" / "dz_comp.mexa64").write_bytes(b"")
    assert "dz_comp.mexa64" in change_in(valve / "matlab")


def test_a_manifest_that_is_none_is_said(valve):
    (valve / "matlab" / "manifest.json").write_text("{}")
    assert "manifest.json" in change_in(valve / "matlab")
