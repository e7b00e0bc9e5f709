"""Reference text that is made when the pages are built: commands, files, warnings and API, each from its one source."""

import importlib
import inspect
from collections.abc import Callable, Iterator
from dataclasses import fields
from fractions import Fraction
from json import dumps
from pkgutil import resolve_name
from typing import Any, get_type_hints

import msgspec

from dzdesign.codegen.calibration.layout import SHAPE_BITS, Member, members
from dzdesign.command_line.parser import COMMANDS, arguments_of_command, command_module, usage_of
from dzdesign.core.artefact_reading import LARGEST_INTEGER
from dzdesign.core.artefact_types import Artefact, JsonText, schema_of
from dzdesign.core.options import field_docstrings
from dzdesign.identify.data_quality.catalogue import catalogue

#: What a caller of the rooms needs.
API = (
    (
        "dzdesign.api",
        (
            "identify", "design", "generate", "calibration", "read_calibration", "verify", "init",
            "simulate", "assess", "report", "batch",
        ),
    ),
    ("dzdesign.stages.init", ("Proposal",)),
    ("dzdesign.assess.assessment", ("Assessment",)),
    ("dzdesign.report.page", ("Report",)),
    ("dzdesign.identify.reading.ramp_files", ("RampTest", "read_ramp_file")),
    ("dzdesign.identify.options", ("IdentifyOptions",)),
    ("dzdesign.identify.identification", ("identify",)),
    ("dzdesign.identify.valve.model", ("ValveModel",)),
    ("dzdesign.identify.valve.side_model", ("SideModel",)),
    ("dzdesign.identify.valve.ramp_result", ("TestResult",)),
    ("dzdesign.design.options", ("DesignOptions",)),
    ("dzdesign.design.designing", ("design",)),
    ("dzdesign.design.compensator", ("Compensator", "SideLaw")),
    ("dzdesign.codegen.project", ("generate", "Firmware")),
    ("dzdesign.stages.calibration", ("CalibrationImage", "ReadCalibration")),
    ("dzdesign.codegen.calibration.reading", ("CalibrationReading", "SideReading", "NodeReading", "DriveReading")),
    ("dzdesign.verify.closed_loop.plant", ("Plant", "read_plant")),
    ("dzdesign.verify.verification", ("verify", "Verification")),
    ("dzdesign.verify.evidence", ("Evidence",)),
    ("dzdesign.report.lot.summary", ("LotSummary",)),
    ("dzdesign.core.errors", ("DzdesignError", "InputError", "RequirementError")),
)

