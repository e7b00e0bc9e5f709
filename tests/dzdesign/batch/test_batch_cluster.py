"""`batch --dask`: a real scheduler and real workers as processes on 127.0.0.1, any of them killed in mid-run."""

import json
import logging
import os
import pydoc
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import CancelledError
from pathlib import Path
from types import SimpleNamespace

import pytest
from distributed import Client
from distributed.client import ClosedClientError

from dzdesign.batch.calibration import Task
from dzdesign.batch.runners import _check_workers, _scheduler_lost, run_on_cluster
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import InputError
from tests.dzdesign.batch.crashing_work import die_over_bad
from tests.dzdesign.batch.test_batch import NOTHING, rows
from tests.support.many_valves import LOT_TOML, write_lot
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

pytestmark = pytest.mark.slow

COUNT, SEED = 7, 7
OPTIONS = ["--config", str(LOT_TOML), "--target", "host"]
#: Each block is tried by the worker that makes it, and the lot's firmware is written here.
BLOCKS = ["--calibration", "block"]


def start(*arguments: str, folder: Path, deaths: int = 3) -> subprocess.Popen:
    """Start a process of Dask in a folder of its own, its tests' helpers importable."""
    folder.mkdir(parents=True)
    environment = os.environ | {
        "PYTHONPATH": str(ROOT),
        "OPENBLAS_NUM_THREADS": "1",
        "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(deaths),
    }
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *arguments], cwd=folder, env=environment,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


@pytest.fixture
def cluster(tmp_path, request):
    """Address of a scheduler, a way to start workers, and its process; all end with the test.

    Its parameter: deaths that a task may survive.
    """
    contact = tmp_path / "scheduler.json"
    processes = [
        start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(contact),
            folder=tmp_path / "scheduler", deaths=getattr(request, "param", 3),
        )
    ]  # fmt: skip
    deadline = time.monotonic() + 60
    while not contact.exists() or not contact.read_text():
        assert time.monotonic() < deadline and processes[0].poll() is None, "the scheduler did not start"
        time.sleep(0.05)
    address = json.loads(contact.read_text())["address"]

    def worker(name: str) -> subprocess.Popen:
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--name", name, "--host", "127.0.0.1")
        processes.append(start("worker", address, *options, folder=tmp_path / name))
        return processes[-1]

    yield address, worker, processes[0]
    for process in reversed(processes):
        process.kill()
        process.wait(20)


def whole_folders(output: Path) -> list[str]:
    return [path.parent.name for path in output.glob("valves/*/manifest.json") if not path.parent.name.startswith(".")]


@needs_compiler
@pytest.mark.skipif(os.name == "nt", reason="SIGKILL is of POSIX")
def test_a_worker_is_killed_in_mid_run_and_nothing_is_lost(cluster, tmp_path, monkeypatch):
    address, worker, _ = cluster
    monkeypatch.chdir(tmp_path)
    broken = write_lot(Path("lot"), COUNT, 2, SEED)
    victim, _ = worker("victim"), worker("survivor")
    at_the_kill = []

    def kill() -> None:
        while len(whole_folders(tmp_path / "out")) < 2:
            time.sleep(0.01)
        victim.send_signal(signal.SIGKILL)
        victim.wait(20)
        at_the_kill.extend(whole_folders(tmp_path / "out"))

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    assert main(["batch", "lot", "-o", "out", "--dask", address, *OPTIONS, *BLOCKS]) == 1
    killer.join(30)
    assert 2 <= len(at_the_kill) < COUNT, "the worker was not killed in mid-run"
    table = rows(tmp_path / "out")
    assert [row["name"] for row in table] == [f"V{number:04d}" for number in range(COUNT)]
    assert {row["name"] for row in table if row["status"] != "ok"} == set(broken)
    assert len(list(Path("out").glob("valves/*/calibration.bin"))) == COUNT - len(broken)
    assert main(["batch", "lot", "-o", "here", "--jobs", "1", *OPTIONS, *BLOCKS]) == 1
    for path in sorted(Path("here").rglob("*.*")):
        if path.is_file():  # what came over the network is what this machine makes
            assert sha256_of(path.read_bytes()) == sha256_of(("out" / path.relative_to("here")).read_bytes()), path


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL is of POSIX")
def test_a_scheduler_that_dies_in_mid_run_is_one_sentence_and_what_is_done_is_kept(
    cluster, tmp_path, monkeypatch, capsys
):
    address, worker, scheduler = cluster
    monkeypatch.chdir(tmp_path)
    write_lot(Path("lot"), COUNT, 2, SEED)
    worker("one")

    def kill() -> None:
        while len(whole_folders(tmp_path / "out")) < 2:
            time.sleep(0.01)
        scheduler.send_signal(signal.SIGKILL)

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    # In a process of its own: what Dask logs goes where stderr was when it was imported.
    code = "import sys; from dzdesign.command_line.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, "batch", "lot", "-o", "out", "--dask", address, *OPTIONS]
    said = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    killer.join(30)
    done = whole_folders(tmp_path / "out")
    assert 2 <= len(done) < COUNT, "the scheduler was not killed in mid-run"
    lines = [line for line in said.stderr.splitlines() if ": valve " not in line]  # a line for each that ended before
    assert (said.returncode, said.stdout) == (2, "") and lines == [
        f"dzdesign: {COUNT} valves, 0 of them done before",
        f"dzdesign: the Dask scheduler at '{address}' is gone; what is done is kept: start one, and give the same "
        "command again with its address",
    ]
    assert main(["batch", "lot", "-o", "out", "--jobs", "1", *OPTIONS]) == 1
    assert f"{COUNT} valves, {len(done)} of them done before" in capsys.readouterr().err


