"""`dzdesign design VALVE.json`."""

from dzdesign.core.errors import one_line
from dzdesign.stages.design import DesignArguments, design
from dzdesign.terminal.page import print_json

Arguments = DesignArguments
EXAMPLES = ("dzdesign design valve.json", "dzdesign design valve.json --hysteresis play --target cortex-m4")


def run(arguments: Arguments, json: bool) -> int:
    """Design a compensator and print its law, certificate and costs."""
    from dzdesign.design.redesign import hysteresis_choices
    from dzdesign.terminal.choices_table import print_choices
    from dzdesign.terminal.tables import print_compensator

    compensator = design(arguments)
    if json:
        print_json(compensator)
    else:
        print_compensator(compensator)
        read_at = compensator.valve.recorded_units.text(compensator.reading_flow_L_min, ".2f L/min")
        print_choices(hysteresis_choices(compensator), read_at, dithered=compensator.valve.dither is not None)
        print(one_line(f"Written: {arguments.output}"))
    return 0
