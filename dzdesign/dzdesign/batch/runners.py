"""Where valves are calibrated: in processes of this machine by joblib, or on a cluster by Dask's scheduler."""

import logging
import os
import pydoc
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, nullcontext, suppress
from itertools import count, islice
from typing import TYPE_CHECKING, Any

from dzdesign.batch.calibration import Outcome, Task, calibrate
from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.core.errors import InputError, and_more
from dzdesign.core.processes import end_with, interrupts_kept_waiting, safe_path
from dzdesign.report.lot.summary import FAILED
from dzdesign.terminal.progress import say

if TYPE_CHECKING:
    from distributed import Client, Future

#: What calibrates one valve.
Work = Callable[[Task], Outcome]
#: Tasks on their way for each that runs: a batch of any length takes no more memory than these.
AHEAD = 2
CONNECT_S = 10
#: Workers that a message names.
MOST_NAMED = 10
#: Loggers of Dask that tell of a lost scheduler in pages of their own.
TALKATIVE = ("distributed", "distributed.client")
ENDED = "the process that calibrated it ended without a word (out of memory, or killed)"


def run_local(tasks: Iterable[Task], jobs: int, work: Work = calibrate) -> Iterator[Outcome]:
    """Calibrate valves in processes of this machine (one: in this process) and yield what came of each, as they end.

    Tasks are read as they are needed. A process that dies takes its pool along; what was under way then is tried again,
    each valve in a pool of its own, so that the one that kills its process is named, and no other is lost.
    """
    under_way: dict[str, Task] = {}

    def noted() -> Iterator[Task]:
        for task in source:
            under_way[task.name] = task
            yield task

    source = iter(tasks)
    more = True
    while more:
        try:
            for outcome in _in_processes(noted(), jobs, work):
                under_way.pop(outcome.name)
                yield outcome
            more = False
        except BrokenProcessPool:
            for task in list(under_way.values()):
                under_way.pop(task.name)
                yield _alone(task, work)


def _in_processes(tasks: Iterable[Task], jobs: int, work: Work) -> Iterator[Outcome]:
    from joblib import Parallel, delayed, parallel_config

    # Of a run that is stopped, by a full disk for one: what to do is said by whoever stops it.
    warnings.filterwarnings("ignore", r"\d+ tasks (which were still|have been)", UserWarning)
    processes: dict[str, Any] = {}
    if jobs > 1:
        processes = {"backend": "loky", "inner_max_num_threads": 1}
        processes |= {"initializer": end_with, "initargs": (os.getpid(),)}
    with safe_path(), parallel_config(n_jobs=jobs, **processes):
        pool = Parallel(return_as="generator_unordered", pre_dispatch=AHEAD * jobs, batch_size=1)
        with interrupts_kept_waiting() if jobs > 1 else nullcontext():
            outcomes = pool(delayed(work)(task) for task in tasks)
        yield from outcomes


def _alone(task: Task, work: Work) -> Outcome:
    """Calibrate a valve in a pool of its own, which it may break."""
    try:
        return next(iter(_in_processes([task], 2, work)))  # two: one job would run in this process
    except BrokenProcessPool:
        return _dead(task)


def _dead(task: Task) -> Outcome:
    """Return the outcome of a valve that ends every process; without a digest, so that another run tries again."""
    return task.outcome(FAILED, f"{ENDED}, and again when it was tried alone", again=True)


def run_on_cluster(tasks: Iterable[Task], address: str, work: Work = calibrate) -> Iterator[Outcome]:
    """Calibrate valves on the workers of a Dask scheduler (``tcp://10.0.0.5:8786``), and yield what came of each.

    The scheduler gives what a dead worker had, finished or not, to another. After several deaths it gives up all that
    lay on each of those workers: these valves are tried again one at a time, so that only the one that kills is blamed.
    The workers must be able to import `work`.
    """
    with _scheduler_lost(address), _client(address) as client:
        _check_workers(client)
        if not client.nthreads():
            say(
                f"no worker is connected to the Dask scheduler at '{address}': waiting for one, such as `dask worker "
                f"{address} --nthreads 1`; if you stop this, what is done is kept"
            )
        suspects = []
        for task, future in _ended(client, iter(tasks), work):
            if _killed(future):
                suspects.append(task)
            else:
                yield _outcome(future, task)
        for suspect in suspects:
            for task, future in _ended(client, iter([suspect]), work):
                yield _dead(task) if _killed(future) else _outcome(future, task)


