"""`batch --outputs`: each valve has them; what is refused or does not hold is that valve's reason, with its output."""

import json
import shutil
from dataclasses import replace
from types import SimpleNamespace

import pytest

from dzdesign.batch import outputs as outputs_module
from dzdesign.batch.arguments import BatchArguments
from dzdesign.batch.calibration import Task, calibrate
from dzdesign.batch.outputs import ForOutputs, WantedOutput, make_output, may_end_otherwise, wanted_outputs
from dzdesign.batch.summary import lot_outputs
from dzdesign.batch.valve_folders import ValveFolder
from dzdesign.codegen import other_targets
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import InputError
from dzdesign.report.lot.folder import read_lot
from dzdesign.report.lot.page import report_of_lot
from dzdesign.report.lot.summary import LotSummary, ValveManifest, ValveOutput
from dzdesign.report.lot.table import read_manifest
from dzdesign.stages import verify as verify_stage
from dzdesign.verify.evidence import TriedInputs
from dzdesign.verify.requirements import REPRODUCED
from tests.dzdesign.batch.test_batch import NOTHING, rows, tree
from tests.support.golden_firmware import golden_compensator
from tests.support.many_valves import lot_options, write_lot

SETTINGS = {"dialect": "codesys", "interface": "plc", "cycle_time": ""}
PLC = WantedOutput(target="iec61131", settings=SETTINGS, folder="plc")
SEED = 7
#: The last one's current is controlled, which no function block does.
LIST = """name,files,drive,coil,rated_current,supply,current_signal
V0000,V0000/*.csv,,,,,
V0001,V0001/*.csv,,,,,
V0002,V0002/*.csv,current,3.5 ohm 40 mH,1 A,18..32 V,0..1.2 A on 2 ohm + 0.15 V
"""


@pytest.mark.parametrize(
    "given",
    [
        {"outputs": "iec61331"},
        {"outputs": "f28335"},
        {"outputs": "iec61131,iec61131"},
        {"outputs": ""},
        {"outputs": "iec61131", "dialect": "twncat"},
        {"outputs": "fmu", "dialect": "twincat"},
        {"outputs": "iec61131", "cycle_time": "10"},
        {"outputs": "iec61131", "plant": "examples/paper_valve/plant.toml"},
        {"interface": "codes"},
        {"outputs": "amplifier"},
        {"outputs": "iec61131", "device": "west"},
        {"outputs": "amplifier", "device": "west", "threshold": "0.01"},
    ],
    ids=lambda given: " ".join(f"{name} {value}" for name, value in given.items()),
)
def test_what_can_not_be_wanted_is_refused(given, wording, request):
    with wording.refusal(InputError, f"batch outputs: {request.node.callspec.id}"):
        wanted_outputs(BatchArguments("lot", **given))


def test_the_settings_are_those_of_each_output():
    assert wanted_outputs(BatchArguments("lot")) == ()
    plant = {"plant": "examples/paper_valve/plant.toml"}
    plc, fmu = wanted_outputs(BatchArguments("lot", outputs=" iec61131, fmu", dialect="twincat", **plant))
    assert (plc.settings, plc.folder) == ({"dialect": "twincat", "interface": "plc", "cycle_time": ""}, "plc")
    assert fmu.folder == "fmu" and json.loads(fmu.settings["plant"])
    assert wanted_outputs(BatchArguments("lot", verify=True, **plant)) == ()  # of the verification alone


def test_a_result_depends_on_the_outputs_that_are_wanted():
    twincat = replace(PLC, settings={**PLC.settings, "dialect": "twincat"})
    digests = {Task(name="V", outputs=outputs, **NOTHING).digest for outputs in ((), (PLC,), (twincat,))}
    assert len(digests) == 3


# --- one output of one valve ------------------------------------------------------------------------------------------


@pytest.fixture
def of_valve(tmp_path):
    compensator = golden_compensator()
    return ForOutputs(compensator=compensator, valve=compensator.valve, recordings=(), place=tmp_path, verify=False)


def test_without_a_verification_it_is_not_verified(of_valve):
    found = make_output(PLC, of_valve)
    assert (found.verdict, found.reason, may_end_otherwise(found)) == ("not verified", "", False)
    assert (of_valve.place / "plc" / "FB_DeadZone.st").is_file()


def found_with(monkeypatch, of_valve, holds, text="7 wrong"):
    """Make an output that `verify` finds to be so."""
    evidence = SimpleNamespace(
        inputs=(TriedInputs(name="all", inputs=5, wrong=0), TriedInputs(name="more", inputs=6, wrong=0)),
        checks=(REPRODUCED.check(holds=True, text=""), REPRODUCED.check(holds=holds, text=text)),
    )
    monkeypatch.setattr(verify_stage, "verify_output_folder", lambda *_: SimpleNamespace(evidence=evidence))
    return make_output(PLC, replace(of_valve, verify=True))


