"""The workflow of the page on CI: its steps are run here, but for those that need a forge."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

PAGE = ROOT / "docs" / "howto" / "ci.md"
EXAMPLE = ROOT / "examples" / "paper_valve"
OPTIONS = 'meter_lag = "0.1 s"\nmeter_floor = "0.6 L/min"\ncurve = "line"\n'
#: Steps that a test can't try: they install the wheel of a release.
NOT_HERE = ("pip install tools/dzdesign-1.0.0-py3-none-any.whl",)


def workflow():
    (found,) = re.findall(r"^```yaml\n(name: .*?)^```$", PAGE.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    return found


def steps():
    return re.findall(r"^ +- run: (.+)$", workflow(), re.MULTILINE)


def test_the_workflow_is_one():
    yaml = pytest.importorskip("yaml")
    document = yaml.safe_load(workflow())
    (job,) = document["jobs"].values()
    assert [step["run"] for step in job["steps"] if "run" in step] == steps()
    assert all({"run", "uses"} & set(step) for step in job["steps"])
    assert document[True]  # `on`, which YAML 1.1 reads so
    commands = [step.split() for step in steps() if step.startswith("dzdesign ")]
    assert [words[1] for words in commands] == ["derive", "identify", "design", "codegen", "verify"]
    assert "--ramps" in commands[-1], "the valve is identified again"


def test_no_page_installs_a_name_that_anybody_may_register():
    """The project is not on PyPI: `pip install dzdesign` would take whatever stands there."""
    by_name = re.compile(r"pip install(?: -\S+)* [\"']?dzdesign(?!-\d)")
    assert by_name.search("pip install dzdesign") and by_name.search("pip install 'dzdesign[fmu]'")
    for page in (ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("*/dzdesign/**/*.py")):
        assert not by_name.search(page.read_text("utf-8").replace("\n", " ")), page


@pytest.fixture(scope="module")
def repository(tmp_path_factory):
    """A user's repository as the page describes it, and a runner's environment."""
    folder = tmp_path_factory.mktemp("ci")
    (folder / "ramps").mkdir()
    for ramp in EXAMPLE.glob("ramps/ramp_dP[15]_1.csv.gz"):  # two pressure drops are enough to identify and design
        shutil.copy(ramp, folder / "ramps")
    shutil.copy(EXAMPLE / "plant.toml", folder)
    (folder / "dzdesign.toml").write_text(OPTIONS, encoding="utf-8")
    for step in steps():
        if step.startswith(("dzdesign identify", "dzdesign design")):
            assert run(step, folder).returncode == 0
    (folder / ".gitignore").write_text("firmware/\nevidence/\nderivation.txt\n", encoding="utf-8")
    git = "git -c user.name=test -c user.email=test@example.org -c init.defaultBranch=main"
    for command in (f"{git} init -q", f"{git} add .", f"{git} commit -qm start"):
        assert run(command, folder).returncode == 0
    return folder


def run(step, folder):
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.run(["bash", "-e", "-c", step], cwd=folder, env=environment, capture_output=True, text=True)


@pytest.mark.slow
@needs_compiler
@pytest.mark.skipif(not (shutil.which("bash") and shutil.which("git")), reason="a runner has bash and git")
def test_the_workflow_runs(repository):
    tried = [step for step in steps() if step not in NOT_HERE]
    assert len(tried) == len(steps()) - 1
    for step in tried:
        done = run(step, repository)
        assert done.returncode == 0, f"{step}:\n{done.stdout}\n{done.stderr}"
    assert (repository / "evidence" / "verification.json").is_file()
    assert "have the verdict expected of them" in (repository / "derivation.txt").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.skipif(not (shutil.which("bash") and shutil.which("git")), reason="a runner has bash and git")
def test_the_workflow_stops_where_an_option_changed_an_artefact(repository):
    (repository / "dzdesign.toml").write_text(OPTIONS.replace("0.6", "0.9"), encoding="utf-8")
    failed = [step for step in steps() if step.startswith(("dzdesign identify", "dzdesign design", "git diff"))
              if run(step, repository).returncode]  # fmt: skip
    assert failed == ["git diff --exit-code valve.json compensator.json"]


@pytest.mark.skipif(not (shutil.which("bash") and shutil.which("git")), reason="a runner has bash and git")
@pytest.mark.parametrize("missing", ["valve.json", "compensator.json"])
def test_the_workflow_stops_where_nobody_committed_an_artefact(tmp_path, missing):
    """Seeded: `git diff` says nothing of a file that is not under version control."""
    for name in ("valve.json", "compensator.json"):
        (tmp_path / name).write_text("{}\n")
    git = "git -c user.name=test -c user.email=test@example.org -c init.defaultBranch=main"
    start = f"{git} init -q && {git} add . && {git} rm -q --cached {missing} && {git} commit -qm start"
    assert run(start, tmp_path).returncode == 0
    failed = [step for step in steps() if step.startswith("git ") and run(step, tmp_path).returncode]
    assert failed == ["git diff --exit-code valve.json compensator.json"]
