"""What the quality gate says of whole recordings, and what follows from it down to the C and the report."""

import ast
import gzip
import re
import string
from dataclasses import replace

import numpy as np
import pytest

from dzdesign.codegen.project import generate, target_named
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import as_document, to_json_bytes
from dzdesign.core.documents import sha256_of, to_json
from dzdesign.core.errors import InputError
from dzdesign.design.certificate import reach_of_certificate
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions, options_of
from dzdesign.identify.data_quality import sweeps
from dzdesign.identify.data_quality.catalogue import catalogue, most_serious_first, warn
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_files import ramp_file_bytes, read_ramp_file
from dzdesign.identify.valve.model import Warning_
from dzdesign.report.artefacts import Chain, Place
from dzdesign.report.summary import headline
from dzdesign.report.valve_report import make_report
from tests.conftest import default_options
from tests.support.attacked_firmware import sealed
from tests.support.paths import ROOT
from tests.support.repeatable_valves import identify
from tests.support.synthetic import L_MIN, MPA, Truth, synthetic_ramp

PRESSURES = (1.0, 2.0, 4.0)
MARK = "SIMULATED by somebody"


def warned(valve, code):
    return [warning for warning in valve.warnings if warning.code == code]


def chain_of(valve, compensator):
    """Return what a report is made of, as it is read from files."""
    found = {"valve": valve, "compensator": compensator}
    places = {role: Place(each.FILE_NAME, sha256_of(to_json_bytes(each))) for role, each in found.items()}
    return Chain(**found, places=places)


def valve_at(dp_MPa, **changes):
    """A ramp of a valve whose flow grows with the root of the pressure drop."""
    root = dp_MPa**0.5
    truth = Truth(knee_rising=5.5 - 0.05 * dp_MPa, slope=4 * root, saturation=100 * root)
    return synthetic_ramp(dp_MPa, replace(truth, **changes), source=f"ramp_dP{dp_MPa:g}.csv")


def written(path, test, *comments):
    """Write a recording into a file and read it back."""
    columns = {"time_s": test.time, "u_V": test.u, "dP_MPa": test.dp / MPA, "Q_Lmin": test.q / L_MIN}
    path.write_bytes(ramp_file_bytes(columns, comments, compress=path.suffix == ".gz"))
    return read_ramp_file(path)


class TestSimulated:
    @pytest.mark.parametrize("name", ["ramp.csv", "ramp.csv.gz"])
    @pytest.mark.parametrize(("comments", "marked"), [((MARK, "more"), True), (("more", MARK), True), ((), False)])
    def test_the_mark_is_seen_wherever_it_stands_above_the_labels(self, tmp_path, name, comments, marked):
        assert written(tmp_path / name, valve_at(1.0), *comments).simulated is marked

    @pytest.mark.parametrize(("line", "marked"), [('"# SIMULATED, no data",,,', True), ("# simulated leak: no", False)])
    def test_a_spreadsheet_may_quote_it_and_a_word_in_a_sentence_is_none(self, tmp_path, line, marked):
        path = tmp_path / "ramp.csv"
        written(path, valve_at(1.0))
        path.write_text(f"{line}\n{path.read_text()}")
        assert read_ramp_file(path).simulated is marked

    def test_every_bundled_recording_is_marked_and_so_is_the_valve(
        self, example_tests, example_valve, example_folder, wording
    ):
        assert all(test.simulated for test in example_tests)
        assert example_valve.warnings[0].code == "simulated"
        wording.of_test(example_valve.warnings[0].text)
        first = sorted((example_folder / "ramps").glob("*.csv.gz"))[0]
        assert gzip.decompress(first.read_bytes()).startswith(b"# SIMULATED")

    def test_some_of_several_are_named(self, wording):
        tests = [valve_at(dp) for dp in PRESSURES]
        tests[1] = replace(tests[1], simulated=True)
        (warning,) = warned(identify(tests), "simulated")
        wording.of_test(str(warning.text))

    @pytest.mark.slow
    def test_the_firmware_and_the_report_say_so_and_those_of_a_measured_valve_do_not(self):
        for simulated in (True, False):
            valve = identify([replace(valve_at(dp), simulated=simulated) for dp in PRESSURES])
            compensator = design(valve)
            firmware = generate(compensator, "host")
            for name, text in firmware.files.items():
                assert ("SIMULATED" in text) is simulated or name in ("compensator.json", ".gitattributes"), name
            shelf = chain_of(valve, compensator)
            of_recording, *others = headline(shelf).cautions
            assert of_recording == reach_of_certificate(compensator)
            assert [text.startswith("SIMULATED") for text in others] == [True] * simulated
            html = make_report(shelf).html
            assert ("SIMULATED recordings" in html[: html.index('<section id="characteristic">')]) is simulated

    @pytest.mark.parametrize("whole", [True, False])
    def test_a_warning_taken_out_hides_no_simulation(self, tmp_path, capsys, wording, whole):
        """Seeded: no warning is left, and the hash of the valve is made anew."""
        compensator = design(identify([replace(valve_at(dp), simulated=True) for dp in PRESSURES]), default_options())
        document = as_document(compensator)
        assert document["valve"]["simulated"] is True
        if not whole:
            document["valve"]["warnings"] = []
        sealed(document["valve"])
        path = tmp_path / "compensator.json"
        path.write_text(to_json(document))
        assert main(["codegen", str(path), "-o", str(tmp_path / "fw")]) == (0 if whole else 2)
        if not whole:
            wording("valve: simulated without its warning", capsys.readouterr().err)
        document["valve"] |= {"simulated": False, "warnings": as_document(compensator.valve)["warnings"]}
        sealed(document["valve"])
        path.write_text(to_json(document))
        assert main(["codegen", str(path), "-o", str(tmp_path / "fw")]) == 2
        wording("valve: a warning of simulation without one", capsys.readouterr().err)


