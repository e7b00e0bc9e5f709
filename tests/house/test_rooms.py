"""The walls of the house: imports run one way and in no circle, public names are documented, the start is light."""

import ast
import importlib
import inspect
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from tests.support.paths import ROOMS, ROOT

#: Beyond the order: what a room may not import though it stands before it.
FORBIDDEN = {
    "verify": {"codegen"},  # the checker shares no code with what it checks
    "assess": {"derivation", "design", "codegen", "verify"},
}
#: Of a room, its sub-rooms and modules from the ground up: a module imports only those on its floor or below. What is
#: not named stands on top.
FLOORS = {
    "identify": (
        "constants", "options", "fit", "valve", "reading", "ramps", "knees", "fitting", "data_quality", "side",
        "plots",
    ),
}  # fmt: skip


def modules(root: Path = ROOT) -> dict[str, Path]:
    """Return every module of the product by its name."""
    found = {}
    for room in ROOMS:
        for path in sorted((root / room / "dzdesign").rglob("*.py")):
            name = ".".join(path.relative_to(root / room).with_suffix("").parts)
            found[name.removesuffix(".__init__")] = path
    return found


def room_of(name: str) -> str:
    """Return the room of a module: modules that stand in no room's package are the front door's."""
    part = name.split(".")[1]
    return part if part in ROOMS else "dzdesign"


def imports(source: str, known: Mapping[str, object]) -> Iterator[str]:
    """Yield the product's modules that a source imports anywhere, also in a function or under TYPE_CHECKING."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                if name in known:
                    yield name
                elif node.module in known:
                    yield node.module


def import_graph(root: Path = ROOT) -> dict[str, set[str]]:
    """Return which module imports which."""
    known = modules(root)
    return {name: set(imports(path.read_text("utf-8"), known)) for name, path in known.items()}


def against_the_order(graph: Mapping[str, set[str]]) -> list[str]:
    """Return the imports that run against the order of the rooms."""
    wrong = []
    for name, needed in graph.items():
        room = room_of(name)
        allowed = set(ROOMS[: ROOMS.index(room) + 1]) - FORBIDDEN.get(room, set())
        wrong += [f"{name} imports {other}" for other in sorted(needed) if room_of(other) not in allowed]
    return wrong


def against_the_floors(graph: Mapping[str, set[str]], room: str) -> list[str]:
    """Return the imports inside a room that run upwards."""
    floors = FLOORS[room]

    def floor(name: str) -> int:
        part = name.split(".")[2] if name.count(".") > 1 else ""
        return floors.index(part) if part in floors else len(floors)

    inside = {name: needed for name, needed in graph.items() if name.startswith(f"dzdesign.{room}.")}
    return [
        f"{name} imports {other}"
        for name, needed in inside.items()
        for other in sorted(needed & inside.keys())
        if floor(other) > floor(name)
    ]


def circle(graph: Mapping[str, set[str]]) -> list[str]:
    """Return the modules of an import circle, or nothing."""
    try:
        TopologicalSorter({name: needed - {name} for name, needed in graph.items()}).prepare()
    except CycleError as error:
        return error.args[1]
    return []


@pytest.fixture(scope="module")
def graph():
    return import_graph()


def test_a_room_imports_only_the_rooms_before_it(graph):
    assert len(graph) > 200 and sum(map(len, graph.values())) > 500
    assert {room_of(name) for name in graph} == set(ROOMS)
    assert against_the_order(graph) == []


def test_the_source_roots_of_all_tools_are_the_rooms():
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    roots = (tools["pyright"]["extraPaths"], tools["mypy"]["mypy_path"], tools["coverage"]["run"]["source"],
             tools["hatch"]["build"]["dev-mode-dirs"])  # fmt: skip
    assert {tuple(listed[: len(ROOMS)]) for listed in roots} == {ROOMS}


@pytest.mark.parametrize("room", FLOORS)
def test_inside_a_room_imports_run_down(graph, room):
    for name in FLOORS[room]:  # a floor that nobody stands on is a misspelled one
        assert any(module.startswith(f"dzdesign.{room}.{name}") for module in graph)
    assert against_the_floors(graph, room) == []


@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("dzdesign.identify.reading.clock", "from dzdesign.identify.ramps.branches import Branch"),
        ("dzdesign.identify.valve.model", "def f():\n    from dzdesign.identify.fitting import bounds"),
        ("dzdesign.identify.plots.style", "from dzdesign.identify.identification import identify"),
    ],
)
def test_a_seeded_import_upwards_is_found(graph, module, line):
    graph = {**graph, module: graph[module] | set(imports(line, graph))}
    assert [found for found in against_the_floors(graph, "identify") if module in found]


@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("dzdesign.identify.seeded", "from dzdesign.design.signals import Signals"),
        ("dzdesign.verify.seeded", "from dzdesign.codegen import project"),
        ("dzdesign.core.seeded", "def f():\n    from dzdesign.derivation.law import law"),
        ("dzdesign.assess.seeded", "import dzdesign.design.signals"),
    ],
)
def test_a_seeded_import_against_the_order_is_found(graph, module, line):
    graph = {**graph, module: set(imports(line, graph))}
    assert any(module in found for found in against_the_order(graph))


def test_there_is_no_import_circle_and_a_seeded_one_is_found(graph):
    assert circle(graph) == []
    source = "if TYPE_CHECKING:\n    from dzdesign.identify.identification import identify"
    errors = "dzdesign.core.errors"
    assert errors in circle({**graph, errors: graph[errors] | set(imports(source, graph))})


def unresolved(source: str) -> Iterator[str]:
    """Yield the imports of ours in a source, also those that no test runs, that name what is not there."""
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith(("dzdesign.", "tests.")):
            continue
        for name in (alias.name for alias in node.names if alias.name != "*"):
            try:
                if not hasattr(importlib.import_module(node.module), name):
                    importlib.import_module(f"{node.module}.{name}")
            except ImportError:
                yield f"line {node.lineno}: from {node.module} import {name}"


@pytest.mark.slow
def test_every_import_of_ours_resolves():
    """In benchmarks too, which no test runs."""
    paths = [path for folder in (*ROOMS, "benchmarks", "docs", "release") for path in (ROOT / folder).rglob("*.py")]
    found = {path.relative_to(ROOT).as_posix(): list(unresolved(path.read_text("utf-8"))) for path in paths}
    assert {path: lines for path, lines in found.items() if lines} == {}
    seed = "def f():\n    from dzdesign.core.errors import nothing\n    from tests.support.absent import paths"
    assert len(list(unresolved(seed))) == 2


def public_objects() -> Iterator[tuple[str, object]]:
    for name in modules():
        module = importlib.import_module(name)
        yield name, module
        for key, value in vars(module).items():
            if (
                not key.startswith("_")
                and (inspect.isfunction(value) or inspect.isclass(value))
                and value.__module__ == name
            ):
                yield f"{name}.{key}", value


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
    code = f"import sys, dzdesign.command_line.cli; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.slow
def test_no_assert_and_no_bare_except_in_shipped_code():
    found = []
    for source in modules().values():
        for node in ast.walk(ast.parse(source.read_text("utf-8"))):
            if isinstance(node, ast.Assert) or (isinstance(node, ast.ExceptHandler) and node.type is None):
                found.append(f"{source.relative_to(ROOT)}:{node.lineno}")
    assert found == []
