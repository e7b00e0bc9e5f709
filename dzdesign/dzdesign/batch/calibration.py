"""What is done with one valve: bytes of recordings in, bytes of artefacts out, so that it can run on any machine."""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from typing import Any

from dzdesign.core.artefact_files import TOOL, sha256_of, write_folder
from dzdesign.core.errors import DzdesignError, one_line

OK, FAILED, DOES_NOT_HOLD = "ok", "failed", "does not hold"
#: Folder of a valve's firmware, in the folder of its results.
FIRMWARE = "firmware"
#: A worker may run several threads; NumPy and the solvers of one process would only get in each other's way.
ONE_AT_A_TIME = Lock()


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """All that a worker needs to calibrate one valve; it may share no file with the client.

    Attributes
    ----------
    name : str
        Of the valve.
    recordings : tuple of (str, bytes)
        Name and content of each file.
    identify, design : mapping
        Options of the two commands, as they are written there; what is not given is missing.
    target : str
        Of the firmware.
    verify : bool
        Whether the firmware is verified.
    plant : (str, bytes) or None
        Name and content of the plant's file, for the verification.
    refused : str
        Why it can't be calibrated at all: its recordings can't be read.
    """

    name: str
    recordings: tuple[tuple[str, bytes], ...]
    identify: Mapping[str, Any]
    design: Mapping[str, str]
    target: str
    verify: bool = False
    plant: tuple[str, bytes] | None = None
    refused: str = ""

    @property
    def digest(self) -> str:
        """SHA-256 of all that the result depends on: recordings, options, the tool's version."""
        plant = self.plant and (self.plant[0], sha256_of(self.plant[1]))
        inputs = {
            "tool": TOOL,
            "name": self.name,
            "recordings": [(name, sha256_of(content)) for name, content in self.recordings],
            "identify": dict(self.identify),
            "design": dict(self.design),
            "target": self.target,
            "verify": self.verify,
            "plant": plant,
            "refused": self.refused,
        }
        return sha256_of(json.dumps(inputs, sort_keys=True).encode())


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What came of a valve.

    Attributes
    ----------
    name : str
        Of the valve.
    status : {"ok", "failed", "does not hold"}
        "does not hold": a requirement of its verification.
    reason : str
        Why it is not ok, one sentence.
    digest : str
        Of the task; empty where another run may end otherwise, so that the next one tries again.
    files : mapping of str to bytes
        Path in the valve's folder to content.
    tool : mapping
        Name and version of what made it.
    """

    name: str
    status: str
    reason: str = ""
    digest: str = ""
    files: Mapping[str, bytes] = field(default_factory=dict)
    tool: Mapping[str, str] = field(default_factory=lambda: dict(TOOL))


def calibrate(task: Task) -> Outcome:
    """Identify, design, generate and, if asked for, verify one valve; a failure is an outcome, never an exception."""
    with ONE_AT_A_TIME, TemporaryDirectory() as temporary:
        folder, digest = Path(temporary), task.digest
        try:
            status, reason = (FAILED, task.refused) if task.refused else _run(task, folder)
        except DzdesignError as error:
            status, reason = FAILED, str(error)
        except Exception as error:  # a fault of ours must not stop the batch either
            status, reason, digest = FAILED, f"unexpected {type(error).__name__}: {error}", ""
        # The worker's own folder is no place that the user knows.
        for place in (folder / "recordings", folder):
            reason = reason.replace(f"{place}{os.sep}", "")
        reason = one_line(reason)
        return Outcome(name=task.name, status=status, reason=reason, digest=digest, files=_files(folder / "out"))


def _run(task: Task, folder: Path) -> tuple[str, str]:
    """Run the stages into ``folder/out`` and return status and reason."""
    from dzdesign.codegen.project import generate
    from dzdesign.stages.design import DesignArguments, design
    from dzdesign.stages.identify import IdentifyArguments, identify
    from dzdesign.stages.verify import VerifyArguments, verify

    out = folder / "out"
    out.mkdir()
    paths = []
    for index, (name, content) in enumerate(task.recordings):
        path = folder / "recordings" / name
        if path.exists():  # a list may name files of one name, from several folders
            path = folder / "recordings" / str(index) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        paths.append(path)
    valve = identify(IdentifyArguments(paths, **task.identify, output=out / "valve.json"))
    compensator = design(DesignArguments(valve, target=task.target, **task.design, output=out / "compensator.json"))
    firmware = generate(compensator, task.target)  # proved by the design, a line above
    write_folder(out / FIRMWARE, firmware.files, firmware.manifest)
    if not task.verify:
        return OK, ""
    plant = None
    if task.plant:
        plant = folder / task.plant[0]
        plant.write_bytes(task.plant[1])
    verification = verify(VerifyArguments(out / FIRMWARE, plant=plant, output=out / "evidence"))
    if verification.holds:
        return OK, ""
    check = next(check for check in verification.checks if not check.holds)
    return DOES_NOT_HOLD, f"{check.name}: {check.text}"


def _files(folder: Path) -> dict[str, bytes]:
    """Return the files of a folder, which may be missing."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}
