"""`output_files`: a compensator in; a function block in Structured Text, and the same as PLC tools import it, out.

PLCopen XML (TC6 2.0) holds the declaration twice: as typed variables, which TwinCAT reads, and as plain text with its
comments, which CODESYS prefers where it is there. The dates that the format asks for are no date: the same text, the
same bytes. TwinCAT's own TcPOU holds the text alone.
"""

from collections.abc import Mapping, Sequence
from textwrap import wrap
from uuid import NAMESPACE_URL, uuid5
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from dzdesign.codegen.banner import lot_in_words
from dzdesign.codegen.integers.form import Form, Node
from dzdesign.codegen.integers.interface import Interface, cycle_time_s, debounce_s, interface_named
from dzdesign.codegen.integers.law import block_form
from dzdesign.codegen.integers.text import (
    COLUMNS,
    first_value,
    rendered,
    st_body,
    st_constants,
    st_remembered,
    st_variables,
)
from dzdesign.core.errors import InputError
from dzdesign.core.version import __version__
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareOrigin
from dzdesign.design.pressure_inputs import what_machine_switches
from dzdesign.design.signals import SIDE_NAMES

NAME = "FB_DeadZone"
TEMPLATE = f"{NAME}.st.jinja"
END = "END_FUNCTION_BLOCK\n"
#: What a block has that counts cycles.
COUNTED = ("debouncing of faults", "interlock")
NAMESPACE = "http://www.plcopen.org/xml/tc6_0200"
XHTML = "http://www.w3.org/1999/xhtml"
PLAIN_TEXT = "http://www.3s-software.com/plcopenxml/interfaceasplaintext"
NO_DATE = "1970-01-01T00:00:00"


def output_files(compensator: Compensator, origin: FirmwareOrigin, settings: Mapping[str, str]) -> dict[str, bytes]:
    """Return the function block as text, and as the file that the tool of a dialect imports.

    A compensator that controls the current is an `InputError`: a PLC's block has no such loop.
    """
    if compensator.current_drive is not None:
        raise InputError(
            "the compensator controls the current, which a function block can't at a PLC's cycle; design it again "
            "with --drive duty, or let the PLC's output or the amplifier control the current"
        )
    chosen = settings["interface"], settings["cycle_time"]
    text, form = structured_text(compensator, origin.compensator_json, *chosen), block_form(compensator, *chosen)
    files = {f"{NAME}.st": text.encode(), f"{NAME}.xml": _plcopen_xml(text, form)}
    if settings["dialect"] == "twincat":
        files[f"{NAME}.TcPOU"] = _tcpou_xml(text)
    return files


def note_of(compensator: Compensator, settings: Mapping[str, str]) -> str:
    """Return what of a design a function block has not; empty where it has all of it."""
    left_out = ", ".join(_not_in_block(compensator, settings["cycle_time"]))
    return f"the function block leaves out, of this design: {left_out}" if left_out else ""


def structured_text(compensator: Compensator, digest: str, interface_name: str, cycle_time: str = "") -> str:
    """Return the function block of a compensator whose file has this SHA-256."""
    interface = interface_named(interface_name, compensator, cycle_time)
    form = block_form(compensator, interface_name, cycle_time)
    of_codes = interface.name == "codes"
    return rendered(
        TEMPLATE,
        compensator,
        digest,
        header=_header(compensator, interface, cycle_time),
        bipolar=len(interface.sides) == 2,
        enabled=any(each.name == "enable" for each in form.inputs),
        counts=interface.fault_cycles > 0,
        command_text="converter code of the command" if of_codes else "0.01 % of full command, -10000 to 10000",
        pressure_text="codes of the pressures" if of_codes else "0.1 bar",
        pressures=", ".join(f"pressure_{name.lower()}" for name in interface.pressures),
        edges=_edges(interface),
        three=interface.three,
        output_text=f"compare value, full duty {interface.full}" if of_codes else "0.01 % of full drive",
        constants=st_constants(form),
        remembered=st_remembered(form),
        variables=st_variables(form),
        body=st_body(form),
    )