@pytest.fixture(scope="module")
def crossed():
    """As a lag that was declared ten times too large leaves it: the knees change places."""
    return identify([valve_at(dp, hysteresis=-0.05) for dp in PRESSURES], IdentifyOptions(meter_lag=0.0))


class TestBranchOrder:
    def test_design_refuses_in_one_sentence(self, crossed, wording):
        assert len(warned(crossed, "branch-order")) == 3
        with wording.refusal(InputError):
            design(crossed)

    def test_a_simulation_without_noise_and_hysteresis_is_in_order(self):
        side = identify([valve_at(1.0, hysteresis=-1e-4, noise=0.0)]).positive
        assert not side.tests[0].closes_above_opening and side.tests[0].u_knee_se_V < 1e-5

    def test_accepted_it_goes_on_and_the_cost_is_said(self, crossed):
        compensator = design(crossed, DesignOptions(accept=("branch-order",)))
        assert any(line.startswith("accepted, branch-order: at 1.00, 2.00, 4.00 MPa") for line in compensator.costs)

    @pytest.mark.slow
    def test_the_report_says_so_beside_the_verdict_and_beside_the_warning(self, crossed):
        """The warning was written before anybody accepted it."""
        options = options_of({"accept": "branch-order"}, target_named("f28335").inputs())
        for valve, accepted in ((crossed, True), (identify([valve_at(dp) for dp in PRESSURES]), False)):
            shelf = chain_of(valve, design(valve, options))
            said = [line for line in headline(shelf).cautions if line.startswith("ACCEPTED warning, branch-")]
            html = make_report(shelf).html
            words = re.sub("<[^>]*>|`", "", html)
            assert bool(said) is accepted
            assert ("ACCEPTED warning, branch-order" in html[: html.index('<section id="characteristic">')]) is accepted
            assert ("refuses it unless it is accepted, which it was (--accept)" in words) is accepted

    def test_a_valve_in_order_costs_nothing_of_it(self):
        valve = identify([valve_at(dp) for dp in PRESSURES])
        assert not any("accepted" in line for line in design(valve, DesignOptions(accept=("branch-order",))).costs)

    def test_the_command_line_and_a_file_of_options_accept_it(self, crossed, tmp_path, monkeypatch, capsys, wording):
        monkeypatch.chdir(tmp_path)
        (tmp_path / "valve.json").write_bytes(to_json_bytes(crossed))
        (tmp_path / "options.toml").write_text('accept = "branch-order"\n')
        assert main(["design", "valve.json"]) == 2 and not (tmp_path / "compensator.json").exists()
        wording.of_test(capsys.readouterr().err)
        assert main(["design", "valve.json", "--accept", "branch-ordr"]) == 2
        assert main(["-v", "design", "valve.json", "--accept", "branch-order"]) == 0
        assert "note: accepted, branch-order" in capsys.readouterr().out
        assert main(["design", "valve.json", "--config", "options.toml"]) == 0

    def test_only_what_stops_a_design_can_be_accepted(self, wording):
        with wording.refusal(InputError):
            options_of({"accept": "branch-ordr"}, target_named("f28335").inputs())