@contextmanager
def _scheduler_lost(address: str) -> Iterator[None]:
    """Say of a scheduler that goes away, whatever was under way with it, one sentence instead of Dask's own pages."""
    with suppress(ImportError):  # which is said elsewhere
        import distributed  # noqa: F401  (when first imported it sets the levels of its loggers)
    levels = {name: logging.getLogger(name).level for name in TALKATIVE}
    for name in TALKATIVE:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        yield
    except Exception as error:
        if not isinstance(error, OSError | CancelledError) and not type(error).__module__.startswith("distributed."):
            raise
        raise InputError(
            f"the Dask scheduler at '{address}' is gone; what is done is kept: start one, and give the same command "
            "again with its address"
        ) from error
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


def _check_workers(client: "Client") -> None:
    """Refuse workers without dzdesign, whose valves would be waited for for ever, and those of another version.

    They are asked by a function of Python's own, which each of them has.
    """
    found = client.run(pydoc.locate, "dzdesign.core.version.__version__", on_error="return")
    odd = {name: version for name, version in found.items() if version is None or isinstance(version, str)}
    words = [
        f"'{name}' has {'no dzdesign' if version is None else f'dzdesign {version}'}"
        for name, version in odd.items()
        if version != THIS_TOOL.version
    ]
    if words:
        raise InputError(
            f"of the Dask workers {and_more(words, MOST_NAMED)}; install dzdesign {THIS_TOOL.version} on each of them, "
            "or end them"
        )


def _ended(client: "Client", source: Iterator[Task], work: Work) -> "Iterator[tuple[Task, Future]]":
    """Hand tasks over, a few ahead of the workers, and return each with its future once that has ended."""
    from distributed import as_completed

    tasks: dict[Future, Task] = {}
    number = count()

    def submit(task: Task) -> "Future":
        # With its recordings: scattered ahead of the task they would be lost with the worker they lie on.
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
            future = client.submit(work, task, key=f"valve-{task.name}-{task.digest[:8]}-{next(number)}", pure=False)
        tasks[future] = task
        return future

    ahead = AHEAD * max(sum(client.nthreads().values()), 8)  # workers that come later take from the same heap
    completed = as_completed([submit(task) for task in islice(source, ahead)], loop=client.loop)
    for future in completed:
        task = tasks.pop(future)
        if future.status in ("cancelled", "lost"):
            if client.status != "running":
                raise ConnectionError("the scheduler took its tasks along")
            completed.add(submit(task))  # it forgot a task whose workers died one after the other
            continue
        for following in islice(source, 1):
            completed.add(submit(following))
        yield task, future


def _killed(future: "Future") -> bool:
    from distributed import KilledWorker

    return future.status == "error" and isinstance(future.exception(), KilledWorker)


def _client(address: str) -> "Client":
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError("--dask needs the package distributed; pip install distributed") from error
    try:
        return Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"no Dask scheduler answers at '{address}' within {CONNECT_S} s ({type(error).__name__}); start one with "
            "`dask scheduler`, and give its address such as tcp://10.0.0.5:8786"
        ) from error


def _outcome(future: "Future", task: Task) -> Outcome:
    """Return what a worker made, if it is of this version; or why it made nothing."""
    if future.status == "error":
        return task.outcome(FAILED, f"unexpected: {future.exception()}", again=True)
    outcome: Outcome = future.result()
    if outcome.manifest.tool != THIS_TOOL:
        raise InputError(
            f"a worker runs dzdesign {outcome.manifest.tool.version}, this is {THIS_TOOL.version}; install one version"
        )
    return outcome
