"""What can be checked of a firmware and was not tried, and how to have it tried."""

from dataclasses import replace

from dzdesign.core.verdicts import NOT_ASKED_FOR, NOT_CHECKED
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.requirements import (
    ALWAYS,
    BOARD_FILES,
    C2000WARE,
    LOAD_STEPS,
    OPTIONAL,
    OWN_PLANT,
    POPULATION,
    PRESSURE_INPUTS,
    Requirement,
)

#: Of a file of the user's: nothing that was generated is there to compare it with.
REVIEW = "review it, and try it on the machine"


def untried_requirements(evidence: Evidence) -> tuple[Requirement, ...]:
    """Return what can be checked of a firmware and was not tried, and how to have it tried."""
    tried = {check.id for check in evidence.checks}
    untried = [
        Requirement(id="user-file", title=f"{name}, which is yours and was changed", how=REVIEW)
        for name in evidence.changed_board_files
    ]
    untried += [
        Requirement(id="user-file", title=f"{name}, which is yours", how=REVIEW) for name in evidence.user_files
    ]
    if evidence.board_not_compiled:
        untried.append(replace(BOARD_FILES, how=evidence.board_not_compiled))
    untried += [each for each in ALWAYS if each.id not in tried]
    if evidence.closed_loop.plant is None:
        untried.append(OWN_PLANT)
    if not any(each.is_load_step for each in evidence.scenarios):
        untried.append(LOAD_STEPS)
    if evidence.population is None:
        untried.append(POPULATION)
    if len(evidence.inputs) > 1 and PRESSURE_INPUTS.id not in tried:
        untried.append(PRESSURE_INPUTS)
    optional = OPTIONAL + ((C2000WARE,) if evidence.target == "f28335" else ())
    return tuple(untried + [each for each in optional if each.id not in tried])


def label_of_untried(requirement: Requirement) -> str:
    """Return the words for a requirement that was not tried: only what every `verify` checks was to be."""
    return NOT_CHECKED if requirement.id in {each.id for each in ALWAYS} else NOT_ASKED_FOR


def not_tried(evidence: Evidence) -> tuple[str, ...]:
    """Return the lines of what was not tried, each with the command that would."""
    return tuple(f"{each.title}: {each.how}" for each in untried_requirements(evidence))
