"""Files made to break their reader: name -> what makes it, and the words of the refusal.

Each is small where it can be: a bomb is a few kilobytes that unpack to gigabytes. ``None`` for the words: a result is
right, or any refusal of one line is.
"""

import gzip
import io
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import polars as pl

from tests.identify.reading.test_file_formats import COLUMNS, frame, hdf5, mat, tdms
from tests.identify.reading.test_ramp_files import ROWS, TIME, U, table, zipped

CSV = table().encode()
HEAD, _, BODY = CSV.partition(b"\n")
MIB = 1 << 20


def repeated(piece: bytes, times: int, head: bytes = b"") -> bytes:
    """Return the gzip of a head and a piece many times over, in as many members."""
    return gzip.compress(head, mtime=0) + gzip.compress(piece, mtime=0) * times


def with_hdf5(make: Callable[[h5py.File], None]) -> bytes:
    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        make(file)
    return out.getvalue()


def linked_elsewhere(file: h5py.File) -> None:
    for name in COLUMNS:
        file[name] = h5py.ExternalLink("/etc/passwd", "/x")
        file[f"soft_{name}"] = h5py.SoftLink(f"/soft_{name}")
    file["loop/again"] = h5py.SoftLink("/loop")


def hard_loop(file: h5py.File) -> None:
    group = file.create_group("a")
    group["b"] = group
    for name, data in COLUMNS.items():
        group[name] = data


def stored_elsewhere(file: h5py.File) -> None:
    for name in COLUMNS:
        file.create_dataset(name, (ROWS,), "f8", external=[("/dev/zero", 0, 8 * ROWS)])


def virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout((ROWS,), "f8")
    layout[:] = h5py.VirtualSource("other.h5", "x", (ROWS,))
    for name in COLUMNS:
        file.create_virtual_dataset(name, layout)


def never_written(file: h5py.File) -> None:
    for name in COLUMNS:
        file.create_dataset(name, (10**13,), "f8", chunks=(1000,))


def huge_chunk(file: h5py.File) -> None:
    for name in COLUMNS:
        file.create_dataset(name, (10**8,), "f8", chunks=(10**8,), compression="gzip")
        file[name].id.write_direct_chunk((0,), zlib.compress(bytes(1000)))


