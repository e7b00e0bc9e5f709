"""Arguments of `batch`."""

from dataclasses import KW_ONLY, dataclass
from typing import Annotated

from dzdesign.core.options import AnyPath, Option, Text, whole_number
from dzdesign.design.request import DesignChoices
from dzdesign.stages.design import TARGETS
from dzdesign.stages.identify import IdentifyChoices

# fmt: off


@dataclass(frozen=True)
class BatchArguments(DesignChoices, IdentifyChoices):
    """Arguments of `batch`: beside its own, the options of `identify` and `design` for every valve."""

    source: Annotated[AnyPath, Option(
        "Folder with a subfolder of recordings for each valve; or a CSV file with a row for each: name, files "
        "(patterns, ; between them), record.NAME, and any option of identify or design that is different for it.",
        "FOLDER")]
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
