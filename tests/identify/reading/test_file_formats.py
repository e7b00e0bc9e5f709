"""The same recording in every format that a bench may write: read alike, refused in one sentence."""

import io
import struct

import h5py
import numpy as np
import polars as pl
import pytest
import scipy.io
from nptdms import ChannelObject, RootObject, TdmsWriter

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.reading.time_stamps import start_of
from tests.identify.reading.test_ramp_files import DP, HEADER, ROWS, TIME, Q, U, assert_is_the_ramp

COLUMNS = dict(zip(HEADER.split(","), (TIME, U, DP, Q), strict=True))
PLAIN = {"time": (TIME, "s"), "u": (U, "V"), "dP": (DP, "MPa"), "Q": (Q, "L/min")}


def tdms(channels=PLAIN, waveform=False):
    """Return a TDMS file whose channels carry their unit as a property."""
    out = io.BytesIO()
    with TdmsWriter(out) as writer:
        objects = []
        for name, (data, unit) in channels.items():
            properties = {"unit_string": unit} if unit else {}
            if waveform:
                properties |= {"wf_increment": 0.04, "wf_start_offset": 0.0, "wf_samples": 1}
            objects.append(ChannelObject("bench", name, data, properties=properties))
        writer.write_segment([RootObject(), *objects])
    return out.getvalue()


def mat(variables=COLUMNS, **keywords):
    out = io.BytesIO()
    scipy.io.savemat(out, variables, **keywords)
    return out.getvalue()


def hdf5(columns=COLUMNS, user_block=b"", units=None, compound=False):
    """Return an HDF5 file; with a user block it is what MATLAB calls version 7.3."""
    out = io.BytesIO()
    with h5py.File(out, "w", userblock_size=512 if user_block else 0) as file:
        if compound:
            file["run/table"] = np.rec.fromarrays(list(columns.values()), names=list(columns))
        else:
            for name, data in columns.items():
                file[f"run/{name}"] = np.atleast_2d(data) if user_block else data
                if units:
                    file[f"run/{name}"].attrs["units"] = units[name]
    content = bytearray(out.getvalue())
    content[: len(user_block)] = user_block
    return bytes(content)


def frame(write, columns=COLUMNS):
    out = io.BytesIO()
    getattr(pl.DataFrame(columns), write)(out)
    return out.getvalue()


GOOD = {
    "tdms": tdms(),
    "tdms units in labels": tdms({label: (data, "") for label, data in COLUMNS.items()}),
    "tdms waveform": tdms({name: PLAIN[name] for name in ("u", "dP", "Q")}, waveform=True),
    "mat 5": mat(),
    "mat 5 compressed": mat(do_compression=True),
    "mat 5 columns": mat(oned_as="column"),
    "mat 5 struct": mat({"run": COLUMNS}),
    "mat 4": mat(format="4"),
    "mat 7.3": hdf5(user_block=b"MATLAB 7.3 MAT-file, Platform: GLNXA64"),
    "hdf5": hdf5(),
    "hdf5 units": hdf5(
        {name: data for name, (data, _) in PLAIN.items()}, units={name: unit for name, (_, unit) in PLAIN.items()}
    ),
    "hdf5 compound": hdf5(compound=True),
    "parquet": frame("write_parquet"),
    "feather": frame("write_ipc"),
}


@pytest.fixture
def read(tmp_path):
    def read(content, name="ramp.mat", **keywords):
        (tmp_path / name).write_bytes(content)
        return read_ramp_file(tmp_path / name, **keywords)

    return read


@pytest.mark.parametrize("name", GOOD)
def test_the_same_recording_in_every_format(read, name):
    assert_is_the_ramp(read(GOOD[name]))
    if name != "mat 4":  # it alone has no mark, and is known by its name
        assert_is_the_ramp(read(GOOD[name], "renamed.csv"))


