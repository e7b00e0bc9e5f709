"""Channels with clocks of their own: laid on the command's clock in every format, or refused by name."""

import io
from itertools import pairwise

import h5py
import numpy as np
import polars as pl
import pytest
import scipy.io
from nptdms import ChannelObject, RootObject, TdmsWriter

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.columns import propose_columns
from dzdesign.identify.reading.ramp_files import read_ramp_file

L_MIN = 1e-3 / 60
BEGUN = np.datetime64("2026-02-03T08:00:00", "us")
UNITS = {"u": "V", "dP": "MPa", "Q": "L/min"}
LABELS = {"time": "time_s", "u": "u_V", "dP": "dP_MPa", "Q": "Q_Lmin"}


def command(t):
    return np.interp(t, [0, 1, 7, 13, 14], [0, 0, 9, 0, 0])


def flow(t):
    """The valve's flow at a time: any difference of clocks moves it."""
    return np.interp(t, [0, 4.5, 7, 9.9, 14], [0, 0, 12, 0, 0])


VALUES = {"u": command, "dP": lambda t: 2 + 0.01 * t, "Q": flow}


def clock(start=0.0, step=0.05, end=14.0):
    return start + step * np.arange(round((end - start) / step))


LATE = {"u": clock(), "dP": clock(), "Q": clock(0.24)[:270]}
SLOW = {"u": clock(step=0.02), "dP": clock(step=0.5), "Q": clock(0.013, step=0.1)}
COMMAND_LATE = {"u": clock(0.317), "dP": clock(), "Q": clock()}
FAST = {"u": clock(step=0.1), "dP": clock(), "Q": clock(step=0.01)}
CLOCKS = {"late": LATE, "slow": SLOW, "command late": COMMAND_LATE, "fast": FAST}


def tdms(clocks, stated=True, offset=False, timeless=""):
    """Return a TDMS file; a channel states its start by date, or by its offset from one, or has no time."""
    out = io.BytesIO()
    with TdmsWriter(out) as writer:
        objects = []
        for name, t in clocks.items():
            properties = {"unit_string": UNITS[name]}
            if name != timeless:
                properties |= {"wf_increment": t[1] - t[0], "wf_start_offset": float(t[0]) if offset else 0.0}
            if name != timeless and (stated is True or name in (stated or ())):
                later = 0 if offset else round(1e6 * t[0])
                properties["wf_start_time"] = BEGUN + np.timedelta64(later, "us")
            objects.append(ChannelObject("bench", name, VALUES[name](t), properties=properties))
        writer.write_segment([RootObject(), *objects])
    return out.getvalue()


def hdf5(clocks):
    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        for name, t in clocks.items():
            file[f"{name}/time_s"], file[f"{name}/{LABELS[name]}"] = t, VALUES[name](t)
    return out.getvalue()


def hdf5_dated(clocks):
    """Each time counts from the date of its own task."""
    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        for name, t in clocks.items():
            file[f"{name}/time"], file[f"{name}/{LABELS[name]}"] = t - t[0], VALUES[name](t)
            start = BEGUN + np.timedelta64(round(1e6 * t[0]), "us")
            file[f"{name}/time"].attrs["units"] = f"seconds since {start}"
    return out.getvalue()


def mat(clocks, label="t_{}_s"):
    out = io.BytesIO()
    both = {label.format(name): t for name, t in clocks.items()}
    scipy.io.savemat(out, both | {LABELS[name]: VALUES[name](t) for name, t in clocks.items()})
    return out.getvalue()


def mat_struct(clocks):
    out = io.BytesIO()
    scipy.io.savemat(out, {f"daq_{name}": {"time_s": t, LABELS[name]: VALUES[name](t)} for name, t in clocks.items()})
    return out.getvalue()


def side_by_side(clocks, label, separator=",", head=(), stamp=None):
    """Return a table of text with a time directly before each quantity; a shorter pair is blank to the end."""
    stamp = stamp or (lambda t: f"{t:.6f}")
    cells = []
    for name, t in clocks.items():
        cells += [list(map(stamp, t)), [f"{value:.6f}" for value in VALUES[name](t)]]
    rows = max(map(len, cells))
    cells = [column + [""] * (rows - len(column)) for column in cells]
    labels = [each for name in clocks for each in (label.format(name), f"{name} ({UNITS[name]})")]
    lines = [*head, separator.join(labels), *map(separator.join, zip(*cells, strict=True))]
    return ("\n".join(lines) + "\n").encode()