def test_a_lot_that_waits_for_a_worker_says_so_once_and_goes_on(cluster, capsys):
    address, worker, _ = cluster
    starter = threading.Timer(2, worker, ["late"])
    starter.start()
    (outcome,) = run_on_cluster(iter([Task(name="a", **NOTHING)]), address, die_over_bad)
    assert outcome.manifest.status == "ok"
    said = capsys.readouterr().err
    assert said.count("no worker is connected") == 1 and f"such as `dask worker {address} --nthreads 1`" in said


def test_workers_without_dzdesign_or_of_another_version_are_named():
    answers = {"tcp://a:1": THIS_TOOL.version, "tcp://b:1": None, "tcp://c:1": "0.1", "tcp://d:1": OSError("gone")}
    with pytest.raises(InputError) as caught:
        _check_workers(SimpleNamespace(run=lambda *_, **__: answers))
    assert "'tcp://b:1' has no dzdesign" in str(caught.value) and "'tcp://c:1' has dzdesign 0.1" in str(caught.value)
    assert "tcp://a" not in str(caught.value) and "tcp://d" not in str(caught.value)


@pytest.mark.parametrize("version", [THIS_TOOL.version, None])
def test_workers_are_asked_for_their_version_first(cluster, version):
    """A Python without the package answers `None`, as of a name that there is not."""
    address, worker, _ = cluster
    worker("asked")
    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(1, timeout=60)
        name = "dzdesign.core.version.__version__" if version else "dzdesign_that_is_not.__version__"
        assert set(client.run(pydoc.locate, name, on_error="return").values()) == {version}
        _check_workers(client)


@pytest.mark.parametrize("fault", [CancelledError(), OSError("a comm is closed"), ClosedClientError("closed")])
def test_whatever_dask_says_of_a_lost_scheduler_is_that_sentence(fault):
    level = logging.getLogger("distributed.client").level
    with pytest.raises(InputError, match="the Dask scheduler at 'tcp://x' is gone"), _scheduler_lost("tcp://x"):
        raise fault
    with pytest.raises(ZeroDivisionError), _scheduler_lost("tcp://x"):
        raise ZeroDivisionError
    assert logging.getLogger("distributed.client").level == level


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL is of POSIX")
@pytest.mark.parametrize("cluster", [0], indirect=True)
def test_a_valve_that_kills_every_worker_is_named(cluster):
    address, worker, _ = cluster
    for number in range(3):
        worker(f"w{number}")
    names = ["a", "bad", "b", "c"]
    tasks = (Task(name=name, **NOTHING) for name in names)
    outcomes = {each.name: each.manifest for each in run_on_cluster(tasks, address, die_over_bad)}
    assert set(outcomes) == set(names)
    assert {name for name, each in outcomes.items() if each.status != "ok"} == {"bad"}
    assert "ended without a word" in outcomes["bad"].reason and outcomes["bad"].inputs_sha256 is None


def test_no_scheduler_is_one_sentence(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("dzdesign.batch.runners.CONNECT_S", 0.5)
    write_lot(tmp_path / "lot", 2, 1, SEED)
    options = ["-o", str(tmp_path / "out"), "--dask", "tcp://127.0.0.1:1"]
    assert main(["batch", str(tmp_path / "lot"), *options]) == 2
    assert "no Dask scheduler answers at 'tcp://127.0.0.1:1'" in capsys.readouterr().err
