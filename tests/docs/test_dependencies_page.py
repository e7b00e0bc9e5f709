"""The page of licences: each run-time dependency stands there, with the licence that its metadata states."""

import re
from importlib.metadata import distribution

from release.components import declared_dependencies, licence_of
from tests.support.paths import ROOT

PAGE = ROOT / "docs" / "reference" / "dependencies.md"


def rows(page):
    """Return of each package what its row says: licence, last release, and purpose."""
    found = {}
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| ") and len(cells) == 4 and cells[0] != "package":
            found[cells[0]] = cells[1:]
    return found


def faults(page):
    """Return what in the page does not fit pyproject.toml or what is installed."""
    listed, found = rows(page), []
    needed = {requirement.name: requirement for requirement in declared_dependencies(ROOT / "pyproject.toml")}
    found += [f"{name} has no row" for name in needed.keys() - listed.keys()]
    found += [f"{name} is not needed" for name in listed.keys() - needed.keys()]
    for name in needed.keys() & listed.keys():
        licence, release, *words = listed[name]
        stated = licence_of(distribution(name))
        if licence != stated:
            found.append(f"{name}: licence {licence}, its metadata says {stated}")
        version = re.fullmatch(r"(\d+(?:\.\d+)+), [A-Z][a-z]+ 20\d\d", release)
        if not version or not needed[name].specifier.contains(version[1]):
            found.append(f"{name}: release {release}")
        if not all(words):
            found.append(f"{name}: an empty cell")
    return sorted(found)


def test_each_dependency_is_listed_with_its_licence():
    assert faults(PAGE.read_text(encoding="utf-8")) == []


def test_a_seeded_fault_is_found():
    page = PAGE.read_text(encoding="utf-8")
    assert faults(page.replace("| rich | MIT |", "| rich | BSD |")) == ["rich: licence BSD, its metadata says MIT"]
    assert faults(re.sub(r"\| rich .*\n", "", page)) == ["rich has no row"]
    assert faults(page.replace("| rich |", "| poor |")) == ["poor is not needed", "rich has no row"]
    assert faults(page.replace("3.5, November 2020", "2.7, November 2020")) == ["pyserial: release 2.7, November 2020"]
