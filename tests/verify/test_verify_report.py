"""What `verify` says and what its report says: one verdict, whatever else lies beside; and whose valve.json it is."""

import shutil
from collections import Counter

import pytest

from dzdesign.command_line.cli import main
from dzdesign.core import artefact_reading
from dzdesign.report import valve_report
from tests.support.attacked_firmware import take_the_rest_as_held
from tests.support.synthetic import needs_compiler

pytestmark = [pytest.mark.slow, needs_compiler]


@pytest.fixture
def copied(reported_demo, tmp_path):
    return shutil.copytree(reported_demo, tmp_path / "demo")


# ---- what was not tried ----


# ---- read once ----


def test_verify_reads_every_artefact_once(copied, tmp_path, monkeypatch):
    """Also compensator.json, of all checks and of the report."""
    read, with_report = Counter(), valve_report.with_report
    take_the_rest_as_held(monkeypatch)
    monkeypatch.setattr(valve_report, "with_report", with_report)
    convert = artefact_reading.convert
    monkeypatch.setattr(
        artefact_reading,
        "convert",
        lambda document, kind, **how: read.update([kind.__name__]) or convert(document, kind, **how),
    )
    assert main(["verify", str(copied / "firmware"), "-o", str(tmp_path / "evidence")]) == 0
    assert read["Compensator"] == 1 and read["ValveModel"] == read["Evidence"] == 0  # one holds it, one is a value
