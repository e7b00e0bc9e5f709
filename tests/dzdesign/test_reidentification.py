"""`verify --ramps`: a valve that was edited throughout, so that all its files fit, and the recordings that tell."""

import json
import shutil
from dataclasses import replace

import pytest

from dzdesign import api
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import InputError
from dzdesign.identify.valve.model import ValveModel
from dzdesign.regeneration import given_files, identified_again, regenerated
from dzdesign.verify.folder import reproduced
from dzdesign.verify.requirements import AS_STATED
from tests.support.attacked_firmware import sealed
from tests.support.synthetic import needs_compiler

NAMES = ("ramp_dP1_1.csv.gz", "ramp_dP1_2.csv.gz", "ramp_dP3_1.csv.gz", "ramp_dP5_1.csv.gz")
OPTIONS = {"meter_lag": "0.1 s", "meter_floor": "0.6 L/min", "record": {"serial": "4711"}}


@pytest.fixture(scope="module")
def ramps(example_folder, tmp_path_factory):
    folder = tmp_path_factory.mktemp("ramps")
    for name in NAMES:
        shutil.copy(example_folder / "ramps" / name, folder / name)
    return folder


@pytest.fixture(scope="module")
def valve(ramps):
    return api.identify(ramps / "*.gz", **OPTIONS)


def tried(valve, files):
    return identified_again(api.design(valve), given_files([str(file) for file in files]))


def in_folder(ramps):
    return [ramps / name for name in NAMES]


def changed(valve, change):
    """Return a valve whose document was changed, read as any reader reads it."""
    document = json.loads(json.dumps(json.loads(api_bytes(valve))))
    change(document)
    return read_artefact(json.dumps(sealed(document)).encode(), ValveModel, "valve.json")


def api_bytes(valve):
    from dzdesign.core.artefact_types import to_json_bytes

    return to_json_bytes(valve)


#: Of a valve.json: all that is a threshold or a bound of it, not an error.
THRESHOLDS = (
    "u_knee", "u_level", "u_onset", "u_guard", "u_min", "u_threshold", "u_lower", "bound_V", "offset_V", "u_V"
)  # fmt: skip


def raised(document, volts=0.3):
    """Raise every threshold, bound and offset of a valve, so that all of it fits."""
    for side in document["sides"].values():
        for place in (*side["tests"], side["reference"], *side["certified"].values(), *side["identified"].values()):
            _raise(place, volts)
        for curve in side["certified"].values():
            _raise(curve["above"], volts)
            for ramp in curve["proof"]["ramps"]:
                _raise(ramp, volts)
        _raise(side["opening_curve"], volts)
        for curve in side["identified"].values():
            row = curve["beta"].index(1.0)
            curve["beta"] = [round(u / curve["u_V"][row], 7) for u in curve["u_V"]]
        side["beta"]["beta"] = side["identified"][side["certificate"]["guard"]]["beta"]


def _raise(place, volts):
    for key, value in place.items():
        if key.startswith(THRESHOLDS) and "_se_" not in key and value is not None:
            many = isinstance(value, list)
            place[key] = [round(each + volts, 7) for each in value] if many else round(value + volts, 7)


class TestTheRecordings:
    def test_that_valve_json_was_made_from_give_it_again(self, valve, ramps):
        check = tried(valve, in_folder(ramps))
        assert check.holds and "4 files" in check.text and "meter_lag = 0.1 s" in check.text

    def test_may_come_in_any_order_with_any_name(self, valve, ramps, tmp_path):
        copies = [tmp_path / name for name in ("d.csv", "c.csv", "b.csv", "a.csv")]
        for copy, name in zip(copies, NAMES, strict=True):
            shutil.copy(ramps / name, copy)
        assert tried(valve, sorted(copies)).holds

    def test_with_swapped_names_are_what_their_bytes_are(self, valve, ramps, tmp_path):
        shutil.copy(ramps / NAMES[0], tmp_path / NAMES[3])
        shutil.copy(ramps / NAMES[3], tmp_path / NAMES[0])
        assert tried(valve, [tmp_path / NAMES[0], tmp_path / NAMES[3], ramps / NAMES[1], ramps / NAMES[2]]).holds

    def test_one_fewer_is_not_checked(self, valve, ramps):
        check = tried(valve, in_folder(ramps)[:-1])
        assert check.holds is None and NAMES[3] in check.text

    def test_one_more_does_not_hold(self, valve, ramps, example_folder):
        """A ramp that identify was not given, be it because it did not suit."""
        other = example_folder / "ramps" / "ramp_dP2_1.csv.gz"
        check = tried(valve, [*in_folder(ramps), other])
        assert check.holds is False and "ramp_dP2_1.csv.gz" in check.text

    def test_another_file_of_the_right_name_does_not_hold(self, valve, ramps, example_folder, tmp_path):
        shutil.copy(example_folder / "ramps" / "ramp_dP5_2.csv.gz", tmp_path / NAMES[3])
        check = tried(valve, [*in_folder(ramps)[:3], tmp_path / NAMES[3]])
        assert (
            check.holds is False
            and NAMES[3] in check.text
            and sha256_of((tmp_path / NAMES[3]).read_bytes()) in (check.text)
        )

    def test_a_copy_beside_its_original_is_refused(self, valve, ramps, tmp_path):
        shutil.copy(ramps / NAMES[0], tmp_path / "copy.csv.gz")
        with pytest.raises(InputError, match="the same recording"):
            tried(valve, [*in_folder(ramps), tmp_path / "copy.csv.gz"])

    def test_a_file_that_is_not_there_is_refused(self, valve, ramps):
        with pytest.raises(InputError, match="none"):
            tried(valve, [*in_folder(ramps), ramps / "none.csv"])


