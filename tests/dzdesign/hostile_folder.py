"""A folder of hostile things: each runs, reads or writes what it must not, if a command is wrong about it.

What would be run leaves a file in the folder `canary`; what would be written lies in `outside`.
"""

import gzip
import io
import json
import os
import pickle
import shutil
import socket
import subprocess
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_types import to_json_bytes
from tests.support.golden_firmware import golden_compensator
from tests.support.paths import GOLDENS

#: Modules that are imported by every command, or by a library of it, from the folder that it stands in if it may.
MODULES = (
    "json", "logging", "struct", "zipfile", "tomllib", "numpy", "scipy", "casadi", "polars", "h5py", "matplotlib",
    "jinja2", "pint", "ziglang", "sitecustomize", "usercustomize", "conftest", "dzdesign", "__main__", "setup",
)  # fmt: skip
#: Programs that a command may call by name.
PROGRAMS = ("gcc", "cc", "clang", "zig", "octave-cli", "git", "qemu-system-arm", "frama-c")
#: What no name may do on a terminal, in a shell, a page, a template or a spreadsheet.
NAMES = (
    "{{7*7}}", "{% raw %}", "${HOME}", "%s%n", "$(touch CANARY)", "`touch CANARY`", ";touch CANARY;", "|touch CANARY",
    "<img src=x onerror=alert(1)>", "<script>alert(1)<", "=cmd|' C calc'!A0", "@SUM(1+1)", "+1+1", "-rf", "--config",
    "a\nb", "\x1b[2J\x1b]0;title\x07", "\u202egpj", "'; DROP TABLE valves", "%2e%2e", "CON", "x" * 200,
    "a *) END_FUNCTION (* ??", "\u2028\x85b",
)  # fmt: skip
#: A library of CasADi's, which it looks for in folders.
LIBRARIES = ("libcasadi_nlpsol_ipopt.so", "libcasadi_conic_daqp.so", "libgcc_s.so.1")
RAMP = b"time_s,u_V,dP_MPa,Q_Lmin\n" + b"".join(b"%d,%.1f,1,0\n" % (n, n / 10) for n in range(60))
RECORD = {"serial": "=cmd|' /C calc'!A0", "customer": "</script><script>alert(1)</script>", "bench": "{{7*7}} @SUM(1)"}


@dataclass(frozen=True, kw_only=True)
class HostileFolder:
    """The folder, what lies around it, and the files in it that a command can be given."""

    root: Path
    place: Path
    outside: Path
    canary: Path
    #: Names below `place`.
    inputs: tuple[str, ...]

    def things(self) -> int:
        """Return how many hostile things there are."""
        return sum(1 for _ in self.place.rglob("*")) + len(NAMES)


class Payload:
    """An object that runs a command as it is unpickled."""

    def __init__(self, canary: Path) -> None:
        self.canary = canary

    def __reduce__(self) -> tuple[object, ...]:
        return os.system, (f"touch '{self.canary}/pickle'",)


def hostile_folder(root: Path) -> HostileFolder:
    """Make it."""
    place, outside, canary = root / "place", root / "outside", root / "canary"
    for each in (place, outside, canary):
        each.mkdir(parents=True)
    (outside / "secret.json").write_text('{"secret": "SECRET"}', encoding="utf-8")
    shutil.copy(GOLDENS / "valve.json", outside / "valve.json")
    _modules(place, canary)
    _settings(place, outside, canary)
    inputs = [*_files(place, canary), *_links(place, outside), *_folders(place, outside)]
    for number, name in enumerate(NAMES):
        named = name.replace("CANARY", str(canary / "name").replace("/", "\\x2f"))
        (place / f"{named}.csv").write_bytes(RAMP + b"%d" % number)
        inputs.append(f"{named}.csv")
    return HostileFolder(root=root, place=place, outside=outside, canary=canary, inputs=tuple(inputs))


