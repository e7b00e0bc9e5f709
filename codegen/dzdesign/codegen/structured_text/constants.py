"""The constants of a function block, each with its comment; of what differs from side to side, one a side."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from textwrap import wrap

from dzdesign.codegen.structured_text.interface import Interface
from dzdesign.codegen.structured_text.law_form import LawForm
from dzdesign.design.compensator import Compensator

#: Columns of a line of numbers, which the template indents.
COLUMNS = 115


@dataclass(slots=True, kw_only=True)
class Constants:
    """What stands in VAR CONSTANT, and how the body names each."""

    signs: tuple[int, ...]
    #: Whether beta has a scale beside its step.
    scales: bool = False
    lines: list[str] = field(default_factory=list)
    #: Constant to what the body has for it: where the sides differ, an element by the variable ``k``.
    printed: dict[str, str] = field(default_factory=dict)

    def each(self, name: str, values: Mapping[int, int], comment: str, kind: str = "DINT") -> None:
        """Add a constant of every side; one that they have alike stands once."""
        numbers = [values[sign] for sign in self.signs]
        self.printed[name] = name
        if len(set(numbers)) == 1:
            self._line(f"{name} : {kind} := {numbers[0]};", comment)
            return
        self.printed[name] = f"{name}[k]"
        self._line(f"{name} : ARRAY[0..1] OF {kind} := [{', '.join(map(str, numbers))}];", comment)

    def pair(self, names: tuple[str, str], values: tuple[int, int], comment: str) -> None:
        """Add two constants of no side, on one line."""
        self.printed |= {name: name for name in names}
        self._line(" ".join(f"{name} : DINT := {value};" for name, value in zip(names, values, strict=True)), comment)

    def one(self, name: str, value: int, comment: str) -> None:
        """Add a constant of no side."""
        self.each(name, dict.fromkeys(self.signs, value), comment)

    def of_sign(self, name: str, sign: int) -> str:
        """Return the constant of one side, whichever is driven."""
        return self.printed[name].replace("[k]", f"[{self.signs.index(sign)}]")

    def table(self, name: str, nodes: Sequence[int], comment: str) -> None:
        """Add a table."""
        text = f"{name} : ARRAY[0..{len(nodes) - 1}] OF DINT := [{', '.join(map(str, nodes))}]; (* {comment} *)"
        self.lines += wrap(text, COLUMNS, subsequent_indent="    ")

    def _line(self, text: str, comment: str) -> None:
        self.lines.append(f"{text} (* {comment} *)")


def constants_of(compensator: Compensator, interface: Interface, forms: Mapping[int, LawForm]) -> Constants:
    """Return every constant of the block."""
    found = Constants(signs=tuple(interface.sides))
    _of_command(found, compensator, interface)
    _of_pressures(found, compensator, interface)
    _of_beta(found, compensator, interface)
    _of_law(found, compensator, interface, forms)
    return found


def _of_command(found: Constants, compensator: Compensator, interface: Interface) -> None:
    sides = interface.sides
    valid = (interface.command_low, interface.command_high)
    found.pair(("COMMAND_LOW", "COMMAND_HIGH"), valid, "valid commands")
    if interface.command_zero or interface.command_direction < 0:
        found.one("COMMAND_ZERO", interface.command_zero, "zero command")
    if interface.name == "codes":
        found.each("COMMAND_SPAN", {sign: side.span for sign, side in sides.items()}, "full command, from zero on")
    if len(sides) == 2 or compensator.zero_band_codes:
        leave_zero = {sign: side.leave_zero for sign, side in sides.items()}
        found.each("LEAVE_ZERO", leave_zero, "a command beyond this leaves zero")
    if compensator.zero_band_codes:
        zero_band = {sign: side.zero_band for sign, side in sides.items()}
        found.each("ZERO_BAND", zero_band, "a command up to this counts as zero")
        transition = {sign: side.transition for sign, side in sides.items()}
        found.each("TRANS_SPAN", transition, "beyond it, from the closing to the opening threshold")


def _of_pressures(found: Constants, compensator: Compensator, interface: Interface) -> None:
    for name, pressure in (("A", interface.a), ("B", interface.b)):
        if pressure.zero:
            found.one(f"PRESSURE_{name}_ZERO", pressure.zero, f"no pressure at sensor {name}")
        names = (f"PRESSURE_{name}_LOW", f"PRESSURE_{name}_HIGH")
        found.pair(names, (pressure.low, pressure.high), f"valid pressures {name}")
    last = max(compensator.side(sign).certificate.dp_MPa[1] for sign in interface.sides)
    shown = compensator.valve.recorded_units.text(float(last), ".4g MPa")
    tested = {sign: side.tested_to for sign, side in interface.sides.items()}
    if len(set(tested.values())) == 1:
        both = (interface.reverse, tested[found.signs[0]])
        found.pair(("REVERSE", "TESTED_TO"), both, f"dP below minus the first: a failed sensor; tested up to {shown}")
        return
    found.one("REVERSE", interface.reverse, "a pressure drop below minus this means a failed sensor")
    found.each("TESTED_TO", tested, f"largest tested pressure drop, {shown}, rounded down")


def _of_beta(found: Constants, compensator: Compensator, interface: Interface) -> None:
    step, per_unit = compensator.beta_step_codes, interface.codes_per_unit
    code_MPa = float(compensator.signals.pressure_a.per_code_MPa)
    shown = compensator.valve.recorded_units.text(code_MPa, ".6g MPa")
    if interface.resolution:
        ratio = (per_unit.numerator, per_unit.denominator)
        found.pair(("CODES", "UNITS"), ratio, f"so many codes of {shown} are so many units")
    found.one("STEP_CODES", step, f"codes of pressure drop, {shown} each, from node to node")
    last = {sign: side.last_code for sign, side in interface.sides.items()}
    found.each("LAST_CODE", last, "largest code that valid pressures make")
    law = {sign: compensator.side(sign).law_beta for sign in interface.sides}
    zero = {sign: compensator.side(sign).beta for sign in interface.sides}
    alike = len({law[sign] + zero[sign] for sign in law}) == 1
    if not alike:
        starts = dict(zip(law, (0, len(law[found.signs[0]])), strict=True))
        found.each("FIRST_ROW", starts, "of the tables, of positive and of negative commands")
    shown_sides = found.signs[:1] if alike else found.signs
    told = f"beta of Eq. (7), over {compensator.beta_denominator}, from no pressure drop on"
    found.table("LAW_NODES", [node for sign in shown_sides for node in law[sign]], told)
    least = {sign: min(nodes) * step for sign, nodes in law.items()}
    found.each("LAW_LEAST", least, "the smallest, for pressures that can't be right")
    if compensator.transition_codes:
        told = "the same of the certified offset at zero command"
        found.table("ZERO_NODES", [node for sign in shown_sides for node in zero[sign]], told)
        found.each("ZERO_LEAST", {sign: min(nodes) * step for sign, nodes in zero.items()}, "likewise")


def _of_law(found: Constants, compensator: Compensator, interface: Interface, forms: Mapping[int, LawForm]) -> None:
    sides = [compensator.side(sign) for sign in found.signs]
    kappa = " and ".join(dict.fromkeys(str(side.drive_range_over_u_max) for side in sides))
    u_min0 = " and ".join(dict.fromkeys(str(side.u_min0_over_u_max) for side in sides))
    found.scales = any(form.beta_scale != 1 for form in forms.values())
    if found.scales:
        scale = {sign: form.beta_scale for sign, form in forms.items()}
        found.each("BETA_SCALE", scale, "what a beta is multiplied by")
    slope = {sign: form.slope for sign, form in forms.items()}
    found.each("FACTOR_SLOPE", slope, f"k x_max/u_max = {kappa}")
    offset = {sign: form.offset for sign, form in forms.items()}
    found.each("FACTOR_OFFSET", offset, f"u_min0/u_max = {u_min0}")
    if any(form.linear for form in forms.values()):
        unit = {sign: form.beta_unit for sign, form in forms.items()}
        found.each("BETA_UNIT", unit, "stands for beta = 1", "UDINT")
        linear = {sign: abs(form.linear) for sign, form in forms.items()}
        found.each("COMMAND_FACTOR", linear, "what the law takes of the command alone")
    dropped = {sign: 2**form.shift for sign, form in forms.items()}
    found.each("DROPPED", dropped, "what the law's sum over 2^32 is divided by first")
    divisor = {sign: form.divisor for sign, form in forms.items()}
    found.each("DIVISOR", divisor, "and what makes units of the output of it")
    found.one("OUTPUT_LIMIT", interface.limit, "largest output")
