"""A compensator as a stage is given it: a result, a compensator.json, or a folder that holds one."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.documents import read_bytes, sha256_of
from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath

if TYPE_CHECKING:
    from dzdesign.design.compensator import Compensator

COMPENSATOR_NAME = "compensator.json"


def given_compensator(given: "Compensator | AnyPath") -> tuple["Compensator", str, str]:
    """Return a compensator, the SHA-256 of its file, and how that is called; of a folder the file in it."""
    from dzdesign.core.artefact_reading import read_artefact
    from dzdesign.core.artefact_types import to_json_bytes
    from dzdesign.design.compensator import Compensator

    if isinstance(given, Compensator):
        return given, sha256_of(to_json_bytes(given)), "the compensator"
    path = Path(given)
    path = path / COMPENSATOR_NAME if path.is_dir() else path
    content = read_bytes(path, "compensator file")
    return read_artefact(content, Compensator, os.fspath(path)), sha256_of(content), f"'{path}'"


def refuse_underived(compensator: "Compensator", source: str, *, of_file: bool) -> None:
    """Refuse a compensator whose numbers do not follow: what is made of it goes to a device without a `verify`."""
    from dzdesign.design.redesign import prove_derived, refuse_without_options

    if of_file:
        refuse_without_options(compensator, source.strip("'"))
    try:
        prove_derived(compensator)
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