def cell_of_cells(deep: int) -> bytes:
    """Return a MAT file of one cell in another, so deep that the stack of its reader ends."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)

    head = element(6, struct.pack("<II", 1, 0)) + element(5, struct.pack("<ii", 1, 1)) + element(1, b"")
    content = bytearray()
    parts = []
    size = len(element(14, head))
    for _ in range(deep):
        parts.append(struct.pack("<II", 14, size))
        size += 8 + len(head)
    for part in reversed(parts):
        content += part + head
    return b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<HH", 0x0100, 0x4D49) + bytes(content)


def huge_cell() -> bytes:
    """Return a MAT file whose cell says that it has two thousand million others."""
    content = mat({"c": np.array([1.0, 2.0], dtype=object)})
    at = content.index(struct.pack("<ii", 1, 2))
    return content[:at] + struct.pack("<ii", 2**16, 2**15) + content[at + 8 :]


def segments(content: bytes, ending: int) -> bytes:
    """Return a TDMS file whose first segment says that it ends elsewhere."""
    return content[:12] + struct.pack("<q", ending) + content[20:]


def object_frame() -> bytes:
    nested = {"list": [[1.0, 2.0]] * ROWS, "struct": [{"a": 1}] * ROWS, "text": ["x"] * ROWS}
    return frame("write_parquet", {**COLUMNS, **nested})


def wide_frame() -> bytes:
    return frame("write_parquet", {f"c{index}": [0.0] for index in range(5000)})


def times_of_day() -> bytes:
    """Return a Parquet file whose clock is one of the wall."""
    seconds = pl.Series((TIME * 1e9).astype("i8")).cast(pl.Time)
    return frame(
        "write_parquet", {"time": seconds, **{name: data for name, data in COLUMNS.items() if name != "time_s"}}
    )


def dictionary_frame() -> bytes:
    out = io.BytesIO()
    data = pl.DataFrame({**COLUMNS, "mode": ["a", "b"] * (ROWS // 2)}).with_columns(pl.col("mode").cast(pl.Categorical))
    data.write_ipc(out)
    return out.getvalue()


def long_frame(write: str, rows: int = 3 * 10**8) -> bytes:
    out = io.BytesIO()
    zeros = pl.select(pl.repeat(0.0, 10**6).alias("u_V")).lazy()
    data = pl.concat([zeros] * 100).collect()
    getattr(data, write)(out, compression="zstd")
    return out.getvalue()


MANY_NAMES = b",".join(b"c%d" % index for index in range(10**6))
#: Text, and what looks like it.
TEXTS: dict[str, tuple[Callable[[], bytes], str | None]] = {
    "a mark": (lambda: b"\xef\xbb\xbf", "is empty"),
    "two marks": (lambda: b"\xef\xbb\xbf\xef\xbb\xbf" + CSV, None),
    "NUL": (lambda: CSV + b"\0", "is not a text file"),
    "UTF-16": (lambda: CSV.decode().encode("utf-16"), None),
    "UTF-16 of half characters": (lambda: b"\xff\xfe" + b"\x00\xd8" * MIB, "is not a text file"),
    "UTF-16 of other planes": (lambda: ("\U0001f600" * MIB).encode("utf-16"), None),
    "UTF-32": (lambda: CSV.decode().encode("utf-32"), "is not a text file"),
    "half a character": (lambda: CSV.replace(b"time", b"\xed\xa0\x80"), "no column of time"),
    "overlong": (lambda: CSV.replace(b"time", b"\xc0\x80"), "no column of time"),
    "a preamble of a million lines": (lambda: b"Channel;1\n" * MIB + CSV, None),
    "a foot of a million lines": (lambda: CSV + b"the end\n" * MIB, "has 1 cell, "),
    "stamps of a million days": (lambda: b"time,u_V,dP_MPa,Q_Lmin\n" + b"".join(
        b"%d-01-%02d 00:00:00,1,1,1\n" % (year, day) for year in range(1, 9999) for day in range(1, 9)), None),
    "mixed line ends": (lambda: CSV.replace(b"\n", b"\r\n", 9).replace(b"\r\n", b"\r", 3), None),
    "line separators of Unicode": (lambda: CSV.replace(b"\n", "\u2028".encode(), 3), None),
    "1e400": (lambda: HEAD + b"\n0,1e400,1,1\n" + BODY, None),
    "minus infinity": (lambda: HEAD + b"\n0,-inf,1,1\n" + BODY, None),
    "1e308 MPa": (lambda: HEAD + b"\n0,1,1e308,1\n" + BODY, None),
    "NaN": (lambda: HEAD + b"\n-0,nan,-0,NaN\n" + BODY, None),
    "a number of 100 kB": (lambda: HEAD + b"\n0," + b"9" * 100_000 + b",1,1\n" + BODY, None),
    "a million columns": (lambda: MANY_NAMES + b"\n" + MANY_NAMES, "has 1000000 cells"),
    "a million words": (lambda: MANY_NAMES.replace(b",", b" "), "has 1000000 cells"),
    "a million quotes": (lambda: b'"' * 10**6 + b"\n" + BODY, None),
    "a quote that is never closed": (lambda: HEAD + b'\n"' + b"1" * 200_000 + b"\n" + BODY, "field larger than"),
    "a header of brackets": (lambda: b"u" + b"[" * 900_000 + b" Q\n" + BODY, None),
    "a header of open units": (lambda: b"u[ " * 100_000 + b"\n" + BODY, None),
    "a label of brackets": (lambda: b"(" * 300_000 + b"x,u_V\n1,2\n", "has no column of"),
    "a label of blanks": (lambda: b"u" + b" " * 500_000 + b"(,Q\n" + BODY, None),
    "a label of underscores": (lambda: b"u" + b"_" * 500_000 + b",Q\n" + BODY, None),
    "one line of 100 MB": (lambda: b"1" * (100 * MIB), "has a line of more than"),
    "blanks": (lambda: b" " * (17 * MIB), None),
    "empty lines": (lambda: b"\n" * (9 * MIB), "comments and blank lines"),
    "comments": (lambda: b"#\n" * (5 * MIB), "comments and blank lines"),
    "comments behind the header": (lambda: HEAD + b"\n" + b"#\n" * MIB, "0 complete rows"),
    "ragged rows": (lambda: HEAD + b"\n" + b"1,2\n" * MIB, "has 2 cells, expected 4"),
    "unit separators": (lambda: CSV.replace(b",1", b",1\x1f2"), None),
    "gzip of lines": (lambda: repeated(b"\n" * MIB, 2000), None),
    "gzip of comments": (lambda: repeated(b"# x\n" * (MIB // 4), 40, HEAD + b"\n"), "unpacks to more than 64 times"),
    "gzip of rows": (lambda: repeated(b"0,0,1,0\n" * (MIB // 8), 40, HEAD + b"\n"), "unpacks to more than 64 times"),
    "gzip of one line": (lambda: repeated(b"1" * MIB, 2000), "unpacks to more than 64 times"),
    "gzip of gzip": (lambda: gzip.compress(gzip.compress(CSV, mtime=0), mtime=0), "is not a text file"),
    "gzip and gzip": (lambda: gzip.compress(CSV, mtime=0) + gzip.compress(BODY, mtime=0), "the time goes back"),
    "gzip and something": (lambda: gzip.compress(CSV, mtime=0) + b"something", "not a whole gzip file"),
    "gzip of nothing": (lambda: gzip.compress(b"", mtime=0), "is empty"),
    "zip behind gzip": (lambda: gzip.compress(zipped("a.csv", CSV), mtime=0), "zip archive"),
}  # fmt: skip
#: Of programs; what crashes or fills a library is refused in the words of `binary_table`.
BINARIES: dict[str, tuple[Callable[[], bytes], str | None]] = {
    "HDF5 with links elsewhere": (lambda: with_hdf5(linked_elsewhere), "holds no columns"),
    "HDF5 with a loop": (lambda: with_hdf5(hard_loop), None),
    "HDF5 stored elsewhere": (lambda: with_hdf5(stored_elsewhere), "lie in another file"),
    "HDF5 virtual": (lambda: with_hdf5(virtual), "lie in another file"),
    "HDF5 never written": (lambda: with_hdf5(never_written), "has 10000000000000 samples"),
    "HDF5 of one chunk": (lambda: with_hdf5(huge_chunk), "chunks of more than 64 MiB"),
    "Parquet of many columns": (wide_frame, "more than 4096 columns"),
    "HDF5 with 'a' as name": (lambda: hdf5({"a\nb\x1b[2J": U}), "no column of"),
    "MAT with cells and handles": (lambda: mat({**COLUMNS, "c": np.array([1.0, "x", [2.0]], dtype=object)}), None),
    "MAT of cells in cells": (lambda: cell_of_cells(100_000), "is not a MATLAB file that can be read"),
    "MAT of a huge cell": (huge_cell, "is not a MATLAB file that can be read"),
    "MAT with one name twice": (lambda: mat() + mat()[128:], "is not a MATLAB file that can be read (Duplicate"),
    "MAT 4 of many rows": (lambda: struct.pack("<5i", 0, 2**31 - 1, 2**31 - 1, 0, 2) + b"x\0", "is not a MATLAB file"),
    "TDMS cut off": (lambda: tdms()[:-50], "is cut off: its last segment is not whole"),
    "TDMS cut off between columns": (lambda: tdms()[: -8 * ROWS], "is cut off"),
    "TDMS of a crashed program": (lambda: segments(tdms(), -1), "is cut off"),
    "TDMS that goes on for ever": (lambda: segments(tdms(), 0), None),
    "TDMS with a clock of no number": (lambda: tdms(waveform=True).replace(struct.pack("<d", 0.04), b"\xff" * 8), None),
    "Parquet with lists and structs": (object_frame, None),
    "Parquet of zeros": (lambda: long_frame("write_parquet"), "samples, which its"),
    "Feather of zeros": (lambda: long_frame("write_ipc"), "samples, which its"),
    "Feather with a dictionary": (dictionary_frame, None),
    "Parquet of times of day": (times_of_day, None),
}  # fmt: skip


def write(name: str, folder: Path) -> Path:
    """Write one of them, and return where."""
    make, _ = {**TEXTS, **BINARIES}[name]
    path = folder / ("hostile.mat" if "MAT" in name else "hostile.csv")
    path.write_bytes(make())
    return path
