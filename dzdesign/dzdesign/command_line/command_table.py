"""The commands: group of `dzdesign --help` and one line of help; a module of `dzdesign.commands` has each one's name.

Such a module has ``Arguments``, a dataclass of `dzdesign.core.options`, ``EXAMPLES``, lines for the help, and
``run(arguments, json)``, which returns the exit status. `dzdesign --help` imports this module and no command's.
"""

from typing import NamedTuple


class Command(NamedTuple):
    """A command of the command line: the heading of `dzdesign --help` under which it stands, and its line there."""

    group: str
    help: str


PIPELINE, EVIDENCE, SETUP = "from ramps to firmware", "evidence", "getting started and diagnostics"

COMMANDS = {
    "plan": Command(PIPELINE, "plan a test series: pressures, ramp times and repeats, with the predicted error"),
    "init": Command(PIPELINE, "look at recordings and write a commented dzdesign.toml"),
    "identify": Command(PIPELINE, "ramp tests in, valve.json out: k, thresholds, beta(dP)"),
    "design": Command(PIPELINE, "valve.json in, compensator.json out: the law with exact coefficients, certified"),
    "codegen": Command(PIPELINE, "compensator.json in, a folder of C out"),
    "calibration": Command(PIPELINE, "compensator.json in, one valve's calibration block out; or read one back"),
    "export": Command(PIPELINE, "compensator.json in, an amplifier's fixed dead-zone parameters out"),
    "verify": Command(PIPELINE, "firmware in, evidence out: every input, and the closed loop"),
    "batch": Command(
        PIPELINE, "many valves: identify, design, codegen for each; one table, one report, the cost of one lot setting"
    ),
    "assess": Command(EVIDENCE, "compare ramp tests without and with the compensator, with limits"),
    "report": Command(
        EVIDENCE, "artefacts in, report.html out: the verdict, figures, every requirement, the origin of each number"
    ),
    "derive": Command(EVIDENCE, "re-derive the paper's equations: premises, steps and a verdict for each"),
    "reproduce": Command(
        EVIDENCE,
        "the paper's valves through the whole product; every number of the paper beside ours, its figures redrawn",
    ),
    "demo": Command(SETUP, "run the whole pipeline on the bundled example"),
    "simulate": Command(SETUP, "ramp tests of a simulated valve, marked as such"),
    "monitor": Command(SETUP, "telemetry of a running firmware in, a ramp file out"),
    "load": Command(SETUP, "a calibration block into a drive, over its serial line"),
    "doctor": Command(SETUP, "show which compilers, simulators and packages are there, and how to get the rest"),
    "schema": Command(SETUP, "the JSON Schema of an artefact: its keys, what they mean, their units"),
    "completion": Command(SETUP, "print the script by which a shell completes commands, options and targets"),
}
#: Of the front page.
EXAMPLES = (
    "dzdesign demo demo                       the whole pipeline on the bundled example",
    "dzdesign init ramps/*.csv                look at recordings, write dzdesign.toml",
    "dzdesign identify ramps/*.csv --config dzdesign.toml",
    "dzdesign codegen valve.json --target f28335",
    "dzdesign verify firmware",
)