def _header(compensator: Compensator, interface: Interface, cycle_time: str) -> list[str]:
    """Return what the header says: rounding, certificate, cycles of a fault, and what the block leaves out."""
    lines: list[str] = []
    if interface.name == "plc":
        lines += wrap(
            "The output is rounded down. A pressure drop stands for all within 0.1 bar of it; the least of their betas "
            "is taken. So the output at zero command is never above what is certified.",
            COLUMNS - 3,
        )
    else:
        lines.append("Codes and compare values are those of the C, number for number.")
    lines += wrap(_certificate(compensator), COLUMNS - 3)
    lines += wrap(what_machine_switches(compensator), COLUMNS - 3)
    lines += wrap(_cycles(compensator, interface, cycle_time), COLUMNS - 3)
    left_out = "Not in it: current control and telemetry"
    if chosen := _not_in_block(compensator, cycle_time):
        left_out += f"; nor, though this design has them: {', '.join(chosen)}"
    return lines + wrap(f"{left_out}.", COLUMNS - 3)


def _cycles(compensator: Compensator, interface: Interface, cycle_time: str) -> str:
    """Return what a fault does and when it is over; empty without a cycle time."""
    cycle_s, cycles = cycle_time_s(cycle_time), interface.fault_cycles
    if cycle_s is None:
        return ""
    lasts_ms, asked_ms = (1e3 * float(each) for each in (cycles * cycle_s, debounce_s(compensator)))
    in_a_row = "a valid cycle" if cycles == 1 else f"{cycles} valid cycles in a row"
    text = (
        f"Call it every {cycle_time}. A fault acts at once: an invalid command switches the output off, pressures that "
        f"can't be right select the smallest beta. It is over with {in_a_row}, {lasts_ms:g} ms (asked for: "
        f"{asked_ms:g} ms)."
    )
    bands = [side.interlock for side in interface.sides.values() if side.interlock is not None]
    if not bands:
        return text
    zeros = [f"{band / 100:g} %" if interface.name == "plc" else f"{band} codes" for band in dict.fromkeys(bands)]
    return (
        f"{text} Interlock: after a start, an invalid command or enable = FALSE the output stays off until, with "
        f"enable = TRUE, the command has been zero, within {' and '.join(zeros)}, for as many cycles in a row."
    )


def _certificate(compensator: Compensator) -> str:
    """Return in short what the output at zero command is certified for; compensator.json has it all."""
    units = compensator.valve.recorded_units
    parts = []
    for sign in compensator.signals.signs:
        certificate = compensator.side(sign).certificate
        low, high = (float(end) for end in certificate.dp_MPa)
        of_sign = "" if len(compensator.signals.signs) == 1 else f" ({compensator.valve.side_name(sign)})"
        bound = f"the {100 * certificate.confidence:.6g}% lower bound of the {certificate.guard} threshold"
        parts.append(f"{bound}{of_sign} {units.span(low, high, '.2f MPa')}")
    text = f"At zero command the output lies below {', and below '.join(parts)}, of {compensator.certified_of}."
    lot = lot_in_words(compensator)
    return f"{text} {lot.banner}" if lot else text


def _edges(interface: Interface) -> str:
    """Say which pressures are ahead of and behind the metering edge of each side."""
    sides = {SIDE_NAMES[sign]: side.pair for sign, side in interface.sides.items()}
    if len(set(sides.values())) == 1:
        return "{} ahead of and {} behind the metering edge".format(*next(iter(sides.values())))
    return ", ".join(f"{ahead} ahead and {behind} behind at {side} commands" for side, (ahead, behind) in sides.items())


def _not_in_block(compensator: Compensator, cycle_time: str) -> list[str]:
    """Return what of a design a function block has not."""
    return [name for name in left_out_of(compensator) if not (cycle_time and name in COUNTED)]


