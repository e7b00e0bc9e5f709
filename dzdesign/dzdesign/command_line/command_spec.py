"""What can be said on the command line: every command with its options, their groups, and examples.

An option is declared as argparse takes it, but argparse is only imported once there is something to parse.
"""

#: Options that may be a table in the TOML file.
TABLES = ("columns", "dp", "after_columns", "limits", "record")
#: Of them those that are given an entry at a time on the command line, which goes before the file's of the same name.
BY_ENTRY = ("record",)
#: (names, keywords of add_argument).
Option = tuple[tuple[str, ...], dict]


def _given(*names: str, **keywords: object) -> Option:
    if "default" in keywords:
        keywords["help"] = f"{keywords['help']} (default: %(default)s)"
    return names, keywords


OUTPUT = ("-o", "--output")
#: Of every command that reads recordings.
COLUMNS = _given(
    "--columns",
    metavar="MAP",
    help='columns, such as "u=AO0:V, Q=Flow (L/min)": a quantity (time, u, dP, pA, pB, Q), its '
    "label in the file and, after a colon, the unit that the label lacks; in the TOML file a table",
)
DP = _given(
    "--dp",
    metavar="P",
    help='pressure drop of files without a column of it, such as "1 MPa"; in the TOML file also a table '
    "[dp] from file name (or pattern) to pressure",
)
SKIP_ROWS = _given(
    "--skip-rows",
    metavar="N",
    help="rows that stand above the header of a file of text, such as a logger's words (default: found)",
)
U_MAX = _given("--u-max", default="10 V", metavar="U", help="full command")
METER_LAG = _given("--meter-lag", metavar="T", help="lag of the flow meter (default: found from ramps of two rates)")
METER_FLOOR = _given("--meter-floor", metavar="Q", help="flow below which the meter reads zero (default: found)")
KNEE_WINDOW = _given("--knee-window", default="12-50", metavar="A-B", help="per cent of the largest flow, straight")
#: Of `identify`, for each valve of `batch` too.
IDENTIFY = (
    COLUMNS,
    DP,
    SKIP_ROWS,
    _given("--dp0", metavar="P", help='reference pressure drop (default: the test nearest to "1 MPa")'),
    U_MAX,
    METER_FLOOR,
    METER_LAG,
    _given("--meter-zero", default="0 L/min", metavar="Q", help="bound of the meter's zero error"),
    _given("--x-max", metavar="X", help='stroke, such as "1.8 mm": gives k in V/mm'),
    _given("--confidence", default="0.99", metavar="C", help="of all lower bounds together"),
    KNEE_WINDOW,
    _given(
        "--flat-below",
        default="0.1",
        metavar="C",
        help="per cent of full command: a threshold that changes by less over the tests is flat, beta is 1",
    ),
    _given(
        "--record",
        action="append",
        metavar="ENTRY",
        help='who and what, such as "serial = 4711", repeatable: kept in valve.json and shown in the report, nothing '
        "is computed from it; in the TOML file a table [record]",
    ),
)
#: Of `design`, and of `codegen` where it designs first; their defaults stand in `dzdesign.command_line.design_options`.
DESIGN = (
    _given("--law", metavar="LAW", help="paper: Eq. (18); target: meets Eq. (16) (default: paper)"),
    _given("--guard", metavar="G", help="threshold to protect: closing, mean or opening (default: closing)"),
    _given("--accept", metavar="CODE", help="design in spite of this warning: branch-order (default: refuse)"),
    _given(
        "--edge",
        metavar="C",
        help='over the first "1 %%" of command run from the closing threshold to the opening one (default: off)',
    ),
    _given(
        "--below-dp0",
        metavar="B",
        help="below dP0 hold beta = 1 as the paper does, or extend it to the tests there (default: hold)",
    ),
    _given(
        "--command-signal",
        metavar="S",
        help='command at the converter: range, attenuator, offset, such as "-10..10 V x 0.15 + 1.5 V", which has both '
        "signs (default: 0 to 10 V over the converter's whole range)",
    ),
    _given("--polarity", metavar="P", help="normal, or inverted: the command counts the other way (default: normal)"),
    _given("--pressure-span", metavar="P", help='span of both pressure sensors (default: "20 MPa")'),
    _given(
        "--pressure-a",
        metavar="S",
        help='sensor ahead of the edge, such as "4..20 mA on 150 ohm = 25 MPa" (default: the converter\'s whole range)',
    ),
    _given("--pressure-b", metavar="S", help="sensor behind the edge (default: the converter's whole range)"),
    _given(
        "--negative-dp",
        metavar="D",
        help="pressure drop of negative commands: same, or swapped, B less A (default: same)",
    ),
    _given(
        "--zero-window",
        metavar="C",
        help='of both signs: pass zero by this before the other solenoid is driven (default: "1 %%")',
    ),
    _given(
        "--ramp-up",
        metavar="T",
        help='time from zero to full command, such as "0.5 s" or "0.5 s / 0.8 s" (default: none)',
    ),
    _given("--ramp-down", metavar="T", help="time from full command to zero (default: none)"),
    _given(
        "--dither",
        metavar="D",
        help='square wave on the output, such as "150 Hz 1 %%": plus and minus 1 %% of full drive (default: off)',
    ),
    _given("--output-max", metavar="C", help='largest drive (default: "100 %%")'),
)
TARGET = _given("--target", default="f28335", metavar="NAME", help="microcontroller, see codegen --list-targets")
PLANT = _given("--plant", metavar="PLANT.toml", help="plant, like examples/paper_valve/plant.toml")

