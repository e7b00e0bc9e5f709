"""The law of a compensator as integer operations, traced once: of both sides for a PLC, of one for MATLAB.

With B_law and B the tables between their nodes, c the command from zero on, Z and E the lengths of zero band and
transition, r = min(max(c - Z, 0), E) what of the transition is passed and m = max(c, Z + E),

    sum = r * (B_law * (slope * m + offset) + linear * m) + (E - r) * (B * offset) + half,

between the law and the certified offset by weights; without a transition r = E = 1. The output is the sum over 2^shift
and a divisor: see codegen/dzdesign/codegen/core/integer_form.py. A word of 64 bits holds the sum as it is; of 32 bits
it is made of limbs.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from dzdesign.codegen.core.integer_form import IntegerForm, Scaling, exact_reciprocal, integer_form
from dzdesign.codegen.integers.form import Form, Limbs, Node
from dzdesign.codegen.integers.interface import Interface, interface_named
from dzdesign.codegen.telemetry.frame import beta_factor
from dzdesign.design.compensator import Compensator
from dzdesign.design.signals import CODE_LIMIT, SIDE_NAMES

#: Function of each sign of command.
FUNCTIONS = {1: "dz_comp", -1: "dz_comp_negative"}
DINT = 2**31
#: Bits of the status: a third pressure, and what lasts until a fault is over.
PRESSURE_C, WAITING, HELD = 512, 32, 64
LINEAR, HALF = "what the law takes of the command alone", "half a unit of the output, for it is rounded"
#: Bits of the sum that are dropped at most: in limbs of 15 bits, two of them and one bit less than a third.
MOST_DROPPED = 44
#: And at least, so that what is left fits a word.
LEAST_DROPPED = 32


def block_form(compensator: Compensator, interface_name: str, cycle_time: str = "") -> Form:
    """Return the operations of a function block, of all sides, in words of 32 bits."""
    interface = interface_named(interface_name, compensator, cycle_time)
    return _Block(compensator, interface, tuple(interface.sides), 32).traced()


def function_form(compensator: Compensator, sign: int) -> Form:
    """Return the operations of one side's function of converter codes, in words of 64 bits."""
    return _Function(compensator, interface_named("codes", compensator), (sign,), 64).traced()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pressures:
    """What the pressures come to."""

    #: Pressure drop; whether it, or one of its pressures, can't be right; and the drop alone.
    drop: Node
    failed: Node
    below: Node
    #: Whether each pressure is not valid, by its name.
    each_failed: Mapping[str, Node]
    #: What the status says of command and pressures.
    status: Node


