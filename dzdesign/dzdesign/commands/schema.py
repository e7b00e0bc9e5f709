"""`dzdesign schema`: the JSON Schemas of the artefacts, as their types state them."""

from dataclasses import dataclass
from json import dumps
from pkgutil import resolve_name
from typing import Annotated, Any

from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import Option, Text
from dzdesign.terminal.page import print_json

#: Name -> (module and type, the artefact, the command that writes it), in the order of the pipeline.
SCHEMAS = {
    "valve": ("dzdesign.identify.valve.model:ValveModel", "valve.json", "identify"),
    "compensator": ("dzdesign.design.compensator:Compensator", "compensator.json", "design"),
    "firmware": ("dzdesign.design.firmware_manifest:FirmwareManifest", "manifest.json of a firmware", "codegen"),
    "output": ("dzdesign.design.output_manifest:OutputManifest", "manifest.json of another output", "codegen"),
    "evidence": ("dzdesign.verify.evidence:Evidence", "verification.json", "verify"),
    "output-evidence": ("dzdesign.verify.output_evidence:OutputEvidence", "evidence.json of another output", "verify"),
    "calibration": (
        "dzdesign.verify.exhaustive.block_check:BlockCheck", "calibration_check.json", "batch --calibration block"
    ),
    "assessment": ("dzdesign.assess.assessment:Assessment", "assessment.json", "assess"),
    "batch": ("dzdesign.report.lot.summary:LotSummary", "batch.json", "batch"),
    "reproduction": ("dzdesign.reproduce.artefact:Reproduction", "reproduction.json", "reproduce"),
    "derivation": (
        "dzdesign.derivation.presentation.content:DerivationReport", "derivation.json", "derive --format json"
    ),
}  # fmt: skip


def schema_document(name: str) -> dict[str, Any]:
    """Return a schema (JSON Schema, draft 2020-12), one of `SCHEMAS`."""
    from dzdesign.core.artefact_schema import json_schema

    if name not in SCHEMAS:
        raise InputError(
            f"there is no schema '{name[:40]}'{nearest(name, SCHEMAS)}; expected one of {', '.join(SCHEMAS)}"
        )
    return json_schema(resolve_name(SCHEMAS[name][0]))


def schema_text(name: str) -> str:
    """Return a schema as the text of its file."""
    return one_line_a_field(schema_document(name)) + "\n"


def one_line_a_field(node: dict[str, Any], indent: str = "") -> str:
    """Return a schema as JSON in which everything about a field stands on one line.

    Examples
    --------
    >>> print(one_line_a_field({"type": "object", "properties": {"dp_MPa": {"type": "number", "unit": "MPa"}}}))
    {
     "type": "object",
     "properties": {
      "dp_MPa": {"type": "number", "unit": "MPa"}
     }
    }
    """
    inner = indent + " "
    lines = []
    for key, value in node.items():
        if key in ("properties", "$defs"):  # named by what they describe
            parts = (f"{inner} {dumps(name)}: {_of_part(part, inner + ' ')}" for name, part in value.items())
            text = "{\n" + ",\n".join(parts) + f"\n{inner}}}"
        else:
            text = dumps(value)
        lines.append(f"{inner}{dumps(key)}: {text}")
    return "{\n" + ",\n".join(lines) + f"\n{indent}}}"


def _of_part(part: Any, indent: str) -> str:
    return one_line_a_field(part, indent) if "properties" in part else dumps(part)


EXAMPLES = ("dzdesign schema", "dzdesign schema valve > valve.schema.json")


@dataclass(frozen=True)
class Arguments:
    """Arguments of `schema`."""

    name: Annotated[Text, Option("NAME", choices=tuple(SCHEMAS))] = None
    """Name of the artefact (default: the names are listed)."""


def run(arguments: Arguments, json: bool) -> int:
    """Print one schema, or which there are."""
    if arguments.name is not None:
        print(schema_text(arguments.name), end="")
    elif json:
        listing = [{"name": name, "artefact": artefact} for name, (_, artefact, _) in SCHEMAS.items()]
        print_json({"schemas": listing})
    else:
        width = max(map(len, SCHEMAS))
        for name, (_, artefact, command) in SCHEMAS.items():
            print(f"{name:{width}}  {artefact}, made by `dzdesign {command}`")
    return 0
