"""`dzdesign plan [VALVE.json]`: a series of ramp tests, with the predicted error."""

from dzdesign.stages.plan import PlanArguments, plan
from dzdesign.terminal.page import print_json

Arguments = PlanArguments
EXAMPLES = (
    'dzdesign plan --budget "10 min"',
    'dzdesign plan pilot.json --budget "1 h" --loss "150 mV"',
    'dzdesign plan --dp-range "5..25 MPa" --noise "0.2 L/min" --repeatability "0.1 %" --meter-lag "50 ms +- 10 ms"',
)


def run(arguments: Arguments, json: bool) -> int:
    """Print the plan; 1 if the loss wanted is not reached in the time."""
    from dzdesign.terminal.plan_tables import print_plan

    found = plan(arguments)
    if json:
        print_json(found)
    else:
        print_plan(found)
    return 1 if found.reached is False else 0