#: Name -> (module and type, the artefact, the command that writes it), in the order of the pipeline.
SCHEMAS = {
    "valve": ("dzdesign.identify.valve.model:ValveModel", "valve.json", "identify"),
    "compensator": ("dzdesign.design.compensator:Compensator", "compensator.json", "design"),
    "firmware": ("dzdesign.design.firmware_manifest:FirmwareManifest", "manifest.json of a firmware", "codegen"),
    "output": ("dzdesign.design.firmware_manifest:OutputManifest", "manifest.json of another output", "codegen"),
    "evidence": ("dzdesign.verify.evidence:Evidence", "verification.json", "verify"),
    "output-evidence": ("dzdesign.verify.evidence:OutputEvidence", "evidence.json of another output", "verify"),
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
#: Node of a JSON Schema.
Node = dict[str, Any]
#: A Fraction in JSON.
FRACTION: Node = {
    "type": "array",
    "prefixItems": [
        {"title": "numerator", "type": "integer", "minimum": -LARGEST_INTEGER, "maximum": LARGEST_INTEGER},
        {"title": "denominator", "type": "integer", "minimum": 1, "maximum": LARGEST_INTEGER},
    ],
    "items": False,
    "minItems": 2,
    "maxItems": 2,
}



def commands() -> str:
    """Return a section for each command: its usage, arguments, options and defaults, as they are declared."""
    return "\n\n".join(map(_command, COMMANDS))


def _command(name: str) -> str:
    help_line, arguments = COMMANDS[name].help, arguments_of_command(name)
    lines = [f"({name})=", f"## {name}", "", f"{help_line[0].upper()}{help_line[1:]}.", ""]
    lines += ["```text", usage_of(name, arguments), "```", ""]
    for argument in arguments:
        value = "" if bool in argument.kinds else f" {argument.option.metavar}"
        names = [f"`{each}{value}`" for each in (argument.option.short, argument.flag) if each]
        required = " Required." if argument.required and not argument.is_positional else ""
        lines += [f"`{argument.option.metavar}`" if argument.is_positional else ", ".join(names)]
        lines += [f": {_sentence(argument.described(argument.default_text))}{required}", ""]
    return "\n".join([*lines, "```text", *command_module(name).EXAMPLES, "```"])


def _sentence(text: str) -> str:
    text = text.replace("*", r"\*").replace("[", r"\[").replace("<", "&lt;")
    return text[0].upper() + text[1:] + ("" if text.endswith(".") else ".")


def files() -> str:
    """Return a section for each schema: a table of its keys, with type, unit and description."""
    return "\n\n".join(_file(name) for name in SCHEMAS)


def _file(name: str) -> str:
    schema = schema_document(name)
    _, artefact, command = SCHEMAS[name]
    label = f"{name}-file" if name in COMMANDS else name  # a command's section has its name
    rows = [f"| `{key}` | {kind} | {unit} | {text} |" for key, kind, unit, text in _rows(schema, schema, "", set())]
    return "\n".join(
        (
            f"({label})=",
            f"## {artefact}",
            "",
            f"{schema['description']} Schema: `{schema['$id']}`,",
            f'<a href="../schemas/{name}.schema.json">as a file</a>. Made by '
            f"`dzdesign {command}`.",
            "",
            "| key | type | unit | what it is |",
            "|---|---|---|---|",
            *rows,
        )
    )


def _rows(
    schema: dict[str, Any], whole: dict[str, Any], place: str, seen: set[str]
) -> Iterator[tuple[str, str, str, str]]:
    """Yield key, type, unit and description of everything inside; what stands for several keys is opened once."""
    for key, given in schema.get("properties", {}).items():
        value, nullable = _resolved(given, whole)
        path = f"{place}{key}" if key in schema.get("required", ()) else f"{place}[{key}]"
        name = given.get("$ref") or next((each["$ref"] for each in given.get("anyOf", ()) if "$ref" in each), "")
        text = given.get("description") or value.get("description", "")
        known = " As above." if name in seen and "properties" in value else ""
        yield path, _kind(value, nullable), given.get("unit", ""), text.replace("|", r"\|") + known
        if name not in seen:
            yield from _inside(value, whole, path, seen)
        seen |= {name} - {""}


def _inside(
    value: dict[str, Any], whole: dict[str, Any], path: str, seen: set[str]
) -> Iterator[tuple[str, str, str, str]]:
    yield from _rows(value, whole, f"{path}.", seen)
    for part, mark in (("items", "[]"), ("additionalProperties", ".*")):
        if isinstance(value.get(part), dict):
            yield from _inside(_resolved(value[part], whole)[0], whole, f"{path}{mark}", seen)


def _resolved(schema: dict[str, Any], whole: dict[str, Any]) -> tuple[dict[str, Any], bool]:
    """Return the schema behind a reference, and whether null stands for it too."""
    nullable = {"type": "null"} in schema.get("anyOf", ())
    if nullable:
        schema = next(each for each in schema["anyOf"] if each != {"type": "null"})
    return (whole["$defs"][schema["$ref"].rpartition("/")[2]] if "$ref" in schema else schema), nullable


def _kind(value: dict[str, Any], nullable: bool) -> str:
    if "const" in value:
        return f"`{value['const']}`"
    kinds = value.get("type", "number or table")
    kinds = [kinds] if isinstance(kinds, str) else list(kinds)
    if "enum" in value:
        kinds = [f"`{each}`" for each in value["enum"] if each is not None] + ["null"] * (None in value["enum"])
    return " or ".join([*kinds, *(["null"] if nullable and "null" not in kinds else [])])


def calibration() -> str:
    """Return the layout of a calibration block: a row for each member, those of a second side by their place alone."""
    lines = ["| word | octet | member | size | what it is | unit | in compensator.json |", f"|{7 * '---|'}"]
    second = "sides[1]."
    for member in members():
        if not member.path.startswith(second):
            lines.append(_member(member))
        elif member.path == second + "offset":
            lines.append(f"| {member.at} | {2 * member.at} | `sides[1]` | | as `sides[0]`, of negative commands | | |")
    lines += ["", "Bits of `shape`:", "", "| bit | meaning |", "|---|---|"]
    return "\n".join([*lines, *(f"| {bit} | {text} |" for bit, text in enumerate(SHAPE_BITS.values()))])


def _member(member: Member) -> str:
    entry = member.entry
    size = f"{entry.bits} bits" + (f" × {entry.count}" if entry.count > 1 else "")
    key = f"`{entry.key}`" if entry.key else ""
    text = entry.text[0].upper() + entry.text[1:]
    return f"| {member.at} | {2 * member.at} | `{member.path}` | {size} | {text} | {entry.unit} | {key} |"


def api() -> str:
    """Return directives for the documented names of each module."""
    parts = []
    for module, names in API:
        found = importlib.import_module(module)
        parts.append(f"## {module}\n\n```{{eval-rst}}\n.. currentmodule:: {module}\n")
        for name in names:
            kind = "autofunction" if inspect.isfunction(getattr(found, name)) else "autoclass"
            members = "\n   :members:" if kind == "autoclass" else ""
            parts.append(f"\n.. {kind}:: {name}{members}\n")
        parts.append("\n```\n")
    return "\n".join(parts)


def warnings() -> str:
    """Return the catalogue of warnings: a chapter for each thing they are about, the codes in the order of letters."""
    entries = sorted(catalogue().items())
    lines = []
    for chapter in ("the recordings", "the flow meter", "the pressure"):
        lines += [f"## About {chapter}", ""]
        for code, entry in entries:
            if entry.about == chapter:
                lines += [f"({code})=", f"### {code}", f"**Meaning:** {entry.meaning.strip()}", ""]
                lines += [f"**What to do:** {entry.remedy.strip()}", ""]
    return "\n".join(lines)


def key_lines(artefact: type) -> list[str]:
    """Return a field of reStructuredText for each key of an artefact that is described."""
    try:
        hints = get_type_hints(artefact, include_extras=True)
    except NameError:  # arguments of a stage, some of whose types only a type checker imports: no artefact
        return []
    lines, below = [], field_docstrings(artefact)
    for field in fields(artefact):
        described = [each.description for each in getattr(hints[field.name], "__metadata__", ()) if each.description]
        described += [below[field.name]] if field.name in below else []
        lines += [f":ivar {field.name}: {described[-1]}"] if described else []
    return lines


def schema_document(name: str) -> dict[str, Any]:
    """Return a schema (JSON Schema, draft 2020-12), one of `SCHEMAS`."""
    return json_schema(resolve_name(SCHEMAS[name][0]))


def json_schema(kind: type[Artefact]) -> Node:
    """Return the JSON Schema (draft 2020-12) of an artefact, with units, bounds and descriptions.

    Further keys are welcome in every object (no ``additionalProperties: false``), as they are to the reader; a rule
    between fields is not in it.
    """
    components = msgspec.json.schema(kind, schema_hook=_schema_of_other_types)["$defs"]
    definitions: dict[str, Node] = {name: _tidy(node) for name, node in components.items()}
    for found in _dataclasses(msgspec.inspect.type_info(kind)):
        node, names = definitions[found.__name__], [field.name for field in fields(found)]
        for name, sentence in field_docstrings(found).items():
            node["properties"][name] = {"description": "", **node["properties"][name]} | {"description": sentence}
        # In the order of the file, and each of them: a default is for who makes one in Python. A field that may be
        # unset stands in the file only where it says something.
        required = [field.name for field in fields(found) if field.default is not msgspec.UNSET]
        node |= {"properties": {name: node["properties"][name] for name in names}, "required": required}
    root = definitions.pop(kind.__name__)
    if "#/$defs/Fraction" in str((root, definitions)):
        definitions["Fraction"] = {"description": "An exact number.", **FRACTION}
    family, _, version = schema_of(kind).removeprefix("dzdesign.").partition("/")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:dzdesign:schema:{family}:{version}",
        "title": kind.FILE_NAME,
        **root,
        "$defs": definitions,
    }


