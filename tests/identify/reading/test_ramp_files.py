"""Ramp files: every reading that must work, every one that must not and says where, and the round trip."""

import gzip
import io
import re
import zipfile

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.ramp_files import ramp_file_bytes, read_ramp_file

ROWS = 30
TIME = np.arange(ROWS) / 25
U = np.linspace(0, 10, ROWS)
DP = np.linspace(1.0, 0.9, ROWS)
Q = np.clip(4 * (U - 5), 0, None)
HEADER = "time_s,u_V,dP_MPa,Q_Lmin"
L_MIN = 1e-3 / 60


def table(header=HEADER, columns=(TIME, U, DP, Q), separator=",", comma=False, end="\n"):
    """Return the text of a ramp file; `comma` writes decimal commas."""
    rows = [[f"{value:.6g}" for value in row] for row in zip(*columns, strict=True)]
    lines = [header, *(separator.join(cells).replace(".", "," if comma else ".") for cells in rows)]
    return end.join(lines) + end


def zipped(name, content="") -> bytes:
    """Return a zip archive of one file."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr(name, content)
    return out.getvalue()


@pytest.fixture
def read(tmp_path):
    def read(content, **keywords):
        path = tmp_path / "ramp.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_ramp_file(path, **keywords)

    return read


@pytest.fixture
def refusal(read):
    """Return the message with which a file is refused."""

    def refusal(content, **keywords):
        with pytest.raises(InputError) as caught:
            read(content, **keywords)
        return str(caught.value)

    return refusal


def assert_is_the_ramp(test, rows=slice(None)):
    np.testing.assert_allclose(test.time, TIME[rows], rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(test.u, U[rows], rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(test.dp, 1e6 * DP[rows], rtol=1e-5)
    np.testing.assert_allclose(test.q, L_MIN * Q[rows], rtol=1e-5, atol=1e-15)


def of_unit(label, column, factor):
    """Return the ramp with one column in another unit."""
    columns = [TIME, U, DP, Q]
    columns[column] = factor * columns[column]
    labels = HEADER.split(",")
    labels[column] = label
    return table(",".join(labels), columns)


def in_quotes():
    return re.sub(r"[^,\n]+", lambda cell: f'"{cell[0]}"', table())


#: The same recording, written in many ways.
READ = {
    **{f"commas and {separator!r}": table(HEADER.replace(",", separator), separator=separator, comma=True)
       for separator in ";\t"},
    **{f"lines that end in {end!r}": table(end=end) for end in ("\n", "\r\n", "\r")},
    **{header: table(header) for header in (
        "time [s],u [V],dP [MPa],Q [L/min]", "t (s),u (V),dP (MPa),Q (l/min)", "t_s,U_V,dp_MPa,q_Lmin",
        "Time[s],Command[V],Delta p[MPa],Flow[lpm]", "time_s,u_V,Δp_MPa,Q_l_min", "time_s , u_V , dP_MPa , Q_LPM",
    )},
    **{label: of_unit(label, column, factor) for label, column, factor in (
        ("time_ms", 0, 1e3), ("time [min]", 0, 1 / 60), ("u_mV", 1, 1e3),
        ("u [%]", 1, 10), ("u [pct]", 1, 10), ("u [percent]", 1, 10),
        ("dP_bar", 2, 10), ("dP [kPa]", 2, 1e3), ("dP (psi)", 2, 145.03773773), ("dP [N/mm2]", 2, 1),
        ("dP [Pa]", 2, 1e6),
        ("Q [m3/s]", 3, L_MIN), ("Q [m³/h]", 3, 0.06), ("Q [cm3/s]", 3, 1000 / 60), ("Q [gpm]", 3, 1 / 3.785411784),
        ("Q_mL/min", 3, 1e3),
    )},
    "both ports": table("time_s,u_V,pA_bar,pB_MPa,Q_Lmin", (TIME, U, 10 * (DP + 1), DP * 0 + 1, Q)),
    "quotes": in_quotes(),
    "quotes and blanks": in_quotes().replace(",", ", "),
    "quoted commas": "\n".join([HEADER, *(
        ",".join(f'"{value:.6g}"'.replace(".", ",") for value in row) for row in zip(TIME, U, DP, Q, strict=True))]),
    "other columns": "\n".join(["sample,time_s,oil temperature,u_V,dP_MPa,note,Q_Lmin,,", *(
        f"{row},{TIME[row]},40.1,{U[row]},{DP[row]},ok,{Q[row]},," for row in range(ROWS))]),
    "T and Q_set behind": table(f"{HEADER},T_degC,Q_set", (TIME, U, DP, Q, 0 * Q + 40, 0 * Q + 7)),
    "T before, Q_set behind": table(f"T_degC,{HEADER},Q_set", (0 * Q + 40, TIME, U, DP, Q, 0 * Q + 7)),
}  # fmt: skip


@pytest.mark.parametrize("name", READ)
def test_it_is_read_as_it_is(read, name):
    assert_is_the_ramp(read(READ[name]))


def test_per_cent_are_of_full_command(read):
    np.testing.assert_allclose(read(READ["u [%]"], u_max=5.0).u, U / 2, rtol=1e-5)


def test_a_file_without_pressure_has_none(read):
    assert read(table("time_s,u_V,Q_Lmin", (TIME, U, Q))).dp is None


def test_comments_and_blank_lines_anywhere(read):
    lines = table().splitlines()
    lines.insert(10, "# valve 12; bench 3, oil at 40 °C")
    lines.insert(5, "   ")
    lines.insert(5, ",,,")  # what a spreadsheet makes of a blank line
    text = '# first\n\n  # second\n"# third; saved again by a spreadsheet",,,\n' + "\n".join(lines) + "\n\n# last"
    assert_is_the_ramp(read(text))


@pytest.mark.parametrize("before", ["", "# bench 3\n\n"])
@pytest.mark.parametrize(
    "spoil", [lambda text: text, lambda text: text.replace(",1,", ",,", 1), lambda text: text[:-1]]
)
def test_plain_rows_are_read_as_rows_with_a_comment_are(read, spoil, before):
    text = before + spoil(table())
    plain, commented = read(text), read(text + "\n# the end\n")
    for name in ("time", "u", "q", "dp"):
        np.testing.assert_array_equal(getattr(plain, name), getattr(commented, name))


@pytest.mark.parametrize("blank", ["", "  ", "nan", "NaN", '""'])
def test_blank_cells_are_missing_samples(read, blank):
    lines = table().splitlines()
    for row, column in ((3, 0), (7, 1), (8, 3)):
        cells = lines[row].split(",")
        cells[column] = blank
        lines[row] = ",".join(cells)
    kept = [row for row in range(ROWS) if row + 1 not in (3, 7, 8)]
    assert_is_the_ramp(read("\n".join(lines)), kept)


@pytest.mark.parametrize("compress", [False, True])
def test_what_is_written_reads_back(read, compress):
    columns = {"time_s": TIME, "u_V": U, "dP_MPa": DP, "Q_Lmin": Q}
    content = ramp_file_bytes(columns, ("SIMULATED", "not a measurement"), compress=compress)
    assert content == ramp_file_bytes(columns, ("SIMULATED", "not a measurement"), compress=compress)
    test = read(content)
    half_a_digit = 0.5001e-4
    np.testing.assert_allclose(test.u, U, atol=half_a_digit)
    np.testing.assert_allclose(test.dp, 1e6 * DP, atol=1e6 * half_a_digit)
    np.testing.assert_allclose(test.q, L_MIN * Q, atol=L_MIN * half_a_digit)


def test_arrays_are_read_only_and_the_file_is_known_by_its_hash(read):
    test = read(table())
    assert test.source == "ramp.csv" and len(test.sha256) == 64
    with pytest.raises(ValueError, match="read-only"):
        test.u[0] = 1


def spoiled(row, column, cell, before=""):
    """Return a ramp file with one cell replaced; `row` counts from the header, 0."""
    lines = table().splitlines()
    cells = lines[row].split(",")
    cells[column] = cell
    lines[row] = ",".join(cells)
    return before + "\n".join(lines)


@pytest.mark.parametrize("separator", ["\x0b", "\x0c", "\x1c", "\x85", "\u2028"])
def test_rows_are_counted_as_an_editor_does(refusal, separator):
    assert "row 6," in refusal(spoiled(4, 1, "x", before=f"# a{separator}b\n"))


def test_long_cells_and_many_columns_are_cut(refusal):
    assert len(refusal(spoiled(4, 1, "x" * 10000))) < 400
    assert len(refusal(",".join(f"channel {n}" for n in range(1000)) + "\n")) < 500


@pytest.mark.parametrize(
    ("name", "words"), [("a.dxd", "DEWESoft"), ("a.D7D", "DEWESoft"), ("a.psdata", "of an oscilloscope")]
)
def test_a_binary_recording_is_named_by_its_suffix(tmp_path, name, words):
    (tmp_path / name).write_bytes(zipped("data") if name == "a.psdata" else b"\x03\0\0DX" + bytes(90))
    with pytest.raises(InputError, match=f"{name}' is a recording {words}|{name}' is a {words} recording; export it"):
        read_ramp_file(tmp_path / name)
    (tmp_path / name).write_text(table())
    assert_is_the_ramp(read_ramp_file(tmp_path / name))  # text is text, whatever it is called


def test_gzip_with_a_changed_byte_is_refused(refusal):
    content = bytearray(gzip.compress(table().encode(), mtime=0))
    for place in range(10, len(content), 7):
        changed = content.copy()
        changed[place] ^= 0x10
        assert "gzip" in refusal(bytes(changed))
