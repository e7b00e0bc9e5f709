"""The list of components: every run-time package with version and licence, valid by the schema of CycloneDX."""

import json
from email.message import Message
from types import SimpleNamespace

import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packaging.requirements import Requirement

from release import components
from release.components import (
    Package,
    bill_of_materials,
    declared_dependencies,
    licence_of,
    packages_needed,
    release_date,
)
from release.distribution import write_components
from tests.support.paths import ROOT


def test_every_package_is_listed_with_what_it_needs(tmp_path):
    path = write_components(ROOT, tmp_path)
    assert path.read_bytes() == write_components(ROOT, tmp_path).read_bytes()
    text = path.read_text(encoding="utf-8")
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(text) is None
    bom = json.loads(text)
    versions = {part["name"].lower(): part["version"] for part in bom["components"]}
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    for requirement in declared_dependencies(ROOT / "pyproject.toml"):
        assert requirement.specifier.contains(versions[requirement.name.lower()])
    # What those need, two steps away too; test tools are none of it.
    assert {"markupsafe", "mpmath"} <= set(versions)
    assert not {"pytest", "cvxpy", "sphinx", "hatchling", "dzdesign"} & set(versions)
    for name, version in versions.items():
        assert f"{name.replace('_', '-')}=={version} " in lock
    refs = {part["bom-ref"] for part in bom["components"]} | {bom["metadata"]["component"]["bom-ref"]}
    assert {each["ref"] for each in bom["dependencies"]} == refs
    assert all(part["licenses"] for part in bom["components"])
    assert bom["metadata"]["timestamp"].startswith(release_date(ROOT / "CITATION.cff"))


def test_a_package_that_is_not_installed_is_no_gap_in_the_list():
    from importlib.metadata import PackageNotFoundError

    with pytest.raises(PackageNotFoundError):
        packages_needed([Requirement("a-package-that-nobody-has")])
    assert packages_needed([Requirement('a-package-that-nobody-has; python_version < "3"')]) == []


def test_a_file_that_does_not_fulfil_the_schema_is_refused(monkeypatch):
    package, made = Package("some", "1.0", "MIT", ()), components.make_outputter
    assert bill_of_materials("dzdesign", "1.0.0", [package], {"some"}, "2026-01-31")

    def seeded(*arguments):
        text = made(*arguments).output_as_string(indent=2)
        return SimpleNamespace(output_as_string=lambda indent: text.replace('"library"', '"bookshelf"'))

    monkeypatch.setattr(components, "make_outputter", seeded)
    with pytest.raises(ValueError, match=r"does not fulfil CycloneDX 1\.6"):
        bill_of_materials("dzdesign", "1.0.0", [package], {"some"}, "2026-01-31")


@pytest.mark.parametrize(
    ("lines", "licence"),
    [
        ([("License-Expression", "MIT OR Apache-2.0"), ("License", "BSD")], "MIT OR Apache-2.0"),
        ([("Classifier", "License :: OSI Approved :: MIT License"), ("License", "Copyright\nA long text")], "MIT"),
        ([("Classifier", "License :: OSI Approved"), ("License", "MPL-2.0")], "MPL-2.0"),
        ([("Classifier", "Topic :: Software"), ("License", "BSD\nmore")], "BSD"),
    ],
)
def test_the_licence_is_what_the_metadata_states(lines, licence):
    metadata = Message()
    for key, value in lines:
        metadata[key] = value
    assert licence_of(SimpleNamespace(metadata=metadata, name="some")) == licence


def test_a_date_that_is_missing_is_said(tmp_path):
    (tmp_path / "CITATION.cff").write_text("version: 1.0.0\n")
    with pytest.raises(ValueError, match="date-released"):
        release_date(tmp_path / "CITATION.cff")