class _Law:
    """What block and function have alike."""

    def __init__(self, compensator: Compensator, interface: Interface, signs: tuple[int, ...], bits: int) -> None:
        self.compensator, self.interface, self.signs = compensator, interface, signs
        self.sides = {sign: interface.sides[sign] for sign in signs}
        self.form = Form(bits=bits)
        self.numbers = {sign: self._numbers(sign) for sign in signs}
        self.transition = {sign: side.transition or 1 for sign, side in self.sides.items()}
        #: All sides drop as many bits of the sum; what one has beyond is in its divisor.
        dropped = [each.shift + twos(self.transition[sign]) for sign, each in self.numbers.items()]
        self.shift = min(MOST_DROPPED, *dropped)
        self.made: dict[str, Node] = {}
        #: Row of the driven side's numbers, where there are two.
        self.row: Node | None = None

    def _numbers(self, sign: int) -> IntegerForm:
        side, interface = self.sides[sign], self.interface
        least_shift = max(LEAST_DROPPED - twos(side.transition or 1), 1) if self.form.bits == 32 else 1
        units = Scaling(
            span=side.span, transition=0, full=interface.full, rounds=interface.rounds, least_shift=least_shift
        )
        return integer_form(self.compensator, sign, units)

    def one(self, name: str, value: int, meaning: str) -> Node:
        """Return a constant of no side."""
        return self.each(name, dict.fromkeys(self.signs, value), meaning)

    def each(self, name: str, values: Mapping[int, int], meaning: str) -> Node:
        """Return a constant of each side: of the driven one, where they differ."""
        if name not in self.made:
            numbers = tuple(dict.fromkeys(values[sign] for sign in self.signs))
            numbers = numbers if len(numbers) == 1 else tuple(values[sign] for sign in self.signs)
            self.made[name] = self.form.constant(name, numbers, meaning)
        found = self.made[name]
        return found if len(found.values) == 1 else found.of(self.row or found.number(0))

    def side_field(self, name: str, attribute: str, meaning: str) -> Node:
        """Return a constant of each side's scaling."""
        return self.each(name, {sign: getattr(side, attribute) for sign, side in self.sides.items()}, meaning)

    def command(self, command: Node) -> tuple[Node, Node]:
        """Return whether a command is valid, and how far it, or the valid one next to it, is from zero on."""
        interface = self.interface
        low = self.one("COMMAND_LOW", interface.command_low, "lowest valid command")
        high = self.one("COMMAND_HIGH", interface.command_high, "highest valid command")
        valid = self.form.let("valid", ~((command < low) | (command > high)), "command: 1 where it is valid")
        inside, direction = command.most(low).least(high), interface.command_direction
        if self.signs == (-1,):
            direction = -direction
        if interface.command_zero or direction < 0:
            zero = self.one("COMMAND_ZERO", interface.command_zero, "zero command")
            inside = inside - zero if direction > 0 else zero - inside
        return valid, inside

    def away(self, followed: Node, inside: Node) -> Node:
        """Return the command towards positive ones, or towards the only side; 0 of one that is not followed."""
        return self.form.let("away", followed.choose(inside, 0), "command from zero on")

    def pressures(self, valid: Node, given: Mapping[str, Node], negative: Node | None = None) -> _Pressures:
        """Return the pressure drop, whether the pressures can't be right, and the status of what is not valid.

        The pressures that are `given` are all that the sides read; `negative` says which side is driven.
        """
        interface, failed, found = self.interface, dict[str, Node](), dict[str, Node]()
        for name, pressure in given.items():
            signal = interface.pressures[name]
            low = self.one(f"PRESSURE_{name}_LOW", signal.low, f"lowest valid pressure {name}")
            high = self.one(f"PRESSURE_{name}_HIGH", signal.high, f"highest valid pressure {name}")
            failed[name] = self.form.let(f"{name.lower()}_failed", (pressure < low) | (pressure > high),
                                         f"pressure {name}: 1 where it is not valid")  # fmt: skip
            value = pressure.most(low).least(high)
            if signal.zero:
                value -= self.one(f"PRESSURE_{name}_ZERO", signal.zero, f"no pressure at sensor {name}")
            found[name] = value
        (ahead, behind), unit = self._of_driven(found, negative, "pressure"), interface.weight_unit
        if unit != 1:
            weights = {sign: side.weight for sign, side in self.sides.items()}
            ahead *= self.one("WEIGHT_AHEAD", unit, "what a number ahead weighs in the difference")
            behind *= self.each("WEIGHT_BEHIND", weights, "what a number behind weighs in it")
        drops = " or ".join(dict.fromkeys(" minus ".join(side.pair) for side in self.sides.values()))
        told = f"pressure drop, {drops}{f', times {unit}' if unit != 1 else ''}"
        difference = self.form.let("difference", ahead - behind, told)
        reverse = self.one("REVERSE", interface.reverse * unit, "a pressure drop below minus this: a failed sensor")
        tested = self.each("TESTED_TO", {s: (side.tested_to + 1) * unit - 1 for s, side in self.sides.items()},
                           f"largest tested pressure drop{f', times {unit}' if unit != 1 else ''}")  # fmt: skip
        one, other = self._of_driven(failed, negative, "failure")
        sound = self.form.let("sound", ~(one | other), "1 where both pressures of the drop are valid")
        below = self.form.let("below", sound & (difference < -reverse), "1 where the drop is too far below zero")
        above = sound & (difference > tested)
        status = (~valid).as_number()
        for place, fault in enumerate((failed.get("A"), failed.get("B"), below, above), 1):
            status = status + fault.as_number() * 2**place if fault else status
        if "C" in failed:
            status = status + failed["C"].as_number() * PRESSURE_C
        implausible = self.form.let("failed", ~sound | below, "1 where the pressures can't be right: least beta")
        dp = difference.most(0)
        if unit != 1:
            told = "codes of the sensor ahead, rounded down"
            dp = self.form.let("dp", dp.over(unit), told)
        return _Pressures(drop=dp, failed=implausible, below=below, each_failed=failed, status=status)

    def _of_driven(self, each: Mapping[str, Node], negative: Node | None, what: str) -> list[Node]:
        """Return what belongs to the inputs ahead and behind: of the driven side, where the two sides' differ."""
        found = []
        for place, (end, where) in enumerate({"ahead": "ahead of", "behind": "behind"}.items()):
            names = list(dict.fromkeys(self.sides[sign].pair[place] for sign in self.signs))
            node = each[names[0]]
            if negative is not None and len(names) > 1:
                chosen = negative.choose(each[names[1]], node)
                node = self.form.let(f"{what}_{end}", chosen, f"{where} the edge of the driven side")
            found.append(node)
        return found

    def betas(self, dp: Node, failed: Node) -> list[Node]:
        """Return beta of the law, and with a transition the certified one at zero command."""
        step = self.compensator.beta_step_codes
        last = self.side_field("LAST_CODE", "last_code", "largest pressure drop that valid pressures make, in codes")
        tables = {"law": [self.numbers[sign].table for sign in self.signs]}
        if self.compensator.transition_codes:
            tables["zero"] = [self._zero_table(sign) for sign in self.signs]
        alike = all(len(set(each)) == 1 for each in tables.values())
        count = max(len(each) - 2 for each in tables["law"])
        first = None
        if not alike:
            starts = {sign: place * count for place, sign in enumerate(self.signs)}
            first = self.each("FIRST_ROW", starts, "where a side's nodes begin")
        nodes = {name: self._nodes(name, each[:1] if alike else each, count) for name, each in tables.items()}
        least = {}
        for name, each in tables.items():
            values = {sign: table[-1] * step for sign, table in zip(self.signs, each, strict=True)}
            told = "the smallest, for pressures that can't be right"
            least[name] = self.each(f"{name.upper()}_LEAST", values, told)
        found: dict[str, list[Node]] = {name: [] for name in tables}
        for suffix, code, told in self._codes(dp):
            code = self.form.let(f"code{suffix}", code.least(last), told)
            row = code.over(step)
            row = self.form.let(f"row{suffix}", row if first is None else row + first, "node of beta")
            past = self.form.let(f"past{suffix}", code.past(step), "codes past the node")
            for name, table in nodes.items():
                found[name].append(table.interpolated(row, past, step))
        betas = []
        for name, read in found.items():
            value = read[0] if len(read) == 1 else read[0].least(read[1])
            told = "beta of the law" if name == "law" else "beta of the certified offset at zero command"
            betas.append(self.form.let(f"{name}_beta", failed.choose(least[name], value), told))
        return betas

    def _zero_table(self, sign: int) -> tuple[int, ...]:
        """Return the nodes of the certified beta, then twice the smallest, as the law's."""
        nodes, scale = self.compensator.side(sign).beta, self.numbers[sign].scale_beta
        return tuple(scale * node for node in (*nodes, *(min(nodes),) * 2))

    def _nodes(self, name: str, tables: list[tuple[int, ...]], count: int) -> Node:
        units = [str(self.numbers[sign].scale_beta * self.compensator.beta_denominator) for sign in self.signs]
        text = "the same of the certified offset at zero command"
        if name == "law":
            text = f"beta of Eq. (7), so many to 1: {' and '.join(dict.fromkeys(units))}"
        rows = [(*table[:-2], *(table[-3],) * (count + 2 - len(table))) for table in tables]
        return self.form.constant(f"{name.upper()}_NODES", tuple(node for row in rows for node in row), text)

    def _codes(self, dp: Node) -> list[tuple[str, Node, str]]:
        """Return the codes at which beta is read; the least of the betas counts.

        Of the pressure drops that a number of a PLC stands for it is one end, as a table rises to a code and falls
        from it on.
        """
        if self.interface.resolution == 0:
            return [("", dp, "codes of the pressure drop")]
        ratios, reach = {sign: side.codes_per_unit for sign, side in self.sides.items()}, self.interface.resolution
        numerators, denominators = ({sign: getattr(each, part) for sign, each in ratios.items()}
                                    for part in ("numerator", "denominator"))  # fmt: skip
        codes = self.each("CODES", numerators, "so many codes of pressure drop are")
        units = self.each("UNITS", denominators, "so many units of the inputs")
        upper = ((dp + reach) * codes + (units - 1)).quotient(units)
        found = [("", upper, "code at the upper end of what the pressure drop stands for")]
        tables = [self.numbers[sign].table[:-2] for sign in self.signs]
        tables += [self._zero_table(sign)[:-2] for sign in self.signs]
        if any(list(table) != sorted(table, reverse=True) for table in tables):
            lower = ((dp - reach).most(0) * codes).quotient(units)
            found.append(("_low", lower, "code at the lower end"))
        return found

    def output(self, towards: Node, betas: list[Node]) -> Node:
        """Return the law's output, limited, at a command towards the driven side."""
        form, ahead, reached, missing = self.form, towards, None, None
        if self.compensator.transition_codes:
            band = self.band()
            length = self.side_field("TRANS_SPAN", "transition", "commands from the zero band to the opening threshold")
            passed = (towards - band).most(0).least(length)
            reached = form.let("reached", passed, "commands of the transition that are passed")
            missing = form.let("missing", length - reached, "commands of the transition that are not")
            ahead = form.let("ahead", towards.most(band + length), "the command, at least the transition's end")
        slope = self.of_law(
            "SLOPE", "slope", "of the command in beta's factor; k x_max/u_max", "drive_range_over_u_max"
        )
        offset = self.of_law("OFFSET", "offset", "constant in beta's factor; u_min0/u_max", "u_min0_over_u_max")
        factor = form.let("factor", ahead * slope + offset, "what beta is multiplied by")
        linear = [self.numbers[sign].linear << self.numbers[sign].linear_shift for sign in self.signs]
        half = [self.numbers[sign].half * self.transition[sign] for sign in self.signs]
        if form.bits == 64:
            total = betas[0] * factor
            if any(linear):
                total = total + ahead * self.one("LINEAR", linear[0], LINEAR)
            if reached is not None and missing is not None:
                total = total.mean(betas[1] * offset, reached, missing, self.transition[self.signs[0]])
            if any(half):
                total = total + self.one("HALF", half[0], HALF)
            return self._divided(form.let("total", total, "the law's sum") >> self.shift)
        limbs = Limbs(form, self.row)
        limbs.add("law", betas[0], factor, reached)
        if any(linear):
            limbs.add_share("own", ahead, limbs.constant("LINEAR", linear, LINEAR), reached)
        if missing is not None:
            at_zero = form.let("at_zero", offset, "what the certified beta is multiplied by")
            limbs.add("zero", betas[1], at_zero, missing)
        limbs.add_number(limbs.constant("HALF", half, HALF))
        return self._divided(limbs.shifted(self.shift))

    def of_law(self, name: str, attribute: str, meaning: str, ratio: str) -> Node:
        """Return a number of each side's law, with the ratio that it stands for."""
        ratios = [str(getattr(self.compensator.side(sign), ratio)) for sign in self.signs]
        told = f"{meaning} = {' and '.join(dict.fromkeys(ratios))}"
        return self.each(name, {sign: getattr(each, attribute) for sign, each in self.numbers.items()}, told)

    def band(self) -> Node:
        """Return the zero band's end."""
        return self.side_field("ZERO_BAND", "zero_band", "a command up to this counts as zero")

    def _divided(self, quotient: Node) -> Node:
        """Return the output of a sum over 2^shift."""
        form, limit = self.form, self.interface.limit
        dropped = {sign: each.shift - self.shift for sign, each in self.numbers.items()}
        divisors = {sign: (each.divisor * self.transition[sign] << max(dropped[sign], 0)) >> max(-dropped[sign], 0)
                    for sign, each in self.numbers.items()}  # fmt: skip
        if form.bits == 32:
            by = self.each("DIVISOR", divisors, f"of the sum over 2^{self.shift}: makes units of the output")
            most = self.one("OUTPUT_LIMIT", limit, "largest output")
            return form.let("drive", quotient.most(0).quotient(by).least(most), "output of the law")
        divisor = divisors[self.signs[0]]
        largest = (limit + 1) * divisor - 1
        drive = quotient.most(0).least(self.one("QUOTIENT_LIMIT", largest, f"of an output of {limit}"))
        if divisor != 1:
            reciprocal, shift = exact_reciprocal(divisor, largest)
            told = f"a product and a shift by {shift} divide by {divisor}, exactly"
            drive = drive * self.one("RECIPROCAL", reciprocal, told) >> shift
        return form.let("drive", drive, "output of the law")


