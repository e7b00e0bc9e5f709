"""Every import resolves in a plain clone for whoever only reads the files: type checkers, editors, people."""

import ast
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from tests.support.paths import ROOMS, ROOT

CONFIG = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
#: Folders that are no room and hold Python, and where their own modules are looked for besides the rooms.
OTHERS = ("tests", "benchmarks", "docs", "release")
#: For comparison in benchmarks, or for what can't be had everywhere: the extras of pyproject.toml that no lock holds.
EXTRAS = {"atheris", "blark", "piecewise_regression", "pwlf"}


def sources() -> list[Path]:
    """Return every Python file of the clone."""
    return sorted(path for folder in (*ROOMS, *OTHERS) for path in (ROOT / folder).rglob("*.py"))


@cache
def roots() -> tuple[Path, ...]:
    """Return where a name is looked for: what pyproject.toml tells a type checker."""
    return tuple(ROOT / folder for folder in CONFIG["tool"]["pyright"]["extraPaths"])


@cache
def module_file(name: str) -> Path | None:
    """Return the file or folder of a module of the clone, or nothing."""
    for root in roots():
        place = root.joinpath(*name.split("."))
        for found in (place.with_name(f"{place.name}.py"), place / "__init__.py", place):
            if found.is_file() or (found is place and found.is_dir() and any(found.rglob("*.py"))):
                return found
    return None


@cache
def names_in(path: Path) -> set[str]:
    """Return what a file binds outside of functions and classes."""
    found: set[str] = set()
    waiting: list[ast.AST] = [ast.parse(path.read_text(encoding="utf-8"))]
    while waiting:
        for node in ast.iter_child_nodes(waiting.pop()):
            match node:
                case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                    found.add(node.name)
                case ast.Import() | ast.ImportFrom():
                    found |= {(alias.asname or alias.name).partition(".")[0] for alias in node.names}
                case ast.Name(ctx=ast.Store()):
                    found.add(node.id)
                case _:
                    waiting.append(node)
    return found


def unresolved(source: str, third_parties: set[str]) -> Iterator[str]:
    """Yield the imports of a source that lead nowhere, or to a name that its module does not have."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if module_file(alias.name) is None and alias.name.partition(".")[0] not in third_parties:
                    yield f"line {node.lineno}: import {alias.name}"
        elif isinstance(node, ast.ImportFrom) and node.module:
            place = module_file(node.module)
            if place is None:
                if node.module.partition(".")[0] not in third_parties:
                    yield f"line {node.lineno}: from {node.module}"
                continue
            known = names_in(place) if place.is_file() else set()
            for alias in node.names:
                if alias.name not in {"*", *known} and module_file(f"{node.module}.{alias.name}") is None:
                    yield f"line {node.lineno}: from {node.module} import {alias.name}"


@pytest.fixture(scope="module")
def third_parties():
    installed = set(packages_distributions()) - {"dzdesign"}  # from Python 3.12 on it lists the clone as well
    return installed | set(sys.stdlib_module_names) | EXTRAS


@pytest.mark.slow
def test_every_import_resolves(third_parties):
    files = sources()
    assert len(files) > 400
    found = [
        f"{path.relative_to(ROOT)} {one}"
        for path in files
        for one in unresolved(path.read_text("utf-8"), third_parties)
    ]
    assert found == []


def test_the_source_roots_of_all_tools_are_the_rooms():
    tools = CONFIG["tool"]
    built = tools["hatch"]["build"]["dev-mode-dirs"]
    roots = (tools["pyright"]["extraPaths"], tools["mypy"]["mypy_path"], tools["coverage"]["run"]["source"], built)
    for listed in roots:
        assert tuple(listed[: len(ROOMS)]) == ROOMS


@pytest.mark.parametrize(
    "seed",
    [
        "import dzdesign.core.nothing",
        "from dzdesign.core.nothing import InputError",
        "from dzdesign.core.errors import NoSuchError",
        "from dzdesign.core import nothing",
        "def deep():\n    if TYPE_CHECKING:\n        from dzdesign.core.errors import nothing",
        "from tests.support import nothing",
        "import scoreboards",
        "from a_package_that_nobody_has import anything",
    ],
)
def test_a_seeded_one_is_found(seed, third_parties):
    assert len(list(unresolved(seed, third_parties))) == 1


def test_what_resolves_is_not_found(third_parties):
    lines = ("import os.path", "import numpy as np", "from dzdesign.core import errors",
             "from dzdesign.core.errors import InputError", "from tests.support import paths")  # fmt: skip
    assert list(unresolved("\n".join(lines), third_parties)) == []