def test_its_verdict_is_that_of_verify(monkeypatch, of_valve):
    found = found_with(monkeypatch, of_valve, True)
    assert (found.verdict, found.inputs, found.reason) == ("holds", 11, "")
    found = found_with(monkeypatch, of_valve, False)
    assert (found.verdict, "7 wrong" in found.reason, may_end_otherwise(found)) == ("does not hold", True, False)
    found = found_with(monkeypatch, of_valve, None, "Octave is not installed")
    assert (found.verdict, may_end_otherwise(found)) == ("not verified", True)


@pytest.mark.parametrize("error", [InputError("ziglang is not installed"), OSError("no space")])
def test_what_could_not_be_made_is_tried_again(monkeypatch, of_valve, error):
    def fail(*_):
        raise error

    monkeypatch.setattr(other_targets, "generate_output", fail)
    found = make_output(PLC, of_valve)
    assert found.verdict == "not made" and str(error) in found.reason and may_end_otherwise(found)
    monkeypatch.undo()
    monkeypatch.setattr(verify_stage, "verify_output_folder", fail)
    found = make_output(PLC, replace(of_valve, verify=True))
    assert found.verdict == "not verified" and str(error) in found.reason and may_end_otherwise(found)


def test_the_lot_names_the_valves_by_what_came_of_their_output():
    verdicts = {"A": "holds", "B": "does not hold", "C": "not verified", "D": "not made", "E": "holds"}
    found = [
        ValveFolder(
            manifest=ValveManifest(
                tool=THIS_TOOL, made_from=(), name=name, status="ok", files={},
                outputs=(ValveOutput(target="iec61131", folder="plc", verdict=verdict),),
            )
        )
        for name, verdict in verdicts.items()
    ]  # fmt: skip
    lot = lot_outputs([PLC], found)["iec61131"]
    assert (lot.holds, lot.does_not_hold, lot.not_verified, lot.not_made) == (("A", "E"), ("B",), ("C",), ("D",))
    assert lot.made == 4


# --- a lot ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A lot with a function block a valve, of which one is refused."""
    folder = tmp_path_factory.mktemp("lot")
    write_lot(folder, 3, 0, SEED)
    (folder / "lot.csv").write_text(LIST, encoding="utf-8")
    assert batch(folder) == 1
    return folder


def batch(folder):
    options = [*lot_options(folder, 'dialect = "twincat"'), "--jobs", "1", "--outputs", "iec61131"]
    return main(["batch", str(folder / "lot.csv"), "-o", str(folder / "out"), *options])


@pytest.mark.slow
def test_each_valve_has_its_output_and_a_refused_one_its_reason(made):
    out = made / "out"
    table = {row["name"]: row for row in rows(out)}
    assert {name: row["output.iec61131"] for name, row in table.items()} == {
        "V0000": "not verified", "V0001": "not verified", "V0002": "not made",
    }  # fmt: skip
    for name in ("V0000", "V0001"):
        content = (out / "valves" / name / "plc" / MANIFEST_NAME).read_bytes()
        assert table[name]["output.iec61131.manifest_sha256"] == sha256_of(content)
        assert (out / "valves" / name / "plc" / "FB_DeadZone.TcPOU").is_file()
    reason = table["V0002"]["reason"]
    assert table["V0002"]["status"] == "failed" and reason.startswith("output iec61131: the compensator controls")
    assert (out / "valves" / "V0002" / "firmware").is_dir() and not (out / "valves" / "V0002" / "plc").exists()
    summary = read_artefact((out / "batch.json").read_bytes(), LotSummary, "batch.json")
    plc = summary.outputs["iec61131"]
    assert (plc.settings["dialect"], plc.not_verified, plc.not_made) == ("twincat", ("V0000", "V0001"), ("V0002",))
    assert [each.reason for each in summary.failed] == [reason]


@pytest.mark.slow
def test_it_is_what_codegen_writes(made, tmp_path, monkeypatch):
    folder = made / "out" / "valves" / "V0001"
    monkeypatch.chdir(tmp_path)
    assert main(["codegen", str(folder / "compensator.json"), "--target", "iec61131", "--dialect", "twincat"]) == 0
    assert tree(tmp_path / "plc") == tree(folder / "plc")


@pytest.mark.slow
def test_what_is_good_is_kept_and_a_lost_output_made_again(made, capsys):
    before = tree(made / "out")
    assert batch(made) == 1
    assert "3 valves, 2 of them done before" in capsys.readouterr().err  # the refused one is tried again
    assert tree(made / "out") == before
    (made / "out" / "valves" / "V0001" / "plc" / "FB_DeadZone.st").unlink()
    assert batch(made) == 1
    assert "3 valves, 1 of them done before" in capsys.readouterr().err
    assert tree(made / "out") == before


