"""The walls of the house: imports run one way, rooms keep their names, public names are documented."""

import ast
import importlib
import inspect
import pkgutil
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-dir"]


@pytest.fixture
def house(tmp_path):
    """The packages as a wheel lays them out: import-linter does not follow an editable install's mapping."""
    for name, folder in sorted(ROOMS.items()):
        target = tmp_path.joinpath(*name.split("."))
        target.mkdir(parents=True, exist_ok=True)
        for source in (ROOT / folder).glob("*.py"):
            shutil.copy(source, target)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def lint_imports(house: Path) -> subprocess.CompletedProcess:
    program = Path(sys.executable).with_name("lint-imports")
    return subprocess.run(
        [str(program), "--no-cache"], cwd=house, capture_output=True, text=True, check=False, env={"PATH": ""}
    )


def test_a_room_imports_only_the_rooms_before_it(house):
    done = lint_imports(house)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("room", "line"),
    [
        ("identify", "from dzdesign.design.signals import Signals"),
        ("verify", "from dzdesign.codegen.project import generate"),
        ("core", "from dzdesign.derivation.law import law"),
    ],
)
def test_a_seeded_import_against_the_order_is_found(house, room, line):
    source = house / "dzdesign" / room / "seeded.py"
    source.write_text(line + "\n")
    assert lint_imports(house).returncode != 0


@pytest.mark.parametrize("room", ["core", "derivation", "identify", "design", "codegen", "verify"])
def test_a_room_refuses_its_bare_name(room):
    done = subprocess.run(
        [sys.executable, "-c", f"import {room}"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert f"import this room as dzdesign.{room}" in done.stderr


def public_objects():
    for name in ROOMS:
        package = importlib.import_module(name)
        for info in pkgutil.iter_modules(package.__path__, f"{name}."):
            if info.name in ROOMS:
                continue
            module = importlib.import_module(info.name)
            yield info.name, module
            for key, value in vars(module).items():
                if (
                    not key.startswith("_")
                    and (inspect.isfunction(value) or inspect.isclass(value))
                    and value.__module__ == info.name
                ):
                    yield f"{info.name}.{key}", value


def test_public_names_are_documented_and_so_are_their_arguments():
    missing = []
    for name, value in public_objects():
        text = inspect.getdoc(value)
        if not text:
            missing.append(name)
        elif inspect.isfunction(value) and "Parameters\n---" in text:
            for argument in inspect.signature(value).parameters:
                if argument not in ("self", "args") and argument not in text:
                    missing.append(f"{name}({argument})")
    assert missing == []


def test_the_front_door_is_light():
    """--help costs no heavy import."""
    heavy = ("numpy", "casadi", "sympy", "cvxpy", "matplotlib", "pint", "polars")
    code = f"import sys, dzdesign.cli; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_no_assert_and_no_bare_except_in_shipped_code():
    found = []
    for folder in ROOMS.values():
        for source in (ROOT / folder).glob("*.py"):
            for node in ast.walk(ast.parse(source.read_text())):
                if isinstance(node, ast.Assert) or (isinstance(node, ast.ExceptHandler) and node.type is None):
                    found.append(f"{source.relative_to(ROOT)}:{node.lineno}")
    assert found == []
