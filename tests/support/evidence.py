"""Evidence as small as it may be, for tests of what reads it."""

from dataclasses import fields, replace
from typing import Any

from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.loop_results import ClosedLoopResult, PressureResult
from dzdesign.verify.requirements import EVERY_RUN
from dzdesign.verify.verification import REQUIREMENTS, Asked, Verification
from dzdesign.verify.verification import verify as verify_folder

#: Every requirement on a firmware, and those that every `verify` tries.
DECLARED = tuple(each for row in REQUIREMENTS for each in row.requirements)
ALWAYS = tuple(each for each in DECLARED if each.how == EVERY_RUN)
LOOP = ClosedLoopResult(plant=None, plant_source="none", plant_sha256=None, dynamics=None, back_MPa=(), pressures=())
EVIDENCE = Evidence(
    tool=THIS_TOOL, made_from=(), target="f28335", changed_board_files=(), user_files=(), differing_files={},
    board_not_compiled="",
    checks=tuple(each.check(holds=True, text="yes") for each in ALWAYS), inputs=(), closed_loop=LOOP, scenarios=(),
    current_loop=None,
)  # fmt: skip


def evidence_with(**changes: Any) -> Evidence:
    """Return evidence of which every requirement holds, with other fields."""
    return replace(EVIDENCE, **changes)


def with_checks(evidence: Evidence, *checks: Any) -> Evidence:
    """Return evidence with further checks."""
    return replace(evidence, checks=(*evidence.checks, *checks))


def verify(folder: Any, plant: Any = None, again: Any = None, **asked: Any) -> Verification:
    """Verify a firmware folder, by default without comparing it."""
    return verify_folder(folder, Asked(plant=plant, **asked), again)


def read_evidence(path: Any) -> Evidence:
    """Return the evidence of a folder or file."""
    path = path / Evidence.FILE_NAME if path.is_dir() else path
    return read_artefact(path.read_bytes(), Evidence, str(path))


def pressure_result(**changes: Any) -> PressureResult:
    """Return what a ramp in closed loop shows that is as good as can be, with other fields."""
    zero = {field.name: 0.0 for field in fields(PressureResult)}
    of_it = {"side": "positive", "unseen_below_L_min": None, "allowed_at_zero_L_min": None}
    return PressureResult(**{**zero, **of_it, **changes})