@pytest.mark.slow
def test_the_report_of_the_lot_lists_them_and_sees_another_manifest(made, tmp_path):
    out = shutil.copytree(made / "out", tmp_path / "out")
    html = report_of_lot(out).html
    assert '<section id="outputs">' in html and "valves/NAME/plc" in html and "iec61131 not made" in html
    block = out / "valves" / "V0001" / "plc" / "FB_DeadZone.st"
    text = block.read_bytes()
    block.write_bytes(text.replace(b"drive := ", b"drive := 1 + "))
    with pytest.raises(InputError, match=r"V0001/plc: changed or missing: FB_DeadZone\.st"):
        read_lot(out)
    block.write_bytes(text)
    path = out / "valves" / "V0000" / "plc" / MANIFEST_NAME
    path.write_bytes(path.read_bytes().replace(b"{", b'{"added": 0, ', 1))
    with pytest.raises(InputError, match=r"V0000/plc/manifest\.json"):
        read_lot(out)


@pytest.mark.slow
def test_each_valve_has_the_parameters_of_its_amplifier(made, tmp_path, monkeypatch, capsys):
    """With the firmware's verification taken as held; that of the parameters is made."""
    monkeypatch.setattr(verify_stage, "verify_firmware", held)
    lot, out = tmp_path / "lot", tmp_path / "out"
    for name in ("V0000", "V0001"):
        shutil.copytree(made / name, lot / name)
    words = [*lot_options(tmp_path, 'device = "west"'), "--jobs", "1", "--outputs", "amplifier", "--verify"]
    assert main(["batch", str(lot), "-o", str(out), *words]) == 0
    capsys.readouterr()
    summary = read_artefact((out / "batch.json").read_bytes(), LotSummary, "batch.json").outputs["amplifier"]
    assert (summary.holds, summary.settings["device"]) == (("V0000", "V0001"), "west")
    files = [(out / "valves" / name / "amplifier" / "west.txt").read_bytes() for name in ("V0000", "V0001")]
    assert files[0] != files[1] and all(content.startswith(b"MIN:A ") for content in files)
    assert (out / "valves" / "V0000" / "amplifier_evidence" / "evidence.json").is_file()
    html = report_of_lot(out).html
    assert "output amplifier, device west: made for 2 of 2 valves; verified, and holds for 2" in html
    (out / "valves" / "V0001" / "amplifier" / "west.txt").write_bytes(files[0])
    with pytest.raises(InputError, match=r"V0001/amplifier: changed or missing: west\.txt"):
        read_lot(out)


def held(arguments, **_):
    """Stand for a verification of the firmware that holds."""
    arguments.output.mkdir()
    return SimpleNamespace(holds=True)


@pytest.mark.slow
def test_an_output_that_does_not_hold_is_the_valves_reason(made, monkeypatch):
    """With the firmware's verification taken as held."""
    evidence = SimpleNamespace(inputs=(), checks=(REPRODUCED.check(holds=False, text="7 wrong"),))
    monkeypatch.setattr(verify_stage, "verify_firmware", held)
    monkeypatch.setattr(verify_stage, "verify_output_folder", lambda *_: SimpleNamespace(evidence=evidence))
    recordings = [(path.name, path.read_bytes()) for path in sorted((made / "V0000").glob("*.csv"))]
    task = Task(
        name="V0000", outputs=(PLC,), verify=True, **{**NOTHING, "recordings": tuple(recordings), "target": "host"}
    )
    task = replace(task, identify=replace(task.identify, meter_lag="0.1 s"))
    outcome = calibrate(task)
    assert outcome.manifest.status == "does not hold"
    assert outcome.manifest.reason == f"output iec61131: {REPRODUCED.title}: 7 wrong"
    assert outcome.manifest.outputs[0].verdict == "does not hold" and outcome.manifest.inputs_sha256 == task.digest
    assert "plc/FB_DeadZone.st" in outcome.files and "evidence/report.html" in outcome.files


@pytest.mark.slow
def test_a_firmware_that_does_not_hold_has_no_outputs(made, monkeypatch):
    from dzdesign.batch import calibration

    monkeypatch.setattr(calibration, "_firmware", lambda *_: ("does not hold", "inputs: 3 wrong"))
    monkeypatch.setattr(outputs_module, "make_output", None)
    recordings = [(path.name, path.read_bytes()) for path in sorted((made / "V0000").glob("*.csv"))]
    task = Task(name="V0000", outputs=(PLC,), **{**NOTHING, "recordings": tuple(recordings)})
    outcome = calibrate(replace(task, identify=replace(task.identify, meter_lag="0.1 s")))
    assert (outcome.manifest.status, outcome.manifest.reason) == ("does not hold", "inputs: 3 wrong")
    assert outcome.manifest.outputs[0].reason == "the firmware does not hold"


@pytest.mark.slow
def test_the_manifest_of_a_valve_says_what_came_of_its_outputs(made):
    (output,) = read_manifest(made / "out" / "valves" / "V0002").outputs
    assert (output.target, output.verdict) == ("iec61131", "not made") and "--drive duty" in output.reason