def dates(t):
    return str(BEGUN + np.timedelta64(round(1e6 * t), "us")).replace("T", " ")


def parquet(clocks):
    out = io.BytesIO()
    columns = {}
    rows = max(t.size for t in clocks.values())
    for name, t in clocks.items():
        for label, values in ((f"{name}_time_s", t), (LABELS[name], VALUES[name](t))):
            columns[label] = np.concatenate([values, np.full(rows - t.size, np.nan)])
    pl.DataFrame(columns).write_parquet(out)
    return out.getvalue()


def scope(clocks):
    """Return TwinCAT Scope's CSV: a block of its own for each channel."""
    text = side_by_side(clocks, "Name", "\t", stamp=lambda t: f"{1e3 * t:.3f}").decode().partition("\n")
    names = "\t".join(f"Name\t{name}_{UNITS[name]}".replace("/", "") for name in clocks)
    block = "\n".join("\t".join([f"{key}\t{value}"] * 3) for key, value in
                      (("Port", "851"), ("SampleTime[ms]", "50"), ("Data-Type", "REAL32")))  # fmt: skip
    return f"Name\tScope01\nFile\tC:\\ramp.tcscope\n\n{names}\n{block}\n\n{text[2]}EOF\n".encode()


MAKERS = {
    "tdms": tdms,
    "tdms by offset": lambda clocks: tdms(clocks, offset=True),
    "tdms without a date": lambda clocks: tdms(clocks, stated=False, offset=True),
    "hdf5 groups": hdf5,
    "hdf5 dates": hdf5_dated,
    "mat names": mat,
    "mat time_Q": lambda clocks: mat(clocks, "time_{}_s"),
    "mat structs": mat_struct,
    "csv equal labels": lambda clocks: side_by_side(clocks, "Time (s)"),
    "csv names": lambda clocks: side_by_side(clocks, "time_{} (s)"),
    "csv names behind": lambda clocks: side_by_side(clocks, "{} time [s]", ";"),
    "csv dates": lambda clocks: side_by_side(clocks, "Time", stamp=dates),
    "csv times of day": lambda clocks: side_by_side(clocks, "Time", stamp=lambda t: dates(t)[11:]),
    "parquet": parquet,
    "TwinCAT Scope": scope,
}


@pytest.fixture
def read(tmp_path):
    def read(content, **keywords):
        (tmp_path / "ramp.csv").write_bytes(content)
        return read_ramp_file(tmp_path / "ramp.csv", **keywords)

    return read


@pytest.mark.parametrize("clocks", CLOCKS)
@pytest.mark.parametrize("maker", MAKERS)
def test_each_channel_is_read_at_its_own_time(read, maker, clocks):
    test, clocks = read(MAKERS[maker](CLOCKS[clocks])), CLOCKS[clocks]
    zero = clocks["u"][0] if maker in ("tdms", "hdf5 dates", "csv dates", "csv times of day") else 0.0
    time = test.time + zero
    assert time[0] >= max(t[0] for t in clocks.values()) - 1e-5
    assert time[-1] <= min(t[-1] for t in clocks.values()) + 1e-5
    assert test.rows_read >= np.count_nonzero((clocks["u"] >= time[0] - 1e-5) & (clocks["u"] <= time[-1] - 1e-5))
    np.testing.assert_allclose(test.u, command(time), atol=1e-4)
    # Linear interpolation cuts the kinks of the flow, by less than half a step.
    np.testing.assert_allclose(test.q, L_MIN * flow(time), atol=L_MIN * 2.0 * max(np.diff(clocks["Q"])))
    assert np.mean(test.q / L_MIN - flow(time)) == pytest.approx(0, abs=5e-3)
    np.testing.assert_allclose(test.dp, 1e6 * VALUES["dP"](time), rtol=1e-5)


@pytest.mark.parametrize("maker", MAKERS)
def test_equal_clocks_change_no_sample(read, maker):
    t = clock()
    test = read(MAKERS[maker](dict.fromkeys(VALUES, t)))
    assert test.rows_read == t.size
    np.testing.assert_allclose(test.q, L_MIN * flow(t), atol=1e-6 * L_MIN)


