"""`output_files`: a compensator in; a function block in Structured Text, and the same as PLC tools import it, out."""

from collections.abc import Mapping
from textwrap import wrap

from dzdesign.codegen.banner import banner_of, lot_in_words
from dzdesign.codegen.core.certificate_text import equation_of
from dzdesign.codegen.integers.form import Form
from dzdesign.codegen.integers.interface import Interface, interface_named
from dzdesign.codegen.integers.law import block_form
from dzdesign.codegen.integers.plcopen import plcopen_xml, tcpou_xml
from dzdesign.codegen.integers.text import st_body, st_constants, st_variables
from dzdesign.core.errors import InputError
from dzdesign.core.strict_templates import strict_templates
from dzdesign.derivation.law import law
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareOrigin
from dzdesign.design.signals import SIDE_NAMES

NAME = "FB_DeadZone"
TEMPLATE = f"{NAME}.st.jinja"
PACKAGE = "dzdesign.codegen.integers"
#: Columns of a line, and of a comment's text.
COLUMNS = 116


def output_files(compensator: Compensator, origin: FirmwareOrigin, settings: Mapping[str, str]) -> dict[str, bytes]:
    """Return the function block as text, and as the file that the tool of a dialect imports.

    A compensator that controls the current is an `InputError`: a PLC's block has no such loop.
    """
    if compensator.current_drive is not None:
        raise InputError(
            "the compensator controls the current, which a function block can't at a PLC's cycle; design it again "
            "with --drive duty, or let the PLC's output or the amplifier control the current"
        )
    text = structured_text(compensator, origin.compensator_json, settings["interface"])
    files = {f"{NAME}.st": text.encode(), f"{NAME}.xml": plcopen_xml(NAME, text)}
    if settings["dialect"] == "twincat":
        files[f"{NAME}.TcPOU"] = tcpou_xml(NAME, text)
    return files


def note_of(compensator: Compensator, settings: Mapping[str, str]) -> str:
    """Return what of a design a function block has not; empty where it has all of it."""
    del settings  # whichever they are
    left_out = ", ".join(left_out_of(compensator))
    return f"the function block leaves out, of this design: {left_out}" if left_out else ""


def structured_text(compensator: Compensator, digest: str, interface_name: str) -> str:
    """Return the function block of a compensator whose file has this SHA-256."""
    interface, form = interface_named(interface_name, compensator), block_form(compensator, interface_name)
    banner = banner_of(compensator, digest).lines(TEMPLATE)
    template = strict_templates(PACKAGE, autoescape=False, lstrip_blocks=True).get_template(TEMPLATE)
    text = str(template.render(banner=banner, **_values(compensator, interface, form)))
    return text.replace("²", "^2").encode("ascii", "replace").decode()  # units of recordings stand in comments


def _values(compensator: Compensator, interface: Interface, form: Form) -> dict[str, object]:
    """Return what the template prints."""
    of_codes, chosen = interface.name == "codes", law(compensator.law)
    return {
        "law_equation": equation_of(chosen),
        "law_text": str(chosen.output).replace("**", "^"),
        "header": _header(compensator, interface),
        "bipolar": len(interface.sides) == 2,
        "has_rest": compensator.zero_band_codes > 0,
        "command_text": "converter code of the command" if of_codes else "0.01 % of full command, -10000 to 10000",
        "pressure_text": "codes of the pressures" if of_codes else "0.1 bar",
        "output_text": f"compare value, full duty {interface.full}" if of_codes else "0.01 % of full drive",
        "constants": st_constants(form),
        "variables": st_variables(form),
        "body": st_body(form),
    }


def _header(compensator: Compensator, interface: Interface) -> list[str]:
    """Return what the header says: how numbers are rounded, what is certified, and what the block leaves out."""
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
    left_out = "Not in it: current control and telemetry"
    if chosen := left_out_of(compensator):
        left_out += f"; nor, though this design has them: {', '.join(chosen)}"
    return lines + wrap(f"{left_out}.", COLUMNS - 3)


def _certificate(compensator: Compensator) -> str:
    """Return in short what the output at zero command is certified for; compensator.json has it all."""
    units = compensator.valve.recorded_units
    parts = []
    for sign in compensator.signals.signs:
        certificate = compensator.side(sign).certificate
        low, high = (float(end) for end in certificate.dp_MPa)
        of_sign = "" if len(compensator.signals.signs) == 1 else f" ({SIDE_NAMES[sign]})"
        bound = f"the {100 * certificate.confidence:.6g}% lower bound of the {certificate.guard} threshold"
        parts.append(f"{bound}{of_sign} {units.span(low, high, '.2f MPa')}")
    text = f"At zero command the output lies below {', and below '.join(parts)}, of {compensator.certified_of}."
    lot = lot_in_words(compensator)
    return f"{text} {lot.banner}" if lot else text


def left_out_of(compensator: Compensator) -> list[str]:
    """Return the drive functions that the compensator has and the block has not."""
    functions = compensator.drive_functions
    found = [
        ("dither", functions.dither_counts > 0),
        ("ramps of the command", functions.has_ramp),
        ("play of a falling command", functions.has_play),
        ("debouncing of faults", functions.fault_samples > 1),
        ("latching of faults", functions.fault_latch),
        ("interlock", functions.interlock_codes is not None),
    ]
    return [name for name, there in found if there]
