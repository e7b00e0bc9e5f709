"""The packages that dzdesign needs at run time, each with version and licence, as a CycloneDX file."""

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5

from cyclonedx.contrib.license.factories import LicenseFactory
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output import make_outputter
from cyclonedx.schema import OutputFormat, SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packageurl import PackageURL
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

#: The newest edition that the common readers of such files know.
EDITION = SchemaVersion.V1_6
#: Words of the metadata that are no identifier of SPDX, but mean one.
SPDX = {
    "GNU Lesser General Public License v3 or later (LGPLv3+)": "LGPL-3.0-or-later",
    "MIT License": "MIT",
    "Apache Software License": "Apache-2.0",
    "Apache 2.0": "Apache-2.0",
    "Python Software Foundation License": "PSF-2.0",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
}


@dataclass(frozen=True, slots=True)
class Package:
    """An installed package: its name as it is written, its version, its licence, and the packages that it needs."""

    name: str
    version: str
    licence: str
    needs: tuple[str, ...]

    @property
    def key(self) -> str:
        """Its name as registries compare names."""
        return canonicalize_name(self.name)


def declared_dependencies(pyproject: Path) -> list[Requirement]:
    """Return the run-time dependencies that a pyproject.toml declares, without its extras."""
    return [Requirement(line) for line in tomllib.loads(pyproject.read_text("utf-8"))["project"]["dependencies"]]


def packages_needed(requirements: list[Requirement]) -> list[Package]:
    """Return the installed packages that the requirements need, and those that these need, sorted by name.

    Packages that another system or Python would need in addition are left out.

    Raises
    ------
    PackageNotFoundError
        If one is not installed.
    """
    found: dict[str, Package] = {}
    waiting = [each for each in requirements if each.marker is None or each.marker.evaluate({"extra": ""})]
    seen: set[tuple[str, frozenset[str]]] = set()
    while waiting:
        wanted = waiting.pop()
        if (key := (canonicalize_name(wanted.name), frozenset(wanted.extras))) in seen:
            continue
        seen.add(key)
        installed = distribution(wanted.name)
        needs = list(_needed_by(installed, wanted.extras))
        names = {canonicalize_name(each.name) for each in needs} | set(found[key[0]].needs if key[0] in found else ())
        found[key[0]] = Package(installed.name, installed.version, licence_of(installed), tuple(sorted(names)))
        waiting += needs
    return [found[name] for name in sorted(found)]


def _needed_by(installed: Distribution, extras: set[str]) -> Iterator[Requirement]:
    for line in installed.requires or ():
        needed = Requirement(line)
        if needed.marker is None or any(needed.marker.evaluate({"extra": extra}) for extra in ("", *extras)):
            yield needed


def licence_of(installed: Distribution) -> str:
    """Return the licence that a package's metadata states: an SPDX expression, or the words that stand there."""
    metadata = installed.metadata
    if "License-Expression" in metadata:
        return metadata["License-Expression"]
    classifiers = [line.split(" :: ")[-1] for line in metadata.get_all("Classifier") or () if "License ::" in line]
    words = [word for word in classifiers if word != "OSI Approved"]
    text = " AND ".join(words) or "".join(metadata.get_all("License") or ()).strip().partition("\n")[0]
    if not text:
        raise PackageNotFoundError(f"{installed.name}, or rather its licence: its metadata states none")
    return SPDX.get(text, text)


def bill_of_materials(name: str, version: str, packages: list[Package], direct: set[str], released: str) -> str:
    """Return the CycloneDX file, as JSON.

    Parameters
    ----------
    name, version
        Of the product.
    packages
        What it needs at run time.
    direct
        Names of those that it needs itself.
    released
        Date of the release, such as ``2026-01-31``; the file states it, and never the time of its making.

    Raises
    ------
    ValueError
        If the file does not fulfil the schema of CycloneDX.
    """
    licences = LicenseFactory()
    product = Component(
        name=name, version=version, type=ComponentType.APPLICATION, bom_ref=f"{name}@{version}",
        licenses=[licences.make_from_string("Apache-2.0")],
    )  # fmt: skip
    parts = {
        package.key: Component(
            name=package.name, version=package.version, type=ComponentType.LIBRARY,
            bom_ref=f"{package.key}@{package.version}",
            purl=PackageURL("pypi", None, package.key, package.version),
            licenses=[licences.make_from_string(package.licence)],
        )
        for package in packages
    }  # fmt: skip
    bom = Bom(components=parts.values())
    bom.metadata.component = product
    bom.metadata.timestamp = datetime.fromisoformat(released).replace(tzinfo=UTC)
    pairs = zip(packages, parts.values(), strict=True)
    listing = "\n".join(f"{part.purl} {package.licence}" for package, part in pairs)
    bom.serial_number = uuid5(NAMESPACE_URL, f"{product.bom_ref}\n{released}\n{listing}")
    bom.register_dependency(product, [parts[each] for each in sorted(direct)])
    for package in packages:
        bom.register_dependency(parts[package.key], [parts[each] for each in package.needs if each in parts])
    text = make_outputter(bom, OutputFormat.JSON, EDITION).output_as_string(indent=2)
    if error := JsonStrictValidator(EDITION).validate_str(text):
        raise ValueError(f"the list of components does not fulfil CycloneDX {EDITION.to_version()}: {error}")
    return f"{text}\n"


def release_date(citation: Path) -> str:
    """Return the date of the release, as CITATION.cff states it."""
    found = re.search(r"^date-released: (\d{4}-\d\d-\d\d)$", citation.read_text("utf-8"), re.M)
    if not found:
        raise ValueError(f"{citation} states no date-released, such as 2026-01-31")
    return found[1]
