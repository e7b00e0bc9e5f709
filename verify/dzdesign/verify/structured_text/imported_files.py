"""What a PLC's tool takes from each file: PLCopen XML and TcPOU, read back element by element.

A tool imports all that such a file has: a second block, an action or a method beside the good one is imported, too. So
a file must have exactly the elements, attributes and texts that the function block makes, and nothing else.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.errors import InputError, quoted
from dzdesign.verify.structured_text.syntax import FunctionBlock, Variable

PLCOPEN = "{http://www.plcopen.org/xml/tc6_0200}"
XHTML = "{http://www.w3.org/1999/xhtml}xhtml"
PLAIN_TEXT = "http://www.3s-software.com/plcopenxml/interfaceasplaintext"
#: How a file begins: then it is in UTF-8 and declares no entity, which other encodings could hide.
BEGIN = b"<?xml version='1.0' encoding='utf-8'?>\n"
DECLARED, END = "END_VAR\n", "END_FUNCTION_BLOCK\n"
#: Section to its element, and its attributes.
SECTIONS: Mapping[str, tuple[str, Mapping[str, str]]] = {
    "VAR_INPUT": ("inputVars", {}), "VAR_OUTPUT": ("outputVars", {}), "VAR": ("localVars", {}),
    "VAR CONSTANT": ("localVars", {"constant": "true"}), "VAR_TEMP": ("tempVars", {}),
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """An element as it must be."""

    tag: str
    #: Name to value; None: any.
    attributes: Mapping[str, str | None] = field(default_factory=dict)
    children: tuple["Shape", ...] = ()
    #: The text in it, where it has no children.
    text: str = ""


def read_xml(path: Path) -> Element:
    """Return the document of a file; one in another encoding or with declarations, comments or instructions is refused.

    A type of its own could grow without end, and what a tool makes of the others differs.
    """
    content = read_bytes(path, "file for a PLC's tool")
    inside = content.removeprefix(BEGIN)
    if inside == content or not inside.isascii():
        raise InputError(f"'{path}' does not begin as generated, or is not ASCII; make it again")
    if b"<!" in inside or b"<?" in inside:
        raise InputError(f"'{path}' declares a document type or has a comment, as no generated file; make it again")
    try:
        return ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        raise InputError(f"'{path}' is not XML: {error}; make it again with `dzdesign codegen`") from error


def plcopen_faults(document: Element, block: FunctionBlock, text: str) -> Iterator[str]:
    """Yield what a project of PLCopen XML has otherwise than the function block and its text make it."""
    declaration, body = _cut(text)

    def shape(tag: str, *children: Shape, **attributes: str | None) -> Shape:
        return Shape(tag=PLCOPEN + tag, attributes=attributes, children=children)

    scaled = (shape(language, shape("scaling", x="1", y="1")) for language in ("fbd", "ld", "sfc"))
    plain = shape("InterfaceAsPlainText", Shape(tag=XHTML, text=declaration))
    pou = shape(
        "pou",
        Shape(tag=f"{PLCOPEN}interface", children=tuple(_sections(block))),
        shape("body", shape("ST", Shape(tag=XHTML, text=body))),
        shape("addData", shape("data", plain, name=PLAIN_TEXT, handleUnknown="implementation")),
        name=block.name,
        pouType="functionBlock",
    )
    header = dict.fromkeys(("companyName", "productName", "productVersion", "creationDateTime"))
    project = shape(
        "project",
        shape("fileHeader", **header),
        shape("contentHeader", shape("coordinateInfo", *scaled), name=None, modificationDateTime=None),
        shape("types", shape("dataTypes"), shape("pous", pou)),
        shape("instances", shape("configurations")),
    )
    yield from _faults(document, project)


def tcpou_faults(document: Element, block: FunctionBlock, text: str) -> Iterator[str]:
    """Yield what a TcPOU has otherwise than the function block and its text make it."""
    declaration, body = _cut(text)
    implementation = Shape(tag="Implementation", children=(Shape(tag="ST", text=body),))
    pou = Shape(
        tag="POU",
        attributes={"Name": block.name, "Id": None, "SpecialFunc": "None"},
        children=(Shape(tag="Declaration", text=declaration), implementation),
    )
    attributes = dict.fromkeys(("Version", "ProductVersion"))
    yield from _faults(document, Shape(tag="TcPlcObject", attributes=attributes, children=(pou,)))


def _cut(text: str) -> tuple[str, str]:
    """Return declaration and body, which tools keep apart."""
    cut = text.rindex(DECLARED) + len(DECLARED)
    return text[:cut], text[cut:].removesuffix(END)


def _sections(block: FunctionBlock) -> Iterator[Shape]:
    """Yield the typed declarations of each section."""
    for section, variables in groupby(block.variables.values(), lambda each: each.section):
        tag, attributes = SECTIONS[section]
        yield Shape(tag=PLCOPEN + tag, attributes=attributes, children=tuple(map(_variable, variables)))


def _variable(variable: Variable) -> Shape:
    kind = Shape(tag=PLCOPEN + variable.kind)
    if variable.bounds:
        ends = dict(zip(("lower", "upper"), map(str, variable.bounds), strict=True))
        parts = (Shape(tag=f"{PLCOPEN}dimension", attributes=ends), Shape(tag=f"{PLCOPEN}baseType", children=(kind,)))
        kind = Shape(tag=f"{PLCOPEN}array", children=parts)
    children = [Shape(tag=f"{PLCOPEN}type", children=(kind,))]
    if variable.initial is not None:
        values = [_simple(variable, value) for value in variable.initial]
        if variable.bounds:
            each = tuple(Shape(tag=f"{PLCOPEN}value", children=(value,)) for value in values)
            values = [Shape(tag=f"{PLCOPEN}arrayValue", children=each)]
        children.append(Shape(tag=f"{PLCOPEN}initialValue", children=tuple(values)))
    return Shape(tag=f"{PLCOPEN}variable", attributes={"name": variable.name}, children=tuple(children))


def _simple(variable: Variable, value: int) -> Shape:
    text = ("FALSE", "TRUE")[value] if variable.kind == "BOOL" else str(value)
    return Shape(tag=f"{PLCOPEN}simpleValue", attributes={"value": text})


def _faults(element: Element, shape: Shape) -> Iterator[str]:
    """Yield how an element differs from what it must be, at most one fault an element."""
    tag = shape.tag.rpartition("}")[2]
    name = f"{tag} {shape.attributes['name']}" if shape.attributes.get("name") else tag
    text = element.text or ""
    if element.tag != shape.tag:
        yield f"{quoted(element.tag.rpartition('}')[2])} stands where {name} is expected"
    elif element.attrib.keys() != shape.attributes.keys():
        yield f"{name} has attributes {', '.join(sorted(element.attrib)) or 'none'}"
    elif others := [key for key, value in shape.attributes.items() if value not in (None, element.get(key))]:
        yield f"{name} has {others[0]} {quoted(element.get(others[0], ''))}"
    elif len(element) != len(shape.children):
        yield f"{name} has {len(element)} elements, expected {len(shape.children)}"
    elif (text.strip() if shape.children else text) != shape.text:
        yield f"{name} has another text than the .st"
    else:
        for child, expected in zip(element, shape.children, strict=True):
            yield from _faults(child, expected)
            if (child.tail or "").strip():
                yield f"{name} has text beside its elements"
