"""Work of a batch that ends its process without a word; a module of its own, so that other processes can import it."""

import os
import signal

from dzdesign.batch.calibration import Outcome, Task


def die_over_bad(task: Task) -> Outcome:
    """Kill the own process over a valve named bad..., else do nothing."""
    if task.name.startswith("bad"):
        os.kill(os.getpid(), signal.SIGKILL)
    return task.outcome("ok")
