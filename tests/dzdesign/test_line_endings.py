"""A clone by git with core.autocrlf=true, as on Windows: other line endings, the same firmware, evidence and block."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.regeneration import given_files, identified_again
from tests.support.attacked_firmware import take_the_rest_as_held
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
RAMPS = sorted((ROOT / "examples/paper_valve/ramps").glob("ramp_dP[15]_1.csv.gz"))


def git(*words, cwd):
    command = ["git", "-c", "user.name=a", "-c", "user.email=a@b", *words]
    subprocess.run(command, cwd=cwd, check=True, capture_output=True)


def clone(folder, place):
    git("init", "-q", cwd=folder)
    git("-c", "core.autocrlf=false", "add", "-A", cwd=folder)
    git("commit", "-qm", "all", cwd=folder)
    git("-c", "core.autocrlf=true", "clone", "-q", str(folder), str(place), cwd=folder)


def endings(folder, ending):
    return {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and ".git/" not in path.as_posix() and b"\r\n" in path.read_bytes()
    } >= ending


@pytest.fixture(scope="module")
def made(example_valve, tmp_path_factory):
    """A folder as `run` leaves it, in block form: valve.json, compensator.json, firmware, evidence."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "valve.json").write_bytes(to_json_bytes(example_valve))
    with pytest.MonkeyPatch.context() as patch:
        take_the_rest_as_held(patch)
        patch.chdir(folder)
        for words in (
            "design valve.json -o compensator.json",
            "codegen compensator.json --target host --calibration block --vectors 700 -o firmware",
            "verify firmware -o evidence",
        ):
            assert main(words.split()) == 0
    return folder


@pytest.mark.skipif(shutil.which("git") is None, reason="no git")
@pytest.mark.parametrize("attributes", [True, False])
def test_a_clone_verifies_and_reports_as_before(made, tmp_path, monkeypatch, capsys, attributes):
    """Without .gitattributes the core's text has other line endings too, and that file is missing."""
    shutil.copytree(made, tmp_path / "made")
    text = (tmp_path / "made/firmware/.gitattributes").read_text()
    if not attributes:
        (tmp_path / "made/firmware/.gitattributes").unlink()
    clone(tmp_path / "made", tmp_path / "clone")
    assert endings(tmp_path / "clone", {"valve.json", "compensator.json", "evidence/verification.json"})
    assert endings(tmp_path / "clone", {"firmware/core/dz_comp.c", "firmware/manifest.json"}) is not attributes
    if not attributes:
        (tmp_path / "clone/firmware/.gitattributes").write_text(text)
    take_the_rest_as_held(monkeypatch)
    monkeypatch.chdir(tmp_path / "clone")
    assert main(["verify", "firmware", "-o", "again"]) == 0
    was, now = (json.loads((place / "verification.json").read_bytes()) for place in (made / "evidence", Path("again")))
    assert was == now
    assert main(["codegen", "compensator.json", "--target", "host", "--calibration", "block", "-o", "other"]) == 0
    for name in ("calibration.bin", "core/dz_comp.c", "host/dz_block.c", "compensator.json"):
        assert (Path("other") / name).read_bytes() == (made / "firmware" / name).read_bytes()
    for name in ("valve.json", "compensator.json", "firmware/manifest.json", "evidence/verification.json"):
        assert sha256_of(Path(name).read_bytes()) == sha256_of((made / name).read_bytes())
    shutil.rmtree("again")
    shutil.rmtree("other")
    assert main(["report", "evidence", "--firmware", "firmware", "-o", "report.html"]) == 0
    # It is written over as the same firmware, not refused as somebody's own.
    same = "codegen compensator.json --target host --calibration block --vectors 700 -o firmware"
    assert main(same.split()) == 0


def test_recordings_that_differ_in_line_endings_only_are_the_same(tmp_path, monkeypatch):
    import gzip

    names = []
    for place, ending in (("unix", b"\n"), ("windows", b"\r\n")):
        (tmp_path / place).mkdir()
        for path in RAMPS:
            content = gzip.decompress(path.read_bytes()).replace(b"\r\n", b"\n").replace(b"\n", ending)
            (tmp_path / place / path.stem).write_bytes(content)
            names.append(path.stem)
    monkeypatch.chdir(tmp_path)
    ramps = [f"unix/{name}" for name in dict.fromkeys(names)]
    assert main(["identify", *ramps, "--curve", "line", "-o", "valve.json"]) == 0
    assert main(["design", "valve.json", "-o", "compensator.json"]) == 0
    from dzdesign.core.artefact_reading import read_artefact
    from dzdesign.design.compensator import Compensator

    compensator = read_artefact(Path("compensator.json").read_bytes(), Compensator, "compensator.json")
    check = identified_again(compensator, given_files([f"windows/{name}" for name in dict.fromkeys(names)]))
    assert check.holds, check.text
