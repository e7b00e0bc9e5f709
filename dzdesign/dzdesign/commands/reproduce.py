"""`dzdesign reproduce`: the paper's valves through the whole product, and every number of the paper beside ours."""

import argparse
from pathlib import Path

from dzdesign.core.artefact_files import TOOL, check_folder_may_be_written, write_folder
from dzdesign.core.artefact_types import THIS_TOOL, schema_of, to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.terminal.progress import stages

PAPER_DOI = "10.11916/j.issn.1005-9113.20063"


def run_reproduce(args: argparse.Namespace) -> int:
    """Reproduce the paper's numbers and figures; 1 if a number that must agree does not."""
    from dzdesign.report.reproduction import Reproduction
    from dzdesign.reproduce.chain import run_chain
    from dzdesign.reproduce.paper_figures import figure_files
    from dzdesign.reproduce.paper_numbers import paper_numbers
    from dzdesign.reproduce.recovered_valves import recover_valves
    from dzdesign.terminal.reproduction_tables import print_reproduction
    from dzdesign.verify.toolchain.host_compiler import host_compiler

    folder, schema = Path(args.output), schema_of(Reproduction)
    if not args.output:
        raise InputError("-o is empty, expected the name of a folder, such as reproduction")
    check_folder_may_be_written(folder, schema)
    host_compiler()
    with stages() as stage:
        stage("recovering the valves' parameters from the printed figures")
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
    content = to_json_bytes(reproduction)
    files: dict[str, str | bytes] = {Reproduction.FILE_NAME: content, **figures}
    for chain in chains:
        files |= chain.files
    write_folder(folder, files, {"schema": schema, "tool": TOOL})
    if args.json:
        print(content.decode(), end="")
    else:
        print_reproduction(reproduction)
        print(f"Figures, parameters and artefacts: {folder}")
    return 0 if reproduction.holds else 1