def _modules(place: Path, canary: Path) -> None:
    for name in MODULES:
        text = f"open({str(canary / name)!r}, 'w').close()\nraise ImportError('taken from the working folder')\n"
        (place / f"{name}.py").write_text(text, encoding="utf-8")
    (place / "hostile.pth").write_text(f"import os; open({str(canary / 'pth')!r}, 'w').close()\n", encoding="utf-8")
    for name in PROGRAMS:
        (place / name).write_text(f"#!/bin/sh\ntouch '{canary / name}'\n", encoding="utf-8")
        (place / name).chmod(0o755)
    compiler = shutil.which("gcc") or shutil.which("cc")
    source = (
        f'#include <stdlib.h>\n__attribute__((constructor)) static void go(void) {{ system("touch {canary}/so"); }}\n'
    )
    for name in LIBRARIES if compiler else ():
        subprocess.run([str(compiler), "-shared", "-fPIC", "-xc", "-", "-o", str(place / name)], input=source.encode(),
                       check=True, cwd=place.parent)  # fmt: skip


def _settings(place: Path, outside: Path, canary: Path) -> None:
    """Write files that libraries and programs look for where they stand."""
    touch = f"touch '{canary}/{{}}'"
    for name, text in {
        "ipopt.opt": f"output_file {outside}/ipopt.txt\nfile_print_level 5\nmax_iter 0\n",
        ".octaverc": f'system("{touch.format("octaverc")}");\n',
        ".gdbinit": f"shell {touch.format('gdbinit')}\n",
        "Makefile": f"all:\n\t{touch.format('make')}\n",
        "stdint.h": '#error "taken from the working folder"\n',
        "stdbool.h": '#error "taken from the working folder"\n',
        "specs": "*cpp:\n-include /etc/passwd\n",
        ".git/config": f'[core]\n\tfsmonitor = "{touch.format("fsmonitor")}"\n\thooksPath = .git/hooks\n',
        ".git/HEAD": "ref: refs/heads/main\n",
        ".git/hooks/post-index-change": f"#!/bin/sh\n{touch.format('hook')}\n",
        ".env": f"PYTHONSTARTUP={place}/json.py\n",
        "dzdesign.toml": f'output = "{outside}/written.json"\nplots = "{outside}/plots"\nu-max = "10 V"\n',
    }.items():
        path = place / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        path.chmod(0o755)
    (place / "matplotlibrc").write_bytes(b"text.usetex: True\nbackend: module://conftest\n\xff\n")