#: Command -> (one line of help, function that runs it, its options).
COMMANDS: dict[str, tuple[str, str, tuple[Option, ...]]] = {
    "demo": (
        "run the whole pipeline on the bundled example",
        "dzdesign.commands.demo:run_demo",
        (_given("folder", metavar="DIR", help="folder for the artefacts"),),
    ),
    "derive": (
        "re-derive the paper's equations: premises, steps and a verdict for each",
        "dzdesign.commands.pipeline:run_derive",
        (
            _given("--format", default="text", metavar="F", help="text, json, latex or html"),
            _given("--equation", action="append", metavar="N", help="18 or T3b: this one and what it rests on"),
            _given("--mutate", action="store_true", help="instead, make every equation wrong; count what is caught"),
            _given(*OUTPUT, metavar="FILE", help="file to write (default: standard output)"),
        ),
    ),
    "identify": (
        "ramp tests in, valve.json out: k, thresholds, beta(dP)",
        "dzdesign.commands.pipeline:run_identify",
        (
            _given(
                "ramps",
                nargs="+",
                metavar="RAMP",
                help="CSV, TDMS, MAT, HDF5, Parquet or Feather: columns time_s, u_V, dP_MPa, Q_Lmin",
            ),
            _given(*OUTPUT, default="valve.json", metavar="FILE", help="file to write"),
            *IDENTIFY,
            _given(
                "--plots",
                metavar="DIR",
                help="also draw, as SVG and PNG in this folder: each pressure drop's flow with its knees, onsets and "
                "residuals; thresholds, bounds and beta over dP",
            ),
        ),
    ),
    "design": (
        "valve.json in, compensator.json out: the law with exact coefficients, certified",
        "dzdesign.commands.pipeline:run_design",
        (
            _given("valve", metavar="VALVE.json", help="made by `dzdesign identify`"),
            _given(*OUTPUT, default="compensator.json", metavar="FILE", help="file to write"),
            TARGET,
            *DESIGN,
        ),
    ),
    "codegen": (
        "compensator.json in, a folder of C out",
        "dzdesign.commands.pipeline:run_codegen",
        (
            _given(
                "source",
                nargs="?",
                metavar="COMPENSATOR.json",
                help="or a VALVE.json: designed first, for the target, with the options below",
            ),
            _given(*OUTPUT, default="firmware", metavar="DIR", help="folder to write"),
            _given(
                "--target",
                metavar="NAME",
                help="microcontroller, see --list-targets (default: that of the design; of a VALVE.json f28335)",
            ),
            _given("--list-targets", action="store_true", help="print name and description of every target"),
            *DESIGN,
        ),
    ),
    "verify": (
        "firmware in, evidence out: every input, and the closed loop",
        "dzdesign.commands.pipeline:run_verify",
        (
            _given("firmware", metavar="DIR", help="made by `dzdesign codegen`"),
            _given(*OUTPUT, default="evidence", metavar="DIR", help="folder to write"),
            PLANT,
            _given(
                "--tolerances",
                metavar="TOL.toml",
                help="also run a series of plants, like examples/paper_valve/tolerances.toml; needs --plant",
            ),
            _given(
                "--include",
                action="append",
                metavar="DIR",
                help="where headers lie that your board files include, such as your chip's; may be repeated",
            ),
            _given("--c2000ware", metavar="DIR", help="also compile f28335 firmware against your C2000Ware's headers"),
            _given("--mutate", action="store_true", help="also make the C wrong in every place; count what is caught"),
            _given("--proof", action="store_true", help="also show by Frama-C that nothing overflows a 16-bit int"),
            _given(
                "--machine-code",
                action="store_true",
                help="also check machine code: every input on a Cortex-M4 in QEMU, a sample on an AVR in simavr",
            ),
        ),
    ),
    "batch": (
        "many valves: identify, design, codegen for each; one table, one report, and the cost of one common setting",
        "dzdesign.batch.command:run_batch",
        (
            _given(
                "source",
                metavar="FOLDER",
                help="one subfolder of recordings a valve; or a CSV file with a row a valve: name, files (patterns, "
                "parted by ;), record.NAME, and any option below that is different for it",
            ),
            _given(*OUTPUT, default="batch", metavar="DIR", help="folder to write; an earlier run there is taken up"),
            _given("--jobs", metavar="N", help="processes of this machine (default: as many as it has processors)"),
            _given("--dask", metavar="ADDRESS", help="instead, a Dask scheduler, such as tcp://10.0.0.5:8786"),
            _given("--pattern", metavar="P", help='recordings in a subfolder, such as "*.csv" (default: by suffix)'),
            _given("--verify", action="store_true", help="also verify each valve's firmware, as the command does"),
            PLANT,
            *IDENTIFY,
            TARGET,
            *DESIGN,
        ),
    ),
    "report": (
        "artefacts in, report.html out: the verdict, figures, every requirement, where each number came from",
        "dzdesign.commands.report:run_report",
        (
            _given(
                "folder", metavar="DIR", help="of demo, verify, codegen, batch, or with valve.json or compensator.json"
            ),
            _given(*OUTPUT, metavar="FILE", help="file to write (default: report.html with the evidence, or in DIR)"),
        ),
    ),
    "assess": (
        "ramp tests without and with the compensator, side by side; limits for the latter",
        "dzdesign.commands.assess:run_assess",
        (
            _given("before", nargs="+", metavar="BEFORE", help="recordings without the compensator, as for identify"),
            _given(
                "--after",
                nargs="+",
                required=True,
                metavar="AFTER",
                help="recordings with it; the command is the compensator's input",
            ),
            _given(*OUTPUT, default="assessment.json", metavar="FILE", help="file to write"),
            _given(
                "--limits",
                metavar="L",
                help='largest values AFTER, such as "dead_zone_opening = 5 %%, flow_at_zero = 0.1 L/min", also of '
                "dead_zone_closing, knee_opening, knee_closing, hysteresis, linearity, symmetry, largest_flow_loss; in "
                "the TOML file a table [limits]",
            ),
            _given(
                "--level",
                metavar="Q",
                help='flow that ends the dead zone, such as "0.6 L/min" or "1 %%" of the largest flow before (default: '
                "what counts as flow: the meter's floor, its noise or 0.5 %% of the largest flow)",
            ),
            _given("--linearity-window", default="10-90", metavar="A-B", help="per cent of full command"),
            COLUMNS,
            _given(
                "--after-columns",
                metavar="MAP",
                help="columns of the recordings after; the u there is the compensator's input (default: as --columns, "
                "also where that is the table [columns] of the TOML file)",
            ),
            DP,
            SKIP_ROWS,
            U_MAX,
            _given("--after-u-max", metavar="U", help="full command of the recordings after (default: as --u-max)"),
            METER_FLOOR,
            METER_LAG,
            KNEE_WINDOW,
            _given("--plots", metavar="DIR", help="also draw, as SVG in this folder, flow over command"),
        ),
    ),
    "monitor": (
        "the telemetry of a running firmware in, a ramp file out",
        "dzdesign.commands.monitor:run_monitor",
        (
            _given("port", metavar="PORT", help="serial port, such as COM5 or /dev/ttyUSB0"),
            _given("--firmware", default="firmware", metavar="DIR", help="made by `dzdesign codegen`: the scalings"),
            _given("--baud", metavar="N", help="bits in a second (default: what the firmware sends)"),
            _given("--seconds", metavar="S", help="to record from the first frame on (default: until Ctrl-C)"),
            _given(*OUTPUT, default="ramp.csv", metavar="FILE", help="file to write"),
        ),
    ),
    "reproduce": (
        "the paper's valves through the whole product; every number of the paper beside ours, its figures redrawn",
        "dzdesign.commands.reproduce:run_reproduce",
        (_given(*OUTPUT, default="reproduction", metavar="DIR", help="folder to write"),),
    ),
    "init": (
        "look at recordings, write a commented dzdesign.toml with what was seen",
        "dzdesign.commands.init:run_init",
        (
            _given("ramps", nargs="*", metavar="RAMP", help="recordings, as for identify (default: ramps/*, or *.csv)"),
            _given(*OUTPUT, default="dzdesign.toml", metavar="FILE", help="file to write; one that exists stays"),
            COLUMNS,
            DP,
            SKIP_ROWS,
        ),
    ),
    "doctor": (
        "which compilers, simulators and packages are there, and how to get the rest",
        "dzdesign.commands.doctor:run_doctor",
        (),
    ),
    "completion": (
        "print the script by which a shell completes commands, options and targets",
        "dzdesign.commands.completion:run_completion",
        (_given("shell", metavar="SHELL", help="bash, zsh, fish, powershell or tcsh"),),
    ),
    "simulate": (
        "ramp tests of a simulated valve, marked as such",
        "dzdesign.commands.pipeline:run_simulate",
        (
            _given(*OUTPUT, default="ramps", metavar="DIR", help="folder to write"),
            PLANT,
            _given("--firmware", metavar="DIR", help="with the compensator of this folder, made by `dzdesign codegen`"),
            _given("--dp", action="append", metavar="P", help="pressure drop, repeatable (default: 0.5 to 5 MPa)"),
            _given("--ramp-time", default="100 s", metavar="T", help="from zero to full command"),
            _given("--seed", default="1", metavar="N", help="of the noise"),
        ),
    ),
    "schema": (
        "the JSON Schema of an artefact: its keys, what they mean, their units",
        "dzdesign.commands.schema:run_schema",
        (_given("name", nargs="?", metavar="NAME", help="valve, compensator, firmware, ... (default: list them)"),),
    ),
}


