"""Date and time of day in two columns: together they are the clock, or the time of day alone where they can't be."""

import datetime
import logging

import numpy as np
import pytest

from dzdesign.identify.reading.columns import propose_columns
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.reading.series import runs_back
from dzdesign.identify.reading.time_stamps import start_of
from tests.identify.reading.logger_files import DP, START, TIME, Q, U, rows, stamps, text

LATE = START.replace(hour=23, minute=59, second=50)
FIRST = start_of("2026-11-22 23:59:50.123")
LABELS = "Datum;Uhrzeit;u [V];dP [MPa];Q [l/min]"
DECLARED = {"time": "Datum + Uhrzeit"}


def two_columns(form="%d.%m.%Y", *, start=LATE, dates=None, labels=LABELS, days=0):
    """Return a recording, `days` the days by which the dates run ahead."""
    dates = dates or [
        (start + datetime.timedelta(days=days, seconds=0.04 * row)).strftime(form) for row in range(TIME.size)
    ]
    return text(labels, *rows(dates, stamps("%H:%M:%S,", start), U, DP, Q))


@pytest.fixture
def read(tmp_path):
    def read_(content, columns=DECLARED, name="ramp.csv"):
        (tmp_path / name).write_bytes(content)
        return read_ramp_file(tmp_path / name, columns=columns)

    return read_


@pytest.fixture
def proposed(tmp_path):
    def proposed_(content):
        (tmp_path / "ramp.csv").write_bytes(content)
        look = propose_columns(tmp_path / "ramp.csv", {})
        return (look.known | look.proposed)["time"].label

    return proposed_


@pytest.mark.parametrize("form", ["%d.%m.%Y", "%d.%m.%y", "%Y-%m-%d", "%m/%d/%Y", "'%d.%m.%Y"])
@pytest.mark.parametrize("columns", [DECLARED, {"time": "Uhrzeit + Datum"}])
def test_they_are_one_clock_over_midnight(read, form, columns):
    test = read(two_columns(form), columns)
    np.testing.assert_allclose(test.time, TIME, atol=6e-4)
    expected = None if form == "%d.%m.%y" else FIRST  # may be the year first
    assert test.stamp == expected


@pytest.mark.parametrize(
    ("labels", "found"),
    [
        (LABELS, "Datum + Uhrzeit"),
        ("Date;Time;u [V];dP [MPa];Q [l/min]", "Date + Time"),
        ("Tag;Zeit + Rest;u [V];dP [MPa];Q [l/min]", "Tag + Zeit + Rest"),
    ],
)
def test_whatever_their_labels(proposed, read, labels, found):
    content = two_columns(labels=labels)
    assert proposed(content) == found
    assert read(content, {"time": found}).stamp == FIRST


def test_a_label_of_the_file_goes_before_a_pair(read):
    clock, still = stamps("%H:%M:%S,", START), ["07:00:00,000"] * TIME.size
    content = text(
        "Datum;Uhrzeit;Datum + Uhrzeit;" + LABELS[14:], *rows(["22.11.2026"] * TIME.size, still, clock, U, DP, Q)
    )
    np.testing.assert_allclose(read(content).time, TIME, atol=6e-4)
    assert not np.any(read(content, {"time": "Uhrzeit"}).time)


def test_of_two_columns_of_dates_none_is_taken_but_the_declared_one(proposed, read):
    exported = ["30.11.2026"] * TIME.size
    dates = ["22.11.2026"] * TIME.size
    content = text("Date;" + LABELS, *rows(exported, dates, stamps("%H:%M:%S,", START), U, DP, Q))
    assert proposed(content) == "Uhrzeit" and read(content, {"time": "Uhrzeit"}).stamp is None
    assert read(content).stamp == start_of("2026-11-22 03:04:05.123")