def test_a_side_that_the_firmware_leaves_out_is_said_in_the_report():
    tests = []
    for dp in PRESSURES:
        up, down = valve_at(dp), valve_at(dp)
        tests.append(
            replace(
                up,
                time=np.concatenate([up.time, up.time[-1] + 0.02 + down.time]),
                u=np.concatenate([up.u, -down.u]),
                q=np.concatenate([up.q, -down.q]),
                dp=np.concatenate([up.dp, down.dp]),
            )
        )
    both, one = identify(tests), identify([valve_at(dp) for dp in PRESSURES])
    for valve, said in ((both, True), (one, False)):
        shelf = chain_of(valve, design(valve))
        assert any("negative side" in text for text in headline(shelf).cautions) is said


class TestKneeErrors:
    @staticmethod
    def curved(power, *, noise=0.08, correlation=0.0, pressures=PRESSURES):
        """Ramps whose flow is a power of the travel; the noise may be slow."""
        from scipy.signal import lfilter

        tests = []
        for dp in pressures:
            test = synthetic_ramp(dp, Truth(noise=0.0))
            rising = np.arange(test.u.size) < test.u.size / 2
            travel = np.clip(test.u - np.where(rising, 5.4, 5.3), 0, None) / 4.6
            white = np.random.default_rng([1, int(dp)]).standard_normal(test.u.size)
            slow = lfilter([np.sqrt(1 - correlation**2)], [1, -correlation], white)
            tests.append(replace(test, q=(18 * dp**0.5 * travel**power + noise * slow) * L_MIN))
        return tests

    @pytest.mark.parametrize("pressures", [PRESSURES, (1.0,)])
    @pytest.mark.parametrize("power", [0.5, 0.6, 2.0])
    @pytest.mark.parametrize("noise", [0.005, 0.08])
    def test_a_curve_is_not_put_down_to_the_meter(self, power, noise, pressures):
        valve = identify(self.curved(power, noise=noise, pressures=pressures))
        assert warned(valve, "bend") and not warned(valve, "noise")

    @pytest.mark.parametrize(("noise", "correlation"), [(1.5, 0.0), (0.3, 0.99)])
    def test_noise_fast_or_slow_is_not_put_down_to_the_valve(self, noise, correlation):
        valve = identify(self.curved(1.0, noise=noise, correlation=correlation))
        assert warned(valve, "noise") and not warned(valve, "bend")

    def test_one_branch_alone_says_that_it_cannot_tell(self, wording):
        (test,) = self.curved(2.0, pressures=(1.0,))
        half = test.u.size // 2
        up = replace(test, **{name: getattr(test, name)[:half] for name in ("time", "u", "q", "dp")})
        (warning,) = warned(identify([up]), "noise")
        wording.of_test(str(warning.text))

    def test_a_sharp_straight_valve_hears_nothing(self):
        valve = identify(self.curved(1.0))
        assert not {"noise", "bend"} & {warning.code for warning in valve.warnings}

    @pytest.mark.parametrize("window", [(0.12, 0.5), (0.6, 0.8)])
    def test_the_window_of_the_line_is_named(self, window, wording):
        (warning, *_) = warned(identify(self.curved(0.5), IdentifyOptions(knee_window=window)), "bend")
        wording.of_test(str(warning.text))

    def test_a_window_that_was_widened_is_named_beside_the_one_that_was_asked_for(self, wording):
        valve = identify(self.curved(0.5))
        row = valve.positive.tests[0]
        row = replace(row, straight_rising=(0.12, 0.9), u_knee_rising_se_V=1.0)
        warning = sweeps._bent(row, 0.1, (0.12, 0.5))
        wording.of_test(str(warning.text))

    def test_the_lower_window_that_curved_names_finds_the_knee_better_and_a_wider_one_worse(self):
        test = synthetic_ramp(1.0, Truth(noise=0.0))
        knees = np.where(np.arange(test.u.size) < test.u.size / 2, 5.4, 5.3)
        travel = np.clip(test.u - knees, 0, None) / (10 - knees)
        noise = 0.08 * np.random.default_rng(1).standard_normal(test.u.size)
        bent = replace(test, q=(18 * (travel - 0.13 * travel**2) + noise) * L_MIN)

        def too_low_V(valve):
            return 5.3 - valve.positive.tests[0].u_knee_falling_V

        default = identify([bent])
        (warning,) = warned(default, "curved")
        low, high = (int(number) / 100 for number in re.search(r"such as (\d+)-(\d+)", warning.text).groups())
        lower, wider = (identify([bent], IdentifyOptions(knee_window=each)) for each in ((low, high), (0.12, 0.8)))
        assert 0 < too_low_V(lower) < 0.5 * too_low_V(default) < 0.3 * too_low_V(wider)