def twos(value: int) -> int:
    """Return how often 2 divides a number."""
    return (value & -value).bit_length() - 1


class _Block(_Law):
    """A function block: it remembers the driven side, and whether the command counts as zero."""

    def traced(self) -> Form:
        """Return the operations."""
        form, both = self.form, len(self.signs) == 2
        command = form.input("command", -DINT, DINT - 1)
        given = {name: form.input(f"pressure_{name.lower()}", -DINT, DINT - 1) for name in self.interface.pressures}
        form.heading("Command, from zero on; zero where it is not valid.")
        valid, inside = self.command(command)
        followed = valid
        if self.interface.fault_cycles:
            inside = form.let("limited", inside, "the command, or the valid one next to it, from zero on")
            followed = self._followed(valid, inside)
        away = self.away(followed, inside)
        towards, negative, driven = self._side(followed, away) if both else (away, None, followed)
        if self.interface.name == "codes" or both:
            towards = towards.least(self.side_field("COMMAND_SPAN", "span", "full command, from zero on"))
        towards = form.let("towards", towards.most(0), "command towards the driven side")
        if self.compensator.zero_band_codes:
            before = form.memory("at_rest", 0, 1, 1, "whether the command counts as zero", boolean=True)
            rests = (towards <= self.band()) | (before & (towards <= self.leave()))
            at_rest = form.let("at_rest", rests, "whether the command counts as zero")
            towards = form.let("asked", at_rest.choose(0, towards), "command that the law is given")
        form.heading("Pressure drop; where it can't be right the smallest beta is taken.")
        found = self.pressures(valid, given, negative)
        failed, status = found.failed, found.status
        if self.interface.fault_cycles:
            failed = self._held(found, negative)
            status = status + (~followed).as_number() * WAITING + failed.as_number() * HELD
        form.let("status", status)
        form.heading("Eq. (7), beta: straight between its nodes.")
        betas = self.betas(found.drop, failed)
        form.heading("The law: a sum of products, in limbs of 15 bits.")
        drive = self.output(towards, betas)
        if negative is None:
            form.let("output_a", driven.choose(drive, 0))
        else:
            form.let("output_a", driven.choose(drive, 0))
            form.let("output_b", negative.choose(drive, 0))
        form.outputs = ("output_a", *(("output_b",) if both else ()), "status")
        return form

    def _followed(self, valid: Node, inside: Node) -> Node:
        """Count the valid commands in a row, of zero command until it is followed; return whether it is."""
        first = 0 if self._has_interlock else self.interface.fault_cycles
        before, needed = self._cycles("valid_commands", first, "valid commands in a row")
        good = valid
        if self._has_interlock:
            enable = self.form.input("enable", 0, 1, boolean=True)
            zero = inside <= self._interlock(self.signs[0])
            if len(self.signs) == 2:
                zero = zero & (-inside <= self._interlock(self.signs[1]))
            told = "whether the command is good: valid, and of zero command before it is followed"
            good = self.form.let("good", valid & enable & (zero | (needed <= before)), told)
        count = self._counted("valid_commands", good, before, needed)
        return self.form.let("followed", needed <= count, "whether the command is followed")

    def _interlock(self, sign: int) -> Node:
        """Return the largest command of a side that the interlock takes for zero command."""
        numbers = {each: side.interlock or 0 for each, side in self.sides.items()}
        made = self.each("INTERLOCK", numbers, "the interlock takes a command up to this for zero command")
        return made.operands[0].of(made.number(self.signs.index(sign))) if made.operation == "of" else made

    @property
    def _has_interlock(self) -> bool:
        return self.sides[self.signs[0]].interlock is not None

    def _held(self, found: _Pressures, negative: Node | None) -> Node:
        """Count the cycles in a row in which a side's pressures can be right; return whether they are not yet used.

        Where the two sides read different pressures each has its count; of the side that is not driven only the
        sensors count, as no flow makes its pressure drop.
        """
        if negative is None or not self.interface.three:
            counts = [self._of_pressures("valid_pressures", found.failed, "pressures that can be right, in a row")]
        else:
            counts = []
            for sign, driven in ((1, ~negative), (-1, negative)):
                one, other = (found.each_failed[name] for name in self.sides[sign].pair)
                name = SIDE_NAMES[sign]
                told = f"pressures of {name} commands that can be right, in a row"
                counts.append(self._of_pressures(f"valid_{name}", one | other | (found.below & driven), told))
        count = counts[0] if len(counts) == 1 or negative is None else negative.choose(counts[1], counts[0])
        needed = self.one("FAULT_CYCLES", self.interface.fault_cycles, "")
        return self.form.let("held", count < needed, "whether the pressures are not used: least beta")

    def _of_pressures(self, name: str, failed: Node, meaning: str) -> Node:
        before, needed = self._cycles(name, self.interface.fault_cycles, meaning)
        return self._counted(name, ~failed, before, needed)

    def _cycles(self, name: str, first: int, meaning: str) -> tuple[Node, Node]:
        """Return a count of cycles as the last call left it, and the one that ends a fault."""
        cycles = self.interface.fault_cycles
        needed = self.one("FAULT_CYCLES", cycles, "so many good cycles in a row end a fault")
        return self.form.memory(name, 0, cycles, first, f"{meaning}, counted up to FAULT_CYCLES"), needed

    def _counted(self, name: str, good: Node, before: Node, needed: Node) -> Node:
        return self.form.let(name, good.choose((before + 1).least(needed), 0))

    def leave(self) -> Node:
        """Return the command beyond which zero is left."""
        return self.side_field("LEAVE_ZERO", "leave_zero", "a command beyond this leaves zero")

    def _side(self, followed: Node, away: Node) -> tuple[Node, Node, Node]:
        """Follow the driven side; return the command towards it, and whether it is the negative or the positive one."""
        form = self.form
        before = form.memory("side", -1, 1, 0, "driven side, 1 or -1; 0: none before the command has left zero")
        first = second = self.leave()
        if first.operation == "of":
            second = first.operands[0].of(away.number(1))
        kept = (away < -second).choose(-1, before)
        chosen = followed.choose((away > first).choose(1, kept), 0)
        side = form.let("side", chosen, "driven side, 1 or -1; 0: none yet")
        negative = form.let("negative", side < 0, "whether the negative side is driven")
        self.row = form.let("k", negative.as_number(), "place of the driven side's numbers")
        return negative.choose(-away, away), negative, side > 0


