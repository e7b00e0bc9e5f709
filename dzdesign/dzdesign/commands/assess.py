"""`dzdesign assess BEFORE... --after AFTER...`."""

from dzdesign.core.errors import one_line
from dzdesign.stages.assess import AssessArguments, assess
from dzdesign.terminal.page import print_json

Arguments = AssessArguments
EXAMPLES = (
    'dzdesign assess before/*.csv --after after/*.csv --limits "dead_zone_opening = 5 %"',
    "dzdesign assess before/*.csv --after after/*.csv --config dzdesign.toml --plots plots",
)


def run(arguments: Arguments, json: bool) -> int:
    """Compare recordings; 1 if one with the compensator misses a limit, or a limit can't be checked."""
    from dzdesign.terminal.assessment_tables import print_assessment

    found = assess(arguments)
    if json:
        print_json(found)
    else:
        print_assessment(found)
        plots = f", plots in {arguments.plots}" if arguments.plots else ""
        print(one_line(f"Written: {arguments.output}{plots}"))
    return 0 if found.holds else 1