#: Where a command stands in `dzdesign --help`; one that is not named stands under the last.
COMMAND_GROUPS = {
    "from ramps to firmware": ("init", "identify", "design", "codegen", "verify", "batch"),
    "evidence": ("assess", "report", "derive", "reproduce"),
    "to try it, and the machine": ("demo", "doctor", "completion", "schema"),
    "more": (),
}
#: Where an option stands in `dzdesign COMMAND --help`; one that is not named stands first, under "options".
OPTION_GROUPS = {
    "the recordings": ("--record", "--columns", "--after-columns", "--dp", "--skip-rows", "--u-max", "--after-u-max"),
    "the flow meter": ("--meter-floor", "--meter-lag", "--meter-zero"),
    "how it is fitted": ("--knee-window", "--confidence", "--flat-below", "--linearity-window"),
    "the law": ("--law", "--guard", "--edge", "--below-dp0", "--output-max", "--accept"),
    "what the firmware is connected to": (
        "--command-signal", "--polarity", "--pressure-span", "--pressure-a", "--pressure-b", "--negative-dp",
    ),
    "beside the law": ("--zero-window", "--ramp-up", "--ramp-down", "--dither"),
    "further checks": ("--tolerances", "--include", "--c2000ware", "--mutate", "--machine-code", "--proof"),
    "of every command": ("--config", "--json", "--quiet", "--verbose", "--help"),
}  # fmt: skip
#: Printed at the end of the help; "" is that of dzdesign itself.
EXAMPLES = {
    "": (
        "dzdesign demo demo                       all of it on the bundled example",
        "dzdesign init ramps/*.csv                look at recordings, write dzdesign.toml",
        "dzdesign identify ramps/*.csv --config dzdesign.toml",
        "dzdesign codegen valve.json --target f28335",
        "dzdesign verify firmware",
    ),
    "init": ("dzdesign init ramps/*.csv", "dzdesign init ramps/*.tdms -o bench2.toml"),
    "identify": (
        'dzdesign identify ramps/*.csv --meter-lag "0.1 s"',
        "dzdesign identify ramps/*.csv --config dzdesign.toml --plots plots",
        'dzdesign identify ramp.csv --dp "1 MPa" --columns "u=AO0:V, Q=Flow (L/min)"',
    ),
    "design": ("dzdesign design valve.json", 'dzdesign design valve.json --edge "1 %" --target cortex-m4'),
    "codegen": (
        "dzdesign codegen compensator.json -o firmware",
        "dzdesign codegen valve.json --target host",
        "dzdesign codegen --list-targets",
    ),
    "verify": (
        "dzdesign verify firmware",
        "dzdesign verify firmware --plant plant.toml --tolerances tolerances.toml",
        "dzdesign verify firmware --machine-code --mutate --proof",
    ),
    "batch": (
        'dzdesign batch lot -o calibrated --jobs 4 --meter-lag "0.1 s"',
        "dzdesign batch lot.csv -o calibrated --verify --dask tcp://10.0.0.5:8786",
    ),
    "assess": (
        'dzdesign assess before/*.csv --after after/*.csv --limits "dead_zone_opening = 5 %"',
        "dzdesign assess before/*.csv --after after/*.csv --config dzdesign.toml --plots plots",
    ),
    "report": ("dzdesign report demo", "dzdesign report evidence -o for_review.html"),
    "derive": ("dzdesign derive --equation 18", "dzdesign derive --format html -o derivation.html"),
    "demo": ("dzdesign demo demo",),
    "monitor": ("dzdesign monitor COM5 --firmware firmware --seconds 100 -o ramp.csv",),
    "reproduce": ("dzdesign reproduce -o reproduction",),
    "simulate": (
        'dzdesign simulate --dp "1 MPa" --dp "5 MPa" -o ramps',
        "dzdesign simulate --firmware firmware -o after",
    ),
    "schema": ("dzdesign schema", "dzdesign schema valve > valve.schema.json"),
    "doctor": ("dzdesign doctor", "dzdesign doctor --json"),
    "completion": (
        'eval "$(dzdesign completion bash)"                       # in ~/.bashrc',
        "dzdesign completion zsh > ~/.zfunc/_dzdesign             # a folder of fpath",
        "dzdesign completion fish > ~/.config/fish/completions/dzdesign.fish",
        "dzdesign completion powershell | Out-String | Invoke-Expression   # in $PROFILE",
    ),
}


def language() -> "parsing.Language":  # noqa: F821
    """Return all that can be said."""
    from dzdesign.command_line import parsing

    return parsing.Language(
        commands=COMMANDS, command_groups=COMMAND_GROUPS, option_groups=OPTION_GROUPS, examples=EXAMPLES,
        tables=TABLES, by_entry=BY_ENTRY,
    )  # fmt: skip
