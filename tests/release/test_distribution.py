"""`make dist`: the same bytes twice and from the source package, and a wheel that needs no clone."""

import hashlib
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile

import pytest

from dzdesign.core.version import __version__
from release.distribution import build_packages, pack_pages, write_checksums
from tests.support.paths import ROOMS, ROOT
from tests.support.synthetic import needs_compiler


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    return build_packages(ROOT, tmp_path_factory.mktemp("dist"))


@pytest.fixture(scope="module")
def installed(built, tmp_path_factory):
    """The wheel's files, alone in a folder."""
    folder = tmp_path_factory.mktemp("installed")
    with zipfile.ZipFile(built[1]) as wheel:
        wheel.extractall(folder)
    return folder


def run_installed(installed, folder, *words):
    """Run the program from the wheel's files, in a folder from which the clone is not seen."""
    code = (
        "import sys; sys.meta_path = [each for each in sys.meta_path if 'editable' not in repr(each)];"
        f"sys.path = [{str(installed)!r}, *(each for each in sys.path if not each.startswith({str(ROOT)!r}"
        " + '/') or 'site-packages' in each)];"
        "import dzdesign.command_line.cli as cli;"
        f"assert all(str(each).startswith({str(installed)!r}) for each in [cli.__file__]), cli.__file__;"
        "sys.exit(cli.main(sys.argv[1:]))"
    )
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    command = [sys.executable, "-I", "-c", code, *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, env=environment)


@pytest.mark.slow
def test_a_second_build_elsewhere_has_the_same_bytes(built, tmp_path):
    """Neither the folder, nor the time, nor the user's umask enters."""
    with tarfile.open(built[0]) as packed:
        packed.extraction_filter = getattr(tarfile, "data_filter", lambda member, _: member)  # of Python 3.11.4
        packed.extractall(tmp_path)
    source = tmp_path / f"dzdesign-{__version__}"
    os.utime(source / "README.md")
    before = os.umask(0o077)
    try:
        again = build_packages(source, tmp_path / "again")
    finally:
        os.umask(before)
    assert [path.name for path in again] == [path.name for path in built]
    for first, second in zip(built, again, strict=True):
        assert first.read_bytes() == second.read_bytes(), first.name


@pytest.mark.slow
def test_a_changed_source_gives_another_wheel(built, tmp_path):
    with tarfile.open(built[0]) as packed:
        packed.extraction_filter = getattr(tarfile, "data_filter", lambda member, _: member)  # of Python 3.11.4
        packed.extractall(tmp_path)
    source = tmp_path / f"dzdesign-{__version__}"
    with (source / "core" / "dzdesign" / "core" / "errors.py").open("a") as file:
        file.write("# one line\n")
    assert build_packages(source, tmp_path / "again")[1].read_bytes() != built[1].read_bytes()


def test_the_wheel_is_what_the_clone_gives(built, tmp_path):
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    assert (tmp_path / built[1].name).read_bytes() == built[1].read_bytes()


def test_the_wheel_has_the_rooms_and_the_example_and_nothing_beside_its_package(installed):
    tops = {path.name for path in installed.iterdir()}
    assert tops == {"dzdesign", f"dzdesign-{__version__}.dist-info"}
    rooms = set(ROOMS) - {"dzdesign"}
    assert rooms <= {path.name for path in (installed / "dzdesign").iterdir()}
    here, there = ROOT / "examples" / "paper_valve", installed / "dzdesign" / "paper_valve"
    files = sorted(path.relative_to(here) for path in here.rglob("*") if path.is_file())
    assert sorted(path.relative_to(there) for path in there.rglob("*") if path.is_file()) == files


def test_the_source_package_has_tests_pages_and_the_lock_but_nothing_that_is_made(built):
    with tarfile.open(built[0]) as packed:
        names = {name.partition("/")[2] for name in packed.getnames()}
    for needed in ("Makefile", "requirements.lock", "tests/conftest.py", "docs/index.md", ".ci/run", "CITATION.cff"):
        assert needed in names
    made = (".venv", "docs/_build", "docs/_made", "demo/")
    assert [name for name in names if "__pycache__" in name or name.startswith(made)] == []


@pytest.mark.slow
@needs_compiler
def test_the_installed_program_runs_the_example_and_its_stages_without_the_clone(installed, tmp_path):
    done = run_installed(installed, tmp_path, "demo", "demo")
    assert done.returncode == 0, done.stderr
    assert ", 0 wrong" in done.stdout
    ramps = [str(path) for path in sorted((installed / "dzdesign" / "paper_valve" / "ramps").glob("*.csv.gz"))]
    for words in (
        ["identify", *ramps, "--meter-lag", "0.1 s", "--meter-floor", "0.6 L/min"],
        ["design", "valve.json"],
        ["codegen", "compensator.json", "-o", "firmware"],
        ["verify", "firmware", "-o", "evidence"],
        ["report", "."],
    ):
        done = run_installed(installed, tmp_path, *words)
        assert done.returncode == 0, (words[0], done.stderr)
    assert (tmp_path / "evidence" / "report.html").is_file()


def test_pages_are_packed_alike_whatever_their_times(tmp_path):
    for name in ("a", "b"):
        site = tmp_path / name / "site"
        (site / "deep").mkdir(parents=True)
        for page in ("index.html", "deep/page.html") if name == "a" else ("deep/page.html", "index.html"):
            (site / page).write_text(f"<p>{page}</p>\n")
        os.utime(site / "index.html", (1e9, 1e9) if name == "a" else None)
        (site / ".doctrees").mkdir()
        (site / ".doctrees" / "environment.pickle").write_text(str(site))  # what Sphinx keeps names the folder
        pack_pages(site, tmp_path / name)
    first, second = (next((tmp_path / name).glob("*.zip")) for name in ("a", "b"))
    assert first.read_bytes() == second.read_bytes()
    with zipfile.ZipFile(first) as packed:
        assert packed.namelist() == [f"dzdesign-{__version__}-docs/{page}" for page in ("deep/page.html", "index.html")]


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="sha256sum is not there")
def test_checksums_are_read_by_sha256sum_and_find_a_change(tmp_path):
    file = tmp_path / "file.whl"
    file.write_bytes(b"one")
    sums = write_checksums([file], tmp_path)
    assert sums.read_text() == f"{hashlib.sha256(b'one').hexdigest()}  file.whl\n"
    check = ["sha256sum", "--check", "--quiet", sums.name]
    assert subprocess.run(check, cwd=tmp_path, check=False).returncode == 0
    file.write_bytes(b"two")
    assert subprocess.run(check, cwd=tmp_path, check=False, capture_output=True).returncode == 1
