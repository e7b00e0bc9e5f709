"""`reproduce`: the paper's numbers against its law, and the paper's valves through the whole product."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.artefact_files import TOOL, check_folder_may_be_written, write_folder
from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath, Option
from dzdesign.terminal.progress import stage_progress

if TYPE_CHECKING:
    from dzdesign.reproduce.artefact import Reproduction

PAPER_DOI = "10.11916/j.issn.1005-9113.20063"


@dataclass(frozen=True, kw_only=True)
class ReproduceArguments:
    """Arguments of `reproduce`."""

    output: Annotated[AnyPath, Option("DIR", short="-o")] = "reproduction"
    """Folder to write."""


def reproduce(arguments: ReproduceArguments) -> "Reproduction":
    """Reproduce the paper's numbers and figures, and write them to a folder."""
    from dzdesign.core.artefact_types import THIS_TOOL, schema_of, to_json_bytes
    from dzdesign.reproduce import figures, law_numbers, runs
    from dzdesign.reproduce.artefact import Reproduction
    from dzdesign.reproduce.product_results import product_results
    from dzdesign.reproduce.recovered_valves import recover_valves
    from dzdesign.verify.toolchain.host_compiler import host_compiler

    if not os.fspath(arguments.output):
        raise InputError("-o is empty, expected the name of a folder, such as reproduction")
    folder, schema = Path(arguments.output), schema_of(Reproduction)
    check_folder_may_be_written(folder, schema)
    host_compiler()
    with stage_progress("recovering the valves' parameters from the printed figures") as stage:
        chains = [runs.run_chain(valve, say=stage) for valve in recover_valves()]
        ran = [each.runs for each in chains]
        reproduction = Reproduction(
            tool=THIS_TOOL,
            made_from=(),
            paper=PAPER_DOI,
            given=law_numbers.GIVEN,
            hypotheses=law_numbers.HYPOTHESES,
            law=tuple(law_numbers.law_numbers()),
            product=tuple(product_results(ran)),
            rejected=tuple(law_numbers.rejected_readings()),
            valves=tuple(each.valve for each in chains),
        )
        stage("drawing")
        drawn = figures.figure_files(ran)
    files: dict[str, str | bytes] = {**drawn, Reproduction.FILE_NAME: to_json_bytes(reproduction)}
    for each in chains:
        files |= each.files
    write_folder(folder, files, {"schema": schema, "tool": TOOL})
    return reproduction
