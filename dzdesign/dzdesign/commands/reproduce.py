"""`dzdesign reproduce`: the paper's valves through the whole product, and every number of the paper beside ours."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath, Option
from dzdesign.terminal.page import print_json

EXAMPLES = ("dzdesign reproduce -o reproduction",)


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Arguments of `reproduce`."""

    output: Annotated[AnyPath, Option("DIR", short="-o")] = "reproduction"
    """Folder to write."""


def run(arguments: Arguments, json: bool) -> int:
    """Reproduce the paper's numbers and figures; 1 if one is missed by more than a stated reason explains."""
    from dzdesign.reproduce.reproduction import reproduce
    from dzdesign.terminal.reproduction_tables import print_reproduction

    if not os.fspath(arguments.output):
        raise InputError("-o is empty, expected the name of a folder, such as reproduction")
    made = reproduce(Path(arguments.output))
    if json:
        print_json(made)
    else:
        print_reproduction(made)
        print(f"Figures, parameters and artefacts: {arguments.output}")
    return 0 if made.holds else 1
