"""The numbers of a valve as a C initialiser, the page that an engineer reads: of each what it is, its value in
engineering units, how it was rounded, and where it comes from.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from textwrap import wrap

from dzdesign.codegen.calibration.layout import NO_INTERLOCK, NO_RAMP, BuiltFor, CalibrationBlock, Words, members
from dzdesign.codegen.calibration.packing import text_of
from dzdesign.codegen.core.certificate_text import in_unit, share_of_command
from dzdesign.codegen.core.constants import COLUMNS, c_comment
from dzdesign.codegen.core.integer_form import integer_form
from dzdesign.derivation.law import law
from dzdesign.derivation.presentation.formulas import to_text
from dzdesign.design.compensator import Compensator
from dzdesign.design.drive_functions import RAMP_UNIT
from dzdesign.design.signals import INPUT_NAMES
from dzdesign.identify.valve.model import SIDES

SIGNS = (1, -1)
#: What the elements of an array of structs are.
ELEMENTS = {
    "sensors": [f"pressure {name}" for name in INPUT_NAMES],
    "sides": ["positive commands", "negative commands"],
}
NEGATIVE_ALONE = "commands from zero to full, which drive the valve's negative side"


def _element(place: str) -> tuple[str, int]:
    """Return the name and the index of an element of an array of structs; of anything else its name and 0."""
    group, _, index = place.rstrip("]").partition("[")
    return group, int(index or 0)


def _between(before: str, after: str, negative_alone: bool) -> list[str]:
    """Return the lines between the last member of one struct in the block's and the first of another; "" is itself."""
    (left, _), (group, element) = _element(before), _element(after)
    lines = ["    },"] if left in ELEMENTS else []
    if left != group:
        lines += ["},"] if left else []
        lines += [f".{group} = {{"] if group else []
    named = NEGATIVE_ALONE if negative_alone and group == "sides" else ELEMENTS.get(group, [""])[element]
    return lines + ([f"    {{ /* {named} */"] if group in ELEMENTS else [])


