"""The text that a PLC's tool takes from each file: read back from PLCopen XML and TcPOU, and the typed declarations."""

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.errors import InputError
from dzdesign.verify.structured_text.syntax import FunctionBlock, Variable

NAMES = {"p": "http://www.plcopen.org/xml/tc6_0200", "h": "http://www.w3.org/1999/xhtml"}
PLAIN_TEXT = "http://www.3s-software.com/plcopenxml/interfaceasplaintext"
END = "END_FUNCTION_BLOCK\n"
#: Element of a section to the section, by whether it is constant.
SECTIONS = {
    ("inputVars", False): "VAR_INPUT", ("outputVars", False): "VAR_OUTPUT", ("localVars", False): "VAR",
    ("localVars", True): "VAR CONSTANT", ("tempVars", False): "VAR_TEMP",
}  # fmt: skip


def read_xml(path: Path) -> Element:
    """Return the document of a file; one with a type of its own, which could grow without end, is refused."""
    content = read_bytes(path, "file for a PLC's tool")
    if b"<!" in content:
        raise InputError(f"'{path}' declares a document type, which no generated file does; make it again")
    try:
        return ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        raise InputError(f"'{path}' is no XML: {error}; make it again with `dzdesign codegen`") from error


def text_of_plcopen(document: Element) -> str:
    """Return the function block of a project of PLCopen XML; empty where it has none."""
    pou = document.find("p:types/p:pous/p:pou", NAMES)
    if pou is None:
        return ""
    declaration = pou.find(f"p:addData/p:data[@name='{PLAIN_TEXT}']/p:InterfaceAsPlainText/h:xhtml", NAMES)
    return _joined(declaration, pou.find("p:body/p:ST/h:xhtml", NAMES))


def text_of_tcpou(document: Element) -> str:
    """Return the function block of a TcPOU; empty where it has none."""
    return _joined(document.find("POU/Declaration"), document.find("POU/Implementation/ST"))


def _joined(declaration: Element | None, body: Element | None) -> str:
    if declaration is None or body is None:
        return ""
    return (declaration.text or "") + (body.text or "") + END


def differing_declarations(document: Element, block: FunctionBlock) -> list[str]:
    """Return the variables whose typed declaration in PLCopen XML is another one than the text's."""
    typed = dict(_typed(document))
    names = [variable.name for variable in block.variables.values()]
    stated = {variable.name: _stated(variable) for variable in block.variables.values()}
    return [name for name in dict.fromkeys([*names, *typed]) if typed.get(name) != stated.get(name)]


def _stated(variable: Variable) -> tuple[object, ...]:
    return variable.section, variable.kind, variable.bounds, variable.initial


def _typed(document: Element) -> Iterator[tuple[str, tuple[object, ...]]]:
    """Yield each variable of the typed interface, with what `_stated` returns of one."""
    interface = document.find("p:types/p:pous/p:pou/p:interface", NAMES)
    for section in interface if interface is not None else ():
        heading = SECTIONS.get((section.tag.partition("}")[2], section.get("constant") == "true"))
        for variable in section:
            array = variable.find("p:type/p:array", NAMES)
            kind = variable.find("p:type/*" if array is None else "p:type/p:array/p:baseType/*", NAMES)
            dimension = array.find("p:dimension", NAMES) if array is not None else None
            bounds = None
            if dimension is not None:
                bounds = (int(dimension.get("lower", "")), int(dimension.get("upper", "")))
            values = [each.get("value", "") for each in variable.iterfind(".//p:simpleValue", NAMES)]
            initial = tuple({"TRUE": 1, "FALSE": 0}.get(value, value) for value in values)
            numbers = tuple(int(value) for value in initial) or None
            yield (
                variable.get("name", ""),
                (heading, kind.tag.partition("}")[2] if kind is not None else "", bounds, numbers),
            )
