"""`output_files`: a compensator in, Structured Text and XML out."""

from collections.abc import Mapping
from dataclasses import dataclass
from textwrap import wrap

from dzdesign.codegen.banner import banner_of, lot_in_words
from dzdesign.codegen.core.certificate_text import equation_of
from dzdesign.codegen.structured_text.constants import Constants, constants_of
from dzdesign.codegen.structured_text.interface import Interface, interface_named
from dzdesign.codegen.structured_text.law_form import LIFT, LawForm, law_form
from dzdesign.codegen.structured_text.plcopen import plcopen_xml, tcpou_xml
from dzdesign.core.errors import InputError
from dzdesign.core.strict_templates import strict_templates
from dzdesign.derivation.law import law
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareOrigin
from dzdesign.design.signals import SIDE_NAMES

NAME = "FB_DeadZone"
TEMPLATE = f"{NAME}.st.jinja"
PACKAGE = "dzdesign.codegen.structured_text"
#: Columns of a line, and of a comment's text.
COLUMNS = 116
#: A weighted difference of valid codes is above the negative of this, times the unit of the weights.
WEIGHT_LIFT = 32768


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
    interface = interface_named(interface_name, compensator)
    forms = {sign: law_form(compensator, interface, sign) for sign in interface.sides}
    values = _values(compensator, interface, forms)
    banner = banner_of(compensator, digest).lines(TEMPLATE)
    template = strict_templates(PACKAGE, autoescape=False, lstrip_blocks=True).get_template(TEMPLATE)
    text = str(template.render(banner=banner, **values))
    return text.replace("²", "^2").encode("ascii", "replace").decode()  # units of recordings stand in comments


@dataclass(frozen=True, slots=True, kw_only=True)
class _Words:
    """What the comments say of the inputs and the output."""

    command: str
    pressure: str
    output: str


def _words(interface: Interface) -> _Words:
    if interface.name == "codes":
        return _Words(
            command="converter code of the command",
            pressure="codes of the pressures",
            output=f"compare value, full duty {interface.full}",
        )
    return _Words(
        command="0.01 % of full command, -10000 to 10000",
        pressure="0.1 bar",
        output="0.01 % of full drive",
    )


def _values(compensator: Compensator, interface: Interface, forms: Mapping[int, LawForm]) -> dict[str, object]:
    """Return what the template prints."""
    constants = constants_of(compensator, interface, forms)
    words, sides = _words(interface), interface.sides
    bipolar, transition = len(sides) == 2, compensator.transition_codes > 0
    linear = next(iter(forms.values())).linear
    chosen = law(compensator.law)
    unit, weighted = compensator.beta_denominator * compensator.beta_step_codes, interface.weight_unit != 1
    return {
        "law_equation": equation_of(chosen),
        "law_text": str(chosen.output).replace("**", "^"),
        "header": _header(compensator, interface),
        "bipolar": bipolar,
        "has_rest": compensator.zero_band_codes > 0,
        "transition": transition,
        "command_text": words.command,
        "pressure_text": words.pressure,
        "output_text": words.output,
        "constants": constants.lines,
        "c": constants.printed,
        "leave_positive": constants.of_sign("LEAVE_ZERO", 1) if bipolar else "",
        "leave_negative": constants.of_sign("LEAVE_ZERO", -1) if bipolar else "",
        "products": 1 + bool(linear) + transition,
        "away": _away(interface, constants),
        "difference": _difference(interface, constants),
        "turns": any(side.turn < 0 for side in sides.values()),
        "weighted": weighted,
        "weight_unit": interface.weight_unit,
        "weight_lift": WEIGHT_LIFT,
        "beta_unit_text": f"1/{unit}",
        "lookups": _lookups(compensator, interface),
        "first_row": f"{constants.printed['FIRST_ROW']} + " if "FIRST_ROW" in constants.printed else "",
        "scale": f" * {constants.printed['BETA_SCALE']}" if constants.scales else "",
        "linear": linear,
        "weight": "passed" if transition else "1",
        "lift": LIFT,
        "rounds": interface.rounds,
    }


def _away(interface: Interface, constants: Constants) -> str:
    """Return the command in units from zero command on, towards positive commands."""
    if interface.command_zero == 0 and interface.command_direction > 0:
        return "command"
    zero = constants.printed["COMMAND_ZERO"]
    return f"command - {zero}" if interface.command_direction > 0 else f"{zero} - command"


def _difference(interface: Interface, constants: Constants) -> str:
    """Return the weighted difference of the pressures."""

    def pressure(name: str, zero: int, weight: int) -> str:
        at_none = f" - {constants.printed[f'PRESSURE_{name.upper()}_ZERO']}" if zero else ""
        text = f"(pressure_{name}{at_none})" if zero else f"pressure_{name}"
        return text if interface.weight_unit == 1 else f"{text} * {weight}"

    a, b = interface.a, interface.b
    return f"{pressure('a', a.zero, a.weight)} - {pressure('b', b.zero, b.weight)}"


def _lookups(compensator: Compensator, interface: Interface) -> list[str]:
    """Return the codes at which beta is read; the least of the betas counts.

    Of the pressure drops that a number stands for it is one end, as a table rises to a code and falls from it on.
    """
    if interface.resolution == 0:
        return ["MAX(dp, 0)"]
    tables = [table for sign in interface.sides for table in _tables(compensator, sign)]
    upper = f"((MAX(dp, 0) + {interface.resolution}) * CODES + (UNITS - 1)) / UNITS"
    lower = f"MAX(dp - {interface.resolution}, 0) * CODES / UNITS"
    if all(list(table) == sorted(table, reverse=True) for table in tables):
        return [upper]
    return [upper, lower]


def _tables(compensator: Compensator, sign: int) -> tuple[tuple[int, ...], ...]:
    side = compensator.side(sign)
    return (side.law_beta, side.beta) if compensator.transition_codes else (side.law_beta,)


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
