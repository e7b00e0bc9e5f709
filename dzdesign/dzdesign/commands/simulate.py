"""`dzdesign simulate`."""

from dzdesign.core.artefact_files import to_json
from dzdesign.core.artefact_types import as_document
from dzdesign.core.errors import one_line
from dzdesign.stages.simulate import SimulateArguments, simulate

Arguments = SimulateArguments
EXAMPLES = (
    'dzdesign simulate --dp "1 MPa" --dp "5 MPa" -o ramps',
    "dzdesign simulate --firmware firmware -o after",
)


def run(arguments: Arguments, json: bool) -> int:
    """Simulate ramp tests and print where they are."""
    made = simulate(arguments)
    written = one_line(f"Written: {len(made.files)} simulated ramp tests in {arguments.output}")
    print(to_json(as_document(made.manifest)) if json else written)
    return 0
