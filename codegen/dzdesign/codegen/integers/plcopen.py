"""A function block's text as the files that PLC tools import: PLCopen XML (TC6 2.0), and TwinCAT's TcPOU.

PLCopen XML holds the declaration twice: as typed variables, which TwinCAT reads, and as plain text with its comments,
which CODESYS prefers where it is there. The dates that the format asks for are no date: the same text, the same bytes.
"""

import re
from collections.abc import Iterator
from uuid import NAMESPACE_URL, uuid5
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from dzdesign.core.version import __version__

NAMESPACE = "http://www.plcopen.org/xml/tc6_0200"
XHTML = "http://www.w3.org/1999/xhtml"
PLAIN_TEXT = "http://www.3s-software.com/plcopenxml/interfaceasplaintext"
NO_DATE = "1970-01-01T00:00:00"
END = "END_FUNCTION_BLOCK\n"
#: Section of the declaration -> its element, and whether it is constant.
SECTIONS = {
    "VAR_INPUT": ("inputVars", False),
    "VAR_OUTPUT": ("outputVars", False),
    "VAR": ("localVars", False),
    "VAR CONSTANT": ("localVars", True),
    "VAR_TEMP": ("tempVars", False),
}
COMMENT = re.compile(r"\(\*.*?\*\)", re.DOTALL)
SECTION = re.compile(r"^(VAR(?:_INPUT|_OUTPUT|_TEMP)?(?: CONSTANT)?)$(.*?)^END_VAR$", re.DOTALL | re.MULTILINE)
DECLARED = re.compile(r"([\w\s,]+):\s*(?:ARRAY\[(\d+)\.\.(\d+)\] OF )?(\w+)(?:\s*:=\s*(.*))?$", re.DOTALL)


def parts_of(text: str) -> tuple[str, str]:
    """Return declaration and body of a function block, which tools keep apart."""
    cut = text.rindex("END_VAR\n") + len("END_VAR\n")
    return text[:cut], text[cut:].removesuffix(END)


def plcopen_xml(name: str, text: str) -> bytes:
    """Return a function block as a project of PLCopen XML."""
    declaration, body = parts_of(text)
    project = Element("project", xmlns=NAMESPACE)
    SubElement(project, "fileHeader", companyName="", productName="dzdesign", productVersion=__version__,
               creationDateTime=NO_DATE)  # fmt: skip
    header = SubElement(project, "contentHeader", name=name, modificationDateTime=NO_DATE)
    coordinates = SubElement(header, "coordinateInfo")
    for language in ("fbd", "ld", "sfc"):
        SubElement(SubElement(coordinates, language), "scaling", x="1", y="1")
    types = SubElement(project, "types")
    SubElement(types, "dataTypes")
    pou = SubElement(SubElement(types, "pous"), "pou", name=name, pouType="functionBlock")
    interface = SubElement(pou, "interface")
    for element, constant, variables in _sections(declaration):
        section = SubElement(interface, element)
        if constant:
            section.set("constant", "true")
        for variable in variables:
            section.append(variable)
    SubElement(SubElement(SubElement(pou, "body"), "ST"), "xhtml", xmlns=XHTML).text = body
    data = SubElement(SubElement(pou, "addData"), "data", name=PLAIN_TEXT, handleUnknown="implementation")
    SubElement(SubElement(data, "InterfaceAsPlainText"), "xhtml", xmlns=XHTML).text = declaration
    SubElement(SubElement(project, "instances"), "configurations")
    return _written(project)


def tcpou_xml(name: str, text: str) -> bytes:
    """Return a function block as TwinCAT keeps it, to be added as an existing item."""
    declaration, body = parts_of(text)
    top = Element("TcPlcObject", Version="1.1.0.1", ProductVersion="3.1.4024.0")
    pou = SubElement(top, "POU", Name=name, Id=f"{{{uuid5(NAMESPACE_URL, text)}}}", SpecialFunc="None")
    SubElement(pou, "Declaration").text = declaration
    SubElement(SubElement(pou, "Implementation"), "ST").text = body
    return _written(top)


def _written(top: Element) -> bytes:
    written: bytes = ElementTree.tostring(top, encoding="utf-8", xml_declaration=True)
    return written + b"\n"


def _sections(declaration: str) -> Iterator[tuple[str, bool, list[Element]]]:
    """Yield each section of the declaration: its element, whether it is constant, and its variables."""
    for heading, inside in SECTION.findall(COMMENT.sub("", declaration)):
        element, constant = SECTIONS[heading]
        yield element, constant, [each for entry in inside.split(";") if entry.strip() for each in _variables(entry)]


def _variables(entry: str) -> Iterator[Element]:
    """Yield the variables of one declaration, such as ``a, b : ARRAY[0..2] OF DINT := [1, 2, 3]``."""
    found = DECLARED.match(entry.strip())
    if found is None:
        raise ValueError(f"no declaration: {entry.strip()[:80]!r}")
    names, lower, upper, kind, start = found.groups()
    for name in names.split(","):
        variable = Element("variable", name=name.strip())
        place = SubElement(variable, "type")
        if lower is not None:
            array = SubElement(place, "array")
            SubElement(array, "dimension", lower=lower, upper=upper)
            place = SubElement(array, "baseType")
        SubElement(place, kind)
        if start is not None:
            _initial(SubElement(variable, "initialValue"), start.strip())
        yield variable


def _initial(place: Element, start: str) -> None:
    if not start.startswith("["):
        SubElement(place, "simpleValue", value=start)
        return
    values = SubElement(place, "arrayValue")
    for value in start.strip("[]").split(","):
        SubElement(SubElement(values, "value"), "simpleValue", value=value.strip())