def _schema_of_other_types(kind: type) -> Node:
    if kind is Fraction:
        return dict(FRACTION)
    if issubclass(kind, JsonText):
        return {"type": "string"}
    raise NotImplementedError  # msgspec then names the type


def _dataclasses(info: object) -> Iterator[type]:
    """Yield the dataclasses that a type is made of, some of them more than once."""
    if isinstance(info, msgspec.inspect.DataclassType):
        yield info.cls
    for name in getattr(info, "__struct_fields__", ()):
        value = getattr(info, name)
        for part in value if isinstance(value, tuple) else (value,):
            if isinstance(part, msgspec.inspect.Type | msgspec.inspect.Field):
                yield from _dataclasses(part)


def _tidy(node: Any) -> Any:
    """Return a node as a person would write it: a short description, and null as one of the types."""
    if isinstance(node, list):
        return [_tidy(item) for item in node]
    if not isinstance(node, dict):
        return node
    node = {key: _tidy(value) for key, value in node.items()}
    if "properties" in node:  # of a class: its name is the definition's, and of its docstring the first paragraph
        node.pop("title", None)
        for value in node["properties"].values():
            value.pop("default", None)  # it stands in every file
        node["description"] = " ".join(node["description"].partition("\n\n")[0].split())
    match node:
        case {"prefixItems": [{"title": "numerator"}, _]}:
            about = {key: value for key, value in node.items() if key not in FRACTION}
            return {**about, "$ref": "#/$defs/Fraction"}
        case {"anyOf": [{"type": str(kind)} as one, {"type": "null"}], **rest}:
            return {**rest, **one, "type": [kind, "null"]}
        case {"anyOf": [{"enum": [*values]}, {"type": "null"}], **rest}:
            return {**rest, "enum": [*values, None]}
        case {"enum": [value], **rest}:
            return {**rest, "const": value}
    return node


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


#: What a page asks for by ``<!-- made: NAME -->``.
MADE: dict[str, Callable[[], str]] = {
    "commands": commands, "files": files, "warnings": warnings, "api": api,
    "calibration": calibration,
}  # fmt: skip
