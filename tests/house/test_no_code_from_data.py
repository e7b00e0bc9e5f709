"""No byte of a file is run as Python; programs and libraries are started and loaded where that is done with care."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.paths import ROOMS, ROOT

#: Modules that make objects or code of bytes, and functions that run text or a shell's words.
MODULES = {"pickle", "cPickle", "dill", "cloudpickle", "joblib.numpy_pickle", "marshal", "shelve", "yaml", "jsonpickle"}
CALLS = {"eval", "exec", "compile", "__import__", "os.system", "os.popen", "subprocess.getoutput",
         "subprocess.getstatusoutput", "pty.spawn", "yaml.load", "runpy.run_path", "sympy.sympify", "sympy.parse_expr",
         "pd.read_pickle", "pandas.read_pickle", "torch.load"}  # fmt: skip
#: Keywords that turn on what is off by default.
KEYWORDS = {"shell", "allow_pickle"}
STARTING = {f"subprocess.{name}" for name in ("Popen", "run", "call", "check_call", "check_output")}
LOADING = ("ctypes", "cffi", "_ctypes", "numpy.ctypeslib", "np.ctypeslib")
#: Where libraries are loaded: by a process of their own.
LOADS = {"verify/dzdesign/verify/toolchain/library_server.py"}
#: Where programs are started: by their full path, and with a time to end.
STARTS = {
    "core/dzdesign/core/processes.py",
    "verify/dzdesign/verify/toolchain/compiled_library.py",
}


def dotted(node: ast.expr) -> str:
    """Return ``os.path.join`` of such an expression, or an empty text."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute) and (before := dotted(node.value)):
        return f"{before}.{node.attr}"
    return ""


def findings(source: str) -> Iterator[tuple[str, str]]:
    """Yield what a module does of `run` (data as code), `load`, `start` and `find` (a program), each with its place."""
    tree = ast.parse(source)
    names = {}  # what a name was imported as
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.asname or alias.name.partition(".")[0]: alias.name for alias in node.names}
            used = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {alias.asname or alias.name: f"{node.module}.{alias.name}" for alias in node.names}
            used = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in used:
            if name.partition(".")[0] in MODULES or name.rpartition(".")[0] in MODULES or name in MODULES:
                yield "run", f"line {node.lineno}: import {name}"
            yield from kinds(name, node.lineno)
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            yield from kinds(dotted(node), node.lineno)
        if isinstance(node, ast.Call):
            first, dot, rest = dotted(node.func).partition(".")
            called = (names.get(first, first) + dot + rest).removeprefix("builtins.")
            if called in CALLS:
                yield "run", f"line {node.lineno}: {called}()"
            for keyword in node.keywords:
                off = isinstance(keyword.value, ast.Constant) and keyword.value.value is False
                if keyword.arg in KEYWORDS and not off:
                    yield "run", f"line {node.lineno}: {keyword.arg}="


def kinds(name: str, line: int) -> Iterator[tuple[str, str]]:
    """Yield what the use of a name is: `load`, `start` or `find`."""
    if name.startswith(LOADING) or name.endswith("ctypes.data_as"):
        yield "load", f"line {line}: {name}"
    if name in STARTING or name.startswith(("os.spawn", "os.exec", "os.posix_spawn")):
        yield "start", f"line {line}: {name}"
    if name == "shutil.which":
        yield "find", f"line {line}: {name}"


def test_the_product_keeps_to_it():
    modules = sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py"))
    assert len(modules) > 100, "the rooms were not found"
    found: dict[str, set[Path]] = {"run": set(), "load": set(), "start": set(), "find": set()}
    for path in modules:
        for kind, _ in findings(path.read_text("utf-8")):
            found[kind].add(path.relative_to(ROOT).as_posix())
    assert found == {"run": set(), "load": LOADS, "start": STARTS, "find": {"core/dzdesign/core/processes.py"}}


@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        *(("run", seed) for seed in (
            "import pickle", "import pickle as p\np.loads(b'')", "from pickle import loads", "import marshal",
            "import yaml", "eval('1')", "exec('1')", "compile('1', '', 'eval')", "import builtins\nbuiltins.eval('1')",
            "from builtins import eval as read\nread('1')", "__import__('os')", "import os\nos.system('ls')",
            "from os import system\nsystem('ls')", "import os as o\no.popen('ls')",
            "import subprocess\nsubprocess.run('ls', shell=True)",
            "import subprocess\nquick = True\nsubprocess.run('ls', shell=quick)",
            "import numpy as np\nnp.load('x', allow_pickle=True)", "import sympy\nsympy.sympify('x')",
            "from sympy import sympify\nsympify('x')", "def deep():\n    class A:\n        b = [eval(c) for c in 'd']",
        )),
        ("load", "import ctypes"),
        ("load", "def f():\n    from ctypes import CDLL"),
        ("load", "import numpy as np\nnp.ctypeslib.load_library('a', '.')"),
        ("load", "import cffi"),
        ("find", "import shutil\nshutil.which('cc')"),
        ("find", "from shutil import which"),
        ("start", "import subprocess\nsubprocess.run(['cc'])"),
        ("start", "from subprocess import Popen"),
        ("start", "import os\nos.execvp('cc', [])"),
    ],
)  # fmt: skip
def test_a_seeded_one_is_seen(kind, seed):
    assert kind in {found for found, _ in findings(seed)}


@pytest.mark.parametrize(
    "seed",
    ["import re\nre.compile('a')", "import ast\nast.literal_eval('1')", "text = 'eval(1)'",
     "import numpy as np\nnp.load('x', allow_pickle=False)",
     "import subprocess\ntry:\n    pass\nexcept subprocess.TimeoutExpired:\n    pass"],
)  # fmt: skip
def test_what_only_looks_like_it_is_not(seed):
    assert list(findings(seed)) == []