class TestStuckPressure:
    @staticmethod
    def stuck(pressures, names=("a.csv", "b.csv", "c.csv")):
        return [
            replace(valve_at(dp), source=name, dp=np.full(valve_at(dp).u.size, 1.0 * MPA))
            for dp, name in zip(pressures, names, strict=True)
        ]

    def test_flows_that_differ_tell_it(self):
        (warning,) = warned(identify(self.stuck(PRESSURES)), "flow-contradicts-dp")
        assert "taken as one test, at 1 MPa," in warning.text and "in 'c.csv'" in warning.text

    @pytest.mark.parametrize("step", [0.0061, 0.0244])
    @pytest.mark.parametrize("ports", [1, 2])
    def test_the_noise_of_a_converter_hides_nothing(self, step, ports):
        tests = self.stuck((1.0, 1.4, 2.0))
        for index, test in enumerate(tests):
            rng = np.random.default_rng(index)
            noise = sum(rng.integers(-2, 3, test.u.size) for _ in range(ports))
            tests[index] = replace(test, dp=(1.0 + step * noise) * MPA)
        valve = identify(tests)
        assert len(warned(valve, "flow-contradicts-dp")) == 1
        assert not warned(valve, "noise") and not warned(valve, "bend")

    def test_a_repeated_test_is_welcome(self):
        assert not warned(identify(self.stuck((1.0, 1.0, 1.0))), "flow-contradicts-dp")

    def test_where_the_mixture_is_refused_the_sensor_is_named(self, monkeypatch, wording):
        def refuse(*_):
            raise InputError("the flow jumps")

        monkeypatch.setattr("dzdesign.identify.identification.identify_side", refuse)
        with pytest.raises(InputError, match="it may be that"):  # and then the warning, as it is
            identify(self.stuck(PRESSURES))
        with wording.refusal(InputError):
            identify([valve_at(dp) for dp in PRESSURES])


class TestCoarseFlow:
    @staticmethod
    def cut_off(step):
        tests = [valve_at(dp) for dp in PRESSURES]
        return [replace(test, q=np.floor(np.maximum(test.q / L_MIN, 0) / step) * step * L_MIN) for test in tests]

    def test_a_flow_that_was_cut_off_to_steps_is_said_and_can_be_allowed_for(self, wording):
        true = [5.4 - 0.05 * dp for dp in PRESSURES]
        coarse = identify(self.cut_off(0.5))
        assert any(test.u_guard_lower_V > closes for test, closes in zip(coarse.positive.tests, true, strict=True))
        wording.of_test(warned(coarse, "coarse-flow")[0].text)
        allowed = identify(self.cut_off(0.5), IdentifyOptions(meter_zero=0.25 * L_MIN))
        assert not warned(allowed, "coarse-flow")
        assert all(test.u_guard_lower_V < closes for test, closes in zip(allowed.positive.tests, true, strict=True))

    def test_steps_that_move_a_threshold_past_its_bound_are_said_however_fine(self, wording):
        quiet = [valve_at(dp, noise=0.01) for dp in PRESSURES]
        cut = [replace(test, q=np.floor(test.q / L_MIN / 0.02) * 0.02 * L_MIN) for test in quiet]
        found = identify(cut)
        wording.of_test(warned(found, "coarse-flow")[0].text)
        assert any(test.u_guard_lower_V > 5.4 - 0.05 * test.dp_MPa for test in found.positive.tests)

    def test_fine_steps_are_not_worth_a_word(self):
        assert not warned(identify(self.cut_off(0.01)), "coarse-flow")


