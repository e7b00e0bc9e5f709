"""The order of recordings: `--order`, dates, and what is said where they contradict one another."""

import datetime
import json
from dataclasses import replace
from pathlib import Path

import pytest

from dzdesign import api
from dzdesign.command_line.cli import main
from dzdesign.identify.data_quality import recordings
from dzdesign.identify.knees import prepared_tests
from tests.support.bench_recordings import L_MIN, MPA, Valve, record

#: Pressure drops, MPa, of the ramps as they were taken, and by how much the valve drifts from the first to the last, V.
TAKEN, DRIFT = (1, 4, 4, 1, 1, 4), 0.1
PAUSE_S = 60
#: Options without which the scatter and the lag would be in the way.
KNOWN = ("--meter-lag", "0 s +- 0.01 s", "--repeatability", "0.02 %")


def ramps():
    """Yield ramps as they are taken, 30 s up and down; the valve warms up, so that it closes ever later."""
    for place, dp in enumerate(TAKEN):
        moved = DRIFT * place / (len(TAKEN) - 1) - 0.05 * dp
        test = record(Valve(opening=5.4 + moved, closing=5.2 + moved), dp, seed=place, rate_Hz=25.0)
        yield replace(test, time=0.3 * test.time)


def write(path: Path, test, start: datetime.datetime | None = None, zone: str = "") -> None:
    """Write a recording as a logger does, with dates or with seconds."""
    clock = [
        f"{second:.3f}" if start is None else f"{start + datetime.timedelta(seconds=second):%Y-%m-%d %H:%M:%S.%f}{zone}"
        for second in test.time.tolist()
    ]
    rows = zip(clock, test.u, test.dp / MPA, test.q / L_MIN, strict=True)
    lines = [f"{time},{u:.5f},{dp:.4f},{q:.5f}" for time, u, dp, q in rows]
    path.write_text("\n".join([f"{'time_s' if start is None else 'time'},u_V,dP_MPa,Q_Lmin", *lines]))


def dated(folder: Path, names, clock) -> list[str]:
    """Write the ramps, each at what a clock shows when the bench begins it."""
    begins = datetime.datetime(2026, 10, 25, 2, 50)
    for place, (name, test) in enumerate(zip(names, ramps(), strict=True)):
        shown = clock(place, begins)
        shown, zone = shown if isinstance(shown, tuple) else (shown, "")
        write(folder / name, test, shown, zone)
        begins += datetime.timedelta(seconds=float(test.time[-1]) + PAUSE_S)
    return [str(folder / name) for name in names]


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def drift_of(*argv) -> float:
    assert main(["-q", "identify", *argv, *KNOWN]) == 0
    (side,) = json.loads(Path("valve.json").read_text())["sides"].values()
    return side["certificate"]["repeatability"]["drift_V"]


def said() -> list[str]:
    warnings = json.loads(Path("valve.json").read_text())["warnings"]
    return [each["text"] for each in warnings if each["code"] == "time-stamps"]


NAMES = ("p1.csv", "p4, cold.csv", "p4, warm.csv", "p1 again.csv", "p1,third.csv", "p4.csv")


@pytest.fixture
def undated(here):
    (here / "ramps").mkdir()
    for name, test in zip(NAMES, ramps(), strict=True):
        write(here / "ramps" / name, test)
    return [f"ramps/{name}" for name in sorted(NAMES)]


class TestOrder:
    def test_names_with_commas_and_paths(self, undated):
        assert drift_of(*undated, "--order", ", ".join(NAMES)) == pytest.approx(DRIFT, abs=0.01)
        assert drift_of(*undated, "--order", ",".join(f"./ramps/{name}" for name in NAMES[::-1])) == pytest.approx(
            -DRIFT, abs=0.01
        )
        each = [word for name in NAMES for word in ("--order", f"ramps/{name}")]
        assert drift_of(*undated, *each) == pytest.approx(DRIFT, abs=0.01)
        assert said() == []

    def test_python_takes_a_list_of_names_or_paths(self, undated):
        known = {"meter_lag": "0 s +- 0.01 s", "repeatability": "0.02 %"}
        for order in (list(NAMES), [Path("ramps") / name for name in NAMES], tuple(NAMES), ", ".join(NAMES)):
            found = api.identify("ramps/*.csv", order=order, **known).positive.certificate.repeatability
            assert found.drift_V == pytest.approx(DRIFT, abs=0.01)

    def test_the_options_file_takes_a_list(self, undated):
        Path("dz.toml").write_text(f"order = {json.dumps(list(NAMES))}\n")
        assert drift_of(*undated, "--config", "dz.toml") == pytest.approx(DRIFT, abs=0.01)

    @pytest.mark.parametrize(
        "order",
        [[*NAMES[:-1], "p5.csv"], NAMES[:-1], [*NAMES, "ramps/p4.csv"], ["ramps/p1.csv, other/p4.csv"], [""]],
        ids=["unknown", "missing", "twice", "another folder", "empty"],
    )
    def test_one_that_is_none_is_refused(self, undated, order, wording, request):
        with wording.refusal(api.InputError, f"recording order: {request.node.callspec.id}"):
            api.identify("ramps/*.csv", order=order)

    def test_files_of_one_name_are_told_apart_by_their_folders(self, here):
        for place, test in enumerate(ramps()):
            folder = here / ("monday" if place < 3 else "tuesday")
            folder.mkdir(exist_ok=True)
            write(folder / f"{place % 3}.csv", test)
        order = [f"{day}/{place}.csv" for day in ("monday", "tuesday") for place in range(3)]
        assert drift_of("*day/*.csv", "--order", ", ".join(order)) == pytest.approx(DRIFT, abs=0.01)
        with pytest.raises(api.InputError, match="which may be"):
            api.identify("*day/*.csv", order=["0.csv", *order[1:]])


