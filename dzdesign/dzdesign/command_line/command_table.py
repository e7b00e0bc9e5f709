"""The commands: group, one line of help, and the module that has their arguments, examples and what runs them.

`dzdesign --help` imports this module and no command's.
"""

from typing import NamedTuple


class Command(NamedTuple):
    """A command of the command line.

    Attributes
    ----------
    group : str
        Heading of `dzdesign --help` under which it stands.
    module : str
        Has ``Arguments``, a dataclass of `dzdesign.core.options`, ``EXAMPLES``, lines for the help, and
        ``run(arguments, json)``, which returns the exit status.
    help : str
        One line.
    """

    group: str
    module: str
    help: str


PIPELINE, EVIDENCE, SETUP = "from ramps to firmware", "evidence", "getting started and diagnostics"
ROOT = "dzdesign.commands"

COMMANDS = {
    "init": Command(PIPELINE, f"{ROOT}.init", "look at recordings and write a commented dzdesign.toml"),
    "identify": Command(PIPELINE, f"{ROOT}.identify", "ramp tests in, valve.json out: k, thresholds, beta(dP)"),
    "design": Command(
        PIPELINE, f"{ROOT}.design", "valve.json in, compensator.json out: the law with exact coefficients, certified"
    ),
    "codegen": Command(PIPELINE, f"{ROOT}.codegen", "compensator.json in, a folder of C out"),
    "verify": Command(PIPELINE, f"{ROOT}.verify", "firmware in, evidence out: every input, and the closed loop"),
    "batch": Command(
        PIPELINE,
        f"{ROOT}.batch",
        "many valves: identify, design, codegen for each; one table, one report, the cost of one lot setting",
    ),
    "assess": Command(EVIDENCE, f"{ROOT}.assess", "compare ramp tests without and with the compensator, with limits"),
    "report": Command(
        EVIDENCE,
        f"{ROOT}.report",
        "artefacts in, report.html out: the verdict, figures, every requirement, the origin of each number",
    ),
    "derive": Command(
        EVIDENCE, f"{ROOT}.derive", "re-derive the paper's equations: premises, steps and a verdict for each"
    ),
    "reproduce": Command(
        EVIDENCE,
        f"{ROOT}.reproduce",
        "the paper's valves through the whole product; every number of the paper beside ours, its figures redrawn",
    ),
    "demo": Command(SETUP, f"{ROOT}.demo", "run the whole pipeline on the bundled example"),
    "simulate": Command(SETUP, f"{ROOT}.simulate", "ramp tests of a simulated valve, marked as such"),
    "monitor": Command(SETUP, f"{ROOT}.monitor", "telemetry of a running firmware in, a ramp file out"),
    "doctor": Command(
        SETUP, f"{ROOT}.doctor", "show which compilers, simulators and packages are there, and how to get the rest"
    ),
    "schema": Command(SETUP, f"{ROOT}.schema", "the JSON Schema of an artefact: its keys, what they mean, their units"),
    "completion": Command(
        SETUP, f"{ROOT}.completion", "print the script by which a shell completes commands, options and targets"
    ),
}
#: Of the front page.
EXAMPLES = (
    "dzdesign demo demo                       the whole pipeline on the bundled example",
    "dzdesign init ramps/*.csv                look at recordings, write dzdesign.toml",
    "dzdesign identify ramps/*.csv --config dzdesign.toml",
    "dzdesign codegen valve.json --target f28335",
    "dzdesign verify firmware",
)
