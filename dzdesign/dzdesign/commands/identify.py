"""`dzdesign identify RAMP...`."""

from dzdesign.core.errors import one_line
from dzdesign.stages.identify import IdentifyArguments, identify
from dzdesign.terminal.page import print_json

Arguments = IdentifyArguments
EXAMPLES = (
    'dzdesign identify ramps/*.csv --meter-lag "0.1 s"',
    "dzdesign identify ramps/*.csv --config dzdesign.toml --plots plots",
    'dzdesign identify ramp.csv --dp "1 MPa" --columns "u=AO0:V, Q=Flow (L/min)"',
)


def run(arguments: Arguments, json: bool) -> int:
    """Identify a valve and print its thresholds."""
    from dzdesign.terminal.tables import print_valve

    valve = identify(arguments)
    if json:
        print_json(valve)
    else:
        print_valve(valve)
        plots = f", plots in {arguments.plots}" if arguments.plots else ""
        print(one_line(f"Written: {arguments.output}{plots}"))
        if len(valve.sides) == 2:
            print("Next, for commands of both signs; state the signal at your converter (and --config, if you use it):")
            print(one_line(f'  dzdesign design {arguments.output} --command-signal "-10..10 V x 0.12 + 1.5 V"'))
    return 0