def left_out_of(compensator: Compensator) -> list[str]:
    """Return the drive functions that the compensator has and the law alone has not."""
    functions = compensator.drive_functions
    found = [
        ("dither", functions.dither_counts > 0),
        ("ramps of the command", functions.has_ramp),
        ("play of a falling command", functions.has_play),
        (COUNTED[0], functions.fault_samples > 1),
        ("latching of faults", functions.fault_latch),
        (COUNTED[1], functions.interlock_codes is not None),
    ]
    return [name for name, there in found if there]


def _parts_of(text: str) -> tuple[str, str]:
    """Return declaration and body of a function block, which tools keep apart."""
    cut = text.rindex("END_VAR\n") + len("END_VAR\n")
    return text[:cut], text[cut:].removesuffix(END)


def _plcopen_xml(text: str, form: Form) -> bytes:
    """Return a function block as a project of PLCopen XML."""
    declaration, body = _parts_of(text)
    project = Element("project", xmlns=NAMESPACE)
    SubElement(project, "fileHeader", companyName="", productName="dzdesign", productVersion=__version__,
               creationDateTime=NO_DATE)  # fmt: skip
    header = SubElement(project, "contentHeader", name=NAME, modificationDateTime=NO_DATE)
    coordinates = SubElement(header, "coordinateInfo")
    for language in ("fbd", "ld", "sfc"):
        SubElement(SubElement(coordinates, language), "scaling", x="1", y="1")
    types = SubElement(project, "types")
    SubElement(types, "dataTypes")
    pou = SubElement(SubElement(types, "pous"), "pou", name=NAME, pouType="functionBlock")
    interface = SubElement(pou, "interface")
    for element, variables in _sections(form):
        section = SubElement(interface, element, {"constant": "true"} if variables is form.constants else {})
        for each in variables:
            section.append(_variable(each))
    SubElement(SubElement(SubElement(pou, "body"), "ST"), "xhtml", xmlns=XHTML).text = body
    data = SubElement(SubElement(pou, "addData"), "data", name=PLAIN_TEXT, handleUnknown="implementation")
    SubElement(SubElement(data, "InterfaceAsPlainText"), "xhtml", xmlns=XHTML).text = declaration
    SubElement(SubElement(project, "instances"), "configurations")
    return _written(project)


def _sections(form: Form) -> list[tuple[str, Sequence[Node]]]:
    """Return the variables of each section of the declaration, by its element, in the order of the text."""
    given = [each for each in form.inputs if each not in form.remembered]
    outputs = [line for name in form.outputs for line in form.lines if line.name == name]
    local = [*form.remembered, *form.own]
    return [("inputVars", given), ("outputVars", outputs), ("localVars", local), ("localVars", form.constants)]


def _variable(node: Node) -> Element:
    """Return a variable with its type and, of a constant and of what is remembered, its first value."""
    variable = Element("variable", name=node.name)
    place, kind = SubElement(variable, "type"), "BOOL" if node.boolean else "DINT"
    if len(node.values) > 1:
        array = SubElement(place, "array")
        SubElement(array, "dimension", lower="0", upper=str(len(node.values) - 1))
        SubElement(SubElement(array, "baseType"), kind)
        values = SubElement(SubElement(variable, "initialValue"), "arrayValue")
        for value in node.values:
            SubElement(SubElement(values, "value"), "simpleValue", value=str(value))
        return variable
    SubElement(place, kind)
    if node.values:
        SubElement(SubElement(variable, "initialValue"), "simpleValue", value=first_value(node))
    return variable


def _tcpou_xml(text: str) -> bytes:
    """Return a function block as TwinCAT keeps it, to be added as an existing item."""
    declaration, body = _parts_of(text)
    top = Element("TcPlcObject", Version="1.1.0.1", ProductVersion="3.1.4024.0")
    pou = SubElement(top, "POU", Name=NAME, Id=f"{{{uuid5(NAMESPACE_URL, text)}}}", SpecialFunc="None")
    SubElement(pou, "Declaration").text = declaration
    SubElement(SubElement(pou, "Implementation"), "ST").text = body
    return _written(top)


def _written(top: Element) -> bytes:
    written: bytes = ElementTree.tostring(top, encoding="utf-8", xml_declaration=True)
    return written + b"\n"
