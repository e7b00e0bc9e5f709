"""FMUs against what `codegen` makes of their compensator.json, where its compiler is here, and where it is not."""

import json
from io import BytesIO
from zipfile import ZipFile

import pytest

from dzdesign.codegen.fmu import files as binaries
from dzdesign.codegen.fmu.files import archive
from dzdesign.codegen.other_targets import write_output
from dzdesign.core.artefact_files import sha256_of
from dzdesign.regeneration import output_regenerated
from tests.support.host_fmus import fmus_of, full_compensator, host_platforms

NAME = "dz_compensator.fmu"


@pytest.fixture(scope="module")
def output():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(binaries, "PLATFORMS", host_platforms())
        return fmus_of(full_compensator(), None)


@pytest.fixture
def folder(output, tmp_path, monkeypatch):
    monkeypatch.setattr(binaries, "PLATFORMS", host_platforms())
    write_output(output, tmp_path / "fmus")
    yield tmp_path / "fmus"
    binaries.made_with.cache_clear()


def edited(folder, name, change):
    """Change a file in an FMU, its own manifest and that of the folder."""
    path, manifest = folder / NAME, folder / "manifest.json"
    with ZipFile(BytesIO(path.read_bytes())) as packed:
        files = {each: packed.read(each) for each in packed.namelist()}
    files[name] = change(files[name])
    path.write_bytes(archive(files))
    document = json.loads(manifest.read_text())
    document["files"][NAME] = sha256_of(path.read_bytes())
    manifest.write_text(json.dumps(document, indent=2) + "\n")


def test_what_was_generated_is_generated_again(folder):
    assert output_regenerated(folder).holds is True


@pytest.mark.parametrize("name", ("sources/dz_comp.c", "modelDescription.xml", "binaries/linux64/dz_compensator.so"))
def test_a_file_edited_together_with_all_manifests_is_found(folder, name):
    edited(folder, name, lambda content: content + b" ")
    check = output_regenerated(folder)
    assert check.holds is False and NAME in check.text


@pytest.mark.parametrize("how", ("missing", "too old", "fails"))
def test_without_its_compiler_it_is_not_checked_and_said_why(folder, monkeypatch, how):
    binaries.made_with.cache_clear()
    if how == "missing":
        monkeypatch.setattr(binaries, "find_spec", lambda name: None)
    elif how == "too old":
        monkeypatch.setattr(binaries, "version", lambda name: "0.13.0")
    else:
        monkeypatch.setattr(binaries, "FLAGS", ("--no-such-flag",))
    check = output_regenerated(folder)
    assert check.holds is None and "ziglang" in check.text


def test_what_another_ziglang_made_is_not_checked_and_said_why(folder):
    found = binaries.version("ziglang")
    this = f"ziglang {found}".encode()
    edited(folder, "extra/dzdesign/manifest.json", lambda text: text.replace(this, b"ziglang 0.99"))
    check = output_regenerated(folder)
    assert check.holds is None and "0.99" in check.text and found in check.text
