"""`run`: one options file -> valve, compensator, firmware or other output, evidence and report.

Each stage is called as its own command would be with ``--config``. What a stage read and wrote is kept by hash in
run.json, so that a stage whose inputs and results have not changed is not run again.
"""

import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any, cast

from dzdesign.core.artefact_files import write_file
from dzdesign.core.documents import json_object, read_bytes, sha256_of, to_json
from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath, Option, paths_of
from dzdesign.core.placing import make_folder
from dzdesign.core.version import __version__
from dzdesign.stages.recordings import expand
from dzdesign.terminal.progress import say

if TYPE_CHECKING:
    from dzdesign.command_line.invocation import Invocation
    from dzdesign.verify.evidence import Evidence, OutputEvidence

RECORD, SCHEMA = "run.json", "dzdesign.run/1"
VALVE, COMPENSATOR, EVIDENCE = "valve.json", "compensator.json", "evidence"
#: Where each stage is.
STAGES = {
    "identify": "dzdesign.stages.identify:identify",
    "design": "dzdesign.stages.design:design",
    "codegen": "dzdesign.stages.generate:generate",
    "verify": "dzdesign.stages.verify:verify",
}
#: Arguments of stages that name files to be read, beside what the stage before wrote.
READ = ("ramps", "plant", "blocks", "include")


@dataclass(frozen=True)
class RunArguments:
    """Arguments of `run`."""

    options: Annotated[AnyPath, Option("TOML")] = "dzdesign.toml"
    """Options of all stages in one file, made by `dzdesign init`. It names the recordings: ramps = ["ramps/*.csv"]."""
    _: KW_ONLY
    output: Annotated[AnyPath, Option("DIR", short="-o")] = "."
    """Folder for the artefacts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StageRun:
    """One stage of a run: what it wrote, and whether that was there already."""

    stage: str
    path: Path
    unchanged: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What a run made."""

    stages: tuple[StageRun, ...]
    evidence: "Evidence | OutputEvidence"
    #: Code and count of each warning of `identify`; and what `design` warns of, in words.
    warnings: dict[str, int]
    notes: tuple[str, ...]
    #: On the firmware or other output, in words.
    verdict: str
    #: What to open first.
    report: Path

    @property
    def holds(self) -> bool:
        """Whether every requirement holds."""
        return self.evidence.holds


