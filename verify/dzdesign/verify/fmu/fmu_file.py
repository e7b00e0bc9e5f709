"""An FMU as it lies there: its files, and what modelDescription.xml says; read from the standard."""

import json
import platform
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.errors import InputError, quoted
from dzdesign.verify.fmu.fmu_archive import unpacked

#: What ties a binary to the description: plain enough to stand in a program's text.
TOKEN = re.compile(r"\{[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}\}")
#: How the description begins.
BEGIN = b'<?xml version="1.0" encoding="UTF-8"?>\n'
DESCRIPTION = "modelDescription.xml"
EXTRA = "extra/dzdesign"
#: Elements of the description, to what a variable of theirs holds.
KINDS = {"Real": "real", "Integer": "integer", "Boolean": "boolean"}
#: Attributes of a variable that have a place of their own, or are for people.
NAMED = {"name", "valueReference", "causality", "unit", "start", "description"}
#: System and processor of this machine to the folder of its binaries, and their ending.
HERE: Mapping[tuple[str, str], tuple[str, str]] = {
    ("linux", "x86_64"): ("linux64", "so"),
    ("linux", "aarch64"): ("aarch64-linux", "so"),
    ("win32", "amd64"): ("win64", "dll"),
    ("darwin", "x86_64"): ("darwin64", "dylib"),
    ("darwin", "arm64"): ("aarch64-darwin", "dylib"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribedVariable:
    """A variable as modelDescription.xml has it."""

    reference: int
    kind: str
    causality: str
    unit: str | None
    start: str | None
    #: Every other attribute, of both of its elements; but for name and description.
    others: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribedUnit:
    """A unit as modelDescription.xml has it: what it is of base units, and in which others it is shown."""

    factor: float
    offset: float
    exponents: Mapping[str, float]
    #: Name to factor and offset.
    displayed: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuFile:
    """One FMU."""

    name: str
    files: Mapping[str, bytes]
    token: str
    identifier: str
    variables: Mapping[str, DescribedVariable]
    units: Mapping[str, DescribedUnit]
    #: What the FMU's own manifest says.
    manifest: Mapping[str, Any]
    #: modelDescription.xml.
    document: ElementTree.Element

    def reference(self, name: str) -> int:
        """Return the value reference of a variable; one that is missing is an `InputError`."""
        if name not in self.variables:
            raise InputError(f"{self.name}: {DESCRIPTION} has no variable {name}")
        return self.variables[name].reference

    def binary(self, folder: str, ending: str) -> bytes | None:
        """Return the binary for a platform, or None."""
        return self.files.get(f"binaries/{folder}/{self.identifier}.{ending}")

    def binary_here(self) -> bytes | None:
        """Return the binary for this machine, or None."""
        place = HERE.get((sys.platform, platform.machine().lower()))
        return self.binary(*place) if place else None


def read_fmu(path: Path) -> FmuFile:
    """Return an FMU; what is none is an `InputError`."""
    content = read_bytes(path, "FMU")
    files = unpacked(content, f"'{path}'")
    try:
        document = _document(files[DESCRIPTION])
        manifest = json.loads(files[f"{EXTRA}/manifest.json"])
        variables, units = _variables(document), _units(document)
    except (KeyError, ValueError, RecursionError, ElementTree.ParseError) as error:
        raise InputError(f"'{path}' is not an FMU of dzdesign: {error}; make it again with `dzdesign "
        "codegen`") from error
    version = document.get("fmiVersion", "")
    if version != "2.0" or not isinstance(manifest, dict):
        raise InputError(f"'{path}' is for FMI '{version[:20]}', expected 2.0")
    token = document.get("guid", "")
    if not TOKEN.fullmatch(token):
        raise InputError(f"'{path}' has the token {quoted(token)}, expected a UUID in braces; make it again")
    simulation = document.find("CoSimulation")
    return FmuFile(
        name=path.name,
        files=files,
        token=token,
        identifier=simulation.get("modelIdentifier", "") if simulation is not None else "",
        variables=variables,
        units=units,
        manifest=manifest,
        document=document,
    )


def _document(content: bytes) -> ElementTree.Element:
    """Return modelDescription.xml; an encoding or a declaration that tools could read otherwise is a `ValueError`."""
    inside = content.removeprefix(BEGIN)
    if inside == content or b"<!" in inside or b"<?" in inside or b"\0" in inside:
        raise ValueError(f"{DESCRIPTION} is not in UTF-8, or has declarations or comments")
    return ElementTree.fromstring(content)


def _units(document: ElementTree.Element) -> dict[str, DescribedUnit]:
    found = {}
    for unit in document.iterfind("UnitDefinitions/Unit"):
        (base,) = unit.findall("BaseUnit")
        numbers = {key: float(value) for key, value in base.attrib.items()}
        factor, offset = numbers.pop("factor", 1.0), numbers.pop("offset", 0.0)
        found[unit.get("name", "")] = DescribedUnit(
            factor=factor,
            offset=offset,
            exponents=numbers,
            displayed={
                each.get("name", ""): (float(each.get("factor", "1")), float(each.get("offset", "0")))
                for each in unit.iterfind("DisplayUnit")
            },
        )
    return found


def _variables(document: ElementTree.Element) -> dict[str, DescribedVariable]:
    found = {}
    for element in document.iterfind("ModelVariables/*"):
        typed = element[0] if element.tag == "ScalarVariable" and len(element) else element
        attributes = {**element.attrib, **typed.attrib}
        if (name := element.get("name", "")) in found:
            raise ValueError(f"{DESCRIPTION} has two variables {name}")
        found[name] = DescribedVariable(
            reference=int(element.get("valueReference", "-1")),
            kind=KINDS.get(typed.tag, typed.tag),
            causality=element.get("causality", "local"),
            unit=typed.get("unit"),
            start=typed.get("start"),
            others={key: value for key, value in attributes.items() if key not in NAMED},
        )
    return found