def on_time(place, begins):
    return begins


def end_of_summer_time(place, begins):
    """Show the wall clock where it goes back by an hour at three."""
    return begins - datetime.timedelta(hours=begins.hour >= 3)


def reset_to(year):
    return lambda place, begins: begins if place < 3 else begins.replace(year=year)


IN_TURN = tuple(f"run_{place:02d}.csv" for place in range(1, 7))
SHUFFLED = ("c.csv", "a.csv", "f.csv", "b.csv", "e.csv", "d.csv")


class TestDates:
    def test_right_ones_count_and_nothing_is_said(self, here):
        for names in (IN_TURN, SHUFFLED):
            assert drift_of(*sorted(dated(here, names, on_time))) == pytest.approx(DRIFT, abs=0.01)
            assert said() == []

    def test_an_order_that_says_the_same_changes_nothing(self, here):
        paths = dated(here, SHUFFLED, on_time)
        assert drift_of(*paths, "--order", ",".join(paths)) == drift_of(*paths)

    def test_a_clock_set_back_between_two_ramps(self, here, wording):
        """By so much that the later half lies among the earlier one by its dates."""
        paths = dated(here, IN_TURN, lambda place, begins: begins - datetime.timedelta(seconds=350 * (place > 2)))
        drift_of(*paths)
        wording("time stamps: set back", "\n".join(said()))
        assert drift_of(*paths, "--order", ",".join(paths)) == pytest.approx(DRIFT, abs=0.01)
        wording("time stamps: order", "\n".join(said()))

    def test_a_zone_is_all_that_it_takes(self, here):
        def berlin(place, begins):
            return end_of_summer_time(place, begins), "+01:00" if begins.hour >= 3 else "+02:00"

        assert drift_of(*dated(here, IN_TURN, berlin)) == pytest.approx(DRIFT, abs=0.01)
        assert said() == []

    def test_ramps_that_overlap(self, here, wording):
        paths = dated(here, SHUFFLED, lambda place, begins: begins - datetime.timedelta(seconds=100 * (place > 2)))
        drift_of(*paths)
        wording("time stamps: overlap", "\n".join(said()))

    @pytest.mark.parametrize("year", [2000, 2027])
    def test_a_date_that_was_lost(self, here, year, wording):
        drift_of(*dated(here, SHUFFLED, reset_to(year)))
        wording(f"time stamps: {year}", "\n".join(said()))

    def test_dates_with_a_zone_and_without_are_not_compared(self, here):
        paths = dated(here, SHUFFLED, lambda place, begins: (begins, "Z" if place > 3 else ""))
        assert drift_of(*paths) is None
        (side,) = json.loads(Path("valve.json").read_text())["sides"].values()
        assert side["certificate"]["repeatability"]["no_drift"] == "order unknown"

    def test_an_order_that_contradicts_them_counts_and_is_said(self, here):
        paths = dated(here, SHUFFLED, on_time)
        assert drift_of(*paths, "--order", ",".join(paths[::-1])) == pytest.approx(-DRIFT, abs=0.01)
        (text,) = said()
        assert "--order counts" in text


class TestSeeded:
    """Without a check the warning of its case is not there."""

    @pytest.mark.parametrize(
        ("check", "clock"), [("_long_pause", reset_to(2000)),
        ("runs_back", lambda place, begins: begins - datetime.timedelta(seconds=100 * (place > 2)))],
    )  # fmt: skip
    def test_a_check_that_sees_nothing(self, here, check, clock, monkeypatch):
        paths = dated(here, SHUFFLED, clock)
        drift_of(*paths)
        assert said()
        monkeypatch.setattr(recordings, check, lambda tests: None)
        drift_of(*paths)
        assert not said()

    def test_dates_that_are_compared_across_zones(self, here, monkeypatch):
        paths = dated(here, SHUFFLED, lambda place, begins: (begins, "+02:00" if place > 3 else ""))
        assert drift_of(*paths) is None
        monkeypatch.setattr(prepared_tests, "with_clock_of_series", list)
        assert abs(drift_of(*paths) - DRIFT) > 0.03