def run(arguments: RunArguments) -> Run:
    """Run the whole chain with the options of one file: identify, design, codegen, verify.

    Returns
    -------
    Run
        Each stage with its artefact, and the evidence; ``holds`` is true if every requirement holds.

    Raises
    ------
    InputError
        If the file names no recordings, or a stage refuses what it is given. Finished stages stay written.

    Examples
    --------
    >>> from dzdesign import api
    >>> api.run("dzdesign.toml", output="valve_4711").holds             # doctest: +SKIP
    True
    """
    from dzdesign.codegen.other_targets import OTHER_TARGETS, check_target_name, folder_of
    from dzdesign.codegen.project import DEFAULT_TARGET
    from dzdesign.core.artefact_reading import read_artefact
    from dzdesign.design.compensator import Compensator
    from dzdesign.design.costs import design_warnings
    from dzdesign.design.pressure_inputs import not_covered
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.report.valve_report import REPORT_NAME
    from dzdesign.verify.evidence import Evidence, OutputEvidence

    folder, options = Path(arguments.output), os.fspath(arguments.options)
    read_bytes(Path(options), "options file")
    ramps = [os.fspath(each) for each in paths_of(_called(options, "verify", "firmware").arguments.ramps)]
    if not ramps:
        raise InputError(f"'{options}' names no recordings; write above its tables: ramps = [\"ramps/*.csv\"]")
    target = _called(options, "codegen", COMPENSATOR).arguments.target or DEFAULT_TARGET
    check_target_name(target)
    try:
        make_folder(folder)
    except OSError as error:
        raise InputError(f"the folder '{folder}' can't be made: {error.strerror}; choose another -o") from error
    valve, compensator, evidence = (os.fspath(folder / name) for name in (VALVE, COMPENSATOR, EVIDENCE))
    made = os.fspath(folder / folder_of(target))
    of_design = ("--target", DEFAULT_TARGET) if target in OTHER_TARGETS else ()
    done = _Record(folder / RECORD)
    stages = (
        done.stage(_called(options, "identify", *ramps, "-o", valve), []),
        done.stage(_called(options, "design", valve, *of_design, "-o", compensator), [valve]),
        done.stage(_called(options, "codegen", compensator, "-o", made, "--replace"), [compensator]),
        done.stage(_called(options, "verify", made, "-o", evidence), [made]),
    )
    name = OutputEvidence.FILE_NAME if target in OTHER_TARGETS else Evidence.FILE_NAME
    read = read_artefact(read_bytes(Path(evidence) / name, "evidence"), (Evidence, OutputEvidence), name)
    found = cast("Evidence | OutputEvidence", read)
    warnings = read_artefact(read_bytes(Path(valve), "valve file"), ValveModel, valve).warnings
    designed = read_artefact(read_bytes(Path(compensator), "compensator file"), Compensator, compensator)
    codes, verdict = [each.code for each in warnings], found.verdict
    if isinstance(found, Evidence) and found.holds:
        parts = [verdict.removesuffix("."), f"the certificate covers {designed.certified_of}", found.reservation]
        verdict = "; ".join(filter(None, parts)) + "."
    return Run(
        stages=stages, evidence=found, warnings={code: codes.count(code) for code in dict.fromkeys(codes)},
        notes=(*not_covered(designed), *design_warnings(designed)), verdict=verdict,
        report=Path(evidence) / (name if target in OTHER_TARGETS else REPORT_NAME),
    )  # fmt: skip


def _called(options: str, *words: str) -> "Invocation":
    """Return what a command line with the options file behind it asks for."""
    from dzdesign.command_line.invocation import parse

    return parse([*words, "--config", options])


class _Record:
    """What the stages of the last run read and wrote, by hash."""

    def __init__(self, path: Path) -> None:
        self._path = path
        known = json_object(path) if path.is_file() else None
        stages = known.get("stages") if known else None
        self._stages: dict[str, Any] = stages if isinstance(stages, dict) else {}

    def stage(self, call: "Invocation", inputs: Sequence[str]) -> StageRun:
        """Run a stage, unless its inputs and its output are those of the last run."""
        from dzdesign.command_line.invocation import in_words_of_the_file

        arguments, output = call.arguments, Path(call.arguments.output)
        files = [*inputs, *(each for name in READ for each in paths_of(getattr(arguments, name, None) or ()))]
        read = sha256_of(json.dumps([__version__, repr(arguments), *_hashes(files)]).encode())
        if self._stages.get(call.command) == {"read": read, "wrote": list(_hashes([output]))} and output.exists():
            return StageRun(stage=call.command, path=output, unchanged=True)
        say(f"{call.command}: writing {output}")
        try:
            resolve_name(STAGES[call.command])(arguments)
        except InputError as error:
            raise InputError(in_words_of_the_file(str(error), call.options_file, call.from_file)) from error
        self._stages[call.command] = {"read": read, "wrote": list(_hashes([output]))}
        write_file(self._path, to_json({"schema": SCHEMA, "stages": self._stages}), SCHEMA)
        return StageRun(stage=call.command, path=output, unchanged=False)


def _hashes(paths: Sequence[AnyPath]) -> Iterator[str]:
    """Yield the hash of each file, of all that match a pattern, and of all in a folder but a report."""
    for path in paths:
        if Path(path).is_dir():
            for file in sorted(each for each in Path(path).rglob("*") if each.is_file() and each.suffix != ".html"):
                yield f"{file.relative_to(path).as_posix()} {sha256_of(file.read_bytes())}"
        elif Path(path).exists() or "*" in os.fspath(path) or "?" in os.fspath(path):
            for file in expand([path]):
                yield sha256_of(read_bytes(file, "file"))