@pytest.mark.parametrize(
    "dates",
    [
        pytest.param(["22.11.2026"] * TIME.size, id="of the export"),
        pytest.param(["22.11.2026"] * 300 + ["23.11.2026"] * (TIME.size - 300), id="a second late"),
        pytest.param(["22.11.2026"] * 200 + ["23.11.2026"] * (TIME.size - 200), id="a second early"),
        pytest.param(["22.11.2026"] + [""] * (TIME.size - 1), id="written once"),
    ],
)
def test_dates_that_do_not_change_at_midnight_are_left_out(read, dates, caplog):
    with caplog.at_level(logging.INFO):
        test = read(two_columns(dates=dates))
    np.testing.assert_allclose(test.time, TIME, atol=6e-4)
    assert test.stamp is None and "'Datum' does not change just as 'Uhrzeit' passes midnight" in caplog.text


def test_a_date_that_changes_away_from_midnight_is_left_out(read, caplog):
    """Seeded: of another time zone it would put a day into the ramp, and a second rate of it into the meter's lag."""
    dates = ["22.11.2026"] * 300 + ["23.11.2026"] * (TIME.size - 300)
    with caplog.at_level(logging.INFO):
        test = read(two_columns(start=START, dates=dates))
    np.testing.assert_allclose(test.time, TIME, atol=6e-4)
    assert test.stamp is None and "so the dates are not used" in caplog.text


def test_times_that_count_from_zero_have_no_date(read):
    test = read(two_columns(start=START.replace(hour=0, minute=0, second=0, microsecond=0)))
    np.testing.assert_allclose(test.time, TIME, atol=6e-4)
    assert test.stamp is None


@pytest.mark.parametrize("label", ["Calibrated", "Kalibrierdatum", "Export date", "Prüfdatum", "Build"])
def test_another_date_is_not_that_of_the_rows(proposed, read, label):
    """Seeded: any column of dates gave recordings of one night a false order, and a bound above the threshold."""
    content = two_columns(start=START, labels=LABELS.replace("Datum", label))
    assert proposed(content) == "Uhrzeit" and read(content, {"time": "Uhrzeit"}).stamp is None
    assert read(content, {"time": f"{label} + Uhrzeit"}).stamp is not None  # but where it is declared


def test_the_time_of_day_may_be_declared_alone(read):
    """Also where the dates could not be read."""
    assert read(two_columns(start=START), {"time": "Uhrzeit"}).stamp is None
    unreadable = ["22.11.2026"] * 300 + ["n/a"] * (TIME.size - 300)
    assert read(two_columns(start=START, dates=unreadable), {"time": "Uhrzeit"}).time.size == TIME.size


def test_a_date_that_is_written_once_holds_for_the_rows_below(read):
    test = read(two_columns(start=START, dates=["22.11.2026"] + [""] * (TIME.size - 1)))
    np.testing.assert_allclose(test.time, TIME, atol=6e-4)
    assert test.stamp == start_of("2026-11-22 03:04:05.123")


def test_a_time_that_is_missing_is_a_missing_sample(read):
    content = two_columns(start=START).replace(START.strftime(";%H:%M:%S,163").encode(), b";", 1)
    assert read(content).time.size == TIME.size - 1


@pytest.mark.parametrize("dates", [["45989"] * TIME.size, ["22. Nov 2026"] * TIME.size, ["1.2.3"] * TIME.size])
def test_what_is_no_date_leaves_the_time_of_day(proposed, read, dates):
    content = two_columns(dates=dates)
    assert proposed(content) == "Uhrzeit"
    test = read(content, {"time": "Uhrzeit"})
    np.testing.assert_allclose(test.time, TIME, atol=6e-4)
    assert test.stamp is None


def one_column(spelled):
    return text("time;u [V];dP [MPa];Q [l/min]", *rows(spelled, U, DP, Q))


def named(month, form="{day}{month}{year} %H:%M:%S,"):
    """Return stamps over midnight, from the last day of a year to the first of the next."""
    start = datetime.datetime(2026, 12, 31, 23, 59, 50, 123000)
    found = []
    for row in range(TIME.size):
        at = start + datetime.timedelta(seconds=0.04 * row)
        day, name, year = f"{at.day:02}", month[at.month == 1], at.year
        found.append(at.strftime(form.format(day=day, month=name, year=year)) + f"{at.microsecond // 1000:03}")
    return found


