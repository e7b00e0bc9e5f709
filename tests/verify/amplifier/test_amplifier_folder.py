"""`verify` of a folder for an amplifier: a wrong file, table or manifest does not hold, whoever generated it."""

import json

import pytest

from dzdesign import api
from dzdesign.codegen.other_targets import generate_output, settings_of
from dzdesign.codegen.writing import write_generated
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import OutputManifest
from dzdesign.verify.outputs import amplifier
from dzdesign.verify.outputs.verification import verify_output
from dzdesign.verify.requirements import DEAD_ZONES, RAMPS, READ_BACK, REPRODUCED, SAFE
from tests.support.golden_firmware import FULL, golden_compensator, golden_valve

TABLE, FIRST = "dead_zones.csv", "positive,1.000000,opening,"
#: Design, and the settings of a folder that has seeded faults.
WEST, CSV = ("one", {"device": "west"}), ("one", {"device": "csv", "table_dp": "2 MPa"})
BOTH = ("two", {"device": "west"})


@pytest.fixture(scope="module")
def designs():
    return {"one": api.design(golden_valve()), "two": golden_compensator(root=FULL)}


@pytest.fixture
def written(designs, tmp_path):
    """Return the folder of a design and settings."""

    def write(name, given):
        made = designs[name]
        output = generate_output(made, "amplifier", settings_of("amplifier", given))
        write_generated(output, tmp_path / "amplifier")
        return tmp_path / "amplifier"

    return write


def edited(folder, name, old, new):
    content = (folder / name).read_bytes()
    assert content.count(old.encode()) == 1
    (folder / name).write_bytes(content.replace(old.encode(), new.encode()))


def found_of(folder):
    """Return what this room alone finds, by id; not what comparing the texts tells."""
    manifest = read_artefact((folder / MANIFEST_NAME).read_bytes(), OutputManifest, MANIFEST_NAME)
    compensator = read_artefact((folder / "compensator.json").read_bytes(), Compensator, "compensator.json")
    checks = amplifier.checks(folder, manifest, compensator, lambda _: None).checks
    return {check.id: check for check in checks}


def failed(folder):
    return {name for name, check in found_of(folder).items() if check.holds is not True}


@pytest.mark.parametrize(
    ("name", "given"),
    [WEST, CSV, BOTH, ("one", {"device": "west", "threshold": "2 %"})]
    + [("one", {"device": device}) for device in ("beckhoff", "cia408", "rmc75")],
    ids=str,
)
def test_what_was_generated_holds(written, name, given):
    found = found_of(written(name, given))
    assert set(found) == {READ_BACK.id, SAFE.id, DEAD_ZONES.id}
    assert all(check.holds for check in found.values())


@pytest.mark.parametrize(
    ("of", "name", "old", "new", "wrong"),
    [
        (WEST, TABLE, "positive,1.000000,opening", "positive,2.000000,opening", DEAD_ZONES),
        (WEST, TABLE, "positive,1.000000,opening", "negative,1.000000,opening", DEAD_ZONES),
        (WEST, TABLE, "positive,1.000000,opening", "positive,1.000000,closing", DEAD_ZONES),
        (WEST, TABLE, "positive,1.000000,opening", "Infinity,1.000000,opening", DEAD_ZONES),
        (WEST, TABLE, f"{FIRST}0.0", f"{FIRST}0.1", DEAD_ZONES),
        (WEST, TABLE, f"{FIRST}0.0", f"{FIRST}nan,0.0", DEAD_ZONES),  # of which no difference is too large
        (WEST, TABLE, "dead_zone_fixed", "dead_zone", DEAD_ZONES),
        (BOTH, "west.txt", "MIN:B 27", "MIN:B 28", SAFE),
    ],
)
def test_a_wrong_file_or_table_is_found(written, of, name, old, new, wrong):
    folder = written(*of)
    edited(folder, name, old, new)
    assert wrong.id in failed(folder)


@pytest.mark.parametrize("lines", [slice(0, 5), slice(0, 0)], ids=str)
def test_a_table_without_its_last_lines_is_found(written, lines):
    folder = written(*WEST)
    text = (folder / TABLE).read_text()
    kept = "".join(text.splitlines(keepends=True)[lines])
    (folder / TABLE).write_text(kept)
    assert DEAD_ZONES.id in failed(folder)


def test_the_file_of_another_device_or_a_second_one_is_found(written):
    folder = written(*WEST)
    path = folder / MANIFEST_NAME
    document = json.loads(path.read_text())
    for settings, more in (
        ({"device": "cia408"}, {}),
        ({"device": "west-pam190"}, {}),
        ({}, {}),
        ({"threshold": "1 MPa"}, {}),
        ({}, {"west.old": "0" * 64}),
    ):
        given = {**document["settings"], **settings} if settings or more else {}
        path.write_text(json.dumps({**document, "settings": given, "files": {**document["files"], **more}}))
        assert failed(folder) == {READ_BACK.id}


def test_a_larger_threshold_than_the_files_is_found(written):
    """`verify` takes the threshold that counts as zero from the settings: of a jump behind it the file is unsafe."""
    folder = written(*WEST)
    path = folder / MANIFEST_NAME
    document = json.loads(path.read_text())
    document["settings"]["threshold"] = "5 %"
    path.write_text(json.dumps(document))
    assert SAFE.id in failed(folder)


def test_the_command_says_what_does_not_hold(written, tmp_path, monkeypatch, capsys):
    folder = written(*WEST)
    monkeypatch.chdir(tmp_path)
    assert main(["verify", str(folder), "-q"]) == 0
    assert "Every requirement holds" in capsys.readouterr().out
    edited(folder, "west.txt", "MIN:A 4956", "MIN:A 4966")
    assert main(["verify", str(folder), "-q"]) == 1
    (missed, _) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("DOES NOT HOLD")]
    assert REPRODUCED.title in missed and "west.txt, line" in missed


def test_the_recordings_that_are_given_are_compared_though_no_law_runs(written):
    asked = []

    def compared(runs):
        asked.append(runs)
        return [RAMPS.check(holds=True, text="every number is the same")]

    verified = verify_output(written(*WEST), ramps=compared)
    assert asked == [False], "an amplifier's file has no pressure inputs"
    assert RAMPS.id in {check.id for check in verified.evidence.checks} and "recordings" not in verified.verdict


def test_the_evidence_names_the_settings(written):
    evidence = verify_output(written(*CSV)).evidence
    assert evidence.settings == {"device": "csv", "table_dp": "2 MPa", "threshold": ""}
    assert [check.id for check in evidence.checks if not check.holds] == [REPRODUCED.id]  # nothing was generated again
    assert evidence.target == "amplifier"


def test_an_option_of_other_outputs_is_refused_by_name(written, capsys, wording):
    folder = written(*WEST)
    assert main(["verify", str(folder), "--machine-code"]) == 2
    wording("amplifier folder: --machine-code", capsys.readouterr().err.replace(str(folder), "amplifier"))