def test_a_matrix_is_addressed_by_its_columns(read):
    test = read(
        mat({"data": np.column_stack([TIME, U, DP, Q])}),
        columns={"time": "data(:,1):s", "u": "data(:,2):V", "dP": "data(:,3):MPa", "Q": "data(:,4):L/min"},
    )
    assert_is_the_ramp(test)


def test_a_missing_sample_is_left_out(read):
    gap = {**COLUMNS, "Q_Lmin": np.where(np.arange(ROWS) == 7, np.nan, Q)}
    kept = np.arange(ROWS) != 7
    assert_is_the_ramp(read(frame("write_parquet", gap)), kept)
    null = {**COLUMNS, "Q_Lmin": [None if row == 7 else float(Q[row]) for row in range(ROWS)]}
    assert_is_the_ramp(read(frame("write_parquet", null)), kept)
    assert_is_the_ramp(read(mat(gap)), kept)


def test_dates_are_seconds_since_the_first(read):
    start = np.datetime64("2026-03-01T08:00:00", "us")
    dates = {**COLUMNS, "time_s": start + np.round(TIME * 1e6).astype("timedelta64[us]")}
    test = read(frame("write_parquet", {"time" if k == "time_s" else k: v for k, v in dates.items()}))
    np.testing.assert_allclose(test.time, TIME, atol=1e-6)


BEGUN = np.datetime64("2026-03-01T08:00:00.500000", "us")
DATES = BEGUN + np.round(TIME * 1e6).astype("timedelta64[us]")


def timed(column, label="time"):
    return {label if key == "time_s" else key: column if key == "time_s" else data for key, data in COLUMNS.items()}


def zoned(zone, write="write_parquet"):
    """Return a table whose column of time has a zone; its dates are those of the wall clock there."""
    clock = pl.Series(DATES).dt.replace_time_zone("UTC").dt.convert_time_zone(zone)
    return frame(write, timed(clock))


def waveform(start, offset=0.0, dates=False):
    """Return a TDMS file as LabVIEW writes a waveform, or channels with one of dates."""
    out = io.BytesIO()
    properties = {"wf_increment": 0.04, "wf_start_offset": offset, "wf_samples": ROWS}
    properties |= {} if start is None else {"wf_start_time": start}
    with TdmsWriter(out) as writer:
        objects = [
            ChannelObject("bench", name, data, properties={"unit_string": unit} | ({} if dates else properties))
            for name, (data, unit) in PLAIN.items() if name != "time"
        ]  # fmt: skip
        objects += [ChannelObject("bench", "time", DATES)] if dates else []
        writer.write_segment([RootObject(), *objects])
    return out.getvalue()


def of_hdf5(attributes, data=TIME):
    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        for name, (column, unit) in PLAIN.items():
            file[name] = data if name == "time" else column
            for key, text in (attributes if name == "time" else {"units": unit}).items():
                file[name].attrs[key] = text
    return out.getvalue()


UTC, LOCAL = "2026-03-01 08:00:00.5Z", "2026-03-01 08:00:00.5"


@pytest.mark.parametrize(
    ("content", "stamp"),
    [
        (waveform(BEGUN), UTC),
        (waveform(np.datetime64("1904-01-01T00:00:00", "us")), ""),  # as LabVIEW writes a start that it does not know
        (waveform(None), ""),
        (waveform(None, dates=True), UTC),
        (frame("write_parquet", timed(DATES)), LOCAL),
        (frame("write_ipc", timed(DATES)), LOCAL),
        (zoned("UTC"), UTC),
        (zoned("Asia/Tokyo"), UTC),
        (zoned("America/New_York", "write_ipc"), UTC),
        (frame("write_parquet", timed(DATES - BEGUN)), ""),
        (of_hdf5({"units": "seconds since 2026-03-01 08:00:00.5"}), UTC),
        (of_hdf5({"units": "s since 2026-03-01T10:00:00.5+02:00"}), UTC),
        (of_hdf5({"units": "seconds since 2026-03-01"}), "2026-03-01 00:00:00Z"),
        (of_hdf5({"units": "s", "start": "2026-03-01T09:00:00.5+01:00"}), UTC),
        (of_hdf5({"units": "s", "start": "2026-03-01T08:00:00.5"}), LOCAL),
        (of_hdf5({"units": "s", "start": "of the bench"}), ""),
        (of_hdf5({"units": "s"}), ""),
        (mat(), ""),  # the date in its head is that of writing
    ],
)
def test_the_date_of_recording_is_read_where_a_file_states_it(read, content, stamp):
    test = read(content)
    assert_is_the_ramp(test)
    assert test.stamp == (start_of(stamp) if stamp else None)
    assert test.started == (test.stamp and test.stamp.seconds)


