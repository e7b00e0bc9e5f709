"""`dzdesign demo DIR`: the whole pipeline on the bundled example, from ramp tests to checked C."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from dzdesign.core.artefact_files import TOOL, check_folder_may_be_written, write_folder
from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath, Option
from dzdesign.core.placing import make_folder
from dzdesign.example import example_folder
from dzdesign.stages.design import DesignArguments, design
from dzdesign.stages.generate import GenerateArguments, generate
from dzdesign.stages.identify import IdentifyArguments, identify
from dzdesign.stages.verify import VerifyArguments, verify_firmware
from dzdesign.terminal.page import print_json
from dzdesign.terminal.progress import say, stage_progress

EXAMPLES = ("dzdesign demo demo",)
#: The flow meter of the bundled recordings, as their first lines tell it.
METER_LAG, METER_FLOOR = "0.1 s", "0.6 L/min"
#: The example's amplifier feeds back the coil's current. With a coil of -20 to 80 °C it is 1.4 % high to 2.0 % low.
AMPLIFIER = "2 %"
RECORD = {"valve": "simulated by dzdesign, no measurement"}
#: Where recordings and plant go, for a user to repeat each step: the pages of the documentation read them there.
EXAMPLE, EXAMPLE_SCHEMA = "example", "dzdesign.example/1"


@dataclass(frozen=True)
class Arguments:
    """Arguments of `demo`."""

    folder: Annotated[AnyPath, Option("DIR")]
    """Folder for the artefacts, and for the example's recordings and plant in its folder `example`."""


def run(arguments: Arguments, json: bool) -> int:
    """Run the pipeline on the bundled ramp tests and print the closing table."""
    from dzdesign.derivation.account.account import verify_statements
    from dzdesign.terminal import brief

    folder, example = Path(arguments.folder), example_folder()
    for part in ("firmware", "evidence", EXAMPLE):
        check_folder_may_be_written(folder / part)
    try:
        make_folder(folder)
    except OSError as error:
        raise InputError(f"the folder '{folder}' can't be made: {error.strerror}") from error
    bundled = {
        file.relative_to(example).as_posix(): file.read_bytes() for file in sorted(example.rglob("*")) if file.is_file()
    }
    write_folder(folder / EXAMPLE, bundled, {"schema": EXAMPLE_SCHEMA, "tool": TOOL})
    with stage_progress("re-deriving the paper's equations"):
        verdicts = verify_statements()
    expected = sum(verdict.as_expected for verdict in verdicts)
    say(f"derivation: {expected} of {len(verdicts)} statements have the verdict expected of them")
    ramps = sorted((example / "ramps").glob("*.csv.gz"))
    valve = identify(
        IdentifyArguments(
            ramps, meter_lag=METER_LAG, meter_floor=METER_FLOOR, record=RECORD,
            output=folder / "valve.json",
        )
    )  # fmt: skip
    say("designing the compensator")
    compensator = design(DesignArguments(valve, amplifier=AMPLIFIER, output=folder / "compensator.json"))
    generate(GenerateArguments(compensator, output=folder / "firmware"))
    verification = verify_firmware(
        VerifyArguments(folder / "firmware", ramps=ramps, plant=example / "plant.toml", output=folder / "evidence"),
        plant_source="plant.toml of the example",
        identified=valve,
    )
    if json:
        print_json(verification.evidence)
    else:
        print(f"Simulated example valve, 0-10 V, on a machine whose amplifier holds its current to {AMPLIFIER}.")
        brief.print_result(verification)
        print(f"Open first: {folder}/evidence/report.html")
    return 0 if verification.holds and expected == len(verdicts) else 1
