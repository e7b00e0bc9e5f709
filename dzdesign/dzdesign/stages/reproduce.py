"""`reproduce`: the paper's valves through the whole product, and every number of the paper beside ours."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath, Option

if TYPE_CHECKING:
    from dzdesign.reproduce.artefact import Reproduction


@dataclass(frozen=True, kw_only=True)
class ReproduceArguments:
    """Arguments of `reproduce`."""

    output: Annotated[AnyPath, Option("DIR", short="-o")] = "reproduction"
    """Folder to write."""


def reproduce(arguments: ReproduceArguments) -> "Reproduction":
    """Reproduce the paper's numbers and figures, and write them to a folder."""
    from dzdesign.reproduce import reproduction

    if not os.fspath(arguments.output):
        raise InputError("-o is empty, expected the name of a folder, such as reproduction")
    return reproduction.reproduce(Path(arguments.output))