def test_a_clock_counts_from_its_date_on(read):
    """What is in the file is the date of its zero, which need not be its first sample."""
    late = read(waveform(BEGUN, offset=2.5))
    assert late.stamp == start_of(UTC) and late.time[0] == pytest.approx(2.5)
    epoch = read(of_hdf5({"units": "seconds since 1970-01-01 00:00:00"}, TIME + 1772352000.5))
    assert epoch.stamp.seconds + epoch.time[0] == pytest.approx(start_of(UTC).seconds)


@pytest.mark.parametrize("name", [name for name in GOOD if name not in ("mat 4",)])
def test_a_file_that_is_cut_off_is_refused_in_one_sentence(read, name):
    for share in (0.1, 0.5, 0.9):
        content = GOOD[name][: int(share * len(GOOD[name]))]
        try:
            test = read(content)
        except InputError as error:
            assert "ramp.mat'" in str(error) and "\n" not in str(error)
        else:  # TDMS keeps whole what was written before the cut
            assert name.startswith("tdms") and test.u.size >= 20


SIGNALS = np.array(
    [(data, label) for label, data in COLUMNS.items() if label != "time_s"], dtype=[("values", "O"), ("label", "O")]
)
#: Structs as Simulink ("structure with time") and dSPACE write them, and one of them without titles.
STRUCTS = {
    "Simulink": ({"Scope": {"time": TIME, "signals": SIGNALS, "blockName": "m/Scope"}}, {"time": "time:s"}),
    "dSPACE": (
        {
            "ramp": {
                "X": {"Name": "time_s", "Data": TIME},
                "Y": np.array(
                    [(label, data) for label, data in COLUMNS.items() if label != "time_s"],
                    dtype=[("Name", "O"), ("Data", "O")],
                ),
            }
        },
        {},
    ),
    "without titles": (
        {"log": {"t": TIME, "signals": np.array([(data,) for data, _ in SIGNALS], dtype=[("values", "O")])}},
        {"time": "t:s", "u": "signals(1).values:V", "dP": "signals(2).values:MPa", "Q": "signals(3).values:L/min"},
    ),
}


@pytest.mark.parametrize("name", STRUCTS)
def test_structs_of_simulators_are_read(read, name):
    variables, columns = STRUCTS[name]
    assert_is_the_ramp(read(mat(variables), columns=columns))


def with_a_table(variables, names=("T", "when")):
    """Return a MAT file with objects as MATLAB 7 saves tables and dates: opaque ones, of which SciPy knows no names."""

    def element(kind, data):
        return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)

    numbers = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<II", 1, 1)) + element(1, b"")
    numbers = element(14, numbers + element(6, struct.pack("<I", 1)))
    flags = element(6, struct.pack("<II", 17, 0))
    kind = element(1, b"MCOS") + element(1, b"table")
    return mat(variables) + b"".join(element(14, flags + element(1, name.encode()) + kind + numbers) for name in names)


def test_a_matlab_table_beside_the_columns_is_left_aside(read):
    assert_is_the_ramp(read(with_a_table(COLUMNS)))
