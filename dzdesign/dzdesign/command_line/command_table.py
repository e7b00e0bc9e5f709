"""The commands: group and help line in `dzdesign --help`; a module of `dzdesign.commands` bears each one's
name, or a row of `dzdesign.commands.relays`.

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
    "init": Command(PIPELINE, "inspect recordings and write a commented dzdesign.toml"),
    "identify": Command(PIPELINE, "fit the valve to its ramp tests: gain, thresholds and beta(dP), in valve.json"),
    "design": Command(PIPELINE, "compute the certified law with exact coefficients, in compensator.json"),
    "codegen": Command(PIPELINE, "write C firmware, or Structured Text, FMUs, a MATLAB function, an amplifier's file"),
    "calibration": Command(PIPELINE, "write one valve's calibration block, or read one back"),
    "export": Command(PIPELINE, "compute the fixed dead-zone parameters of an amplifier"),
    "verify": Command(PIPELINE, "check a firmware on every input and in closed loop, and write the evidence"),
    "batch": Command(PIPELINE, "calibrate many valves, with one table and one report"),
    "assess": Command(EVIDENCE, "compare ramp tests without and with the compensator, with limits"),
    "report": Command(EVIDENCE, "write report.html from the artefacts in a folder"),
    "derive": Command(EVIDENCE, "derive the paper's equations again: premises, steps and a verdict for each"),
    "reproduce": Command(EVIDENCE, "compute the paper's numbers and figures again, and compare them"),
    "demo": Command(SETUP, "run the whole chain on the bundled example"),
    "simulate": Command(SETUP, "simulate ramp tests of a valve; the files are marked as simulated"),
    "monitor": Command(SETUP, "record the telemetry of a running firmware as a ramp file"),
    "load": Command(SETUP, "load a calibration block into an amplifier over its serial line"),
    "doctor": Command(SETUP, "list compilers, simulators and packages, and how to install what is missing"),
}
#: Of the front page.
EXAMPLES = (
    "dzdesign demo demo                       run the whole chain on the bundled example",
    "dzdesign init ramps/*.csv                inspect recordings and write dzdesign.toml",
    "dzdesign identify ramps/*.csv --config dzdesign.toml",
    "dzdesign design valve.json               with --command-signal for a valve driven to both sides",
    "dzdesign codegen compensator.json --target f28335",
    "dzdesign verify firmware --ramps ramps/*.csv",
)