class TestClippedMeter:
    @staticmethod
    def recordings(tmp_path, cut, **truth):
        tests = []
        for dp in PRESSURES:
            test = valve_at(dp, **truth)
            tests.append(written(tmp_path / test.source, replace(test, q=cut(test.q / L_MIN) * L_MIN)))
        return tests

    @pytest.mark.parametrize(
        "cut",
        [
            pytest.param(lambda q: np.where(q < 0, -0.0, q), id="at zero, written -0.0"),
            pytest.param(lambda q: np.where(q < 0.6, -0.0, q), id="zero below its floor, written -0.0"),
            pytest.param(lambda q: np.maximum(q, 0.6), id="at its floor"),
            pytest.param(lambda q: np.round(np.maximum(q, 0.6) / 0.1) * 0.1, id="in steps of its noise"),
            pytest.param(lambda q: np.where(np.arange(q.size) % 997 == 0, 0.0, np.maximum(q, 0.6)), id="drop-outs"),
            pytest.param(lambda q: np.where(np.arange(q.size) == 0, 5.0, np.maximum(q, 0.6)), id="a glitch first"),
            pytest.param(lambda q: np.maximum(q, 0.6) * (1 + 1e-9 * np.sin(q)), id="not to the last digit"),
        ],
    )
    def test_knees_are_true_and_bounds_below_them(self, tmp_path, cut):
        tests = self.recordings(tmp_path, cut)
        for test, dp in zip(identify(tests).positive.tests, PRESSURES, strict=True):
            opens = 5.5 - 0.05 * dp
            assert test.u_knee_rising_V == pytest.approx(opens, abs=5e-3)
            assert test.u_knee_falling_V == pytest.approx(opens - 0.1, abs=5e-3)
            assert opens - 0.12 < test.u_guard_lower_V < opens - 0.1

    def test_a_floor_that_is_written_as_such_is_no_zero_error(self, tmp_path):
        valve = identify(self.recordings(tmp_path, lambda q: np.maximum(q, 0.6)))
        assert len(warned(valve, "meter-clipped")) == 3 and not warned(valve, "meter-zero")
        assert valve.meter.floor_L_min == pytest.approx(0.6)

    def test_a_zero_error_stays_one(self, tmp_path):
        valve = identify(self.recordings(tmp_path, lambda q: q + 0.6))
        assert warned(valve, "meter-zero") and not warned(valve, "meter-clipped")

    @pytest.mark.parametrize("cut", [lambda q: np.maximum(q, 0.6), lambda q: q + 0.6], ids=["floor", "zero error"])
    def test_of_a_meter_that_does_not_scatter_the_safe_one_is_taken(self, tmp_path, cut):
        quiet = identify(self.recordings(tmp_path, cut, noise=0.0))
        assert warned(quiet, "meter-clipped") and not warned(quiet, "meter-zero")
        (first, *_) = warned(quiet, "meter-clipped")
        assert "can't show which it is, so the flow is taken as cut off, which is safe" in first.text
        assert quiet.positive.tests[0].u_guard_lower_V < 5.375  # where the first of them closes


