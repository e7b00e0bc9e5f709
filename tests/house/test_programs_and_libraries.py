"""Only a child process loads a library of a file's; programs are found and started where that is done with care."""

import ast
from pathlib import Path

import pytest

from tests.house.test_no_code_from_data import dotted, shipped
from tests.support.paths import ROOT

#: Calls of the system's own library; and what is run as a process of its own.
LOADS = {
    "core/dzdesign/core/folder_swap.py",
    "dzdesign/dzdesign/batch/parent_watch.py",
    "verify/dzdesign/verify/toolchain/library_server.py",
}
#: What starts programs: by their full path, and with a time to end.
STARTS = {
    "core/dzdesign/core/processes/running.py",
    "identify/dzdesign/identify/reading/binary/reader_process.py",
    "verify/dzdesign/verify/toolchain/compiled_library.py",
}
STARTING = {f"subprocess.{name}" for name in ("Popen", "run", "call", "check_call", "check_output")}
LOADING = {"ctypes", "cffi", "_ctypes"}


def uses(source: str) -> set[str]:
    """Return which of the things to look for a module has: `load`, `start`, `find`."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import) and any(each.name.partition(".")[0] in LOADING for each in node.names):
            found.add("load")
        elif isinstance(node, ast.ImportFrom):
            names = {f"{node.module}.{each.name}" for each in node.names}
            found |= {"load"} if (node.module or "").partition(".")[0] in LOADING | {"numpy.ctypeslib"} else set()
            found |= {"find"} if "shutil.which" in names else set()
            found |= {"start"} if names & STARTING else set()
        elif isinstance(node, ast.Attribute):
            name = dotted(node)
            found |= {"find"} if name == "shutil.which" else {"start"} if name in STARTING else set()
            found |= {"load"} if ".ctypeslib" in name or name.endswith("ctypes.data_as") else set()
            found |= {"start"} if name.startswith(("os.spawn", "os.exec", "os.posix_spawn")) else set()
    return found


def test_the_product_keeps_to_it():
    found = {path.relative_to(ROOT).as_posix(): uses(path.read_text("utf-8")) for path in shipped()}
    assert {name for name, kinds in found.items() if "load" in kinds} == LOADS
    assert {name for name, kinds in found.items() if "start" in kinds} == STARTS
    assert {name for name, kinds in found.items() if "find" in kinds} == set()


@pytest.mark.parametrize(
    ("seed", "kind"),
    [
        ("import ctypes", "load"),
        ("def f():\n    from ctypes import CDLL", "load"),
        ("import numpy as np\nnp.ctypeslib.load_library('a', '.')", "load"),
        ("import cffi", "load"),
        ("import shutil\nshutil.which('cc')", "find"),
        ("from shutil import which", "find"),
        ("import subprocess\nsubprocess.run(['cc'])", "start"),
        ("from subprocess import Popen", "start"),
        ("import os\nos.execvp('cc', [])", "start"),
    ],
)
def test_each_of_them_is_seen(seed: str, kind: str):
    assert kind in uses(seed)


def test_a_subprocess_that_is_only_waited_for_in_vain_is_none():
    assert uses("import subprocess\ntry:\n    pass\nexcept subprocess.TimeoutExpired:\n    pass") == set()


def test_the_list_is_of_files_that_are_there():
    assert all((ROOT / Path(name)).is_file() for name in LOADS | STARTS)
