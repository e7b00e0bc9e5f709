"""The law of one side in integers: every table of the core, and every `#define` of its arithmetic."""

from dataclasses import dataclass

from dzdesign.codegen.core.certificate_text import KAPPA_ROUNDING, U_MIN0_ROUNDING, equation_of
from dzdesign.codegen.core.constants import EXACT
from dzdesign.codegen.core.integer_form import IntegerForm
from dzdesign.codegen.telemetry.frame import beta_factor
from dzdesign.derivation.law import law
from dzdesign.derivation.presentation.formulas import to_text
from dzdesign.design.compensator import Compensator
from dzdesign.design.signals import SIDE_NAMES


@dataclass(frozen=True, slots=True, kw_only=True)
class Named:
    """A constant of the text: its comment says what it is, its engineering value and how it was rounded."""

    symbol: str
    value: int
    equation: str
    engineering: str
    rounding: str = EXACT


@dataclass(frozen=True, slots=True, kw_only=True)
class LawConstants:
    """The law of one side: its tables, its integers, and the division."""

    compensator: Compensator
    form: IntegerForm
    sign: int

    @property
    def unit(self) -> int:
        """What stands for beta = 1 in the tables."""
        return self.form.scale_beta * self.compensator.beta_denominator * self.compensator.beta_step_codes

    def arithmetic(self) -> list[Named]:
        """Return the law's integers."""
        limit = [self._limit()] if self.form.exceeds else []
        return [*self._factor(), *self._straight(), *self._half(), *limit, *self._reciprocal(), *self._beta()]

    def _constant(self, symbol: str, value: int, equation: str, engineering: str, rounding: str = EXACT) -> Named:
        return Named(symbol=symbol, value=value, equation=equation, engineering=engineering, rounding=rounding)

    def _per_volt(self, count: int) -> float:
        """Return u_O/u_i of a coefficient of the command in the sum."""
        form, signals = self.form, self.compensator.signals
        codes = signals.command.span(self.sign) * (self.compensator.transition_codes or 1)
        return count * codes / (form.divisor << form.shift) / signals.compare_max

    def _drive(self, count: int, form: str) -> str:
        """Return u_O of a term of the sum, in the unit that a person sees."""
        of_sum, c = self.form, self.compensator
        volts = count / (of_sum.divisor << of_sum.shift) / c.signals.compare_max * float(c.u_max_V)
        return c.valve.recorded_units.of_side(SIDE_NAMES[self.sign]).text(volts, form)

    def _factor(self) -> list[Named]:
        """Return what beta multiplies, by command and alone, and what the transition takes away."""
        c, form, side = self.compensator, self.form, self.compensator.side(self.sign)
        chosen = law(c.law)
        equation = equation_of(chosen)
        u_min0_text = f"exact from u_min0/u_max = {side.u_min0_over_u_max}; that fraction was {U_MIN0_ROUNDING}"
        found = []
        if form.slope:
            factor = to_text(chosen.gain_by_beta(1)).replace("*", " ")
            found.append(
                self._constant(
                    "FACTOR_SLOPE", form.slope, f"{equation}, coefficient of beta * u_i in u_O",
                    f"{factor} = {self._per_volt(form.slope * self.unit):.6f}",
                    f"exact from k x_max/u_max = {side.drive_range_over_u_max}, {KAPPA_ROUNDING}",
                )
            )  # fmt: skip
        found.append(
            self._constant(
                "FACTOR_OFFSET", form.offset, f"{equation}, coefficient of beta in u_O",
                f"u_min0 = {self._drive(form.offset * self.unit, '.6f V')}", u_min0_text,
            )
        )  # fmt: skip
        if form.transition:
            found.append(
                self._constant(
                    "TRANSITION_FACTOR", form.transition,
                    "transition, coefficient of (beta - beta_zero) in u_O, for each code of command missing to its end",
                    f"u_min0/{c.transition_codes} = {self._drive(form.transition * self.unit, '.6g dV')}", u_min0_text,
                )
            )  # fmt: skip
        return found

    def _straight(self) -> list[Named]:
        """Return the coefficient of the command that beta does not touch."""
        total = self.form.linear << self.form.linear_shift
        if not total:
            return []
        equation = f"{equation_of(law(self.compensator.law))}, coefficient of u_i alone in u_O"
        return [self._constant("COMMAND_TERM", total, equation, f"{self._per_volt(total):.6f}")]

    def _half(self) -> list[Named]:
        """Return the half count that rounds to nearest, and the shift that drops the fraction."""
        form = self.form
        equation = "Eq. (32), half a count, so that shift and division round to the nearest, a half up"
        return [
            self._constant("HALF", form.half, equation, self._drive(form.half, ".3g dV")),
            self._constant("SUM_SHIFT", form.shift, f"the sum is u_O in counts times {form.divisor} * 2^{form.shift}",
                           f"1/2^{form.shift}", "rounded down, the half being in it"),
        ]  # fmt: skip

    def _limit(self) -> Named:
        form, c = self.form, self.compensator
        limit = c.drive_functions.compare_limit
        return self._constant(
            "QUOTIENT_LIMIT",
            form.largest,
            f"largest quotient whose compare value is the limit, ({limit} + 1) * {form.divisor} - 1",
            c.valve.recorded_units.of_side(SIDE_NAMES[self.sign]).text(
                limit / c.signals.compare_max * float(c.u_max_V), ".4g V"
            ),
        )

    def _reciprocal(self) -> list[Named]:
        form = self.form
        if form.divisor == 1:
            return []
        shift = form.reciprocal_shift
        return [
            self._constant(
                "RECIPROCAL", form.reciprocal, f"what the quotient is multiplied by to get counts, times 2^{shift}",
                f"1/{form.divisor}",
                rounding=f"one of those above it that are exact for every quotient up to {form.largest}",
            ),
            self._constant("RECIPROCAL_SHIFT", shift, "the power of two in RECIPROCAL", f"2^{shift}"),
        ]  # fmt: skip

    def _beta(self) -> list[Named]:
        factor, shift = self.beta_scaling()
        rounding = "rounded up, and proved: dz_beta() is beta * 2^15 rounded down for the whole table"
        return [
            self._constant("BETA_FACTOR", factor, f"from the table's beta to multiples of 2^-15, times 2^{shift}",
                           f"2^15/{self.unit}", rounding),
            self._constant("BETA_SHIFT", shift, "the power of two in BETA_FACTOR", f"2^{shift}"),
        ]  # fmt: skip

    def beta_scaling(self) -> tuple[int, int]:
        """Return factor and shift that bring the table's beta to the 2^-15 of dz_beta()."""
        return beta_factor(self.unit, max(self.form.table) * self.compensator.beta_step_codes)
