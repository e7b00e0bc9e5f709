"""Whether the checks of evidence follow from its figures: who edits one of both contradicts the other."""

from collections import Counter

from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.design.compensator import Compensator
from dzdesign.verify.closed_loop.loop_checks import loop_checks
from dzdesign.verify.closed_loop.valve_at_corners import valve_at_corners_check
from dzdesign.verify.current.coil_simulation import coil_loop_of
from dzdesign.verify.current.current_checks import checks_of
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.exhaustive.all_inputs import input_checks
from dzdesign.verify.exhaustive.lot_check import lot_checked
from dzdesign.verify.integrator.comparison import native_plant_check
from dzdesign.verify.requirements import (
    FROM_INPUTS,
    FROM_LOOP,
    KNOWN_IDS,
    LOT,
    OF_CURRENT,
    POPULATION,
    ZERO_COMMAND,
    ZERO_FLOW_AFTER_SCENARIOS,
    Check,
)


def contradictions(evidence: Evidence, compensator: Compensator | None) -> tuple[Check, ...]:
    """Return the checks that are said to hold and do not follow from the figures, here counted and compared again.

    One that stands there twice, or that this version does not know, is none either: it would add to what was tried.
    Without a compensator the figures of the inputs alone are looked at.
    """
    inputs, loop = evidence.inputs, evidence.closed_loop
    units = compensator.valve.recorded_units if compensator else AS_COMPUTED
    follow = [check for each in inputs for check in input_checks(each, units, both_signs=len(inputs) > 1)]
    kinds = set(FROM_INPUTS)
    if compensator:
        kinds |= {LOT, POPULATION, *FROM_LOOP, *OF_CURRENT}
        follow += lot_checked(inputs, compensator)
        drive, around, current = compensator.current_drive, coil_loop_of(compensator), evidence.current_loop
        if drive and around and current:
            follow += checks_of(current, drive, around)
            follow += [valve_at_corners_check(current.valve, units)] if current.valve else []
        if loop.pressures and evidence.scenarios:
            given = loop.plant is not None
            follow += loop_checks(
                loop.pressures, evidence.scenarios, compensator, evidence.population, plant_given=given
            )

        if loop.against_integrator:
            by_current, is_stand_in = drive is not None, loop.plant is None
            compared = loop.against_integrator
            follow += [native_plant_check(compared, units, is_stand_in=is_stand_in, by_current=by_current)]

    def key(check: Check) -> tuple[object, ...]:  # another version may word it otherwise, and units be another valve's
        worded_alike = evidence.tool == THIS_TOOL and (compensator is not None or check.id != ZERO_COMMAND.id)
        return (check.id, check.name, check.holds, *((check.text, check.not_required) if worded_alike else ()))

    ids, derived = {kind.id for kind in kinds}, {key(check) for check in follow}
    found = [each for each in evidence.checks if each.holds and each.id in ids and key(each) not in derived]
    if evidence.tool == THIS_TOOL:
        tried = Counter((each.id, each.name) for each in evidence.checks)
        found += [each for each in evidence.checks if each.id not in KNOWN_IDS or tried[each.id, each.name] > 1]
        found += [each for each in evidence.checks if each.not_required and each.id != ZERO_FLOW_AFTER_SCENARIOS.id]
    return tuple(found)