class _Function(_Law):
    """A function of arrays of codes, of one side."""

    def traced(self) -> Form:
        """Return the operations."""
        form, (sign,) = self.form, self.signs
        u = form.input("u", 0, CODE_LIMIT)
        given = {name: form.input(f"p_{name.lower()}", 0, CODE_LIMIT) for name in self.sides[sign].pair}
        form.heading("Command, in codes from zero on; zero where it is not valid.")
        valid, inside = self.command(u)
        away = self.away(valid, inside)
        span = self.side_field("COMMAND_SPAN", "span", "full command, from zero on")
        towards = form.let("towards", away.most(0).least(span), "command towards this side")
        form.heading("Pressure drop; where it can't be right the smallest beta is taken.")
        found = self.pressures(valid, given)
        form.let("status", found.status)
        form.heading("Eq. (7), beta: straight between its nodes.")
        betas = self.betas(found.drop, found.failed)
        form.heading("The law.")
        form.let("compare", valid.choose(self.output(towards, betas), 0))
        numbers, step = self.numbers[sign], self.compensator.beta_step_codes
        unit = numbers.scale_beta * self.compensator.beta_denominator * step
        factor, shift = beta_factor(unit, max(numbers.table) * step)
        shown = betas[0] * self.one("BETA_FACTOR", factor, "makes beta times 2^15 of it, for a display") >> shift
        form.let("beta", shown)
        form.outputs = ("compare", "status", "beta")
        return form