class TestAnEdit:
    def test_of_all_thresholds_by_300_mV_fits_every_file_and_no_recording(self, valve, ramps, tmp_path):
        other = changed(valve, raised)
        assert other.positive.reference.u_min_V == pytest.approx(valve.positive.reference.u_min_V + 0.3, abs=1e-6)
        compensator = api.design(other)
        api.generate(compensator, target="host", output=tmp_path / "firmware")
        assert reproduced(tmp_path / "firmware", regenerated(tmp_path / "firmware")).holds
        check = tried(other, in_folder(ramps))
        assert check.holds is False and "sides.positive." in check.text

    def test_of_thresholds_by_two_microvolts_is_seen(self, valve, ramps):
        check = tried(changed(valve, lambda document: raised(document, 1e-5)), in_folder(ramps))
        assert check.holds is False

    def test_of_the_confidence_in_both_places_is_seen(self, valve, ramps):
        def surer(document):
            document["options"]["texts"]["confidence"] = "0.999"
            for side in document["sides"].values():
                side["certificate"]["confidence"] = 0.999

        assert tried(changed(valve, surer), in_folder(ramps)).holds is False

    @pytest.mark.parametrize(
        "change",
        [
            lambda document: document["options"]["texts"].update(confidence="0.9"),
            lambda document: document["options"]["texts"].update(meter_lag="0 s +- 0 s"),
            lambda document: document["warnings"].pop(),
            lambda document: document["meter"].update(lag_longer_s=0.0),
            lambda document: document["sides"]["positive"]["tests"][1].update(leak_L_min=0.01),
            lambda document: document["sides"]["positive"]["tests"][0].update(outliers=3),
            lambda document: document["sides"]["positive"]["tests"][0].update(saturates=True),
        ],
        ids=["an option", "the lag", "a warning", "a tolerance", "a leak", "a count", "a sentence"],
    )
    def test_of_one_entry_is_seen(self, valve, ramps, change):
        assert tried(changed(valve, change), in_folder(ramps)).holds is False

    def test_of_the_hashes_alone_is_seen(self, valve, ramps):
        def other(document):
            document["made_from"][0]["sha256"] = "0" * 64

        assert tried(changed(valve, other), in_folder(ramps)).holds is False

    def test_of_the_record_is_none_of_the_recordings(self, valve, ramps):
        assert tried(changed(valve, lambda document: document["record"].update(serial="4712")), in_folder(ramps)).holds


class TestWhatCanNotBeChecked:
    def test_a_valve_without_its_options(self, valve, ramps):
        check = tried(replace(valve, options=None), in_folder(ramps))
        assert check.holds is None and "options" in check.text

    def test_a_valve_of_another_version(self, valve, ramps):
        def older(document):
            document["tool"]["version"] = "0.0.9"

        check = tried(changed(valve, older), in_folder(ramps))
        assert check.holds is None and "0.0.9" in check.text

    def test_an_option_that_identify_does_not_have(self, valve, ramps):
        def strange(document):
            document["options"]["texts"]["plots"] = "elsewhere"

        check = tried(changed(valve, strange), in_folder(ramps))
        assert check.holds is False and "plots" in check.text


class TestOptionsOfEveryKind:
    def test_tables_order_and_parts_are_taken_again(self, ramps):
        by_hand = "2.4 +- 0.1 L/min at 5.6 V, 3 MPa, closing"
        valve = api.identify(
            [ramps / name for name in NAMES[::-1]], low_flow=[by_hand], order=[NAMES[1], NAMES[0], NAMES[3], NAMES[2]],
            from_={NAMES[0]: "1 s"}, missing=["OFF", "none"], meter_lag="0.1 s", confidence=0.95,
        )  # fmt: skip
        order = (NAMES[1], NAMES[0], NAMES[3], NAMES[2])
        assert valve.options.lists == {"order": order, "missing": ("OFF", "none"), "low_flow": (by_hand,)}
        assert valve.options.tables == {"from_": {NAMES[0]: "1 s"}} and valve.options.texts["confidence"] == "0.95"
        check = tried(valve, in_folder(ramps))
        assert check.holds, check.text

    def test_files_of_one_name_in_two_folders(self, ramps, tmp_path):
        places = [tmp_path / folder / "ramp.csv.gz" for folder in ("a", "b")]
        for place, name in zip(places, (NAMES[0], NAMES[3]), strict=True):
            place.parent.mkdir()
            shutil.copy(ramps / name, place)
        valve = api.identify(places, curve="line")
        assert [each.source for each in valve.made_from] == ["a/ramp.csv.gz", "b/ramp.csv.gz"]
        assert tried(valve, [ramps / NAMES[3], ramps / NAMES[0]]).holds


@needs_compiler
@pytest.mark.slow
@pytest.mark.usefixtures("each_core_once")
def test_the_command_says_it_in_verdict_and_report(valve, ramps, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    api.generate(api.design(valve), target="host", output="firmware")
    files = [str(file) for file in in_folder(ramps)]
    assert main(["-v", "verify", "firmware", "--ramps", *files, "-o", "with"]) == 0
    said = capsys.readouterr().out
    assert AS_STATED not in said and "every number is the same" in said
    assert AS_STATED not in (tmp_path / "with" / "report.html").read_text().partition("</header>")[0]
    assert main(["verify", "firmware", "-o", "without"]) == 0
    assert AS_STATED in capsys.readouterr().out
    assert AS_STATED in (tmp_path / "without" / "report.html").read_text()
    assert main(["verify", "firmware", "--ramps", str(ramps / "*dP1*"), "-o", "fewer"]) == 1
    assert main(["verify", "firmware", "--ramps", "none/*.csv"]) == 2
