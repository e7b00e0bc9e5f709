"""Arguments of `batch`."""

from dataclasses import KW_ONLY, dataclass
from typing import Annotated, ClassVar

from dzdesign.core.option_readers import whole_number
from dzdesign.core.options import AnyPath, Option, Text
from dzdesign.design.design_choices import DesignChoices
from dzdesign.stages.generate import OutputChoices
from dzdesign.stages.identify import IdentifyChoices


@dataclass(frozen=True)
class BatchArguments(OutputChoices, DesignChoices, IdentifyChoices):
    """Arguments of `batch`: beside its own, the options of `identify`, `design` and outputs for every valve.

    Those are of the options file: the command line has what the class declares itself.
    """

    IN_FILE: ClassVar = (OutputChoices, DesignChoices, IdentifyChoices)
    #: Options of `identify` that are of one valve: without them it would be another one.
    ONE_VALVE: ClassVar = ("low_flow",)

    source: Annotated[AnyPath, Option("FOLDER")]
    """Folder with a subfolder of recordings for each valve, or a CSV file with a row for each valve. Its columns are
    name, files (patterns separated by semicolons), record.NAME and any option of identify or design that differs
    between the valves. Options for all valves are in the file of --config."""
    _: KW_ONLY
    output: Annotated[AnyPath, Option("DIR", short="-o")] = "batch"
    """Folder to write. An earlier run in it is continued."""
    jobs: Annotated[
        int | str | None, Option("N", read=whole_number("a number of processes such as 4", least=1, digits=4))
    ] = None
    """Number of processes on this machine (default: the number of its processors)."""
    dask: Annotated[Text, Option("ADDRESS")] = None
    """Address of a Dask scheduler to use instead, such as tcp://10.0.0.5:8786."""
    pattern: Annotated[Text, Option("P")] = None
    """Pattern of the recordings in a subfolder, such as "*.csv" (default: by suffix)."""
    verify: Annotated[bool, Option()] = False
    """Verify each valve's firmware and outputs too, as the command verify does."""
    plant: Annotated[AnyPath | None, Option("PLANT.toml")] = None
    """File with the plant of the closed loop, for the verification. The output fmu then also includes an FMU of the
    plant."""
    outputs: Annotated[Text, Option("NAMES")] = None
    """Outputs for each valve in addition to its firmware, separated by commas: iec61131, fmu, matlab,
    amplifier. Their options are in the file of --config."""
    calibration: Annotated[Text, Option("FORM")] = None
    """Form of a valve's numbers (default: fixed). fixed: in a firmware for each valve. block: in a calibration block
    for one firmware of the lot; each block is tried on every input."""
    target: Annotated[str, Option("NAME")] = "f28335"
    """Microcontroller. `codegen --list-targets` lists them."""
