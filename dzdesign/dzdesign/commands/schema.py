"""`dzdesign schema`: the JSON Schemas of the artefacts, as their types state them."""

import json as json_module
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from dzdesign.core.documents import to_json
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import Option, Text

#: Name -> (module and type, or the package that keeps a file of it; the artefact; the command that writes it), in the
#: order of the pipeline.
SCHEMAS: Mapping[str, tuple[str, str, str]] = MappingProxyType(
    {
        "valve": ("dzdesign.identify.valve.model:ValveModel", "valve.json", "identify"),
        "compensator": ("dzdesign.design.compensator:Compensator", "compensator.json", "design"),
        "firmware": ("dzdesign.design.firmware_manifest:FirmwareManifest", "manifest.json of a firmware", "codegen"),
        "evidence": ("dzdesign.verify.evidence:Evidence", "verification.json", "verify"),
        "assessment": ("dzdesign.assess.assessment:Assessment", "assessment.json", "assess"),
        "batch": ("dzdesign.report.lot.summary:LotSummary", "batch.json", "batch"),
        "reproduction": ("dzdesign.report.reproduction:Reproduction", "reproduction.json", "reproduce"),
        "derivation": (
            "dzdesign.derivation.presentation.content:DerivationReport",
            "derivation.json",
            "derive --format json",
        ),
    }
)


def schema_text(name: str) -> str:
    """Return a schema (JSON Schema, draft 2020-12) as the text of its file.

    Parameters
    ----------
    name : str
        One of `SCHEMAS`.

    Raises
    ------
    InputError
        If there is no such schema.

    Examples
    --------
    >>> schema_text("valve").startswith("{")
    True
    """
    if name not in SCHEMAS:
        raise InputError(
            f"there is no schema '{name[:40]}'{nearest(name, SCHEMAS)}; expected one of {', '.join(SCHEMAS)}"
        )
    module, _, kind = SCHEMAS[name][0].partition(":")
    if kind:
        from dzdesign.core.artefact_schema import json_schema

        return to_json(json_schema(getattr(import_module(module), kind)))
    return (Path(str(files(module))) / "schemas" / f"{name}.schema.json").read_text(encoding="utf-8")


def schema_document(name: str) -> dict[str, Any]:
    """Return a schema as `json` reads it.

    Parameters
    ----------
    name : str
        One of `SCHEMAS`.
    """
    document: dict[str, Any] = json_module.loads(schema_text(name))
    return document


EXAMPLES = ("dzdesign schema", "dzdesign schema valve > valve.schema.json")


@dataclass(frozen=True)
class Arguments:
    """Arguments of `schema`."""

    name: Annotated[Text, Option("NAME", choices=tuple(SCHEMAS))] = None
    """valve, compensator, firmware, ... (default: list them)."""


def run(arguments: Arguments, json: bool) -> int:
    """Print one schema, or which there are."""
    if arguments.name is not None:
        print(schema_text(arguments.name), end="")
    elif json:
        listing = [{"name": name, "artefact": artefact} for name, (_, artefact, _) in SCHEMAS.items()]
        print(json_module.dumps({"schemas": listing}, indent=2))
    else:
        width = max(map(len, SCHEMAS))
        for name, (_, artefact, command) in SCHEMAS.items():
            print(f"{name:{width}}  {artefact}, made by `dzdesign {command}`")
    return 0
