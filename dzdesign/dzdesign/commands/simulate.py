"""`dzdesign simulate`."""

from dzdesign.core.errors import one_line
from dzdesign.stages.simulate import SimulateArguments, simulate
from dzdesign.terminal.page import print_json

Arguments = SimulateArguments
EXAMPLES = (
    'dzdesign simulate --dp "1 MPa" --dp "5 MPa" -o ramps',
    "dzdesign simulate --firmware firmware -o after",
)


def run(arguments: Arguments, json: bool) -> int:
    """Simulate ramp tests and print where they are."""
    made = simulate(arguments)
    if json:
        print_json(made.manifest)
    else:
        tests = "test" if len(made.files) == 1 else "tests"
        print(one_line(f"Written: {len(made.files)} simulated ramp {tests} in folder '{arguments.output}'"))
    return 0