def test_no_reading_is_made_up_over_a_pause(read):
    t = clock()
    paused = t[(t < 5) | (t > 6.5)]
    test = read(mat({"u": t, "dP": t, "Q": paused}))
    assert not np.any((test.time > 5.0) & (test.time < 6.45)) and test.rows_read == paused.size


EVEN = {**LATE, "Q": clock(0.24, end=14.24)}
NAMELESS = mat(EVEN).replace(b"t_u_s", b"t_x_s").replace(b"t_Q_s", b"t_y_s")


def test_equal_times_may_have_any_name(read):
    equal = mat(dict.fromkeys(VALUES, clock())).replace(b"t_u_s", b"t_x_s").replace(b"t_Q_s", b"t_y_s")
    assert read(equal, columns={"time": "t_x_s"}).rows_read == clock().size


def test_init_takes_the_time_of_the_command(tmp_path):
    for number, (maker, label) in enumerate((("mat names", "t_u_s"), ("csv equal labels", "Time (s)#1"))):
        path = tmp_path / f"{number}.csv"
        path.write_bytes(MAKERS[maker](LATE))
        assert propose_columns(path, {}).known["time"].label == label
    content = side_by_side(LATE, "Time (s)").replace(b"u (V)", b"Dev1/ao0 (V)", 1)
    path.write_bytes(content)
    look = propose_columns(path, {})
    assert look.proposed["time"].label == "Time (s)#1" and not look.unclear


def test_equal_labels_of_time_mean_the_command_s(read):
    content = side_by_side(LATE, "X_Value").replace(b"u (V)", b"AO0", 1)
    test = read(content, columns={"time": "X_Value:s", "u": "AO0:V"})
    np.testing.assert_allclose(test.q, L_MIN * flow(test.time), atol=0.1 * L_MIN)


def csv(**blank):
    """Return a CSV with one time, in which the last rows of some columns are blank."""
    t = clock(step=0.01)
    cells = {LABELS[name]: [f"{value:.4f}" for value in (t if name == "time" else VALUES[name](t))] for name in LABELS}
    for name, count in blank.items():
        cells[LABELS[name]][-count:] = [""] * count
    return "\n".join([",".join(cells), *map(",".join, zip(*cells.values(), strict=True)), ""]).encode()


@pytest.mark.parametrize("again", [1, 2])
@pytest.mark.parametrize("label", ["u_V", "dP_MPa", "Q_Lmin"])
def test_a_value_in_the_last_rows_of_a_column_that_ended_is_no_reason_to_read_it(read, label, again):
    """Seeded: a threshold was 83 mV above the truth, without a word."""
    whole = [line.split(",") for line in csv().decode().splitlines()]
    for line in whole[-30:-again]:
        line[whole[0].index(label)] = ""
    with pytest.raises(InputError, match=f"'{label}' ends at row .*, 30 rows .* before the"):
        read("\n".join(map(",".join, whole)).encode())


def test_rows_that_are_blank_in_all_columns_end_none(read):
    whole = csv().decode().splitlines()
    assert read("\n".join([*whole[:-30], *([",,,"] * 28), *whole[-2:]]).encode()).rows_read == 1372


def test_rows_that_a_logger_wrote_in_part_are_cut(read):
    assert read(csv(Q=1)).rows_read == 1399
    assert read(csv(u=1, dP=1, Q=1)).rows_read == 1399
    assert read(csv(u=50, dP=50, Q=50)).rows_read == 1350
    whole = csv().decode().splitlines()
    tenth = [line if index % 10 == 1 else line.rpartition(",")[0] + "," for index, line in enumerate(whole)]
    assert read("\n".join([whole[0], *tenth[1:]]).encode()).rows_read == 140
    failed = [line if index < 1300 else line.rpartition(",")[0] + ",-9999" for index, line in enumerate(whole)]
    assert read("\n".join(failed).encode()).rows_read == 1299