@dataclass(frozen=True, kw_only=True)
class ValvePage:
    """The members that the struct of a firmware has, with the numbers of a compensator."""

    compensator: Compensator
    block: CalibrationBlock
    built: BuiltFor

    def lines(self) -> list[str]:
        """Return what stands between the braces of a `struct dz_calibration`: the members that this firmware has."""
        parts: dict[str, object] = {"": self.block, "current": self.block.current}
        # What is not set C makes zero.
        signals = self.compensator.signals
        parts |= {f"sensors[{place}]": self.block.sensors[place] for place in range(len(signals.pressures))}
        parts |= {f"sides[{place}]": self.block.sides[place] for place in range(len(signals.signs))}
        if self.built.fixed and not self.built.has("CURRENT"):
            del parts["current"]
        lines: list[str] = []
        within = ""
        for path, _, entry in members():
            place, _, name = path.rpartition(".")
            if place not in parts or not self.built.keeps(entry):
                continue
            if place != within:
                lines += _between(within, place, self.compensator.positive is None)
                within = place
            group, element = _element(place)
            sign = SIGNS[element] if group == "sides" else 0
            known = self._sides[sign] if sign else self._current if place == "current" else self._own
            if group == "sensors":
                known = self._sensors[element]
            valve = self.compensator.valve
            key = entry.key.replace("*", valve.side_name(sign) if sign else INPUT_NAMES[element].lower())
            indent, value = " " * (8 if group in ELEMENTS else 4 if group else 0), getattr(parts[place], name)
            said = self._comment(entry, known.get(name, ""), key, len(indent) + 4)
            lines += [f"{indent}{line}" for line in (*said, *self._assigned(name, entry, value, sign))]
        return [*lines, *_between(within, "", False)]

    @staticmethod
    def _comment(entry: Words, engineering: str, key: str, indent: int) -> list[str]:
        """Return the comment in C that says what a number is, for lines that begin with so many blanks."""
        unit = f" ({entry.unit})" if entry.unit else ""
        value = f": {engineering}" if engineering else ""
        text = f"{entry.text}{unit}{value} ({entry.rounding}).{f' From {key}.' if key else ''}"
        return c_comment((text[0].upper() + text[1:]).replace("²", "^2"), COLUMNS - indent)

    def _assigned(self, name: str, entry: Words, value: int | tuple[int, ...], sign: int) -> Iterator[str]:
        """Yield one member with its value: two halves of a number of 64 bits, pairs in braces, a table's rows."""
        if isinstance(value, int):
            words = (value % 2**32, value >> 32) if entry.bits == 64 else (value,)
            printed = [f"{word}u" if entry.bits == 16 else f"UINT32_C({word})" for word in words]
            yield f".{name} = {printed[0]}," if len(printed) == 1 else f".{name} = {{{', '.join(printed)}}},"
            return
        yield f".{name} = {{"
        if entry.pairs:
            yield from (f"    {line}" for line in self._rows(value, sign))
        else:
            texts = ", ".join(f"{each}u" for each in value)
            yield from (f"    {line}" for line in wrap(texts, COLUMNS - 24))
        yield "},"

    def _rows(self, value: tuple[int, ...], sign: int) -> Iterator[str]:
        """Yield the nodes of beta, the pressure drop from which each line goes, and what stands for no pressure."""
        c = self.compensator
        unit, units = integer_form(c, sign).scale_beta * c.beta_denominator, c.valve.recorded_units
        pairs = [f"{{UINT32_C({law}), UINT32_C({zero})}}," for law, zero in zip(value[::2], value[1::2], strict=True)]
        for node in range(len(c.side(sign).beta)):
            place = units.text(float(c.signals.pair(sign).dp_MPa(node * c.beta_step_codes)), ".3f MPa")
            law_beta, zero_beta = (number / unit for number in value[2 * node : 2 * node + 2])
            certified = f", certified {zero_beta:.6f}" if law_beta != zero_beta else ""
            yield f"{pairs[node]} /* {place}: beta {law_beta:.6f}{certified} */"
        mask = self.built.sizes.node_mask
        unused = " ".join(["{0u,0u},"] * (mask - len(c.side(sign).beta)))
        yield from (line.replace(",0u", ", 0u") for line in wrap(unused, COLUMNS - 40))
        yield f"{pairs[mask]} /* pressures that can't be right: beta {value[-2] / unit:.6f} */"
        yield pairs[mask + 1]

    # ---- engineering values, by the member's name ----

    @cached_property
    def _own(self) -> dict[str, str]:
        c, signals, functions = self.compensator, self.compensator.signals, self.compensator.drive_functions
        units, u_max_V = c.valve.recorded_units, float(c.u_max_V)
        command, controller = signals.command, units.of_controller
        share, limit = self._share, functions.compare_limit / signals.compare_max
        found = {"magic": "", "serial": text_of(self.block.serial), "record": text_of(self.block.record)}

        def reading(code: int) -> str:
            codes = command.direction(1) * (code - command.zero_code)
            sign = 1 if codes >= 0 or len(signals.signs) == 1 else -1
            return controller.text(SIDES[c.valve.side_name(1)] * codes / command.span(sign) * u_max_V + 0.0, ".4g V")

        for name, code in zip(("zero", "low", "high"), (command.zero_code, *command.valid_codes), strict=True):
            found[f"command_{name}"] = reading(code)
        found |= {
            "reverse": units.text(float(signals.pair(1).dp_MPa(c.reverse_codes)), ".3f MPa"),
            "transition_codes": share(c.transition_codes) if c.transition_codes else "none",
            "zero_band": f"{share(c.zero_band_codes)}; error of a zero command, {c.command_error.offset_codes} + "
            f"{c.command_error.noise_codes} codes",
            "compare_limit": f"{units.text(limit * u_max_V, '.4g V')}, {limit:.1%} duty",
            "leave_zero": f"{share(functions.leave_zero_codes)}; a zero command with twice its noise stays within",
            "fault_samples": f"{1e3 * functions.fault_samples / signals.sample_Hz:.4g} ms",
            "fault_latch": "latched" if functions.fault_latch else "not latched",
            "interlock": "it does not wait" if self.block.interlock == NO_INTERLOCK else share(self.block.interlock),
            "ramps": "ramped" if functions.has_ramp else "not ramped",
        }
        if functions.dither_counts:
            peak = functions.dither_counts / signals.compare_max
            found["dither_counts"] = f"{peak:.3%} of full drive{in_unit(c, peak)}"
            half_s = functions.dither_ticks / signals.tick_Hz
            found["dither_ticks"] = f"{1e3 * half_s:.4g} ms, {1 / (2 * half_s):g} Hz"
        if functions.has_play:
            found |= {
                "play_codes": share(functions.play_codes),
                "play_noise": share(functions.play_noise_codes),
                "play_step_shift": f"{functions.play_step_codes} codes, {share(functions.play_step_codes)}",
                "play_shift": f"{functions.play_codes} * {c.transition_codes}",
            }
        return found

    @cached_property
    def _sensors(self) -> list[dict[str, str]]:
        units = self.compensator.valve.recorded_units
        return [
            {
                name: units.text(float((code - sensor.zero_code) * sensor.per_code_MPa), ".4g MPa")
                for name, code in zip(
                    ("zero", "low", "high", "full"),
                    (sensor.zero_code, *sensor.valid_codes, sensor.full_code),
                    strict=True,
                )
            }
            for sensor in self.compensator.signals.pressures.values()
        ]

    @cached_property
    def _sides(self) -> dict[int, dict[str, str]]:
        return {sign: self._side(sign) for sign in self.compensator.signals.signs}

    def _side(self, sign: int) -> dict[str, str]:
        c, side, form = self.compensator, self.compensator.side(sign), integer_form(self.compensator, sign)
        signals, functions, numbers = c.signals, c.drive_functions, self.block.sides[sign < 0]
        units = c.valve.recorded_units.of_side(c.valve.side_name(sign))
        u_max_V, place = float(c.u_max_V), int(sign < 0)
        span, chosen, unit = signals.command.span(sign), law(c.law), form.scale_beta * c.beta_denominator
        divisor, whole = form.divisor << form.shift, unit * c.beta_step_codes
        pair = signals.pair(sign)
        ahead_MPa, behind_MPa = float(pair.ahead.per_code_MPa), float(pair.behind.per_code_MPa)
        ratio = f"{units.text(behind_MPa, '.6g MPa')} / {units.text(ahead_MPa, '.6g MPa')}"
        ahead, behind = pair.names

        def volts(count: float, text: str) -> str:
            return units.text(count / divisor / signals.compare_max * u_max_V, text)

        def per_volt(count: int) -> float:
            return count * span * (c.transition_codes or 1) / divisor / signals.compare_max

        def ramp(step: int) -> str:
            if not functions.has_ramp or step == NO_RAMP:
                return "no limit"
            return f"full command in {span * RAMP_UNIT / (step * signals.sample_Hz):.4g} s"

        factor = to_text(chosen.gain_by_beta(1)).replace("*", " ")
        low, high = min(side.beta) / c.beta_denominator, max(side.law_beta) / c.beta_denominator
        found = {
            "offset": f"u_min0 = {volts(form.offset * whole, '.6f V')}, u_min0/u_max = {side.u_min0_over_u_max}",
            "slope": f"{factor} = {per_volt(form.slope * whole):.6f}, k x_max/u_max = {side.drive_range_over_u_max}"
            if form.slope
            else "beta does not change the gain",
            "transition": f"u_min0/{c.transition_codes} = {volts(form.transition * whole, '.6g dV')}"
            if form.transition
            else "none",
            "linear": f"{per_volt(form.linear << form.linear_shift):.6f}",
            "half": volts(form.half, ".3g dV"),
            "quotient_limit": units.text(self.block.compare_limit / signals.compare_max * u_max_V, ".4g V"),
            "reciprocal": f"1/{form.divisor << (form.shift - 32)}",
            "reciprocal_shift": f"2^{32 + numbers.reciprocal_shift}",
            "balance": f"codes {pair.ahead.zero_code} of {ahead} and {pair.behind.zero_code} of {behind}",
            "weight": f"{ratio} = {behind_MPa / ahead_MPa:.6g}",
            "tested_to": c.valve.recorded_units.text(float(side.certificate.dp_MPa[1]), ".4g MPa"),
            "beta_factor": f"2^15/{whole}",
            "beta_shift": f"2^{numbers.beta_shift}",
            "ramp_up": ramp(numbers.ramp_up),
            "ramp_down": ramp(numbers.ramp_down),
            "nodes": f"beta {low:.6f} to {high:.6f}, in 1/{c.beta_denominator}",
            "span": c.valve.recorded_units.of_controller.text(SIDES[c.valve.side_name(sign)] * u_max_V, "g V"),
            "room": self._share(numbers.room, sign),
            "band_end": self._share(c.zero_band_codes, sign),
        }
        if functions.has_play:
            widths = [u_max_V * end(functions.play_counts[place]) / signals.compare_max for end in (min, max)]
            controller = c.valve.recorded_units.of_controller
            ends = f"{controller.number(widths[0], '.4g dV')} to {controller.text(widths[1], '.4g dV')}"
            found["play"] = f"the recorded hysteresis, {ends}"
        return found

    @cached_property
    def _current(self) -> dict[str, str]:
        if self.compensator.current_drive is None:
            return {}
        loop = self.compensator.current_drive.loop
        unit = 1 << loop.gain_shift
        return {
            "integral_limit": f"{loop.integral_limit} PWM counts",
            "release": f"{loop.release} PWM counts: the current does not overshoot on release",
            "current_gain": f"{loop.current_gain / (1 << loop.current_shift):.6g}",
            "proportional": f"{loop.proportional / unit:.6g}",
            "integral": f"{loop.integral / unit:.6g}",
            "feed_forward": f"{loop.feed_forward / unit:.6g}: R i over the supply",
            "offset_shift": f"{1 << loop.offset_shift} sums",
            "held_ticks": "" if loop.held_ticks else "one solenoid",
            "supply_shift": f"{loop.supply.step_codes} codes" if loop.supply else "not measured",
        }

    def _share(self, codes: int, sign: int = 1) -> str:
        return share_of_command(self.compensator, codes, sign)