class TestUpperEnd:
    """A flow at the end of the meter's range is no stop of the valve, and a stop is no such end."""

    @staticmethod
    def valve(cut, *, pressures=PRESSURES, sign=1, **truth):
        tests = []
        for dp in pressures:
            changes = {name: value * dp**0.5 if name == "saturation" else value for name, value in truth.items()}
            test, rng = valve_at(dp, **changes), np.random.default_rng(9)
            tests.append(replace(test, u=sign * test.u, q=sign * cut(test.q / L_MIN, rng) * L_MIN))
        return tests

    @staticmethod
    def check(found, *, drive_range, clipped, opens=5.5):
        (side,) = found.sides.values()
        assert side.k_x_max_over_u_max == pytest.approx(drive_range, abs=0.006)
        assert len(warned(found, "flow-clipped")) == clipped
        for test in side.tests:
            knee = opens - 0.05 * (test.dp_MPa or 1.0)
            assert test.u_knee_rising_V == pytest.approx(knee, abs=0.015)
            assert test.u_guard_lower_V < knee - 0.1
        assert not {"curved", "flow-falls", "not-full-command"} & {warning.code for warning in found.warnings}
        return side

    @pytest.mark.parametrize(
        ("cut", "sign"),
        [
            pytest.param(lambda q, rng: np.minimum(q, 8.0), 1, id="at one number"),
            pytest.param(lambda q, rng: np.minimum(q, 3.0), 1, id="at a small one"),
            pytest.param(lambda q, rng: np.clip(q, 0, 8.0), -1, id="at both ends"),
            pytest.param(lambda q, rng: np.minimum(q, 8.0) + rng.normal(0, 0.03, q.size), -1, id="noise added to it"),
            pytest.param(lambda q, rng: np.where(rng.random(q.size) < 2e-3, 40, np.minimum(q, 8)), 1, id="glitches"),
            pytest.param(lambda q, rng: np.where(rng.random(q.size) < 2e-3, 0, np.minimum(q, 8)), 1, id="drop-outs"),
            pytest.param(lambda q, rng: np.round(np.minimum(q, 8.0) / 0.5) * 0.5, 1, id="in coarse steps"),
        ],
    )
    def test_the_end_of_the_range_is_no_stop(self, cut, sign):
        found = identify(self.valve(cut, sign=sign))
        side = self.check(found, drive_range=0.455, clipped=3)
        assert not any(test.saturates for test in side.tests)

    def test_it_is_said_with_what_follows(self, wording):
        found = identify(self.valve(lambda q, rng: np.minimum(q, 8.0)))
        wording.of_test("\n".join(warned(found, code)[0].text for code in ("flow-clipped", "no-saturation")))
        notes = as_document(design(found, DesignOptions()))["costs"]
        assert any(note.startswith("flow-clipped:") for note in notes)

    def test_another_pressure_drop_shows_the_stop(self):
        found = identify(self.valve(lambda q, rng: np.minimum(q, 20.0), saturation=12.0))
        side = self.check(found, drive_range=0.3, clipped=1)
        assert [test.saturates for test in side.tests] == [True, True, False]

    @pytest.mark.parametrize(
        "cut",
        [
            pytest.param(lambda q, rng: q, id="noise"),
            pytest.param(lambda q, rng: np.round(q / 0.1) * 0.1, id="steps"),
            pytest.param(lambda q, rng: np.round(q / 0.5) * 0.5, id="coarse steps"),
            pytest.param(lambda q, rng: np.minimum(q, np.median(q[q > 0.98 * q.max()])), id="one number each"),
        ],
    )
    def test_a_stop_stays_one(self, cut):
        side = self.check(identify(self.valve(cut, saturation=12.0)), drive_range=0.3, clipped=0)
        assert all(test.saturates for test in side.tests)

    def test_a_stop_without_noise_at_one_pressure_stays_one(self):
        self.check(identify(self.valve(lambda q, rng: q, pressures=(1.0,), saturation=12.0, noise=0.0)),
                   drive_range=0.3, clipped=0)  # fmt: skip

    def test_one_pressure_is_enough_for_a_number_that_repeats(self):
        self.check(
            identify(self.valve(lambda q, rng: np.minimum(q, 8.0), pressures=(1.0,))), drive_range=0.455, clipped=1
        )

    def test_the_declared_end_is_enough_for_one_with_noise(self, tmp_path):
        (test,) = self.valve(lambda q, rng: np.minimum(q, 8.0) + rng.normal(0, 0.03, q.size), pressures=(1.0,))
        rows = {"time_s": test.time, "u_V": test.u, "dP_MPa": test.dp / MPA, "Q_mA": 4 + 2 * test.q / L_MIN}
        (tmp_path / "ramp.csv").write_bytes(ramp_file_bytes(rows, (), compress=False))
        for columns, clipped in ({"Q": "Q_mA:4..20 mA = 0..8 L/min"}, 1), ({"Q": "Q_mA:4..24 mA = 0..10 L/min"}, 0):
            read = read_ramp_file(tmp_path / "ramp.csv", columns=columns)
            assert len(warned(identify([read]), "flow-clipped")) == clipped

    @pytest.mark.parametrize("sign", [1, -1])
    def test_rows_without_a_flow_at_the_top_are_beyond_the_range(self, tmp_path, sign, wording):
        tests = []
        for test in self.valve(lambda q, rng: q, sign=sign):
            path = tmp_path / test.source
            written(path, test)
            head, *lines = path.read_text().splitlines()
            blank = [line if abs(float(line.split(",")[3])) < 8 else line.rsplit(",", 1)[0] + "," for line in lines]
            path.write_text("\n".join([head, *blank]))
            tests.append(read_ramp_file(path))
        found = identify(tests)
        self.check(found, drive_range=0.455, clipped=3)
        if sign > 0:
            wording.of_test(warned(found, "flow-clipped")[0].text)

    def test_a_supply_at_its_limit_is_not_the_meter(self):
        tests = []
        for test in self.valve(lambda q, rng: q, noise=0.0):
            left = np.minimum(1, 12.0 * L_MIN / np.maximum(test.q, 1e-9))
            noise = np.random.default_rng(8).normal(0, 0.08, test.q.size)
            tests.append(replace(test, q=test.q * left + noise * L_MIN, dp=test.dp * left**2))
        assert not warned(identify(tests), "flow-clipped")

    def test_a_healthy_range_is_not_blamed(self):
        tests = [replace(test, q_range=(0.0, 50 * L_MIN)) for test in self.valve(lambda q, rng: q)]
        self.check(identify(tests), drive_range=0.455, clipped=0)


