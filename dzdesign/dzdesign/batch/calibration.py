"""What is done with one valve: bytes of recordings in, bytes of artefacts out, so that it can run on any machine."""

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from threading import Lock

from dzdesign.core.artefact_files import TOOL, sha256_of, write_folder
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile
from dzdesign.core.errors import DzdesignError, one_line
from dzdesign.core.scratch import scratch_folder
from dzdesign.design.design_choices import DesignChoices
from dzdesign.design.firmware_manifest import Calibration
from dzdesign.report.lot.summary import DOES_NOT_HOLD, FAILED, OK, Status
from dzdesign.report.lot.valve_folder import FIRMWARE, ValveManifest
from dzdesign.stages.identify import IdentifyChoices

#: A worker may run several threads; NumPy and the solvers of one process would only get in each other's way.
SOLVER_LOCK = Lock()


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """All that a worker needs to calibrate one valve; it may share no file with the client.

    Recordings and plant are name and content of a file; the options of `identify` and `design` are as they are written
    on the command line, what is not given is missing. `refused` says why it can't be calibrated at all: its recordings
    can't be read.
    """

    name: str
    recordings: tuple[tuple[str, bytes], ...]
    identify: IdentifyChoices
    design: DesignChoices
    target: str
    calibration: Calibration = "fixed"
    verify: bool = False
    plant: tuple[str, bytes] | None = None
    refused: str = ""

    @property
    def digest(self) -> str:
        """SHA-256 of all that the result depends on: recordings, options, the tool's version."""
        inputs = {
            "tool": TOOL,
            "name": self.name,
            "recordings": [(name, sha256_of(content)) for name, content in self.recordings],
            "identify": asdict(self.identify),
            "design": asdict(self.design),
            "target": self.target,
            "calibration": self.calibration,
            "verify": self.verify,
            "plant": self.plant and (self.plant[0], sha256_of(self.plant[1])),
            "refused": self.refused,
        }
        return sha256_of(json.dumps(inputs, sort_keys=True).encode())

    def outcome(
        self, status: Status, reason: str = "", files: Mapping[str, bytes] | None = None, *, again: bool = False
    ) -> "Outcome":
        """Return what came of it; `files` by their path in the valve's folder.

        The next run tries it `again` where that may end otherwise.
        """
        manifest = ValveManifest(
            tool=THIS_TOOL,
            made_from=tuple(SourceFile(source=name, sha256=sha256_of(content)) for name, content in self.recordings),
            name=self.name,
            status=status,
            reason=one_line(reason),
            inputs_sha256=None if again else self.digest,
            files={},
        )
        return Outcome(manifest=manifest, files=files or {})


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What came of a valve: the manifest of its folder, without hashes yet, and the files by their path in it."""

    manifest: ValveManifest
    files: Mapping[str, bytes] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Of the valve."""
        return self.manifest.name


def calibrate(task: Task) -> Outcome:
    """Identify, design, generate and, if asked for, verify one valve; a failure is an outcome, never an exception."""
    if task.refused:
        return task.outcome(FAILED, task.refused)
    with SOLVER_LOCK, scratch_folder() as folder:
        again = False
        status: Status
        try:
            status, reason = _run(task, folder)
        except DzdesignError as error:
            status, reason = FAILED, str(error)
        except Exception as error:  # a fault of ours must not stop the batch either
            status, reason, again = FAILED, f"unexpected {type(error).__name__}: {error}", True
        # The worker's own folder is no place that the user knows.
        for place in (folder / "recordings", folder):
            reason = reason.replace(f"{place}{os.sep}", "")
        out = folder / "out"
        paths = sorted(path for path in out.rglob("*") if path.is_file())  # none where nothing came to be written
        files = {path.relative_to(out).as_posix(): path.read_bytes() for path in paths}
        return task.outcome(status, reason, files, again=again)


def _run(task: Task, folder: Path) -> tuple[Status, str]:
    """Run the stages into ``folder/out`` and return status and reason."""
    from dzdesign.batch.blocks import write_block
    from dzdesign.codegen.project import generate
    from dzdesign.stages.design import DesignArguments, design
    from dzdesign.stages.identify import IdentifyArguments, identify
    from dzdesign.stages.verify import VerifyArguments, verify_firmware

    out = folder / "out"
    out.mkdir()
    recordings = _write_recordings(task, folder)
    valve = identify(IdentifyArguments(recordings, **vars(task.identify), output=out / "valve.json"))
    compensator = design(
        DesignArguments(valve, target=task.target, **vars(task.design), output=out / "compensator.json")
    )
    place = out / FIRMWARE
    if task.calibration == "block":
        status, reason = write_block(compensator, task.target, out)
        if status != OK or not task.verify:
            return status, reason
        place = folder / FIRMWARE  # the lot's firmware stands beside all valves
    firmware = generate(compensator, task.target, calibration=task.calibration)  # proved by the design above
    write_folder(place, firmware.contents, firmware.manifest)
    if not task.verify:
        return OK, ""
    plant = None
    if task.plant:
        plant = folder / task.plant[0]
        plant.write_bytes(task.plant[1])
    arguments = VerifyArguments(place, ramps=recordings, plant=plant, output=out / "evidence")
    verification = verify_firmware(arguments, identified=valve)
    if verification.holds:
        return OK, ""
    check = next(check for check in verification.evidence.all_checks if not check.holds)
    return DOES_NOT_HOLD, f"{check.name}: {check.text}"


def _write_recordings(task: Task, folder: Path) -> list[Path]:
    paths = []
    for index, (name, content) in enumerate(task.recordings):
        path = folder / "recordings" / name
        if path.exists():  # a list may name files of one name, from several folders
            path = folder / "recordings" / str(index) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        paths.append(path)
    return paths
