"""What passes at zero command where no requirement forbids it: no failure of the firmware, and not harmless."""

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.verify.closed_loop.drive_corners import NOT_DECLARED
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN
from dzdesign.verify.closed_loop.loop_checks import in_which_runs
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.loop_results import ScenarioResult

#: What a scenario measures whose flow is that of a command that was never taken away.
OF_A_COMMAND = "flow_after_zero_command_L_min"
#: What a machine is declared by; the caution beside it says that none was.
DECLARE = "Declare the machine to `design`: `--coil-temperature` with `--supply`, `--amplifier` or `--drive current`."


def unrequired_flow(evidence: Evidence, units: RecordedUnits) -> str:
    """Say how much passes at zero command at most, in the scenarios in which no flow is not required; empty if none.

    A flow that the recordings do not show is none here: the card of the flow at zero command has its bound.
    """
    passing = [each for each in evidence.scenarios if not each.must_shut and _is_seen(each)]
    if not passing:
        return ""
    most = max(passing, key=lambda one: one.q_zero_L_min)
    flow = units.text(most.q_zero_L_min, ".3g L/min")
    remedy = DECLARE if most.not_required == NOT_DECLARED else f"Reason: {most.not_required}."
    return (
        f"Not required, and not harmless: up to {flow} at zero command "
        f"({most.name}{in_which_runs(most, passing, units)}). {remedy}"
    )


def _is_seen(scenario: ScenarioResult) -> bool:
    """Return whether flow passes at zero command, beyond what may and what the recordings hide."""
    shown = scenario.q_zero_L_min >= (scenario.unseen_below_L_min or 0.0)
    return shown and scenario.q_beyond_L_min > NO_FLOW_L_MIN and OF_A_COMMAND not in scenario.figures
