"""What `verify` says and what its report says: one verdict, whatever else lies beside; and whose valve.json it is."""

import json
import re
import shutil
from collections import Counter
from dataclasses import replace

import pytest

from dzdesign.codegen.project import generate
from dzdesign.command_line.cli import main
from dzdesign.core import artefact_reading
from dzdesign.core.artefact_files import sha256_of, to_json, write_folder
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.design.designing import design
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.firmware.compensator_checks import valve_follows
from dzdesign.verify.firmware.folder import read_compensator
from dzdesign.verify.requirements import VALVE
from dzdesign.verify.untried import not_tried
from tests.conftest import default_options
from tests.support.evidence import evidence_with
from tests.support.synthetic import needs_compiler

pytestmark = [pytest.mark.slow, needs_compiler]


@pytest.fixture
def copied(reported_demo, tmp_path):
    return shutil.copytree(reported_demo, tmp_path / "demo")


def strangers(folder):
    """Change the valve that lies beside a firmware."""
    valve = json.loads((folder / "valve.json").read_bytes())
    (folder / "valve.json").write_text(to_json({**valve, "u_max_V": 11.0}))


# ---- valve.json ----


def spaced(copied):
    """The firmware of a valve.json that somebody saved with another spacing; its compensator."""
    content = json.dumps(json.loads((copied / "valve.json").read_bytes())).encode()
    compensator = design(read_artefact(content, ValveModel, "valve.json"), default_options(), content)
    write_folder(copied / "firmware", *_made(compensator))
    (copied / "valve.json").write_bytes(content)
    return compensator


def _made(compensator):
    firmware = generate(compensator, "f28335")
    return firmware.files, firmware.manifest


def test_the_hash_of_a_valve_as_identify_writes_it_needs_no_file(copied):
    (copied / "valve.json").unlink()
    check = valve_follows(copied / "firmware", read_compensator(copied / "firmware"))
    assert check.holds and check.id == VALVE.id


def test_of_another_spacing_it_is_compared_with_the_file_and_not_checked_without(copied, wording):
    compensator = spaced(copied)
    check = valve_follows(copied / "firmware", compensator)
    assert check.holds
    wording.of_test(check.text)
    (copied / "valve.json").rename(copied / "bench 7.json")  # the name says nothing
    assert valve_follows(copied / "firmware", compensator).holds
    (copied / "bench 7.json").unlink()
    assert valve_follows(copied / "firmware", compensator).holds is None


def test_a_valve_file_that_was_replaced_is_said_first(copied):
    """What was compared is told by its hash, and the file of the name comes before others."""
    compensator = read_compensator(copied / "firmware")
    stated = compensator.valve_json_sha256
    other = json.loads((copied / "valve.json").read_bytes())
    other["record"] = {"serial": "another"}
    for name in ("again.json", "valve.json"):
        (copied / name).write_text(to_json(other))
    digest = sha256_of((copied / "valve.json").read_bytes())
    check = valve_follows(copied / "firmware", compensator)
    assert check.holds and "valve.json" not in check.name
    assert check.text.startswith(f"valve.json beside the firmware is ANOTHER valve, SHA-256 {digest}, and not used; ")
    assert check.text.endswith(f"have the SHA-256 in made_from: {stated}")
    (copied / "a.json").write_bytes(to_json_bytes(compensator.valve))  # the one that it was made from, by another name
    check = valve_follows(copied / "firmware", compensator)
    assert check.holds and check.text.startswith("valve.json beside the firmware is ANOTHER valve")


def test_a_strangers_valve_is_not_compared(copied):
    compensator = spaced(copied)
    strangers(copied)
    assert valve_follows(copied / "firmware", compensator).holds is None


def test_a_hash_that_is_not_that_of_the_valve_is_found(copied, wording):
    compensator = read_compensator(copied / "firmware")
    compensator = replace(compensator, made_from=(replace(compensator.made_from[0], sha256="0" * 64),))
    check = valve_follows(copied / "firmware", compensator)
    assert check.holds is False
    wording.of_test(check.text)
    (copied / "valve.json").unlink()
    check = valve_follows(copied / "firmware", compensator)
    assert check.holds is None  # nobody can tell, so it must not hold
    digests = {"0" * 64: "STATED", compensator.valve_sha256: "FOUND"}
    text = "".join(digests.get(word, word) for word in re.split(r"(\w+)", check.text))
    wording("requirement valve: no file at hand", text)


def test_another_valve_under_the_hash_of_the_file_is_found(copied, wording):
    compensator = spaced(copied)
    compensator = replace(compensator, valve=replace(compensator.valve, record={"serial": "another"}))
    check = valve_follows(copied / "firmware", compensator)
    assert check.holds is False
    wording.of_test(check.text)


# ---- what was not tried ----


@pytest.mark.parametrize(("target", "said"), [("f28335", True), ("cortex-m4", False), ("host", False)])
def test_the_headers_of_ti_are_named_where_they_make_sense(target, said):
    assert any("--c2000ware" in line for line in not_tried(evidence_with(target=target))) is said


# ---- read once ----


def test_verify_reads_every_artefact_once(copied, tmp_path, monkeypatch):
    """Also compensator.json, of all checks and of the report."""
    read = Counter()
    convert = artefact_reading.convert
    monkeypatch.setattr(
        artefact_reading,
        "convert",
        lambda document, kind, **how: read.update([kind.__name__]) or convert(document, kind, **how),
    )
    assert main(["verify", str(copied / "firmware"), "-o", str(tmp_path / "evidence")]) == 0
    assert read["ValveModel"] == 1 and read["Compensator"] == 1 and read["Evidence"] == 1