def labview(columns="One", segments=1, comma=True, dates=("08:00:00",) * 3, runs_on=True, delta=(0.05,) * 3, late=0.0):
    """Return a LabVIEW measurement file; `late` is when the flow's own clock begins, s."""
    width = 6 if columns == "Multi" else 3
    head = ["LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", f"Decimal_Separator\t{',.'[not comma]}",
            f"X_Columns\t{columns}", "Date\t2026/02/03", "***End_of_Header***\t", "\t"]  # fmt: skip
    times = {"u": clock(), "dP": clock(), "Q": clock(late, step=delta[2])}
    lines = head
    rows = min(t.size for t in times.values())
    bounds = np.linspace(0, rows, segments + 1).astype(int)
    for begin, end in pairwise(bounds):
        zero = 0.0 if runs_on else times["u"][begin]
        start = [f"{date}.{round(1e7 * (times['u'][begin] - times['u'][0]) * (not runs_on)) % 10**7:07d}000000001"
                 if float(times["u"][begin]) < 1 or runs_on else f"08:00:{times['u'][begin]:016.13f}"
                 for date in dates]  # fmt: skip
        keys = {"Date": ["2026/02/03"] * 3, "Time": start, "Y_Unit_Label": ["Volts", "MPa", "L/min"],
                "X_Dimension": ["Time"] * 3, "X0": [f"{times['u'][begin] - zero:.16E}"] * 3,
                "Delta_X": [f"{each:.6f}" for each in delta]}  # fmt: skip
        between = "\t\t" if columns == "Multi" else "\t"
        lines += ["Channels\t3" + "\t" * width]
        lines += [f"{key}\t{between.join(cells)}\t" for key, cells in keys.items()]
        x = ["X_Value"] * 3 if columns == "Multi" else ["X_Value", "", ""]
        labels = [each for pair in zip(x, ("AO0", "AI7", "AI3"), strict=True) for each in pair if each]
        lines += ["***End_of_Header***" + "\t" * width, "\t".join([*labels, "Comment"])]
        for row in range(begin, end):
            cells = []
            for index, (name, t) in enumerate(times.items()):
                if columns == "Multi" or not index:
                    cells.append("" if columns == "No" else f"{t[row] - zero:.6f}")
                cells.append(f"{VALUES[name](t[row]):.6f}")
            lines.append("\t".join(cells) + ("\tseen by the operator" if row == 7 else ""))
        lines.append("")
    text = "\r\n".join(lines)
    return (text.replace(".", ",") if comma else text).encode()


LABVIEW = {
    "One": labview(),
    "No": labview("No"),
    "Multi": labview("Multi"),
    "points": labview(comma=False),
    "segments": labview(segments=4),
    "segments without X": labview("No", segments=3),
    "segments of a clock each": labview(segments=3, runs_on=False),
    "Multi, segments of a clock each": labview("Multi", segments=5, runs_on=False),
    "Multi, flow late": labview("Multi", late=0.317),
    "Multi, slow flow": labview("Multi", delta=(0.05, 0.05, 0.025)),
    "No, fast flow": labview("No", delta=(0.05, 0.05, 0.025)),
    "One, fast flow": labview("One", delta=(0.05, 0.05, 0.025)),
}


@pytest.mark.parametrize("name", LABVIEW)
def test_labview_measurement_files(read, name):
    test = read(LABVIEW[name], columns={"u": "AO0", "dP": "AI7", "Q": "AI3"})
    np.testing.assert_allclose(test.u, command(test.time), atol=1e-4)
    np.testing.assert_allclose(test.q, L_MIN * flow(test.time), atol=0.12 * L_MIN)
    assert np.mean(test.q / L_MIN - flow(test.time)) == pytest.approx(0, abs=5e-3)
    assert test.started is not None and test.time[-1] > 6.5


def test_labview_channels_that_begin_at_different_times_of_one_X_column(read):
    late = labview("No", dates=("08:00:00", "08:00:00", "08:00:02"))
    test = read(late, columns={"u": "AO0", "dP": "AI7", "Q": "AI3"})
    np.testing.assert_allclose(test.q, L_MIN * flow(test.time - 2), atol=0.12 * L_MIN)
    early = labview("One", dates=("08:00:02", "08:00:00", "08:00:00"))
    one = read(early, columns={"u": "AO0", "dP": "AI7", "Q": "AI3"})
    np.testing.assert_allclose(one.q, L_MIN * flow(one.time + 2), atol=0.12 * L_MIN)
