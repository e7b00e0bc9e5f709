"""No byte of a file is ever run as Python: what the product ships calls nothing that could."""

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
KEYWORDS = {"shell": True, "allow_pickle": True}


def shipped() -> list[Path]:
    return sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py"))


def dotted(node: ast.expr) -> str:
    """Return ``os.path.join`` of such an expression, or an empty text."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute) and (before := dotted(node.value)):
        return f"{before}.{node.attr}"
    return ""


def findings(source: str) -> Iterator[str]:
    """Return what in a module runs or unpickles data."""
    tree = ast.parse(source)
    names = {}  # what a name was imported as
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.partition(".")[0] in MODULES or alias.name in MODULES:
                    yield f"line {node.lineno}: import {alias.name}"
                if alias.asname:
                    names[alias.asname] = alias.name
        elif isinstance(node, ast.ImportFrom) and node.module:
            if node.module.partition(".")[0] in MODULES or node.module in MODULES:
                yield f"line {node.lineno}: from {node.module}"
            names |= {alias.asname or alias.name: f"{node.module}.{alias.name}" for alias in node.names}
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        called = dotted(node.func)
        first, dot, rest = called.partition(".")
        called = names.get(first, first) + dot + rest
        if called in CALLS or called.removeprefix("builtins.") in CALLS:
            yield f"line {node.lineno}: {called}()"
        for keyword in node.keywords:
            if keyword.arg in KEYWORDS and not (
                isinstance(keyword.value, ast.Constant) and keyword.value.value is False
            ):
                yield f"line {node.lineno}: {keyword.arg}="


def test_nothing_shipped_runs_data():
    modules = shipped()
    assert len(modules) > 100, "the rooms were not found"
    found = [f"{path.relative_to(ROOT)} {text}" for path in modules for text in findings(path.read_text("utf-8"))]
    assert found == []


@pytest.mark.parametrize(
    "seed",
    [
        "import pickle",
        "import pickle as p\np.loads(b'')",
        "from pickle import loads",
        "import marshal",
        "import yaml",
        "eval('1')",
        "exec('1')",
        "compile('1', '', 'eval')",
        "import builtins\nbuiltins.eval('1')",
        "from builtins import eval as read\nread('1')",
        "__import__('os')",
        "import os\nos.system('ls')",
        "from os import system\nsystem('ls')",
        "import os as o\no.popen('ls')",
        "import subprocess\nsubprocess.run('ls', shell=True)",
        "import subprocess\nquick = True\nsubprocess.run('ls', shell=quick)",
        "import numpy as np\nnp.load('x', allow_pickle=True)",
        "import sympy\nsympy.sympify('x')",
        "from sympy import sympify\nsympify('x')",
        "def deep():\n    class A:\n        b = [eval(c) for c in 'd']",
    ],
)
def test_a_seeded_one_is_seen(seed):
    assert list(findings(seed))


@pytest.mark.parametrize(
    "seed",
    ["import re\nre.compile('a')", "import ast\nast.literal_eval('1')", "import subprocess\nsubprocess.run(['ls'])",
     "import numpy as np\nnp.load('x', allow_pickle=False)", "text = 'eval(1)'"],
)  # fmt: skip
def test_what_only_looks_like_it_is_not(seed):
    assert not list(findings(seed))