SECONDS = [f"{second:.3f}" for second in TIME]
SPELLED = {
    "MATLAB": named(("-Dec-", "-Jan-")),
    "German": named((". Dezember ", ". Januar ")),
    "German, short": named((". Dez. ", ". Jan. ")),
    "French": named((" décembre ", " janvier ")),
    "English": named(("Dec ", "Jan "), "{month}{day}, {year} %H:%M:%S,"),
    "year first": named(("-Dec-", "-Jan-"), "{year}{month}{day} %H:%M:%S,"),
    "compact": stamps("%Y%m%dT%H%M%S.", LATE),
    "compact without a T": stamps("%Y%m%d%H%M%S.", LATE),
    "IEC date": stamps("DT#%Y-%m-%d-%H:%M:%S.", LATE),
    "IEC time of day": stamps("TOD#%H:%M:%S.", LATE),
    "two digits": stamps("%d.%m.%y %H:%M:%S.", LATE),
    "colon before milliseconds": stamps("%H:%M:%S:", LATE),
    "offset": [f"{stamp}+01:00" for stamp in stamps("%Y-%m-%dT%H:%M:%S.", LATE)],
    "seconds": [f"{second} sec" for second in SECONDS],
    "seconds, or milliseconds": [f"{1000 * t:.0f} ms" if t < 1 else f"{t:.3f} s".replace(".", ",") for t in TIME],
    "pandas": [f"0 days 23:59:{50 + t:06.3f}" if t < 10 else f"1 days 00:00:{t - 10:06.3f}" for t in TIME],
    "IEC duration": [f"T#{1000 * t:.0f}ms" if t < 1 else f"T#{int(t)}s{1000 * (t % 1):.0f}ms" for t in TIME],
    "IEC duration, long": [f"TIME#0d_0h_{int(t // 60)}m_{t % 60:.3f}s" for t in TIME],
}


@pytest.mark.parametrize("name", SPELLED)
def test_a_time_as_programs_spell_it(read, name):
    test = read(one_column(SPELLED[name]), {})
    np.testing.assert_allclose(test.time, TIME, atol=6e-4)
    if name in ("MATLAB", "German", "French", "English", "year first"):
        assert test.stamp == start_of("2026-12-31 23:59:50.123")
    assert (test.stamp is None) == name.startswith(("IEC t", "IEC du", "sec", "pandas", "two", "colon"))


def test_recordings_that_overlap_are_seen(read):
    first, early = read(two_columns()), read(two_columns(start=LATE + datetime.timedelta(seconds=20)), name="b.csv")
    after = read(two_columns(days=1), name="c.csv")
    assert runs_back([first, early]) == (first, early) and runs_back([first, after]) is None


@pytest.mark.parametrize(
    ("labels", "form", "known"),
    [
        ("Zeit [s];Zeitstempel;u [V];dP [MPa];Q [l/min]", "%d.%m.%Y %H:%M:%S,%f", True),
        ("time [s];timestamp;u [V];dP [MPa];Q [l/min]", "%Y-%m-%d %H:%M:%S", True),
        ("time [s];Pruefung;u [V];dP [MPa];Q [l/min]", "%Y-%m-%d 07:00:00", False),
        ("time [s];Zeitstempel;u [V];dP [MPa];Q [l/min]", "%H:%M:%S,%f", False),
        ("time [s];Zeitstempel;u [V];dP [MPa];Q [l/min]", "Ramp %H %M", False),
        ("time [s];Zeitstempel;u [V];dP [MPa];Q [l/min]", "%d.%m.%Y %H:%M", False),
    ],
)
def test_dates_beside_a_clock_that_counts_are_its_own_if_they_run_with_it(read, labels, form, known):
    """The clock may begin anywhere; a date that stands still is of something else."""
    counted = [f"{5 + 0.04 * row:.2f}" for row in range(TIME.size)]
    dates = [(LATE + datetime.timedelta(seconds=0.04 * row)).strftime(form) for row in range(TIME.size)]
    test = read(text(labels, *rows(counted, dates, U, DP, Q)), {"time": labels.split(";")[0]})
    np.testing.assert_allclose(test.time, 5 + TIME, atol=6e-4)
    assert (test.stamp is not None) is known and test.started == (test.stamp.seconds if known else None)
    if known:
        assert abs(test.stamp.seconds - (FIRST.seconds - 5)) < 1
