"""The paper's valves through the whole product, and every number of the paper beside ours."""

from pathlib import Path

from dzdesign.core.artefact_files import TOOL, check_folder_may_be_written, write_folder
from dzdesign.core.artefact_types import THIS_TOOL, schema_of, to_json_bytes
from dzdesign.reproduce.artefact import Reproduction
from dzdesign.reproduce.assumptions import ASSUMPTIONS, HYSTERESIS_V
from dzdesign.reproduce.chain import Chain, run_chain
from dzdesign.reproduce.paper_figures import figure_files
from dzdesign.reproduce.paper_numbers import paper_numbers
from dzdesign.reproduce.recovered_valves import recover_stopped, recover_valves
from dzdesign.reproduce.rows import Subject
from dzdesign.terminal.progress import stage_progress
from dzdesign.verify.toolchain.host_compiler import host_compiler

PAPER_DOI = "10.11916/j.issn.1005-9113.20063"


def reproduce(folder: Path) -> Reproduction:
    """Reproduce the paper's numbers and figures, and write them to a folder."""
    schema = schema_of(Reproduction)
    check_folder_may_be_written(folder, schema)
    host_compiler()
    with stage_progress("recovering the valves' parameters from the printed figures") as stage:
        plain = [run_chain(valve, say=stage) for valve in recover_valves()]
        assumed = [run_chain(valve.with_hysteresis(HYSTERESIS_V), say=stage) for valve in recover_valves()]
        stopped = run_chain(recover_stopped(), say=stage)
        subjects = [subject_of(*both) for both in zip(plain, assumed, strict=True)]
        reproduction = Reproduction(
            tool=THIS_TOOL,
            made_from=(),
            paper=PAPER_DOI,
            assumptions=ASSUMPTIONS,
            numbers=tuple(paper_numbers(subjects, subject_of(stopped))),
            valves=tuple(chain.valve for chain in (*plain, *assumed, stopped)),
        )
        stage("drawing")
        figures = figure_files(subjects, subject_of(stopped))
    files: dict[str, str | bytes] = {**figures, Reproduction.FILE_NAME: to_json_bytes(reproduction)}
    for chain in (*plain, *assumed, stopped):
        files |= chain.files
    write_folder(folder, files, {"schema": schema, "tool": TOOL})
    return reproduction


def subject_of(plain: Chain, assumed: Chain | None = None) -> Subject:
    """Return the runs of a valve, as recovered and with the assumed hysteresis."""
    chains = [plain] if assumed is None else [plain, assumed]
    return Subject(
        runs=plain.runs,
        with_hysteresis=assumed.runs if assumed else None,
        load_and_oil=tuple(chain.load_and_oil for chain in chains if chain.load_and_oil),
    )
