"""What is done with one valve: bytes of recordings in, bytes of artefacts out, so that it can run on any machine."""

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

from dzdesign.batch.outputs import ForOutputs, WantedOutput, make_output, may_end_otherwise, reason_of_outputs
from dzdesign.core.artefact_files import TOOL, write_folder
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile, to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import DzdesignError, one_line
from dzdesign.core.placing import scratch_folder
from dzdesign.design.design_choices import DesignChoices
from dzdesign.design.firmware_manifest import BLOCK_FILE, Calibration
from dzdesign.report.lot.summary import (
    DOES_NOT_HOLD,
    FAILED,
    FIRMWARE,
    NOT_MADE,
    OK,
    Status,
    ValveManifest,
    ValveOutput,
)
from dzdesign.stages.identify import IdentifyChoices
from dzdesign.terminal.progress import reporting

if TYPE_CHECKING:
    from dzdesign.codegen.calibration.layout import BuiltFor
    from dzdesign.design.compensator import Compensator
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.verify.exhaustive.block_check import BlockFirmware

#: The same block for the programmer at the end of the line.
BLOCK_IMAGE = "calibration.hex"
#: Folder of a valve's evidence.
EVIDENCE = "evidence"
#: A worker may run several threads; NumPy and the solvers of one process would only get in each other's way.
SOLVER_LOCK = Lock()


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """All that a worker needs to calibrate one valve; it may share no file with the client.

    Recordings and plant are name and content of a file; the options of `identify` and `design` are as written
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
    outputs: tuple[WantedOutput, ...] = ()
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
            "outputs": [asdict(each) for each in self.outputs],
            "refused": self.refused,
        }
        return sha256_of(json.dumps(inputs, sort_keys=True).encode())

    def outcome(
        self,
        status: Status,
        reason: str = "",
        *,
        again: bool = False,
        outputs: tuple[ValveOutput, ...] = (),
    ) -> "Outcome":
        """Return what came of it, without its files; the next run tries it `again` where that may end otherwise."""
        manifest = ValveManifest(
            tool=THIS_TOOL,
            made_from=tuple(SourceFile(source=name, sha256=sha256_of(content)) for name, content in self.recordings),
            name=self.name,
            status=status,
            reason=one_line(reason),
            inputs_sha256=None if again else self.digest,
            outputs=outputs,
            files={},
        )
        return Outcome(manifest=manifest)


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
    # The batch says a line for each valve; a stage's own would not name its valve, and a worker knows no --quiet.
    with SOLVER_LOCK, reporting(quiet=True, verbose=False), scratch_folder() as folder:
        try:
            manifest = _run(task, folder).manifest
        except DzdesignError as error:
            manifest = task.outcome(FAILED, str(error)).manifest
        except Exception as error:  # a fault of ours must not stop the batch either
            manifest = task.outcome(FAILED, f"unexpected {type(error).__name__}: {error}", again=True).manifest
        out = folder / "out"
        paths = sorted(path for path in out.rglob("*") if path.is_file())  # none where nothing came to be written
        files = {path.relative_to(out).as_posix(): path.read_bytes() for path in paths}
        outputs = tuple(replace(each, reason=_of_the_user(each.reason, folder)) for each in manifest.outputs)
        reason = _of_the_user(manifest.reason, folder)
        return Outcome(manifest=replace(manifest, reason=reason, outputs=outputs), files=files)


def _of_the_user(reason: str, folder: Path) -> str:
    """Return a reason without the worker's own folder, which is not a place that the user knows."""
    for place in (folder / "recordings", folder / "out", folder):
        reason = reason.replace(f"{place}{os.sep}", "")
    return reason


def _run(task: Task, folder: Path) -> Outcome:
    """Run the stages into ``folder/out``."""
    from dzdesign.stages.design import DesignArguments, design
    from dzdesign.stages.identify import IdentifyArguments, identify

    out = folder / "out"
    out.mkdir()
    recordings = _write_recordings(task, folder)
    valve = identify(IdentifyArguments(recordings, **vars(task.identify), output=out / "valve.json"))
    compensator = design(
        DesignArguments(valve, target=task.target, **vars(task.design), output=out / "compensator.json")
    )
    status, reason = _firmware(task, folder, valve, compensator, recordings)
    if status != OK:
        unmade = tuple(_unmade(each, "the firmware does not hold") for each in task.outputs)
        return task.outcome(status, reason, outputs=unmade)
    of = ForOutputs(compensator=compensator, valve=valve, recordings=recordings, place=out, verify=task.verify)
    outputs = tuple(make_output(each, of) for each in task.outputs)
    if outputs and task.verify:
        _report_with_outputs(out)
    again = any(map(may_end_otherwise, outputs))
    status = DOES_NOT_HOLD if any(each.verdict == DOES_NOT_HOLD for each in outputs) else FAILED if again else OK
    return task.outcome(status, reason_of_outputs(outputs), again=again, outputs=outputs)


def _report_with_outputs(out: Path) -> None:
    """Write the valve's report as `dzdesign report` does: if that changed a file, the next run would make all again."""
    from dzdesign.report.valve_report import REPORT_NAME
    from dzdesign.stages.report import ReportArguments, report

    report(ReportArguments(out, output=out / EVIDENCE / REPORT_NAME))


def _unmade(wanted: WantedOutput, reason: str) -> ValveOutput:
    return ValveOutput(target=wanted.target, folder=wanted.folder, verdict=NOT_MADE, reason=reason)


def _firmware(
    task: Task, folder: Path, valve: "ValveModel", compensator: "Compensator", recordings: list[Path]
) -> tuple[Status, str]:
    """Write a valve's firmware or block into ``folder/out``, and verify it if asked for; return status and reason."""
    from dzdesign.codegen.project import generate
    from dzdesign.stages.verify import VerifyArguments, verify_firmware

    out = folder / "out"
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
    arguments = VerifyArguments(place, ramps=recordings, plant=plant, output=out / EVIDENCE)
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


def write_block(compensator: "Compensator", target: str, folder: Path) -> tuple[Status, str]:
    """Write the block of the compensator.json in `folder`, and what came of every input; return status and reason.

    A compensator that a block has no room for is an `InputError`.
    """
    from dzdesign.codegen.calibration.block import block_of, built_for
    from dzdesign.codegen.calibration.packing import image_of, pack
    from dzdesign.codegen.project import target_named

    name = "compensator.json"
    digest = sha256_of((folder / name).read_bytes())
    octets = pack(block_of(compensator, digest))
    (folder / BLOCK_FILE).write_bytes(octets)
    (folder / BLOCK_IMAGE).write_bytes(image_of(octets, "hex", target_named(target).block_place))
    found = _block_firmware(built_for(compensator)).check(octets, compensator, SourceFile(source=name, sha256=digest))
    (folder / found.FILE_NAME).write_bytes(to_json_bytes(found))
    if found.holds:
        return OK, ""
    check = found.requirement(BLOCK_FILE, compensator)
    return DOES_NOT_HOLD, f"{check.name}: {check.text}"


@cache
def _block_firmware(built: "BuiltFor") -> "BlockFirmware":
    """Return the core as `codegen` writes it, which stays compiled as long as this process lives."""
    from dzdesign.codegen.project import block_core
    from dzdesign.verify.exhaustive.block_check import BlockFirmware
    from dzdesign.verify.toolchain.host_compiler import build_folder

    texts = {name: text.encode() for name, text in block_core(built).items()}
    folder = build_folder() / f"core-{sha256_of(b''.join(texts.values()))[:32]}"
    for name, content in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return BlockFirmware(folder)