class TestOrder:
    def test_what_stops_a_design_comes_first(self, crossed):
        marked = [replace(valve_at(dp, hysteresis=-0.05), simulated=True) for dp in PRESSURES]
        for valve in (crossed, identify(marked, IdentifyOptions(meter_lag=0.0))):
            assert [warning.code for warning in valve.warnings[:3]] == ["branch-order"] * 3
        codes = [warning.code for warning in valve.warnings]
        assert codes[3] == "simulated"
        places = list(map(list(catalogue()).index, codes))
        assert places == sorted(places)

    def test_the_catalogue_is_what_the_checks_say(self):
        """Each text is used, and every place in it is filled: seen in the calls of `warn`."""
        calls = [
            node
            for path in (ROOT / "identify").rglob("*.py")
            for node in ast.walk(ast.parse(path.read_text("utf-8")))
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "warn"
        ]
        used = {call.args[0].value for call in calls}
        assert used == set(catalogue()) and len(used) > 40
        for call in calls:
            filled = {word.arg for word in call.keywords}
            text = catalogue()[call.args[0].value].text
            for each in text.values() if isinstance(text, dict) else [text]:
                places = {name for _, name, _, _ in string.Formatter().parse(each) if name}
                assert places <= filled or isinstance(text, dict), (call.args[0].value, places ^ filled)
            cases = [ast.unparse(each) for each in call.args[2:3]]
            assert bool(cases) == isinstance(text, dict), call.args[0].value

    def test_the_unit_of_a_quantity_stands_in_its_place(self):
        """Or it would be said in V whatever the recordings are in; of two with one unit the first is ``#unit``."""
        for code, entry in catalogue().items():
            for text in entry.text.values() if isinstance(entry.text, dict) else [entry.text]:
                assert not re.search(r"\}\s*(m?V|MPa|L/min)\b", text), code
                for _, name, spec, _ in string.Formatter().parse(text):
                    ending = re.search(r"_(V|mV|MPa|L_min|V_s)$", name or "")
                    assert not ending or " " in (spec or ""), (code, name)

    def test_a_place_that_nobody_fills_is_an_error(self):
        with pytest.raises(KeyError, match="zero_L_min"):
            warn("meter-zero", "ramp.csv", "one", leak="")

    def test_an_unknown_one_comes_last(self):
        two = [Warning_(code=code, text="", source=None) for code in ("unheard-of", "thinned")]
        assert most_serious_first(two) == tuple(reversed(two))
