"""`dzdesign design VALVE.json`."""

from dzdesign.core.errors import one_line
from dzdesign.stages.design import DesignArguments, design

Arguments = DesignArguments
EXAMPLES = ("dzdesign design valve.json", 'dzdesign design valve.json --transition "1 %" --target cortex-m4')


def run(arguments: Arguments, json: bool) -> int:
    """Design a compensator and print its law, certificate and costs."""
    compensator = design(arguments)
    if json:
        from dzdesign.core.artefact_types import to_json_bytes

        print(to_json_bytes(compensator).decode(), end="")
        return 0
    from dzdesign.terminal.tables import print_compensator

    print_compensator(compensator)
    print(one_line(f"Written: {arguments.output}"))
    return 0