def _files(place: Path, canary: Path) -> list[str]:
    """Write files that break, fill or run their reader."""
    packed = io.BytesIO()
    np.save(packed, np.array([Payload(canary)], dtype=object), allow_pickle=True)
    pickled, lol = pickle.dumps(Payload(canary)), "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 9}">' for n in range(1, 10))
    bomb = f'<?xml version="1.0"?><!DOCTYPE l [<!ENTITY l0 "l">{lol}]><l>&l9;</l>'.encode()
    sheet = io.BytesIO()
    with zipfile.ZipFile(sheet, "w") as archive:
        archive.writestr("xl/workbook.xml", bomb)
        archive.writestr("../../outside/unpacked", b"x")
    valve = json.loads((GOLDENS / "valve.json").read_bytes())
    contents: dict[str, bytes] = {
        "pickle.npy": packed.getvalue(), "pickle.mat": pickled, "pickle.json": pickled, "pickle.csv": pickled,
        "entities.xml": bomb, "entities.json": bomb, "sheet.xlsx": sheet.getvalue(), "sheet.csv": sheet.getvalue(),
        "fmu.fmu": sheet.getvalue(),
        "bomb.csv.gz": gzip.compress(bytes(2**26)), "bomb.json": gzip.compress(bytes(2**22)),
        "deep.json": b"[" * 100_000, "deep.toml": b"a" + b".a" * 50_000 + b" = 1\n",
        "nan.json": json.dumps({**valve, "u_max_V": float("nan")}).encode(),
        "twice.json": b'{"schema": "dzdesign.valve/1", "schema": "dzdesign.compensator/1"}',
        "digits.json": b'{"schema": "dzdesign.valve/1", "u_max_V": ' + b"9" * 100_000 + b"}",
        "nul.csv": RAMP.replace(b"0,", b"\0,", 9), "mark.csv": b"\xef\xbb\xbf" * 3 + RAMP, "long.csv": b"1," * 10**6,
        "latin.csv": b"\xe9\xff\xfe" + RAMP, "latin.toml": b"u-max = '\xff V'\n", "latin.json": b'{"schema": "\xff"}',
        "keys.toml": b"".join(b"k%d = 1\n" % n for n in range(20_000)), "TDSm.tdms": b"TDSm" + bytes(99),
        "PAR1.parquet": b"PAR1" + bytes(99) + b"PAR1", "hdf.h5": b"\x89HDF\r\n\x1a\n" + bytes(99),
        "formula.csv": b"=cmd|' /C calc'!A0,u_V\n@SUM(1+1),+1\n", "escape.csv": b"\x1b[2J\x1b]0;t\x07,u_V\n1,2\n",
        "template.toml": b"u-max = '{{7*7}}'\ncolumns = {u = '${HOME}'}\n", "nothing.json": b"", "nothing.csv": b"",
        "block.hex": b":" + b"F" * 1000 + b"\n:00000001FF\n", "block.bin": b"DZCAL" + bytes(999),
        "block.txt": b"@0\nq\n",
        "record.json": json.dumps({**valve, "record": RECORD}).encode(),
    }  # fmt: skip
    for name, content in contents.items():
        (place / name).write_bytes(content)
    return list(contents)


def _links(place: Path, outside: Path) -> list[str]:
    links = {
        "passwd.csv": "/etc/passwd", "passwd.json": "/etc/passwd", "dangling.csv": str(outside / "absent"),
        "loop.csv": "loop.csv", "zero.csv": "/dev/zero", "null.json": "/dev/null",
        "secret.json": "../outside/secret.json", "up": "..", "root": "/",
    }  # fmt: skip
    for name, target in links.items():
        (place / name).symlink_to(target)
    os.mkfifo(place / "pipe.csv")
    with socket.socket(socket.AF_UNIX) as server:
        before = os.getcwd()
        os.chdir(place)  # the name of a socket is short
        try:
            server.bind("socket.csv")
        finally:
            os.chdir(before)
    return [*(name for name in links if name not in ("up", "root")), "socket.csv"]


def _folders(place: Path, outside: Path) -> list[str]:
    """Make folders that look like those of dzdesign, and name what lies outside."""
    compensator = to_json_bytes(golden_compensator())
    manifest = {
        "schema": "dzdesign.firmware/1", "files": {"../../outside/secret.json": "0" * 64, "/etc/passwd": "0" * 64},
        "core": ["../../outside/secret.json"], "target": "{{7*7}}", "board": ["../../outside/secret.json"],
    }  # fmt: skip
    contents: dict[str, Callable[[Path], object]] = {
        "firmware_up": lambda folder: (folder / MANIFEST_NAME).write_text(json.dumps(manifest), encoding="utf-8"),
        "output_up": lambda folder: (folder / MANIFEST_NAME).write_text(
            json.dumps({**manifest, "schema": "dzdesign.output/1"}), encoding="utf-8"
        ),
        "firmware_link": lambda folder: (folder / "core").symlink_to(outside),
        "evidence_link": lambda folder: (folder / "verification.json").symlink_to(outside / "secret.json"),
        "batch_link": lambda folder: (folder / "batch.json").symlink_to(outside / "secret.json"),
        "artefacts_link": lambda folder: (folder / "valve.json").symlink_to(outside / "valve.json"),
        "lot_of_pipes": lambda folder: os.mkfifo(folder / "ramp_1MPa.csv"),
    }
    for name, make in contents.items():
        (place / name).mkdir()
        (place / name / "compensator.json").write_bytes(compensator)
        make(place / name)
    return list(contents)
