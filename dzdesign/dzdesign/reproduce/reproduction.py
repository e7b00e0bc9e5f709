"""The paper's valves through the whole product, and every number of the paper beside ours."""

from pathlib import Path

from dzdesign.core.artefact_files import TOOL, check_folder_may_be_written, write_folder
from dzdesign.core.artefact_types import THIS_TOOL, schema_of, to_json_bytes
from dzdesign.report.reproduction import Reproduction
from dzdesign.reproduce.chain import run_chain
from dzdesign.reproduce.paper_figures import figure_files
from dzdesign.reproduce.paper_numbers import paper_numbers
from dzdesign.reproduce.recovered_valves import recover_valves
from dzdesign.terminal.progress import stage_progress
from dzdesign.verify.toolchain.host_compiler import host_compiler

PAPER_DOI = "10.11916/j.issn.1005-9113.20063"


def reproduce(folder: Path) -> Reproduction:
    """Reproduce the paper's numbers and figures, and write them to a folder."""
    schema = schema_of(Reproduction)
    check_folder_may_be_written(folder, schema)
    host_compiler()
    with stage_progress("recovering the valves' parameters from the printed figures") as stage:
        chains = [run_chain(valve, say=stage) for valve in recover_valves()]
        reproduction = Reproduction(
            tool=THIS_TOOL,
            made_from=(),
            paper=PAPER_DOI,
            numbers=tuple(paper_numbers([chain.runs for chain in chains])),
            valves=tuple(chain.valve for chain in chains),
        )
        stage("drawing")
        figures = figure_files([chain.runs for chain in chains])
    files: dict[str, str | bytes] = {**figures, Reproduction.FILE_NAME: to_json_bytes(reproduction)}
    for chain in chains:
        files |= chain.files
    write_folder(folder, files, {"schema": schema, "tool": TOOL})
    return reproduction
