"""Options of the stages from the law to the evidence: `design`, `codegen`, `verify`, `simulate`, `report`, `batch`."""

from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Annotated

from dzdesign.arguments.recordings import IdentifyChoices
from dzdesign.core.options import (
    CHECKS,
    AnyPath,
    Option,
    Paths,
    Text,
    Texts,
    quantity,
    whole_number,
)
from dzdesign.design.request import DesignChoices

if TYPE_CHECKING:
    from dzdesign.codegen.project import Firmware
    from dzdesign.design.compensator import Compensator
    from dzdesign.identify.valve.model import ValveModel

#: Where the names of the targets stand.
TARGETS = "dzdesign.codegen.project:TARGET_NAMES"

# fmt: off


@dataclass(frozen=True)
class DesignArguments(DesignChoices):
    """Arguments of `design`."""

    valve: Annotated["ValveModel | AnyPath", Option("valve.json, made by `dzdesign identify`.", "VALVE.json")]
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option(
        "File to write, compensator.json.", "FILE", command_default="compensator.json", short="-o")] = None
    target: Annotated[str, Option(
        "Microcontroller whose converter and timer the law is for; `codegen --list-targets` lists them.",
        "NAME", choices=TARGETS)] = "f28335"


@dataclass(frozen=True)
class GenerateArguments(DesignChoices):
    """Arguments of `codegen`, in Python `generate`."""

    compensator: Annotated["Compensator | AnyPath", Option(
        "compensator.json, or a valve.json, which is designed first with the options of `design`.",
        "COMPENSATOR.json")]
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option(
        "Folder to write, with the C project.", "DIR", command_default="firmware", short="-o")] = None
    target: Annotated[Text, Option(
        "Microcontroller (default: that of the design; of a VALVE.json f28335).", "NAME", choices=TARGETS)] = None


@dataclass(frozen=True)
class VerifyArguments:
    """Arguments of `verify`."""

    firmware: Annotated["Firmware | AnyPath", Option("Folder made by `dzdesign codegen`.", "DIR")]
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option(
        "Folder to write, with the evidence.", "DIR", command_default="evidence", short="-o")] = None
    plant: Annotated[AnyPath | None, Option(
        "File with the plant of the closed loop, like examples/paper_valve/plant.toml (default: made of the identified "
        "thresholds).", "PLANT.toml")] = None
    tolerances: Annotated[AnyPath | None, Option(
        "File with a series of plants to run too, like examples/paper_valve/tolerances.toml; needs a plant.",
        "TOL.toml", CHECKS)] = None
    include: Annotated[Paths, Option(
        "Folder of headers that your board files include, such as your chip's. Repeatable.", "DIR", CHECKS)] = ()
    c2000ware: Annotated[AnyPath | None, Option(
        "Folder of your C2000Ware: also compile f28335 firmware against its headers.", "DIR", CHECKS)] = None
    mutate: Annotated[bool, Option(
        "Also make the C wrong in every place, and count what is caught.", group=CHECKS)] = False
    machine_code: Annotated[bool, Option(
        "Also check machine code: every input on a Cortex-M4 in QEMU, a sample on an AVR in simavr.",
        group=CHECKS)] = False
    proof: Annotated[bool, Option(
        "Also prove by Frama-C that nothing overflows a 16-bit int.", group=CHECKS)] = False


@dataclass(frozen=True, kw_only=True)
class SimulateArguments:
    """Arguments of `simulate`."""

    output: Annotated[AnyPath | None, Option(
        "Folder to write, with the recordings.", "DIR", command_default="ramps", short="-o")] = None
    plant: Annotated[AnyPath | None, Option(
        "File with the plant (default: that of the paper's valve).", "PLANT.toml")] = None
    firmware: Annotated[AnyPath | None, Option(
        "Folder made by `dzdesign codegen`, whose compensator then drives the valve.", "DIR")] = None
    dp: Annotated[Texts, Option(
        "Pressure drop of a ramp test; repeatable (default: 0.5, 1, 2, 3, 4 and 5 MPa).", "P", example="1 MPa")] = ()
    ramp_time: Annotated[str, Option(
        "Time from zero to full command.", "T", example="100 s", read=quantity("time"))] = "100 s"
    seed: Annotated[int | str, Option(
        "Random seed of the measurement noise.", "N",
        read=whole_number("a whole number of zero or more, such as 1", digits=18))] = "1"


@dataclass(frozen=True)
class ReportArguments:
    """Arguments of `report`."""

    folder: Annotated[AnyPath, Option(
        "Folder of demo, verify, codegen or batch, or with valve.json or compensator.json.", "DIR")]
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option(
        "File to write (default of the command: report.html beside the evidence, or in the folder).",
        "FILE", short="-o")] = None


@dataclass(frozen=True)
class BatchArguments(DesignChoices, IdentifyChoices):
    """Arguments of `batch`: beside its own, the options of `identify` and `design` for every valve."""

    source: Annotated[AnyPath, Option(
        "Folder with a subfolder of recordings for each valve; or a CSV file with a row for each: name, files "
        "(patterns, ; between them), record.NAME, and any option of identify or design that is different for it.", "FOLDER")]
    _: KW_ONLY
    output: Annotated[AnyPath, Option(
        "Folder to write; an earlier run there is continued.", "DIR", short="-o")] = "batch"
    jobs: Annotated[int | str | None, Option(
        "Processes of this machine (default: as many as it has processors).", "N",
        read=whole_number("a number of processes such as 4", least=1, digits=4))] = None
    dask: Annotated[Text, Option(
        "Instead, address of a Dask scheduler, such as tcp://10.0.0.5:8786.", "ADDRESS")] = None
    pattern: Annotated[Text, Option(
        'Pattern of the recordings in a subfolder, such as "*.csv" (default: by suffix).', "P")] = None
    verify: Annotated[bool, Option("Also verify each valve's firmware, as the command does.")] = False
    plant: Annotated[AnyPath | None, Option(
        "File with the plant of the closed loop, for the verification.", "PLANT.toml")] = None
    target: Annotated[str, Option(
        "Microcontroller; `codegen --list-targets` lists them.", "NAME", choices=TARGETS)] = "f28335"


# fmt: on
